#include "products/attributes/motion.h"

#include "base/elementary.h"
#include "geometry/bvh.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Polygons with more corners say nothing. */
enum { MOST_CORNERS = 64 };
/* Targets that move nothing farther than this share of the extent of the mesh do not count. */
static const double LEAST_OFFSET = 1e-4;

/* ---- on polygons */

/* A polygon with its tangent plane: the gradient of what has the value x_i at its corners is the sum of x_i slope[i].
 */
typedef struct polygon {
    uint32_t corners;
    const uint32_t *corner;
    double axis[2][3], slope[MOST_CORNERS][2];
} polygon;

/* What moves on a polygon, J: a row an axis. */
typedef struct move {
    uint32_t group; /* of weights */
    double to[2][3];
} move;

/* The mean gradient over the triangles of a fan. False where the polygon has no area. */
static bool measure(const qw_clean_input *in, uint32_t f, polygon *p)
{
    p->corners = in->face_begin[f + 1] - in->face_begin[f], p->corner = in->corner + in->face_begin[f];
    if (p->corners > MOST_CORNERS) return false;
    double edge[MOST_CORNERS][3], normal[3] = {0, 0, 0}, cross[3];
    const double *origin = in->position + 3 * (size_t)p->corner[0];
    for (uint32_t i = 0; i < p->corners; i++)
        for (size_t k = 0; k < 3; k++) edge[i][k] = in->position[3 * (size_t)p->corner[i] + k] - origin[k];
    for (uint32_t i = 1; i + 1 < p->corners; i++) {
        qw_cross_doubles(edge[i], edge[i + 1], cross);
        for (int k = 0; k < 3; k++) normal[k] += cross[k];
    }
    double twice = sqrt(qw_dot_doubles(normal, normal));
    if (!(twice > 0) || !isfinite(twice)) return false;
    qw_unit_doubles(normal);
    qw_to_doubles(qw_any_orthogonal(qw_normalize(qw_v3_of_doubles(normal))), p->axis[0]);
    qw_cross_doubles(normal, p->axis[0], p->axis[1]);
    for (uint32_t i = 0; i < p->corners; i++) {
        uint32_t before = (i + p->corners - 1) % p->corners, after = (i + 1) % p->corners;
        double across[3];
        for (int k = 0; k < 3; k++) across[k] = edge[before][k] - edge[after][k];
        qw_cross_doubles(normal, across, cross);
        for (int a = 0; a < 2; a++) p->slope[i][a] = qw_dot_doubles(cross, p->axis[a]) / twice;
    }
    return true;
}

static void add_offset(const polygon *p, uint32_t i, const double offset[3], move *m)
{
    for (int a = 0; a < 2; a++)
        for (int k = 0; k < 3; k++) m->to[a][k] += p->slope[i][a] * offset[k];
}

/* All that moves a polygon. */
typedef struct moves {
    move *move; /* move[count] */
    uint32_t count;
} moves;

static void add_weights(const qw_attribute *a, const polygon *p, moves *t)
{
    uint32_t first = t->count;
    for (uint32_t i = 0; i < p->corners; i++) {
        const float *weight = a->values + (size_t)p->corner[i] * a->components;
        const uint32_t *group = a->group + (size_t)p->corner[i] * a->components;
        double sum = 0;
        for (uint32_t k = 0; k < a->components; k++) sum += (double)weight[k];
        for (uint32_t k = 0; k < a->components && sum > 0; k++) {
            uint32_t m = first;
            while (m < t->count && t->move[m].group != group[k]) m++;
            if (m == t->count) t->move[t->count++] = (move){.group = group[k]};
            const double share[3] = {(double)weight[k] / sum, 0, 0};
            add_offset(p, i, share, &t->move[m]);
        }
    }
}

