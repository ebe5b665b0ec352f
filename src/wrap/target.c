#include "wrap/target.h"

#include "math/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Units to the frame of the tree, whose coordinates are below one half. */
static const double SCALE = 1.0 / (1 << QW_LATTICE_BITS);
static const double SLACK = 1e-6; /* of a cell, as in lattice.c */

typedef struct looking {
    qw_env *env;
    const qw_lattice *lattice;
    const qw_wrap_triangles *triangles;
    uint8_t *visible;
} looking;

/* ---- which triangles can be seen from outside */

static bool is_beside_outside(const qw_lattice *l, const uint32_t at[3])
{
    for (int dz = -1; dz <= 1; dz++)
        for (int dy = -1; dy <= 1; dy++)
            for (int dx = -1; dx <= 1; dx++) {
                int64_t x = (int64_t)at[0] + dx, y = (int64_t)at[1] + dy, z = (int64_t)at[2] + dz;
                if (x < 0 || y < 0 || z < 0 || x >= l->frame.cells[0] || y >= l->frame.cells[1] ||
                    z >= l->frame.cells[2])
                    continue;
                if (l->cell[qw_cell_index(&l->frame, (uint32_t)x, (uint32_t)y, (uint32_t)z)] == QW_CELL_OUTSIDE)
                    return true;
            }
    return false;
}

/* Whether one of the cells low <= at < high that the triangle meets has an outside cell beside it. */
static bool is_seen_in(const looking *k, const double p[3][3], const uint32_t low[3], const uint32_t high[3])
{
    const qw_wrap_frame *f = &k->lattice->frame;
    double centre[3], half[3];
    int longest = 0;
    for (int i = 0; i < 3; i++) {
        centre[i] = 0.5 * ((double)low[i] + high[i]) * f->side, half[i] = 0.5 * ((double)high[i] - low[i]) * f->side;
        if (high[i] - low[i] > high[longest] - low[longest]) longest = i;
    }
    if (!qw_triangle_meets_box(p, centre, half, SLACK * f->side)) return false;
    if (high[longest] - low[longest] == 1) return is_beside_outside(k->lattice, low);
    uint32_t middle = (low[longest] + high[longest]) / 2, end[3], begin[3];
    memcpy(end, high, sizeof end), memcpy(begin, low, sizeof begin);
    end[longest] = begin[longest] = middle;
    return is_seen_in(k, p, low, end) || is_seen_in(k, p, begin, high);
}

static void look(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const looking *l = user;
    const qw_wrap_frame *f = &l->lattice->frame;
    (void)block;
    for (uint32_t t = begin; t < end; t++) {
        double p[3][3];
        uint32_t low[3], high[3];
        if (t % 64 == 0 && !qw_listen(l->env)) return;
        for (int i = 0; i < 3; i++)
            memcpy(p[i], l->triangles->position + 3 * (size_t)l->triangles->corner[3 * (size_t)t + (size_t)i],
                   sizeof p[i]);
        for (int k = 0; k < 3; k++) {
            double lowest = fmin(p[0][k], fmin(p[1][k], p[2][k])), highest = fmax(p[0][k], fmax(p[1][k], p[2][k]));
            low[k] = (uint32_t)fmax(0, qw_floor(lowest / f->side - SLACK));
            high[k] = (uint32_t)fmin(f->cells[k], qw_floor(highest / f->side + SLACK) + 1);
        }
        l->visible[t] = is_seen_in(l, p, low, high);
    }
}

/* ---- the tree */

static void take_visible(qw_env *env, const qw_wrap_triangles *t, qw_target *target)
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

static qw_vec3 in_tree(const double p[3])
{
    return qw_v3((float)(p[0] * SCALE - 0.5), (float)(p[1] * SCALE - 0.5), (float)(p[2] * SCALE - 0.5));
}

qw_target qw_target_build(qw_env *env, const qw_lattice *lattice, const qw_wrap_triangles *triangles,
                          uint32_t vertex_count)
{
    qw_target t = {.visible = QW_NEW_ZERO(env, uint8_t, triangles->count)};
    looking l = {env, lattice, triangles, t.visible};
    qw_parallel(env, triangles->count, 256, look, &l);
    qw_break_silence(env);
    t.mesh.vertex_count = vertex_count;
    t.mesh.position = QW_NEW(env, qw_vec3, vertex_count);
    for (uint32_t v = 0; v < vertex_count; v++) t.mesh.position[v] = in_tree(triangles->position + 3 * (size_t)v);
    take_visible(env, triangles, &t);
    t.bvh = qw_bvh_build(env, &t.mesh);
    return t;
}

qw_touch qw_target_nearest(const qw_target *t, const double point[3], uint32_t hint)
{
    qw_hit hit = qw_bvh_nearest(t->bvh, in_tree(point), qw_v3(0, 0, 0), -1, 4, hint);
    assert(hit.face != QW_NONE);
    double at[3] = {hit.point.x, hit.point.y, hit.point.z}, sum = 0;
    qw_touch touch = {.face = hit.face};
    for (int k = 0; k < 3; k++) {
        touch.at[k] = (at[k] + 0.5) / SCALE, touch.normal[k] = t->normal[3 * (size_t)hit.face + (size_t)k];
        sum += (touch.at[k] - point[k]) * (touch.at[k] - point[k]);
    }
    touch.distance = sqrt(sum);
    return touch;
}
