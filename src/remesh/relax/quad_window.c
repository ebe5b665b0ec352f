#include "remesh/relax/quad_window.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A repair has lost shape where the middle of a quad or of a side lies farther from the surface than this, in mean
   edges, and farther than any did before: it would be a flap pulled off a thin rod. */
static const float FARTHEST = 0.2f;
/* A quad is flat where no corner's triangle is wider than this share of its longest side: single precision means
 * little below it. */
static const float FLAT = 1e-6f;
/* To judge a quad, or to search a place for a vertex, is one step of the budget: some hundred triangles of the surface
   are looked at. Between sheets that lie close together, as in a roll, it can be all there are, and what helps there is
   chance: so the square of this many times as many are that many steps more. */
enum { LOOKED_A_STEP = 512 };

void qw_spend(qw_repair_site *s, uint64_t steps, uint64_t looked)
{
    uint64_t times = looked / LOOKED_A_STEP, all = steps + times * times;
    s->budget -= s->budget < all ? s->budget : all;
}

/* ---- taking */

static bool is_inside(const qw_repair_site *s, uint32_t v)
{
    uint32_t first = s->e.out[v], h = first;
    do {
        if (s->face_in[h / 4] != s->round) return false;
        h = qw_quad_around(&s->e.mesh, h);
    } while (h != QW_NONE && h != first);
    return true;
}

static void add_vertex(qw_repair_site *s, qw_window *p, uint32_t v)
{
    assert(v < s->e.mesh.vertex_count && p->quads.vertex_count <= QW_WINDOW_VERTICES);
    if (s->vertex_in[v] == s->round) return;
    s->vertex_in[v] = s->round, s->number[v] = p->quads.vertex_count;
    p->vertex[p->quads.vertex_count++] = v;
}

/* The quads at v and their vertices; false where there is no room. */
static bool add_around(qw_repair_site *s, qw_window *p, uint32_t v)
{
    assert(v < s->e.mesh.vertex_count && p->quads.face_count <= QW_WINDOW_FACES);
    uint32_t first = s->e.out[v], h = first;
    do {
        uint32_t f = h / 4;
        if (s->face_in[f] != s->round) {
            if (p->quads.face_count == QW_WINDOW_FACES) return false;
            s->face_in[f] = s->round, s->face_number[f] = p->quads.face_count;
            p->face[p->quads.face_count++] = f;
            for (uint32_t i = 0; i < 4; i++) add_vertex(s, p, s->e.mesh.corner[4 * f + i]);
        }
        h = qw_quad_around(&s->e.mesh, h);
    } while (h != QW_NONE && h != first);
    return true;
}

static void index_window(qw_window *p)
{
    uint32_t n = p->quads.vertex_count, sides = 4 * p->quads.face_count;
    memset(p->begin, 0, (n + 2) * sizeof *p->begin);
    for (uint32_t h = 0; h < sides; h++) p->begin[p->corner[h] + 2]++;
    for (uint32_t v = 0; v < n; v++) p->begin[v + 2] += p->begin[v + 1];
    for (uint32_t h = 0; h < sides; h++) p->around[p->begin[p->corner[h] + 1]++] = h;
}

static qw_role role_of(const qw_repair_site *s, uint32_t v, qw_freedom freedom)
{
    bool bound = s->curves.edge && s->curves.edge[v] != QW_NONE, on_curve = bound || s->e.mesh.kind[v];
    if (!is_inside(s, v) || (s->stays && s->stays[v])) return QW_ROLE_FIXED;
    if (!on_curve) return QW_ROLE_FREE;
    if (bound) return QW_ROLE_BOUND;
    return freedom == QW_CORNERS_SLIDE && s->all_curves ? QW_ROLE_CORNER : QW_ROLE_FIXED;
}

static void copy_vertex(const qw_repair_site *s, qw_window *p, uint32_t i, qw_freedom freedom)
{
    assert(i < p->quads.vertex_count);
    uint32_t v = p->vertex[i];
    p->position[i] = s->e.mesh.position[v], p->kind[i] = s->e.mesh.kind[v], p->home[i] = s->home[v];
    p->ground[i] = s->ground ? s->ground[v] : qw_v3(0, 0, 0);
    p->edge[i] = s->curves.edge ? s->curves.edge[v] : QW_NONE;
    p->role[i] = (uint8_t)role_of(s, v, freedom);
    if (p->role[i] != QW_ROLE_FIXED) p->moving[p->moving_count++] = i;
}

