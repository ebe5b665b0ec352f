/* The rings around a flipped quad, all but the outermost vertices, are spread out as a membrane that hangs from those
 * (each vertex in the middle of its neighbours: Tutte's embedding has no quad turned over where the ring is convex),
 * then brought back onto the surface. More rings are tried until none in there is flipped, and what has fewest is kept;
 * a few more until no corner is turned over. Curve vertices slide on their curves, corners stay; where that does not
 * do, all of them go to the nearest point of any curve.
 */
#include "quad/untangle.h"

#include "mesh/slide.h"

#include <math.h>
#include <string.h>

enum {
    MOST_RINGS = 6,
    FEW_RINGS = 3, /* where a quad is perhaps not flipped, or is no more and corners are still turned over */
    SWEEPS = 12,   /* of smoothing, a ring */
    SETTLINGS = 4, /* onto the surface, with a sweep between */
    POINTS = 4,    /* of a triangle that are looked at */
    MOST_IN_PATCH = 64,
    MOST_SEEDS = 2000,
    PASSES = 4,
    LOOSE_PASS = 2,     /* from here on corners may move */
    GRAIN = 16,         /* a question takes some microseconds */
    ASKED_AT_ONCE = 64, /* before it is looked whether that is enough */
    LEAST_LOOKS = 50000,
    LOOKS_A_QUAD = 10 /* at quads: some tenths of a second, so that hopeless cases take no longer */
};
/* Corners of a patch's quads that do not move, at least, and how many may move for each: six rings of a plain lattice
 * have six. */
enum { LEAST_HELD = 4, MOST_MOVING = 8 };

/* As for the measure of flipped faces, but stricter, as that takes samples: opposed and agreeing normals (cosines), the
   share of a quad that opposes, and edge lengths within which nothing agrees if it is certainly flipped, or may be. */
static const float OPPOSED = -0.2f, AGREES = 0.3f, MOST_OPPOSED = 0.3f, FAR = 0.8f, NEAR = 0.4f;
/* And as the measure itself has them. */
static const float MEASURED_AGREES = 0.2f, MEASURED_OPPOSED = 0.6f;
/* What agrees and is smaller than this, in squares of the mean edge, is not worth mentioning: scans have single
   triangles that face any way, and a measure by some tens of samples to a quad sees nothing of them. */
static const float CRUMB = 0.1f;
/* What is spread out has at least this share of the area that it had: folds go, the tips of thin parts stay. */
static const float LEAST_AREA = 0.4f, LEAST_AREA_IN_DOUBT = 0.85f;
/* Normals of a vertex and of the surface may differ by this much (cosine) for a point to count as the same sheet. */
static const float SAME_SHEET = 0.2f;

typedef struct tangle {
    qw_env *env;
    const qw_untangling *u;
    float edge;                  /* mean length */
    const qw_curve_tree *loose;  /* all curves, where corners may move and curve vertices change curves; or NULL */
    uint32_t *faces, face_count; /* of the patch */
    uint32_t *order,
        asked;       /* [face_count] the patch's faces in the order in which faults() asks, and how many it has asked */
    uint8_t *degree; /* [face_count] what it heard, in that order */
    uint8_t *was_flipped;                 /* [faces] when it asked last */
    uint32_t *vertices, vertex_count;     /* those that may move */
    uint32_t *face_in, *vertex_in, patch; /* [faces], [vertices]: the number of the patch that they were last in */
    qw_vec3 *old, *best;                  /* [vertex_count], room for all */
    uint32_t *old_edge, *best_edge;
    uint64_t looks;              /* left */
    bool changed;                /* in this pass */
    uint32_t *seeds, seed_count; /* [faces] that are or may be flipped */
    uint8_t *is_seed;            /* [faces] */
} tangle;

/* ---- flipped quads */

static qw_vec3 triangle_cross(const qw_vec3 *p, uint32_t half, const uint32_t *c)
{
    qw_vec3 a = p[c[0]], b = p[c[1 + half]], d = p[c[2 + half]];
    return qw_cross(qw_sub(b, a), qw_sub(d, a));
}