static void add_target(const qw_attribute *a, const polygon *p, double largest, moves *t)
{
    move *m = &t->move[t->count++];
    *m = (move){0};
    for (uint32_t i = 0; i < p->corners; i++) {
        double offset[3];
        for (size_t k = 0; k < 3; k++) offset[k] = (double)a->values[3 * (size_t)p->corner[i] + k] / largest;
        add_offset(p, i, offset, m);
    }
}

/* The direction of the larger eigenvalue of a symmetric matrix; returns by how much it is the larger. */
static double larger_axis(double xx, double xy, double yy, double axis[2])
{
    double half = 0.5 * qw_atan2(2 * xy, xx - yy);
    axis[0] = qw_cos(half), axis[1] = qw_sin(half);
    return sqrt((xx - yy) * (xx - yy) + 4 * xy * xy);
}

/* The direction in which they all change the most, as long as one of them changes along it at the most, times how clear
 * it is. */
static qw_vec3 most_change(const polygon *p, const moves *t)
{
    double xx = 0, xy = 0, yy = 0, axis[2], most = 0, along[3];
    for (uint32_t m = 0; m < t->count; m++) {
        const double(*to)[3] = (const double(*)[3])t->move[m].to;
        xx += qw_dot_doubles(to[0], to[0]), xy += qw_dot_doubles(to[0], to[1]), yy += qw_dot_doubles(to[1], to[1]);
    }
    if (!(xx + yy > 0) || !isfinite(xx + yy)) return qw_v3(0, 0, 0);
    double clear = larger_axis(xx, xy, yy, axis) / (xx + yy);
    for (uint32_t m = 0; m < t->count; m++) {
        for (int k = 0; k < 3; k++) along[k] = axis[0] * t->move[m].to[0][k] + axis[1] * t->move[m].to[1][k];
        most = fmax(most, qw_dot_doubles(along, along));
    }
    for (int k = 0; k < 3; k++) along[k] = clear * sqrt(most) * (axis[0] * p->axis[0][k] + axis[1] * p->axis[1][k]);
    return qw_v3_of_doubles(along);
}

/* ---- on the input */

bool qw_is_target(const qw_attribute *a)
{
    return a->kind == QW_VALUES && a->domain == QW_PER_VERTEX && a->components == 3 &&
           strncmp(a->name, "target:", strlen("target:")) == 0;
}

double qw_offset_at(const qw_attribute *target, uint32_t v)
{
    double offset[3];
    for (size_t k = 0; k < 3; k++) offset[k] = (double)target->values[3 * (size_t)v + k];
    return sqrt(qw_dot_doubles(offset, offset));
}

double qw_largest_offset(const qw_attribute *target)
{
    double most = 0;
    for (uint32_t v = 0; v < target->count; v++) most = fmax(most, qw_offset_at(target, v));
    return most;
}

static double extent_of(const qw_clean_input *in)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t v = 0; v < in->vertex_count; v++)
        for (size_t k = 0; k < 3; k++)
            low[k] = fmin(low[k], in->position[3 * v + k]), high[k] = fmax(high[k], in->position[3 * v + k]);
    return sqrt(qw_distance2_doubles(low, high));
}

qw_vec3 *qw_motion_of_faces(qw_env *env, const qw_clean_input *input, const qw_attribute *attributes, uint32_t count)
{
    double *largest = QW_NEW_ZERO(env, double, count), least = LEAST_OFFSET * extent_of(input);
    size_t most = 0;
    for (uint32_t i = 0; i < count; i++) {
        const qw_attribute *a = &attributes[i];
        if (a->kind == QW_WEIGHTS) most += (size_t)MOST_CORNERS * a->components;
        else if (qw_is_target(a) && qw_largest_offset(a) > least) largest[i] = qw_largest_offset(a), most++;
    }
    qw_vec3 *motion = most > 0 ? QW_NEW(env, qw_vec3, input->face_count) : NULL;
    moves t = {QW_NEW(env, move, most), 0};
    for (uint32_t f = 0; motion && f < input->face_count; f++, t.count = 0) {
        polygon p;
        motion[f] = qw_v3(0, 0, 0);
        if (!measure(input, f, &p)) continue;
        for (uint32_t i = 0; i < count; i++) {
            if (attributes[i].kind == QW_WEIGHTS) add_weights(&attributes[i], &p, &t);
            else if (largest[i] > 0) add_target(&attributes[i], &p, largest[i], &t);
        }
        motion[f] = most_change(&p, &t);
    }
    qw_free(env, t.move), qw_free(env, largest);
    return motion;
}

