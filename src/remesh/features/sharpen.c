/* An edge is cut where its ends belong to sides that meet at an angle. The triangles of a band have two such edges, and
 * the crease goes through them from edge to edge; one with three is a corner. Each edge that is cut gets a vertex where
 * the two sides, extrapolated, meet; a corner gets one where three do. So the line is as straight as the sides are
 * even, however ragged the band. Triangles of the band are then smoothed, each vertex within its side or along its
 * line.
 *
 *      a side ____._____.____              ____._____.____
 *                  \   / \    cut: the       __\ _ / _\__   the vertices that are put there,
 *      band         \ /   \   edges across      \ /   \     moved onto the line
 *      other side ___'_____'__               ____'_____'__
 *
 * What is a crease, and what a fold of something soft, is decided by how even the sides are beside how much they turn.
 */
#include "remesh/features/sharpen.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "geometry/tri_edit.h"
#include "remesh/features/side_fit.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

static const double LEAST_TURN = 0.4363323; /* radians, 25 degrees: between the sides of a crease */
/* Most spread of the normals in the sides, as a share of the turn: in one place, and over all of a component. Sampled
 * parts have 0.02 to 0.06, statues and animals 0.09 to 0.18. */
static const double UNEVEN_PLACE = 0.25, UNEVEN = 0.08;
/* Where edges that are marked are longer than so large a share of the creases, the component has its sharp edges
 * already. */
static const double MOST_MARKED = 0.5;
/* Sides that turn by more than 150 degrees are the two walls of a thin shell: its rim lies between them, not a crease.
 */
static const double WALLS_TURN = 2.6179939;
/* How far from its place a vertex may be put, in edges of the input: further, the sides are no guide. */
static const float MOST_MOVED = 6;
/* With more than this share of its creases between two walls a component is left as it is. */
static const double MOST_WALLS = 0.025;
enum { RINGS = 3, SMOOTHING_ROUNDS = 8 };

typedef struct sharpener {
    qw_env *env;
    qw_sides sides;
    const qw_trimesh *mesh;
    const qw_census *census;
    uint8_t *cut;   /* uint8_t[3 face_count], the same on both sides: sides meet */
    uint8_t *sharp; /* uint8_t[components]: 1: has sampled creases */
    uint8_t *ring;  /* uint8_t[vertex_count]: 0: at a cut; rings away from there; rings: farther */
    uint8_t rings;
    uint32_t *fit_of; /* uint32_t[vertex_count]: index into fit, or QW_NONE: beyond the band */
    uint32_t *fitted; /* uint32_t[fits]: vertex */
    qw_side_fit *fit; /* qw_side_fit[fits] */
    uint32_t fits;
} sharpener;

static bool is_lower(const qw_trimesh *mesh, uint32_t h) { return mesh->twin[h] == QW_NONE || h < mesh->twin[h]; }

static double angle_between(qw_vec3 n, qw_vec3 m) { return qw_acos(fmin(fmax((double)qw_dot(n, m), -1), 1)); }

/* ---- which edges are cut */

/* Turn between the sides to which the ends of an edge belong, and the spread within them, radians. */
typedef struct meeting {
    double turn, spread;
} meeting;

static meeting meeting_at(const sharpener *s, uint32_t h)
{
    assert(h < 3 * s->mesh->face_count);
    const qw_sides *d = &s->sides;
    uint32_t a = d->side[s->mesh->corner[h]], b = d->side[s->mesh->corner[qw_next(h)]];
    const qw_side_plane *p = &d->plane[a], *q = &d->plane[b];
    if (a == b || qw_length2(p->normal) == 0 || qw_length2(q->normal) == 0) return (meeting){0, 0};
    return (meeting){angle_between(p->normal, q->normal), 0.5 * ((double)p->spread + (double)q->spread)};
}

static void ask_cuts(void *user, uint32_t begin, uint32_t end)
{
    const sharpener *s = user;
    for (uint32_t h = 3 * begin; h < 3 * end; h++) {
        meeting m = meeting_at(s, h);
        s->cut[h] = m.turn >= LEAST_TURN && m.spread <= UNEVEN_PLACE * m.turn;
    }
}

static int cuts_of(const sharpener *s, uint32_t f) { return s->cut[3 * f] + s->cut[3 * f + 1] + s->cut[3 * f + 2]; }