static qw_vec3 point_in(const qw_vec3 *p, uint32_t half, const uint32_t *c, int k)
{
    static const float weight[POINTS][3] = {{1.0f / 3, 1.0f / 3, 1.0f / 3},
                                            {2.0f / 3, 1.0f / 6, 1.0f / 6},
                                            {1.0f / 6, 2.0f / 3, 1.0f / 6},
                                            {1.0f / 6, 1.0f / 6, 2.0f / 3}};
    qw_vec3 q = qw_scale(p[c[0]], weight[k][0]);
    return qw_madd(qw_madd(q, weight[k][1], p[c[1 + half]]), weight[k][2], p[c[2 + half]]);
}

static qw_vec3 normal_of(const qw_untangling *u, uint32_t f)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    const qw_vec3 *p = u->position;
    return qw_normalize(qw_cross(qw_sub(p[c[2]], p[c[0]]), qw_sub(p[c[3]], p[c[1]])));
}

/* Whether a quad faces against every one beside it, of which there are at least three. */
static bool faces_against_all(const qw_untangling *u, uint32_t f)
{
    qw_vec3 n = normal_of(u, f);
    uint32_t beside = 0;
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
        uint32_t g = u->quads->twin[h];
        if (g == QW_NONE) continue;
        if (qw_dot(n, normal_of(u, g / 4)) >= OPPOSED) return false;
        beside++;
    }
    return beside >= 3;
}

/* The half of f that opposes the surface more, where more than that share of f does, and the triangle of the surface
 * that is near; else 2. */
static uint32_t opposed_half(const qw_untangling *u, uint32_t f, float share, uint32_t *near)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    const qw_vec3 *p = u->position;
    qw_vec3 normal[2];
    float area[2], opposed[2] = {0, 0}, left;
    *near = QW_NONE;
    for (uint32_t half = 0; half < 2; half++) {
        qw_vec3 n = triangle_cross(p, half, c);
        area[half] = qw_length(n), normal[half] = qw_normalize(n);
    }
    left = area[0] + area[1];
    for (uint32_t half = 0; half < 2; half++)
        for (int k = 0; k < POINTS; k++) {
            if (opposed[0] + opposed[1] + left <= share * (area[0] + area[1])) return 2;
            left -= area[half] / POINTS;
            qw_hit hit = qw_bvh_nearest(u->tree, point_in(p, half, c, k), qw_v3(0, 0, 0), -1, INFINITY, *near);
            if (hit.face == QW_NONE) return 2;
            *near = hit.face;
            if (qw_dot(normal[half], qw_normalize(qw_face_cross(u->surface, hit.face))) < OPPOSED)
                opposed[half] += area[half] / POINTS;
        }
    if (!(opposed[0] + opposed[1] > share * (area[0] + area[1]))) return 2;
    return opposed[1] > opposed[0];
}

bool qw_is_opposed(const qw_untangling *u, uint32_t f)
{
    uint32_t near;
    return opposed_half(u, f, MEASURED_OPPOSED, &near) < 2;
}

/* Whether a point of a triangle is within `reach` of p, for triangles that have no long sides or are far away. */
static bool may_reach(const qw_trimesh *s, uint32_t triangle, qw_vec3 p, float reach)
{
    const uint32_t *c = s->corner + 3 * (size_t)triangle;
    qw_vec3 a = s->position[c[0]];
    float side = sqrtf(fmaxf(qw_length2(qw_sub(s->position[c[1]], a)), qw_length2(qw_sub(s->position[c[2]], a))));
    return qw_length2(qw_sub(p, a)) <= (reach + side) * (reach + side);
}