/* ---- at points */

/* Means of products of a direction with itself, as the sign of one means nothing: xx, xy, xz, yy, yz, zz. */
typedef struct lines {
    float of[6];
} lines;

static void add_line(lines *l, float weight, qw_vec3 d)
{
    const float product[6] = {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};
    for (int i = 0; i < 6; i++) l->of[i] += weight * product[i];
}

static float product(const lines *l, qw_vec3 a, qw_vec3 b)
{
    const float *m = l->of;
    return a.x * (m[0] * b.x + m[1] * b.y + m[2] * b.z) + a.y * (m[1] * b.x + m[3] * b.y + m[4] * b.z) +
           a.z * (m[2] * b.x + m[4] * b.y + m[5] * b.z);
}

/* Means over the triangles around each vertex of the clean surface, in its frame. */
static lines *lines_of_clean(qw_env *env, const qw_clean *clean, const qw_vec3 *motion)
{
    const qw_trimesh *m = &clean->mesh;
    lines *l = QW_NEW_ZERO(env, lines, m->vertex_count);
    float *area = QW_NEW_ZERO(env, float, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (qw_own_frame_of(&clean->own, m->position[m->corner[h]]) != QW_NONE) continue; /* its axes are others */
        float twice = qw_length(qw_face_cross(m, h / 3));
        qw_vec3 d = qw_scale(motion[clean->source_face[h / 3]], (float)(1 / clean->frame.scale));
        add_line(&l[m->corner[h]], twice, d), area[m->corner[h]] += twice;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++)
        for (int i = 0; i < 6; i++) l[v].of[i] = area[v] > 0 ? l[v].of[i] / area[v] : 0;
    qw_free(env, area);
    return l;
}

typedef struct taking {
    const qw_trimesh *mesh;
    const qw_bvh *tree;
    const lines *at; /* lines[mesh->vertex_count] */
    const qw_vec3 *point, *normal;
    qw_vec3 *taken;
} taking;

static void take_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const taking *t = user;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        qw_hit hit = qw_bvh_nearest(t->tree, t->point[i], t->normal[i], QW_SAME_SHEET, INFINITY, hint);
        t->taken[i] = qw_v3(0, 0, 0);
        if (hit.face == QW_NONE) continue;
        lines mean = {0};
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 6; c++)
                mean.of[c] += hit.weight[k] * t->at[t->mesh->corner[3 * (size_t)hit.face + (size_t)k]].of[c];
        qw_vec3 x = qw_any_orthogonal(t->normal[i]), y = qw_cross(t->normal[i], x);
        double axis[2], length = sqrt(larger_axis((double)product(&mean, x, x), (double)product(&mean, x, y),
                                                  (double)product(&mean, y, y), axis));
        if (!isfinite(length)) continue;
        t->taken[i] = qw_scale(qw_madd(qw_scale(x, (float)axis[0]), (float)axis[1], y), (float)length);
        hint = hit.face;
    }
}

qw_vec3 *qw_motion_at_points(qw_env *env, const qw_clean *clean, const qw_vec3 *motion, const qw_vec3 *point,
                             const qw_vec3 *normal, uint32_t count)
{
    assert(motion);
    qw_vec3 *taken = QW_NEW(env, qw_vec3, count);
    qw_scope_begin(env);
    taking t = {&clean->mesh, qw_bvh_build(env, &clean->mesh), lines_of_clean(env, clean, motion), point, normal,
                taken};
    qw_parallel(env, count, QW_GRAIN_HEAVY, take_block, &t);
    qw_scope_end(env);
    return taken;
}
