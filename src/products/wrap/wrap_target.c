#include "products/wrap/wrap_target.h"

#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Units to the frame of the tree, whose coordinates are below one half. */
static const double SCALE = 1.0 / (1 << QW_LATTICE_BITS);
/* Of a distance: what is nearer than this by a tree of single precision is nearer. */
static const double SURELY = 0.99;

typedef struct looking {
    qw_env *env;
    const qw_wrap_lattice *lattice;
    const qw_wrap_triangles *triangles;
    uint8_t *visible;
} looking;

/* Which triangles can be seen from outside. */
static void look(void *user, uint32_t begin, uint32_t end)
{
    const looking *l = user;
    for (uint32_t t = begin; t < end; t++) {
        double p[3][3];
        if (t % 64 == 0 && !qw_listen(l->env)) return;
        for (int i = 0; i < 3; i++)
            memcpy(p[i], l->triangles->position + 3 * (size_t)l->triangles->corner[3 * (size_t)t + (size_t)i],
                   sizeof p[i]);
        l->visible[t] = qw_triangle_is_seen(l->lattice, (const double(*)[3])p) != QW_HIDDEN;
    }
}

/* ---- the tree */

/* Takes the triangles that are visible into the target, with their normals and numbers. */
static void take_visible(qw_env *env, const qw_wrap_triangles *t, qw_wrap_target *target)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < t->count; i++) count += target->visible[i];
    assert(count > 0);
    target->mesh.corner = QW_NEW(env, uint32_t, 3 * (size_t)count);
    target->source = QW_NEW(env, uint32_t, count), target->normal = QW_NEW(env, double, 3 * (size_t)count);
    for (uint32_t i = 0; i < t->count; i++) {
        if (!target->visible[i]) continue;
        uint32_t f = target->mesh.face_count++;
        const double *p[3];
        double u[3], v[3], *n = target->normal + 3 * (size_t)f;
        for (uint32_t k = 0; k < 3; k++) {
            target->mesh.corner[3 * (size_t)f + k] = t->corner[3 * (size_t)i + k];
            p[k] = t->position + 3 * (size_t)t->corner[3 * (size_t)i + k];
        }
        for (int k = 0; k < 3; k++) u[k] = p[1][k] - p[0][k], v[k] = p[2][k] - p[0][k];
        qw_cross_doubles(u, v, n);
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++) n[k] = length > 0 ? n[k] / length : 0;
        target->source[f] = i;
    }
    target->hidden = t->count - count;
}

qw_vec3 qw_in_tree(const double p[3])
{
    return qw_v3((float)(p[0] * SCALE - 0.5), (float)(p[1] * SCALE - 0.5), (float)(p[2] * SCALE - 0.5));
}

qw_wrap_target qw_wrap_target_build(qw_env *env, const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles,
                                    uint32_t vertex_count)
{
    qw_wrap_target t = {.visible = QW_NEW_ZERO(env, uint8_t, triangles->count)};
    looking l = {env, lattice, triangles, t.visible};
    qw_parallel(env, triangles->count, 256, look, &l);
    qw_heartbeat(env);
    t.mesh.vertex_count = vertex_count;
    t.mesh.position = QW_NEW(env, qw_vec3, vertex_count);
    for (uint32_t v = 0; v < vertex_count; v++) t.mesh.position[v] = qw_in_tree(triangles->position + 3 * (size_t)v);
    take_visible(env, triangles, &t);
    t.bvh = qw_bvh_build(env, &t.mesh);
    return t;
}

/* Where the target is touched, in the units of the caller: place, normal and distance from a point. */
static qw_touch touch_of(const qw_wrap_target *t, const double point[3], const qw_hit *hit)
{
    assert(hit->face != QW_NONE);
    double at[3] = {hit->point.x, hit->point.y, hit->point.z}, sum = 0;
    qw_touch touch = {.face = hit->face};
    for (int k = 0; k < 3; k++) {
        touch.at[k] = (at[k] + 0.5) / SCALE, touch.normal[k] = t->normal[3 * (size_t)hit->face + (size_t)k];
        sum += (touch.at[k] - point[k]) * (touch.at[k] - point[k]);
    }
    touch.distance = sqrt(sum);
    return touch;
}

qw_touch qw_wrap_target_nearest(const qw_wrap_target *t, const double point[3], uint32_t hint)
{
    return qw_wrap_target_near(t, point, hint, 0);
}

qw_touch qw_wrap_target_near(const qw_wrap_target *t, const double point[3], uint32_t hint, double enough)
{
    float e = (float)(enough > 0 ? SURELY * enough * SCALE : 0);
    qw_bvh_query query = {
        .point = qw_in_tree(point), .least_dot = -1, .max_distance = 4, .hint = hint, .enough2 = e * e};
    qw_hit hit = qw_bvh_find(t->bvh, &query, NULL);
    return touch_of(t, point, &hit);
}