/* Whether a triangle agrees with a normal, and a point of it is within `reach` of p. */
static bool agrees_near(const qw_trimesh *s, uint32_t triangle, qw_vec3 p, qw_vec3 normal, float reach)
{
    const uint32_t *c = s->corner + 3 * (size_t)triangle;
    qw_vec3 n = qw_face_cross(s, triangle);
    if (qw_dot(n, normal) <= MEASURED_AGREES * qw_length(n) || !may_reach(s, triangle, p, reach)) return false;
    return qw_triangle_distance2(s->position[c[0]], s->position[c[1]], s->position[c[2]], p) <= reach * reach;
}

/* Whether the patch of such triangles about the one given has an area of `enough`; false where it takes too many. */
static bool is_patch_enough(const qw_trimesh *s, uint32_t triangle, qw_vec3 p, qw_vec3 normal, float reach,
                            float enough)
{
    uint32_t patch[MOST_IN_PATCH], count = 0;
    float area = 0;
    patch[count++] = triangle;
    for (uint32_t i = 0; i < count; i++) {
        area += 0.5f * qw_length(qw_face_cross(s, patch[i]));
        if (area >= enough) return true;
        for (uint32_t h = 3 * patch[i]; h < 3 * patch[i] + 3; h++) {
            uint32_t next = s->twin[h] == QW_NONE ? QW_NONE : s->twin[h] / 3, k = 0;
            while (k < count && patch[k] != next) k++;
            if (next != QW_NONE && k == count && count < MOST_IN_PATCH && agrees_near(s, next, p, normal, reach))
                patch[count++] = next;
        }
    }
    return false;
}

/* What of near is within the reach of one quad, for all of its points. */
enum { MOST_OWN = 4096 };
typedef struct own_near {
    qw_near *near;
    qw_vec3 middle;
    float reach;
    uint32_t list[MOST_OWN], count; /* MOST_OWN: there is no room, and all of near is looked at */
    bool is_listed;
} own_near;

static void list_near(const qw_trimesh *s, own_near *own)
{
    qw_near *near = own->near;
    for (uint32_t i = 0; i < s->face_count && !near->is_listed; i++)
        if (may_reach(s, i, near->middle, near->reach)) near->list[near->count++] = i;
    for (uint32_t i = 0; i < near->count && !own->is_listed && own->count < MOST_OWN; i++)
        if (may_reach(s, near->list[i], own->middle, own->reach)) own->list[own->count++] = near->list[i];
    near->is_listed = own->is_listed = true;
}

/* Whether of the surface within `reach` of p so much agrees with a normal. All triangles near by are only looked at
 * where the nearest that agree are too few. */
static bool agrees_enough(const qw_untangling *u, own_near *own, qw_vec3 p, qw_vec3 normal, float reach, float enough)
{
    const qw_trimesh *s = u->surface;
    qw_hit hit = qw_bvh_nearest(u->tree, p, normal, MEASURED_AGREES, reach, QW_NONE);
    if (hit.face == QW_NONE) return false;
    if (is_patch_enough(s, hit.face, p, normal, reach, enough)) return true;
    list_near(s, own);
    const uint32_t *list = own->count < MOST_OWN ? own->list : own->near->list;
    uint32_t count = own->count < MOST_OWN ? own->count : own->near->count;
    float area = 0;
    for (uint32_t i = 0; i < count && area < enough; i++)
        if (agrees_near(s, list[i], p, normal, reach)) area += 0.5f * qw_length(qw_face_cross(s, list[i]));
    return area >= enough;
}

bool qw_is_turned_over(const qw_untangling *u, float edge, uint32_t f, qw_near *near)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    float alone = 0, all = 0, crumb = CRUMB * edge * edge;
    if (!qw_is_opposed(u, f)) return false;
    own_near own;
    own.near = near, own.count = 0, own.is_listed = false;
    own.middle = qw_scale(
        qw_add(qw_add(u->position[c[0]], u->position[c[1]]), qw_add(u->position[c[2]], u->position[c[3]])), 0.25f);
    own.reach = edge;
    for (uint32_t i = 0; i < 4; i++) own.reach = fmaxf(own.reach, edge + qw_distance(own.middle, u->position[c[i]]));
    for (uint32_t half = 0; half < 2; half++) {
        qw_vec3 n = triangle_cross(u->position, half, c), normal = qw_normalize(n);
        for (int k = 0; k < POINTS; k++) {
            all += qw_length(n);
            if (!agrees_enough(u, &own, point_in(u->position, half, c, k), normal, FAR * edge, crumb))
                alone += qw_length(n);
        }
    }
    return alone > 0.5f * all;
}

