#include "quad/relax.h"

#include "mesh/bvh.h"

#include <math.h>
#include <string.h>

enum { SWEEPS = 80, PROJECT_EVERY = 4, GRAIN = 512 };

/* How much a quad's square is drawn to the wanted size rather than its own. */
static const float SIZE_PULL = 0.6f;
/* Normals of the surface and of the quads may differ by this much (cosine) for a point to count as the same sheet. */
static const float SAME_SHEET = 0.2f;

typedef struct relaxation {
    const qw_quadmesh *quads;
    const qw_trimesh *surface;
    const qw_bvh *tree;
    const qw_curve_tree *curves;
    uint32_t *begin, *around; /* quads around each vertex: corner half-edges around[begin[v]..begin[v+1]] */
    float *size;              /* [vertices] wanted edge length */
    qw_vec3 *position, *next; /* [vertices] */
    qw_vec3 *normal;          /* [vertices] of the surface where the vertex was last projected */
    uint32_t *face;           /* [vertices] triangle last projected to, or QW_NONE */
    qw_vec3 *ideal;           /* [4 faces] where each quad wants its corners */
    bool project;
} relaxation;

/* The square that fits the quad best: with corners turned back by k quarter turns about the normal they all say the same half diagonal. */
static void fit_square(const relaxation *r, uint32_t f)
{
    const uint32_t *c = r->quads->corner + 4 * f;
    qw_vec3 p[4], center = {0, 0, 0};
    for (int i = 0; i < 4; i++) p[i] = r->position[c[i]], center = qw_add(center, p[i]);
    center = qw_scale(center, 0.25f);
    qw_vec3 n = qw_normalize(qw_cross(qw_sub(p[2], p[0]), qw_sub(p[3], p[1])));
    qw_vec3 even = qw_sub(p[0], p[2]), odd = qw_sub(p[1], p[3]);
    qw_vec3 half = qw_scale(qw_sub(qw_reject(even, n), qw_cross(n, odd)), 0.25f);
    float wanted = (r->size[c[0]] + r->size[c[1]] + r->size[c[2]] + r->size[c[3]]) * (0.25f * 0.70710678f);
    float own = qw_length(half);
    if (own > 1e-3f * wanted) half = qw_scale(half, 1.0f + SIZE_PULL * (wanted / own - 1.0f));
    qw_vec3 turned = qw_cross(n, half);
    qw_vec3 *ideal = r->ideal + 4 * (size_t)f;
    ideal[0] = qw_add(center, half);
    ideal[1] = qw_add(center, turned);
    ideal[2] = qw_sub(center, half);
    ideal[3] = qw_sub(center, turned);
}

static void fit_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    for (uint32_t f = begin; f < end; f++) fit_square(user, f);
}

/* Signed corner area about the surface's normal if vertex v were at p. */
static float corner_area(const relaxation *r, uint32_t h, qw_vec3 p, int at)
{
    const uint32_t *c = r->quads->corner;
    uint32_t ends[3] = {c[qw_quad_prev(h)], c[h], c[qw_quad_next(h)]};
    qw_vec3 q[3];
    for (int i = 0; i < 3; i++) q[i] = i == at ? p : r->position[ends[i]];
    return qw_dot(qw_cross(qw_sub(q[2], q[1]), qw_sub(q[0], q[1])), r->normal[ends[1]]);
}

/* Whether moving v to p turns over a corner that was upright, its own or a neighbour's. */
static bool turns_over(const relaxation *r, uint32_t v, qw_vec3 p)
{
    for (uint32_t i = r->begin[v]; i < r->begin[v + 1]; i++) {
        uint32_t h = r->around[i], corners[3] = {h, qw_quad_next(h), qw_quad_prev(h)};
        static const int at[3] = {1, 0, 2};
        for (int k = 0; k < 3; k++) {
            float floor_area = 0.05f * r->size[v] * r->size[v];
            float now = corner_area(r, corners[k], r->position[v], at[k]), then = corner_area(r, corners[k], p, at[k]);
            if (then < floor_area && then < now) return true;
        }
    }
    return false;
}

static qw_vec3 on_curve(const relaxation *r, uint32_t v, qw_vec3 p)
{
    qw_curve_hit hit = qw_curve_nearest(r->curves, p, 1.0f * r->size[v]);
    return hit.segment == QW_NONE ? r->position[v] : hit.point;
}

static qw_vec3 on_surface(relaxation *r, uint32_t v, qw_vec3 p)
{
    if (!r->project && r->face[v] != QW_NONE) /* in between: stay in the tangent plane */
        return qw_madd(p, -qw_dot(qw_sub(p, r->position[v]), r->normal[v]), r->normal[v]);
    qw_hit hit = qw_bvh_nearest(r->tree, p, r->normal[v], SAME_SHEET, 4.0f * r->size[v], r->face[v]);
    if (hit.face == QW_NONE) return r->position[v];
    r->face[v] = hit.face;
    return hit.point;
}

