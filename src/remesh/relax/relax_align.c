#include "remesh/relax/relax_align.h"

#include "base/constants.h"
#include "geometry/slide.h"

#include <assert.h>
#include <math.h>

/* ---- directions at the quads */

typedef struct lookup {
    const qw_vec3 *position;
    qw_relax_lines *lines;
} lookup;

/* Returns d turned about n by the number of quarters that brings it nearest to u. */
static qw_vec3 nearest_turn(qw_vec3 d, qw_vec3 n, qw_vec3 u)
{
    qw_vec3 e = qw_cross(n, d);
    float du = qw_dot(d, u), eu = qw_dot(e, u);
    if (fabsf(du) >= fabsf(eu)) return du < 0 ? qw_scale(d, -1) : d;
    return eu < 0 ? qw_scale(e, -1) : e;
}

/* Where the surface is nearest to the middle of quad f. From where it was the last time one walks there. */
static qw_hit find_place(const qw_relax_lines *l, uint32_t f, qw_vec3 middle, qw_vec3 n, uint32_t hint)
{
    if (l->place[f] != QW_NONE) {
        qw_surface_point there = qw_slide_on_surface(l->mesh, l->outgoing, 3 * l->place[f], middle, 0);
        return qw_bvh_nearest_on(l->tree, there.half_edge / 3, middle);
    }
    uint32_t part = l->quads->component ? l->quads->component[l->quads->corner[4 * (size_t)f]] : QW_NONE;
    return qw_bvh_nearest_of(l->tree, part, middle, n, QW_SAME_SHEET, (float)QW_ANYWHERE, hint);
}

/* The directions along and across which each quad should lie, from the surface below its middle; as long as they
 * are clear. */
static void look_up_block(void *user, uint32_t begin, uint32_t end)
{
    const lookup *t = user;
    qw_relax_lines *l = t->lines;
    const qw_vec3 *p = t->position;
    uint32_t hint = QW_NONE;
    for (uint32_t f = begin; f < end; f++) {
        const uint32_t *c = l->quads->corner + 4 * (size_t)f;
        l->along[f] = l->across[f] = qw_v3(0, 0, 0);
        qw_vec3 middle = qw_quad_middle(p, c), n = qw_normalize(qw_quad_cross(p, c));
        qw_hit hit = find_place(l, f, middle, n, l->near && l->near[f] != QW_NONE ? l->near[f] : hint);
        if (hit.face == QW_NONE || qw_length2(n) < 0.5f) continue;
        l->place[f] = hint = hit.face;
        qw_vec3 u = qw_sub(qw_add(p[c[1]], p[c[2]]), qw_add(p[c[0]], p[c[3]])), sum = {0, 0, 0};
        for (uint32_t i = 0; i < 3; i++) {
            qw_vec3 d = l->direction[l->mesh->corner[3 * hit.face + i]];
            sum = qw_madd(sum, hit.weight[i], nearest_turn(qw_reject(d, n), n, u));
        }
        float clear = fminf(qw_length(sum), 1);
        l->along[f] = qw_scale(qw_normalize(sum), sqrtf(l->strength * l->share[f] * clear));
        l->across[f] = qw_cross(n, l->along[f]);
    }
}

qw_relax_lines qw_begin_relax_lines(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *mesh, const qw_bvh *tree,
                                    const qw_vec3 *direction, float strength, const float *share)
{
    assert(strength >= 0 && mesh->face_count > 0 && tree && direction);
    uint32_t n = quads->face_count;
    qw_relax_lines l = {.quads = quads, .mesh = mesh, .direction = direction, .strength = strength, .share = share};
    l.tree = tree, l.outgoing = qw_trimesh_outgoing(env, mesh);
    l.along = QW_NEW(env, qw_vec3, n), l.across = QW_NEW(env, qw_vec3, n), l.place = QW_NEW(env, uint32_t, n);
    for (uint32_t f = 0; f < n; f++) l.place[f] = QW_NONE;
    return l;
}

void qw_find_relax_lines(qw_env *env, qw_relax_lines *lines, const qw_vec3 *position)
{
    lookup t = {position, lines};
    qw_parallel(env, lines->quads->face_count, QW_GRAIN_HEAVY, look_up_block, &t);
}

/* ---- energy */

typedef struct residuals {
    qw_lanes u, v;            /* over the wanted length */
    qw_vec3_lanes at_u, at_v; /* what u and v are not to be along */
} residuals;

static qw_vec3_lanes choose4(qw_lanes_mask first, const qw_vec3_lanes *a, const qw_vec3_lanes *b)
{
    return (qw_vec3_lanes){qw_choose(first, a->x, b->x), qw_choose(first, a->y, b->y), qw_choose(first, a->z, b->z)};
}

/* How far four quads' two mean directions are off `along` and `across`, whichever each is nearer to. */
static residuals residuals_of(qw_lanes scale, const qw_vec3_lanes p[4], const qw_vec3_lanes *along,
                              const qw_vec3_lanes *across)
{
    qw_vec3_lanes u = qw_sub4(qw_add4(p[1], p[2]), qw_add4(p[0], p[3])),
                  v = qw_sub4(qw_add4(p[2], p[3]), qw_add4(p[0], p[1]));
    qw_lanes ud = qw_dot4(u, *along), ue = qw_dot4(u, *across), vd = qw_dot4(v, *along), ve = qw_dot4(v, *across);
    qw_lanes_mask u_along = ue * ue + vd * vd <= ud * ud + ve * ve;
    residuals r = {.at_u = choose4(u_along, across, along), .at_v = choose4(u_along, along, across)};
    r.u = 0.5f * scale * qw_dot4(u, r.at_u), r.v = 0.5f * scale * qw_dot4(v, r.at_v);
    return r;
}

qw_lanes qw_lines_energy(qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes *along,
                         const qw_vec3_lanes *across)
{
    residuals r = residuals_of(1.0f / qw_lanes_sqrt(wanted), p, along, across);
    return r.u * r.u + r.v * r.v;
}

static void add_residual(qw_lanes r, const qw_lanes d[8], qw_relax_model *model)
{
    for (int i = 0; i < 8; i++) {
        model->gradient[i] += 2.0f * r * d[i];
        for (int j = 0; j < 8; j++) model->matrix[i][j] += 2.0f * d[i] * d[j];
    }
}

void qw_add_lines(qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes axis[4][2], const qw_vec3_lanes *along,
                  const qw_vec3_lanes *across, qw_relax_model *model)
{
    static const float sign_u[4] = {-0.5f, 0.5f, 0.5f, -0.5f}, sign_v[4] = {-0.5f, -0.5f, 0.5f, 0.5f};
    qw_lanes scale = 1.0f / qw_lanes_sqrt(wanted), by_u[8], by_v[8];
    residuals r = residuals_of(scale, p, along, across);
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++) {
            by_u[2 * i + k] = sign_u[i] * scale * qw_dot4(axis[i][k], r.at_u);
            by_v[2 * i + k] = sign_v[i] * scale * qw_dot4(axis[i][k], r.at_v);
        }
    add_residual(r.u, by_u, model);
    add_residual(r.v, by_v, model);
}