uint32_t qw_flip_degree(const qw_untangling *u, float edge, uint32_t f)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    const qw_vec3 *p = u->position;
    uint32_t near, half = opposed_half(u, f, MOST_OPPOSED, &near);
    if (half == 2) return 0;
    qw_vec3 normal = qw_normalize(triangle_cross(p, half, c));
    qw_hit hit = qw_bvh_nearest(u->tree, point_in(p, half, c, 0), normal, AGREES, FAR * edge, near);
    if (hit.face == QW_NONE) return QW_CERTAINLY_FLIPPED;
    /* a scan has single triangles that face any way */
    return hit.distance2 > NEAR * NEAR * edge * edge || faces_against_all(u, f);
}

/* Cheap, and true of all that can be flipped: a corner of the quad is turned against the surface there or against the
   quad, or nothing is known of the surface there. */
static bool is_suspect(const qw_untangling *u, uint32_t f)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    const qw_vec3 *p = u->position;
    qw_vec3 n = normal_of(u, f);
    bool known = false;
    for (uint32_t i = 0; i < 4; i++) {
        qw_vec3 q = p[c[i]], ground = u->ground[c[i]];
        if (qw_dot(qw_cross(qw_sub(p[c[(i + 1) & 3]], q), qw_sub(p[c[(i + 3) & 3]], q)), n) <= 0) return true;
        if (qw_length2(ground) < 0.5f) continue;
        if (qw_dot(ground, n) < AGREES) return true;
        known = true;
    }
    return !known;
}

float qw_mean_edge(const qw_untangling *u)
{
    double sum = 0;
    for (uint32_t h = 0; h < 4 * u->quads->face_count; h++)
        sum += (double)qw_distance(u->position[u->quads->corner[h]], u->position[u->quads->corner[qw_quad_next(h)]]);
    return (float)(sum / (4.0 * u->quads->face_count));
}

/* ---- patches */

static bool is_on_curve(const tangle *t, uint32_t v)
{
    return t->u->curves->edge[v] != QW_NONE ||
           (t->loose && t->u->quads->kind && t->u->quads->kind[v] != QW_VERTEX_FREE);
}

static bool may_move(const tangle *t, uint32_t v)
{
    return t->loose || t->u->curves->edge[v] != QW_NONE || !t->u->quads->kind ||
           t->u->quads->kind[v] != QW_VERTEX_CORNER;
}

static void grow_patch(tangle *t, uint32_t seed, uint32_t rings)
{
    const qw_untangling *u = t->u;
    t->patch++;
    t->face_count = t->vertex_count = 0;
    t->faces[t->face_count++] = seed, t->face_in[seed] = t->patch;
    for (uint32_t ring = 0, done = 0; ring < rings; ring++)
        for (uint32_t end = t->face_count; done < end; done++)
            for (uint32_t i = 0; i < 4; i++) {
                uint32_t v = u->quads->corner[4 * t->faces[done] + i];
                for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++) {
                    uint32_t f = u->around[k] / 4;
                    if (t->face_in[f] != t->patch) t->face_in[f] = t->patch, t->faces[t->face_count++] = f;
                }
            }
    for (uint32_t j = 0; j < 4 * t->face_count; j++) {
        uint32_t v = u->quads->corner[4 * t->faces[j / 4] + j % 4];
        if (t->vertex_in[v] == t->patch || !may_move(t, v)) continue;
        t->vertex_in[v] = t->patch;
        bool inside = true;
        for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++) inside &= t->face_in[u->around[k] / 4] == t->patch;
        if (inside) t->vertices[t->vertex_count++] = v;
    }
}