/* ---- what is a crease */

/* Cut edges that hang together by triangles. Each edge inside counts twice. */
typedef struct crease {
    double length, cuts, turn, spread;
    uint32_t component;
} crease;

/* Length of the line through a triangle. */
static double line_in(const sharpener *s, uint32_t f)
{
    assert(f < s->mesh->face_count);
    qw_vec3 m[3];
    int count = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
        if (s->cut[h])
            m[count++] = qw_lerp(s->mesh->position[s->mesh->corner[h]], s->mesh->position[s->mesh->corner[qw_next(h)]],
                                 0.5f);
    return count < 2 ? 0 : (double)qw_distance(m[0], m[1]);
}

/* Adds what the crease has in one triangle: the length of its line there, and the cuts at its edges. */
static void add_triangle(const sharpener *s, uint32_t f, crease *c)
{
    assert(f < s->mesh->face_count);
    c->component = s->census->component[f], c->length += line_in(s, f);
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        if (!s->cut[h]) continue;
        meeting m = meeting_at(s, h);
        c->cuts++, c->turn += m.turn, c->spread += m.spread;
    }
}

/* label: uint32_t[face_count], of the crease through each triangle. In the current scope. */
static crease *find_creases(const sharpener *s, uint32_t *label, uint32_t *count)
{
    const qw_trimesh *mesh = s->mesh;
    uint32_t n = mesh->face_count, *stack = QW_NEW(s->env, uint32_t, n);
    crease *list = NULL;
    size_t room = 0;
    *count = 0;
    memset(label, 0xff, n * sizeof *label);
    for (uint32_t seed = 0; seed < n; seed++) {
        if (cuts_of(s, seed) == 0 || label[seed] != QW_NONE) continue;
        uint32_t top = 0;
        list = qw_grow(s->env, list, &room, *count + 1, sizeof *list);
        crease *c = &list[*count];
        *c = (crease){0};
        stack[top++] = seed, label[seed] = *count;
        while (top > 0) {
            uint32_t f = stack[--top];
            add_triangle(s, f, c);
            for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
                uint32_t t = mesh->twin[h];
                if (s->cut[h] && t != QW_NONE && label[t / 3] == QW_NONE) label[t / 3] = *count, stack[top++] = t / 3;
            }
        }
        ++*count;
    }
    qw_free(s->env, stack);
    return list;
}

static void drop_others(const sharpener *s, const crease *list, const uint32_t *label, double quad_edge)
{
    for (uint32_t f = 0; f < s->mesh->face_count; f++)
        if (label[f] != QW_NONE && list[label[f]].length < quad_edge)
            s->cut[3 * f] = s->cut[3 * f + 1] = s->cut[3 * f + 2] = 0;
}

/* uint8_t[vertex_count]: rings away from the ends of edges that are cut, at most `rings`. Where sides count, a ring is
   not left over a cut. */
static uint8_t *rings_around(const sharpener *s, uint8_t rings)
{
    assert(s->cut);
    const qw_trimesh *mesh = s->mesh;
    uint8_t *ring = QW_NEW(s->env, uint8_t, mesh->vertex_count);
    memset(ring, rings, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (s->cut[h]) ring[mesh->corner[h]] = ring[mesh->corner[qw_next(h)]] = 0;
    for (uint8_t r = 0; r + 1 < rings; r++)
        for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
            uint32_t a = mesh->corner[h], b = mesh->corner[qw_next(h)];
            if (ring[a] == r && ring[b] > r) ring[b] = r + 1;
            if (ring[b] == r && ring[a] > r) ring[a] = r + 1;
        }
    return ring;
}

/* What decides about a component. */
typedef struct verdict {
    double creases, marked; /* lengths */
    double turn, spread;    /* means over the creases, times their lengths */
} verdict;

static void add_crease(verdict *v, const crease *c)
{
    v->creases += c->length;
    v->turn += c->length * c->turn / c->cuts, v->spread += c->length * c->spread / c->cuts;
}

static bool was_sampled(const verdict *v)
{
    return v->creases > 0 && v->marked <= MOST_MARKED * v->creases && v->spread <= UNEVEN * v->turn;
}