void qw_window_take(qw_repair_site *s, qw_window *p, const uint32_t *seeds, uint32_t seed_count, uint32_t rings,
                    qw_freedom freedom)
{
    const qw_quadmesh *q = &s->e.mesh;
    assert(seed_count <= QW_WINDOW_SEEDS);
    s->round++;
    p->quads =
        (qw_quadmesh){.position = p->position, .corner = p->corner, .twin = p->twin, .kind = p->kind, .mark = p->mark};
    p->freedom = freedom, p->moving_count = 0, p->farthest = -1, p->least_area = 0;
    for (uint32_t i = 0; i < seed_count; i++) add_vertex(s, p, seeds[i]);
    bool fits = true;
    for (uint32_t ring = 0, done = 0; ring < rings; ring++)
        for (uint32_t end = p->quads.vertex_count; fits && done < end; done++) fits = add_around(s, p, p->vertex[done]);
    for (uint32_t i = 0; i < p->quads.vertex_count; i++) copy_vertex(s, p, i, freedom);
    for (uint32_t h = 0; h < 4 * p->quads.face_count; h++) {
        uint32_t at = 4 * p->face[h / 4] + h % 4, t = q->twin[at];
        p->corner[h] = s->number[q->corner[at]], p->mark[h] = q->mark[at];
        p->twin[h] = t != QW_NONE && s->face_in[t / 4] == s->round ? 4 * s->face_number[t / 4] + t % 4 : QW_NONE;
    }
    index_window(p);
    qw_window_save(p);
}

/* ---- saving */

void qw_window_save(qw_window *p)
{
    assert(p->quads.face_count <= QW_WINDOW_FACES && p->quads.vertex_count <= QW_WINDOW_VERTICES);
    uint32_t n = p->quads.vertex_count;
    memcpy(p->saved_position, p->position, n * sizeof *p->position);
    memcpy(p->saved_ground, p->ground, n * sizeof *p->ground);
    memcpy(p->saved_edge, p->edge, n * sizeof *p->edge);
}

void qw_window_restore(qw_window *p)
{
    assert(p->quads.face_count <= QW_WINDOW_FACES && p->quads.vertex_count <= QW_WINDOW_VERTICES);
    uint32_t n = p->quads.vertex_count;
    memcpy(p->position, p->saved_position, n * sizeof *p->position);
    memcpy(p->ground, p->saved_ground, n * sizeof *p->ground);
    memcpy(p->edge, p->saved_edge, n * sizeof *p->edge);
}

void qw_window_put(qw_repair_site *s, const qw_window *p)
{
    assert(p->quads.vertex_count <= QW_WINDOW_VERTICES);
    for (uint32_t k = 0; k < p->moving_count; k++) {
        uint32_t i = p->moving[k], v = p->vertex[i];
        qw_quad_edit_place(&s->e, v, p->position[i]);
        if (s->ground) s->ground[v] = p->ground[i];
        if (s->curves.edge) s->curves.edge[v] = p->edge[i];
    }
}

/* ---- scoring */

uint32_t qw_inverted_corners(const qw_vec3 *position, const uint32_t *corner)
{
    assert(position && corner);
    qw_vec3 n = qw_quad_cross(position, corner);
    uint32_t count = 0;
    for (uint32_t i = 0; i < 4; i++) {
        qw_vec3 at = position[corner[i]], a = qw_sub(position[corner[(i + 1) & 3]], at),
                b = qw_sub(position[corner[(i + 3) & 3]], at);
        count += qw_dot(qw_cross(a, b), n) <= 0;
    }
    return count;
}

bool qw_may_be_flipped(const qw_vec3 *position, const qw_vec3 *ground, const uint32_t *corner)
{
    assert(position && corner);
    qw_vec3 n = qw_normalize(qw_quad_cross(position, corner));
    bool known = false;
    for (uint32_t i = 0; i < 4; i++) {
        qw_vec3 up = ground[corner[i]];
        if (qw_length2(up) < 0.5f) continue;
        if (qw_dot(up, n) < QW_FLIP_AGREES) return true;
        known = true;
    }
    return !known || qw_inverted_corners(position, corner) > 0;
}

/* All corners on one line, or two of them at one place: no quad to be kept, whatever its normals say. */
static bool is_flat(const qw_vec3 *position, const uint32_t *c)
{
    float longest2 = 0, most2 = 0;
    for (int i = 0; i < 4; i++) {
        qw_vec3 a = position[c[i]], b = position[c[(i + 1) & 3]], d = position[c[(i + 2) & 3]];
        float side2 = qw_length2(qw_sub(b, a));
        if (side2 == 0 || (i < 2 && qw_length2(qw_sub(d, a)) == 0)) return true;
        longest2 = fmaxf(longest2, side2);
        most2 = fmaxf(most2, qw_length2(qw_cross(qw_sub(b, a), qw_sub(d, b))));
    }
    return most2 <= FLAT * FLAT * longest2 * longest2;
}

/* What is wrong with a quad's form, without a look at the surface. */
static qw_faults faults_of_form(const qw_vec3 *position, const uint32_t *corner)
{
    if (is_flat(position, corner)) return (qw_faults){1, 0, 4};
    return (qw_faults){0, 0, (int32_t)qw_inverted_corners(position, corner)};
}