static void save(const tangle *t, qw_vec3 *position, uint32_t *edge)
{
    for (uint32_t i = 0; i < t->vertex_count; i++)
        position[i] = t->u->position[t->vertices[i]], edge[i] = t->u->curves->edge[t->vertices[i]];
}

static void restore(const tangle *t, const qw_vec3 *position, const uint32_t *edge)
{
    const qw_untangling *u = t->u;
    for (uint32_t i = 0; i < t->vertex_count; i++)
        u->position[t->vertices[i]] = position[i], u->curves->edge[t->vertices[i]] = edge[i];
}

static bool has_turned_corner(const qw_untangling *u, uint32_t f)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    const qw_vec3 *p = u->position;
    qw_vec3 n = qw_cross(qw_sub(p[c[2]], p[c[0]]), qw_sub(p[c[3]], p[c[1]]));
    for (uint32_t i = 0; i < 4; i++)
        if (qw_dot(qw_cross(qw_sub(p[c[(i + 1) & 3]], p[c[i]]), qw_sub(p[c[(i + 3) & 3]], p[c[i]])), n) <= 0)
            return true;
    return false;
}

static void ask_faces(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const tangle *t = user;
    for (uint32_t i = t->asked + begin; i < t->asked + end; i++)
        t->degree[i] = (uint8_t)qw_flip_degree(t->u, t->edge, t->order[i]);
}

uint32_t qw_flipped_first(const uint32_t *faces, uint32_t count, const uint8_t *was_flipped, uint32_t *order)
{
    uint32_t first = 0, last = count;
    for (uint32_t i = 0; i < count; i++) order[was_flipped[faces[i]] ? first++ : --last] = faces[i];
    return first;
}

/* What is wrong with the patch: flipped quads before quads of which a corner is turned over. Where that is `most` or
 * more, something that is no less than `most`. */
static uint64_t faults(tangle *t, uint64_t most)
{
    t->looks -= t->looks < t->face_count ? t->looks : t->face_count;
    uint64_t sum = 0, base = (uint64_t)t->face_count + 1;
    for (uint32_t i = 0; i < t->face_count; i++) sum += has_turned_corner(t->u, t->faces[i]);
    uint32_t first = qw_flipped_first(t->faces, t->face_count, t->was_flipped, t->order),
             until = most == UINT64_MAX ? t->face_count : first;
    for (t->asked = 0; t->asked < t->face_count && sum < most;) {
        qw_parallel(t->env, until - t->asked, GRAIN, ask_faces, t);
        for (; t->asked < until; t->asked++) {
            uint32_t f = t->order[t->asked], degree = t->degree[t->asked];
            t->was_flipped[f] = degree > 0;
            if (degree > 0) sum += (degree == QW_CERTAINLY_FLIPPED ? base * base : base) - has_turned_corner(t->u, f);
        }
        until = t->face_count - until < ASKED_AT_ONCE ? t->face_count : until + ASKED_AT_ONCE;
    }
    return sum;
}

/* ---- membranes */

/* To the middle of its neighbours, or of those on curves, from where it slides on its own. */
static void relax_vertex(const tangle *t, uint32_t v)
{
    const qw_untangling *u = t->u;
    bool bound = is_on_curve(t, v);
    qw_vec3 sum = {0, 0, 0};
    float count = 0;
    for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++) {
        uint32_t ends[2] = {u->quads->corner[qw_quad_next(u->around[k])], u->quads->corner[qw_quad_prev(u->around[k])]};
        uint32_t edges[2] = {u->around[k], qw_quad_prev(u->around[k])};
        for (int i = 0; i < 2; i++) {
            if (bound && u->quads->twin[edges[i]] != QW_NONE && !(u->quads->mark && u->quads->mark[edges[i]])) continue;
            sum = qw_add(sum, u->position[ends[i]]), count += 1;
        }
    }
    if (count == 0) return;
    qw_vec3 p = qw_scale(sum, 1 / count);
    if (bound && !t->loose) p = qw_slide_bound(u->curves, &u->curves->edge[v], p);
    if (bound && t->loose) p = qw_curve_nearest(t->loose, p, INFINITY).point;
    u->position[v] = p;
}