/* Whether any component has sampled creases. */
static bool judge_components(sharpener *s, const crease *list, uint32_t count, double quad_edge)
{
    assert(s->census->components > 0);
    const qw_trimesh *mesh = s->mesh;
    uint32_t components = (uint32_t)s->census->components;
    verdict *v = QW_NEW_ZERO(s->env, verdict, components);
    for (uint32_t i = 0; i < count; i++)
        if (list[i].length >= quad_edge) add_crease(&v[list[i].component], &list[i]);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (mesh->mark && mesh->mark[h] && is_lower(mesh, h))
            v[s->census->component[h / 3]].marked += (double)qw_edge_length(mesh, h);
    }
    s->sharp = QW_NEW(s->env, uint8_t, components);
    bool any = false;
    for (uint32_t i = 0; i < components; i++) any |= s->sharp[i] = was_sampled(&v[i]);
    return any;
}

/* Takes the cuts off the components that are not sharp. */
static void drop_blunt(const sharpener *s)
{
    for (uint32_t f = 0; f < s->mesh->face_count; f++)
        if (!s->sharp[s->census->component[f]]) s->cut[3 * f] = s->cut[3 * f + 1] = s->cut[3 * f + 2] = 0;
}

/* Finds the edges that creases run across, and drops what is too short or too weak to be a crease. False: nothing
 * is left. */
static bool find_cuts(sharpener *s, double quad_edge)
{
    const qw_trimesh *mesh = s->mesh;
    s->cut = QW_NEW(s->env, uint8_t, 3 * (size_t)mesh->face_count);
    qw_parallel(s->env, mesh->face_count, QW_GRAIN_LIGHT, ask_cuts, s);
    uint32_t count, *label = QW_NEW(s->env, uint32_t, mesh->face_count);
    const crease *list = find_creases(s, label, &count);
    drop_others(s, list, label, quad_edge);
    bool any = count > 0 && judge_components(s, list, count, quad_edge);
    if (any) drop_blunt(s);
    return any;
}

/* ---- sides */

static void fit_sides(void *user, uint32_t begin, uint32_t end)
{
    const sharpener *s = user;
    for (uint32_t i = begin; i < end; i++) s->fit[i] = qw_fit_side(&s->sides, s->fitted[i], s->cut, s->ring);
}

static const qw_side_fit *side_of(const sharpener *s, uint32_t v) { return &s->fit[s->fit_of[v]]; }

/* The turn where the sides meet, as they have been fitted. */
static double fitted_turn(const sharpener *s, uint32_t h)
{
    uint32_t a = s->mesh->corner[h], b = s->mesh->corner[qw_next(h)];
    const qw_side_fit *both[2] = {side_of(s, a), side_of(s, b)};
    qw_vec3 p = qw_meet_sides(both, 2, qw_lerp(s->mesh->position[a], s->mesh->position[b], 0.5f));
    return angle_between(qw_normal_of(both[0], p), qw_normal_of(both[1], p));
}

static void uncut(const sharpener *s, uint32_t h)
{
    s->cut[h] = 0;
    if (s->mesh->twin[h] != QW_NONE) s->cut[s->mesh->twin[h]] = 0;
}

/* Where creases fade, planes still turn when the sides no longer do: there the line would leave the crease. */
static void trim_creases(const sharpener *s)
{
    const qw_trimesh *mesh = s->mesh;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (s->cut[h] && is_lower(mesh, h) && fitted_turn(s, h) < LEAST_TURN) uncut(s, h);
}

/* Fits a quadric to the side of each vertex near a crease, which is where the crease is looked for. */
static void find_fits(sharpener *s)
{
    assert(s->cut && s->sides.plane);
    uint32_t n = s->mesh->vertex_count;
    s->rings = RINGS, s->ring = rings_around(s, s->rings);
    s->fit_of = QW_NEW(s->env, uint32_t, n), s->fitted = QW_NEW(s->env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) {
        s->fit_of[v] = s->ring[v] < s->rings && qw_length2(s->sides.plane[s->sides.side[v]].normal) > 0 ? s->fits
                                                                                                        : QW_NONE;
        if (s->fit_of[v] != QW_NONE) s->fitted[s->fits++] = v;
    }
    s->fit = QW_NEW(s->env, qw_side_fit, s->fits);
    qw_parallel(s->env, s->fits, QW_GRAIN_SEARCH, fit_sides, s);
    trim_creases(s);
    s->ring = rings_around(s, s->rings);
}