/* Beside the surface, of a quad that is not flat. */
static qw_faults faults_of_side(const qw_flip_judge *judge, const qw_vec3 *position, const uint32_t *corner)
{
    qw_flip flip = qw_flip_of_quad(judge, position, corner);
    return (qw_faults){flip == QW_FLIPPED, flip == QW_DOUBTFUL, 0};
}

qw_faults qw_faults_of_quad(const qw_flip_judge *judge, const qw_vec3 *position, const qw_vec3 *ground,
                            const uint32_t *corner)
{
    assert(judge && position && corner);
    qw_faults faults = faults_of_form(position, corner);
    if (faults.flipped || (ground && !qw_may_be_flipped(position, ground, corner))) return faults;
    qw_add_faults(&faults, faults_of_side(judge, position, corner), 1);
    return faults;
}

qw_faults qw_window_faults_of(qw_repair_site *s, const qw_window *p, uint32_t f)
{
    assert(f < p->quads.face_count);
    const uint32_t *c = p->corner + 4 * (size_t)f;
    uint64_t effort = 0;
    qw_flip_judge judge = s->judge;
    judge.effort = &effort;
    qw_faults faults = qw_faults_of_quad(&judge, p->position, p->ground, c);
    qw_spend(s, qw_may_be_flipped(p->position, p->ground, c), effort);
    return faults;
}

static float distance_to_surface(const qw_repair_site *s, uint32_t component, qw_vec3 point)
{
    qw_hit hit = qw_bvh_nearest_of(s->tree, component, point, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
    return qw_distance(hit.point, point);
}

/* The largest distance from the surface of the middles of quads and of their sides. */
static float find_farthest(const qw_repair_site *s, const qw_window *p)
{
    float most = 0;
    uint32_t part = qw_window_component(s, p);
    for (uint32_t h = 0; h < 4 * p->quads.face_count; h++) {
        qw_vec3 a = p->position[p->corner[h]], b = p->position[p->corner[qw_quad_next(h)]];
        if (h % 4 == 0) most = fmaxf(most, distance_to_surface(s, part, qw_quad_middle(p->position, p->corner + h)));
        if (p->twin[h] > h) most = fmaxf(most, distance_to_surface(s, part, qw_lerp(a, b, 0.5f)));
    }
    return most;
}

static float find_area(const qw_window *p)
{
    float sum = 0;
    for (uint32_t f = 0; f < p->quads.face_count; f++) sum += qw_length(qw_quad_cross(p->position, p->corner + 4 * f));
    return sum;
}

/* Whether the window has kept its shape, compared with what was saved first (which is still so when this is first
   asked). */
static bool keeps_shape(const qw_repair_site *s, qw_window *p)
{
    float area = find_area(p), far = find_farthest(s, p);
    if (p->farthest < 0) {
        qw_vec3 now[QW_WINDOW_VERTICES];
        size_t size = p->quads.vertex_count * sizeof *now;
        memcpy(now, p->position, size), memcpy(p->position, p->saved_position, size);
        p->farthest = fmaxf(FARTHEST * s->edge, find_farthest(s, p)), p->area = find_area(p);
        memcpy(p->position, now, size);
    }
    return far <= p->farthest && area >= p->least_area * p->area;
}

/* The faults of the window as it is. As soon as those found so far are no fewer than `most` they are returned, as the
   window is no better then. What is cheap to see is looked at first. */
static qw_faults faults_at_most(qw_repair_site *s, const qw_window *p, qw_faults most)
{
    qw_faults sum = {0, 0, 0};
    uint32_t list[QW_WINDOW_FACES], count = 0;
    for (uint32_t f = 0; f < p->quads.face_count; f++) {
        const uint32_t *c = p->corner + 4 * (size_t)f;
        qw_faults form = faults_of_form(p->position, c);
        qw_add_faults(&sum, form, 1);
        if (qw_may_be_flipped(p->position, p->ground, c)) list[count++] = f;
    }
    qw_spend(s, count, 0);
    for (uint32_t i = 0; i < count && qw_fewer_faults(sum, most); i++) {
        const uint32_t *c = p->corner + 4 * (size_t)list[i];
        uint64_t effort = 0;
        qw_flip_judge judge = s->judge;
        judge.effort = &effort;
        if (!is_flat(p->position, c)) qw_add_faults(&sum, faults_of_side(&judge, p->position, c), 1);
        qw_spend(s, 0, effort);
    }
    return sum;
}

bool qw_window_keep_better(qw_repair_site *s, qw_window *p)
{
    assert(s->tree && p->quads.face_count <= QW_WINDOW_FACES);
    qw_faults now = faults_at_most(s, p, p->faults);
    if (!qw_fewer_faults(now, p->faults) || !keeps_shape(s, p)) return false;
    p->faults = now;
    qw_window_save(p);
    return true;
}