static qw_vec3 normal_at(const tangle *t, uint32_t v)
{
    const qw_untangling *u = t->u;
    qw_quadmesh now = *u->quads;
    now.position = u->position;
    qw_vec3 n = {0, 0, 0};
    for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++) n = qw_add(n, qw_quad_normal(&now, u->around[k] / 4));
    return qw_normalize(n);
}

static void settle_vertex(const tangle *t, uint32_t v)
{
    const qw_untangling *u = t->u;
    if (is_on_curve(t, v)) return;
    qw_hit hit = qw_bvh_nearest(u->tree, u->position[v], normal_at(t, v), SAME_SHEET, 4 * t->edge, QW_NONE);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest(u->tree, u->position[v], qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
    if (hit.face != QW_NONE) u->position[v] = hit.point;
}

/* Whether the patch hangs from a ring that is long enough: a limb or a whole component would shrink to nothing. */
static bool is_held(const tangle *t)
{
    uint32_t corners = 4 * t->face_count, moving = 0;
    for (uint32_t i = 0; i < t->vertex_count; i++)
        moving += t->u->begin[t->vertices[i] + 1] - t->u->begin[t->vertices[i]];
    return corners - moving >= LEAST_HELD && moving <= MOST_MOVING * (corners - moving);
}

static float patch_area(const tangle *t)
{
    float sum = 0;
    for (uint32_t i = 0; i < t->face_count; i++)
        for (uint32_t half = 0; half < 2; half++)
            sum += qw_length(triangle_cross(t->u->position, half, t->u->quads->corner + 4 * (size_t)t->faces[i]));
    return sum;
}

static bool has_certain(const tangle *t, uint64_t faults)
{
    return faults > ((uint64_t)t->face_count + 1) * t->face_count;
}

/* Leaves in place the best of what is met on the way; returns its faults. */
static uint64_t spread_out(tangle *t, uint32_t rings)
{
    uint64_t least = faults(t, UINT64_MAX);
    if (!is_held(t)) return least;
    float least_area = patch_area(t) * (has_certain(t, least) ? LEAST_AREA : LEAST_AREA_IN_DOUBT);
    save(t, t->old, t->old_edge);
    memcpy(t->best, t->old, t->vertex_count * sizeof *t->best),
        memcpy(t->best_edge, t->old_edge, t->vertex_count * sizeof *t->best_edge);
    for (uint32_t sweep = 0; sweep < SWEEPS * rings; sweep++)
        for (uint32_t i = 0; i < t->vertex_count; i++) relax_vertex(t, t->vertices[i]);
    for (int settling = 0; settling < SETTLINGS && least > 0 && t->looks > 0; settling++) {
        for (uint32_t i = 0; i < t->vertex_count; i++) settle_vertex(t, t->vertices[i]);
        uint64_t count = faults(t, least);
        if (count < least && patch_area(t) >= least_area)
            least = count, t->changed = true, save(t, t->best, t->best_edge);
        for (uint32_t i = 0; i < t->vertex_count; i++) relax_vertex(t, t->vertices[i]);
    }
    restore(t, t->best, t->best_edge);
    return least;
}

static void add_seed(tangle *t, uint32_t f)
{
    if (!t->is_seed[f]) t->is_seed[f] = 1, t->seeds[t->seed_count++] = f;
}

/* What is no longer flipped in one place may be so in another: all that was spread out is looked at again. */
static void spread_around(tangle *t, uint32_t seed)
{
    uint64_t left = 1;
    uint32_t most = qw_flip_degree(t->u, t->edge, seed) == 2 ? MOST_RINGS : FEW_RINGS;
    for (uint32_t rings = 1;
         rings <= most && left > 0 && t->looks > 0 && (rings <= FEW_RINGS || qw_flip_degree(t->u, t->edge, seed));
         rings++) {
        grow_patch(t, seed, rings);
        left = spread_out(t, rings);
        for (uint32_t i = 0; i < t->face_count; i++) add_seed(t, t->faces[i]);
    }
}

static void make_room(tangle *t, uint32_t faces, uint32_t vertices)
{
    qw_env *env = t->env;
    t->faces = QW_NEW(env, uint32_t, faces), t->order = QW_NEW(env, uint32_t, faces),
    t->degree = QW_NEW(env, uint8_t, faces), t->was_flipped = QW_NEW_ZERO(env, uint8_t, faces);
    t->vertices = QW_NEW(env, uint32_t, vertices);
    t->face_in = QW_NEW_ZERO(env, uint32_t, faces), t->vertex_in = QW_NEW_ZERO(env, uint32_t, vertices);
    t->old = QW_NEW(env, qw_vec3, vertices), t->best = QW_NEW(env, qw_vec3, vertices);
    t->old_edge = QW_NEW(env, uint32_t, vertices), t->best_edge = QW_NEW(env, uint32_t, vertices);
}

static void ask_seeds(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const tangle *t = user;
    for (uint32_t i = begin; i < end; i++) t->is_seed[t->seeds[i]] = qw_flip_degree(t->u, t->edge, t->seeds[i]) > 0;
}

/* Keeps the seeds that are flipped. */
static void keep_flipped(tangle *t)
{
    uint32_t kept = 0;
    qw_parallel(t->env, t->seed_count, GRAIN, ask_seeds, t);
    for (uint32_t i = 0; i < t->seed_count; i++)
        if (t->is_seed[t->seeds[i]]) t->seeds[kept++] = t->seeds[i];
    t->seed_count = kept;
}

uint32_t qw_untangle_quads(qw_env *env, const qw_untangling *u)
{
    qw_scope_begin(env);
    uint32_t faces = u->quads->face_count, first;
    tangle t = {.env = env, .u = u, .seeds = QW_NEW(env, uint32_t, faces), .is_seed = QW_NEW_ZERO(env, uint8_t, faces)};
    for (uint32_t f = 0; f < faces; f++)
        if (is_suspect(u, f)) add_seed(&t, f);
    if (t.seed_count > 0) t.edge = qw_mean_edge(u);
    keep_flipped(&t);
    first = t.seed_count;
    if (first > 0) make_room(&t, faces, u->quads->vertex_count);
    t.looks = LEAST_LOOKS + LOOKS_A_QUAD * (uint64_t)faces;
    for (int pass = 0; pass < PASSES && t.seed_count > 0; pass++) {
        if (pass > 0 && !t.changed) {
            if (pass > LOOSE_PASS) break;
            pass = LOOSE_PASS;
        }
        if (pass == LOOSE_PASS)
            t.loose = qw_all_curves(env, u->surface), t.looks = LEAST_LOOKS + LOOKS_A_QUAD * (uint64_t)faces;
        t.changed = false;
        for (uint32_t i = 0, count = t.seed_count; i < count && i < MOST_SEEDS; i++) {
            qw_break_silence(env);
            if (qw_flip_degree(u, t.edge, t.seeds[i]) > (t.loose ? 1u : 0u)) spread_around(&t, t.seeds[i]);
        }
        keep_flipped(&t);
    }
    if (first > 0) qw_log(env, QW_LOG_DEBUG, "%u quads were flipped, %u are left so", first, t.seed_count);
    uint32_t left = t.seed_count;
    for (uint32_t i = 0; u->flipped && i < left; i++)
        u->flipped[t.seeds[i]] = (uint8_t)qw_flip_degree(u, t.edge, t.seeds[i]);
    qw_scope_end(env);
    return left;
}