/* Shares of an edge that a crossing keeps from its ends, so that no triangle is without area. */
static const double CROSSING_BEGIN = 0.02, CROSSING_END = 0.98;

/* Where the crease crosses the edge of h: to begin with as far from one side as from the other. On the boundary it
   stays there. */
static qw_vec3 crossing_of(const sharpener *s, uint32_t h)
{
    assert(h < 3 * s->mesh->face_count);
    uint32_t a = s->mesh->corner[h], b = s->mesh->corner[qw_next(h)];
    const qw_side_fit *both[2] = {side_of(s, a), side_of(s, b)};
    double fa = fabs(qw_height_over(both[1], s->mesh->position[a])),
           fb = fabs(qw_height_over(both[0], s->mesh->position[b]));
    double t = fa + fb > 0 ? fa / (fa + fb) : 0.5;
    qw_vec3 from = qw_lerp(s->mesh->position[a], s->mesh->position[b],
                           (float)fmin(fmax(t, CROSSING_BEGIN), CROSSING_END));
    if (s->mesh->twin[h] == QW_NONE) return from;
    qw_vec3 p = qw_meet_sides(both, 2, from);
    return qw_distance(p, from) <= MOST_MOVED * s->sides.edge[a] ? p : from;
}

static qw_vec3 corner_of(const sharpener *s, uint32_t f, qw_vec3 from)
{
    const uint32_t *c = s->mesh->corner + 3 * (size_t)f;
    const qw_side_fit *all[3] = {side_of(s, c[0]), side_of(s, c[1]), side_of(s, c[2])};
    qw_vec3 p = qw_meet_sides(all, 3, from);
    return qw_distance(p, from) <= MOST_MOVED * s->sides.edge[c[0]] ? p : from;
}

/* Sharp components of which too much is the rim of a thin shell are so no longer. Returns whether any is left. */
static bool drop_shells(sharpener *s)
{
    const qw_trimesh *mesh = s->mesh;
    uint32_t components = (uint32_t)s->census->components;
    uint32_t *all = QW_NEW_ZERO(s->env, uint32_t, components), *walls = QW_NEW_ZERO(s->env, uint32_t, components);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t c = s->census->component[h / 3];
        if (s->cut[h] && is_lower(mesh, h)) all[c]++, walls[c] += fitted_turn(s, h) > WALLS_TURN;
    }
    bool any = false;
    for (uint32_t i = 0; i < components; i++) any |= s->sharp[i] = s->sharp[i] && walls[i] <= MOST_WALLS * all[i];
    return any;
}

/* ---- the new surface */

static void mark_between(qw_edit *e, uint32_t a, uint32_t b)
{
    uint32_t h = qw_edit_between(e, a, b), t = h == QW_NONE ? QW_NONE : qw_edit_twin(e, h);
    if (t != QW_NONE) e->face[h >> 2].mark[h & 3] = e->face[t >> 2].mark[t & 3] = QW_MARK_FEATURE;
}

/* A triangle in which three creases meet gets a vertex: on the edge from one of the crossings to the corner opposite,
   which the splits have left. m: the crossings, on the edges from corner i to the next. */
static void cut_corner(const sharpener *s, qw_edit *e, uint32_t f, const uint32_t m[3])
{
    assert(f < s->mesh->face_count);
    const uint32_t *c = s->mesh->corner + 3 * (size_t)f;
    qw_vec3 sum = qw_add(qw_add(e->vertex[m[0]].position, e->vertex[m[1]].position), e->vertex[m[2]].position);
    uint32_t h = QW_NONE;
    for (int i = 0; i < 3 && h == QW_NONE; i++) h = qw_edit_between(e, m[i], c[(i + 2) % 3]);
    assert(h != QW_NONE);
    uint32_t corner = qw_edit_split(e, h, corner_of(s, f, qw_scale(sum, 1 / 3.0f)), 0, 0);
    for (int i = 0; i < 3; i++) mark_between(e, corner, m[i]);
}