static void move_vertex(relaxation *r, uint32_t v)
{
    const uint8_t *kind = r->quads->kind;
    uint32_t count = r->begin[v + 1] - r->begin[v];
    r->next[v] = r->position[v];
    if (count == 0 || (kind && kind[v] == QW_VERTEX_CORNER)) return;
    qw_vec3 sum = {0, 0, 0};
    for (uint32_t i = r->begin[v]; i < r->begin[v + 1]; i++) sum = qw_add(sum, r->ideal[r->around[i]]);
    qw_vec3 target = qw_scale(sum, 1.0f / (float)count);
    bool curve = kind && kind[v] == QW_VERTEX_CURVE;
    target = curve ? on_curve(r, v, target) : on_surface(r, v, target);
    for (int halving = 0; halving < 3; halving++) {
        if (!turns_over(r, v, target)) {
            r->next[v] = target;
            return;
        }
        target = qw_lerp(r->position[v], target, 0.5f);
        if (!r->project) continue;
        target = curve ? on_curve(r, v, target) : on_surface(r, v, target);
    }
    /* nowhere to go: then at least on the surface, from which the sweeps in between may have strayed */
    if (r->project) r->next[v] = curve ? on_curve(r, v, r->position[v]) : on_surface(r, v, r->position[v]);
}

static void move_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    for (uint32_t v = begin; v < end; v++) move_vertex(user, v);
}

/* Surface normals at the vertices, for the corner test and for the sheet test: the quads' own, which change slowly. */
static void update_normals(qw_env *env, relaxation *r)
{
    qw_quadmesh now = *r->quads;
    now.position = r->position;
    qw_vec3 *fresh = qw_quadmesh_vertex_normals(env, &now);
    for (uint32_t v = 0; v < now.vertex_count; v++)
        if (qw_length2(fresh[v]) > 0.5f) r->normal[v] = fresh[v];
    qw_free(env, fresh);
}

static void collect_corners(qw_env *env, relaxation *r)
{
    uint32_t n = r->quads->vertex_count, sides = 4 * r->quads->face_count;
    r->begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2);
    r->around = QW_NEW(env, uint32_t, sides);
    for (uint32_t h = 0; h < sides; h++) r->begin[r->quads->corner[h] + 2]++;
    for (uint32_t v = 0; v < n; v++) r->begin[v + 2] += r->begin[v + 1];
    for (uint32_t h = 0; h < sides; h++) r->around[r->begin[r->quads->corner[h] + 1]++] = h;
}

/* Wanted sizes: the mean length of the edges at each vertex, smoothed over the mesh so that sizes are even but follow a scale field. */
static void wanted_sizes(qw_env *env, relaxation *r)
{
    uint32_t n = r->quads->vertex_count, sides = 4 * r->quads->face_count;
    float *sum = QW_NEW(env, float, n), *count = QW_NEW(env, float, n);
    for (int pass = 0; pass < 200; pass++) {
        memset(sum, 0, n * sizeof *sum), memset(count, 0, n * sizeof *count);
        for (uint32_t h = 0; h < sides; h++) {
            uint32_t a = r->quads->corner[h], b = r->quads->corner[qw_quad_next(h)];
            float fa = r->size[a], fb = r->size[b];
            if (pass == 0) fa = fb = qw_distance(r->position[a], r->position[b]);
            sum[a] += fb, sum[b] += fa, count[a] += 1, count[b] += 1;
        }
        for (uint32_t v = 0; v < n; v++) r->size[v] = count[v] > 0 ? sum[v] / count[v] : r->size[v];
    }
    qw_free(env, sum), qw_free(env, count);
}

static const qw_curve_tree *build_curves(qw_env *env, const qw_trimesh *surface)
{
    uint32_t count = 0, corners = 3 * surface->face_count;
    qw_vec3 *from = QW_NEW(env, qw_vec3, corners), *to = QW_NEW(env, qw_vec3, corners);
    for (uint32_t h = 0; h < corners; h++) {
        uint32_t t = surface->twin[h];
        bool curve = t == QW_NONE || (h < t && surface->mark && (surface->mark[h] & QW_MARK_FEATURE));
        if (!curve) continue;
        from[count] = surface->position[surface->corner[h]];
        to[count++] = surface->position[surface->corner[qw_next(h)]];
    }
    const qw_curve_tree *tree = qw_curve_tree_build(env, from, to, count);
    qw_free(env, from), qw_free(env, to);
    return tree;
}

static void sweep(qw_env *env, relaxation *r, bool project)
{
    r->project = project;
    qw_parallel(env, r->quads->face_count, GRAIN, fit_block, r);
    qw_parallel(env, r->quads->vertex_count, GRAIN, move_block, r);
    qw_vec3 *old = r->position;
    r->position = r->next;
    r->next = old;
    if (project) update_normals(env, r);
}

qw_vec3 *qw_relax_quads(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface)
{
    qw_scope_begin(env);
    uint32_t n = quads->vertex_count;
    relaxation r = {.quads = quads, .surface = surface};
    r.tree = qw_bvh_build(env, surface);
    r.curves = build_curves(env, surface);
    r.position = QW_NEW(env, qw_vec3, n), r.next = QW_NEW(env, qw_vec3, n);
    r.normal = QW_NEW_ZERO(env, qw_vec3, n);
    r.size = QW_NEW_ZERO(env, float, n);
    r.face = QW_NEW(env, uint32_t, n);
    r.ideal = QW_NEW(env, qw_vec3, (size_t)4 * quads->face_count);
    memcpy(r.position, quads->position, n * sizeof *r.position);
    memset(r.face, 0xff, n * sizeof *r.face);
    collect_corners(env, &r);
    wanted_sizes(env, &r);
    update_normals(env, &r);
    for (uint32_t s = 0; s < SWEEPS; s++) {
        sweep(env, &r, s % PROJECT_EVERY == 0 || s + 1 == SWEEPS);
        qw_progress(env, (s + 1.0) / SWEEPS);
    }
    qw_keep(env, r.position);
    qw_scope_end(env);
    return r.position;
}