/* home of a vertex on a crease: the half-edge that it was put on; of a corner QW_NONE. */
static void cut_surface(const sharpener *s, qw_edit *e)
{
    assert(e->vertex_count == s->mesh->vertex_count);
    const qw_trimesh *mesh = s->mesh;
    uint32_t sides = 3 * mesh->face_count, *at = QW_NEW(s->env, uint32_t, sides);
    for (uint32_t f = 0; f < mesh->face_count; f++)
        if (s->sharp[s->census->component[f]]) memset(e->face[f].mark, 0, sizeof e->face[f].mark);
    for (uint32_t h = 0; h < sides; h++) {
        if (!s->cut[h]) continue;
        if (!is_lower(mesh, h)) at[h] = at[mesh->twin[h]];
        else
            at[h] = qw_edit_split(e, qw_edit_between(e, mesh->corner[h], mesh->corner[qw_next(h)]), crossing_of(s, h),
                                  0, h);
    }
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t m[3], k = 0;
        if (cuts_of(s, f) < 2) continue;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            if (s->cut[h]) m[k++] = at[h];
        if (k == 2) mark_between(e, m[0], m[1]);
        else cut_corner(s, e, f, m);
    }
}

/* ---- smoothing */

/* The mean of the vertices around, or of those along a crease. Returns how many these are. */
static uint32_t mean_around(const qw_edit *e, uint32_t v, bool along, qw_vec3 *mean)
{
    assert(v < e->vertex_count);
    qw_vec3 sum = {0, 0, 0};
    uint32_t count = 0, start = e->vertex[v].out, h = start;
    do {
        if (!along || qw_edit_mark(e, h)) sum = qw_add(sum, e->vertex[qw_edit_head(e, h)].position), count++;
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    if (h == QW_NONE) return 0; /* the boundary stays */
    *mean = qw_scale(sum, 1 / fmaxf((float)count, 1));
    return count;
}

static void smooth_on_line(const sharpener *s, qw_edit *e, uint32_t v)
{
    uint32_t h = e->vertex[v].home;
    qw_vec3 mean;
    if (h == QW_NONE || mean_around(e, v, true, &mean) != 2) return;
    const qw_side_fit *both[2] = {side_of(s, s->mesh->corner[h]), side_of(s, s->mesh->corner[qw_next(h)])};
    qw_vec3 p = qw_meet_sides(both, 2, mean);
    if (qw_distance(p, mean) <= MOST_MOVED * s->sides.edge[s->mesh->corner[h]]) e->vertex[v].position = p;
}

/* Smooths what lies beside the new crease: its vertices along it, those around it on their fitted sides. */
static void smooth_band(const sharpener *s, qw_edit *e)
{
    for (int round = 0; round < SMOOTHING_ROUNDS; round++) {
        qw_heartbeat(s->env);
        for (uint32_t v = s->mesh->vertex_count; v < e->vertex_count; v++) smooth_on_line(s, e, v);
        for (uint32_t i = 0; i < s->fits; i++) {
            uint32_t v = s->fitted[i];
            const qw_side_fit *fit = &s->fit[i];
            qw_vec3 mean;
            if (s->ring[v] + 1 >= s->rings || mean_around(e, v, false, &mean) == 0) continue;
            qw_vec3 p = qw_meet_sides(&fit, 1, mean);
            if (qw_distance(p, mean) <= MOST_MOVED * s->sides.edge[v]) e->vertex[v].position = p;
        }
    }
}

bool qw_sharpen(qw_env *env, qw_trimesh *surface, const qw_census *census, float quad_edge)
{
    assert(surface->twin && census->component && quad_edge > 0);
    qw_scope_begin(env);
    sharpener s = {.env = env, .mesh = surface, .census = census};
    bool found = qw_find_sides(env, surface, &s.sides) && find_cuts(&s, (double)quad_edge);
    if (found) find_fits(&s), found = drop_shells(&s);
    if (found) {
        drop_blunt(&s);
        s.ring = rings_around(&s, s.rings);
        const float *target = QW_NEW_ZERO(env, float, surface->vertex_count);
        qw_edit e = qw_edit_open(env, surface, target, s.sides.outgoing);
        cut_surface(&s, &e);
        smooth_band(&s, &e);
        uint8_t *mark = surface->mark, *point = surface->point;
        *surface = qw_edit_plain(&e, point, point ? surface->vertex_count : 0);
        qw_free(env, mark), qw_free(env, point);
    }
    qw_scope_end(env);
    return found;
}
