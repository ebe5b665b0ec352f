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

/* The input with what moves it. */
typedef struct moving {
    const qw_clean_input *input;
    const qw_attribute *attributes;
    uint32_t count;
    const double *largest; /* double[count]: offsets of targets; 0: it is none */
    qw_vec3 *motion;       /* qw_vec3[faces of the input] */
} moving;

/* J of the weight of a group, or of a target's offset over its largest: a row an axis. */
static void gradient(const polygon *p, const qw_attribute *a, uint32_t group, double largest, double to[2][3])
{
    memset(to, 0, 2 * sizeof *to);
    for (uint32_t i = 0; i < p->corners; i++)
        for (size_t k = 0; k < (a->kind == QW_WEIGHTS ? 1 : 3); k++) {
            double x = a->kind == QW_WEIGHTS ? qw_share_of_group(a, p->corner[i], group)
                                             : (double)a->values[3 * (size_t)p->corner[i] + k] / largest;
            for (int e = 0; e < 2; e++) to[e][k] += p->slope[i][e] * x;
        }
}

/* The number n among the groups at the corners of a polygon; false where it came before. */
static bool is_new_group(const polygon *p, const qw_attribute *a, uint32_t n, uint32_t *group)
{
    const uint32_t *of = a->group + (size_t)p->corner[n / a->components] * a->components;
    *group = of[n % a->components];
    for (uint32_t m = 0; m < n; m++)
        if (a->group[(size_t)p->corner[m / a->components] * a->components + m % a->components] == *group) return false;
    return true;
}

/* Adds J^T J of all that moves: xx, xy, yy. Returns the square of the largest change along an axis. */
static double add_moves(const moving *m, const polygon *p, const double axis[2], double sum[3])
{
    double most = 0, to[2][3], along[3];
    for (uint32_t i = 0; i < m->count; i++) {
        const qw_attribute *a = &m->attributes[i];
        bool has_groups = a->kind == QW_WEIGHTS;
        uint32_t moves = has_groups ? p->corners * a->components : m->largest[i] > 0, group = 0;
        for (uint32_t n = 0; n < moves; n++) {
            if (has_groups && !is_new_group(p, a, n, &group)) continue;
            gradient(p, a, group, m->largest[i], to);
            sum[0] += qw_dot_doubles(to[0], to[0]), sum[1] += qw_dot_doubles(to[0], to[1]);
            sum[2] += qw_dot_doubles(to[1], to[1]);
            for (int k = 0; k < 3; k++) along[k] = axis[0] * to[0][k] + axis[1] * to[1][k];
            most = fmax(most, qw_dot_doubles(along, along));
        }
    }
    return most;
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
static qw_vec3 most_change(const moving *m, const polygon *p)
{
    double sum[3] = {0}, twice[3] = {0}, axis[2] = {0}, along[3];
    add_moves(m, p, axis, sum);
    if (!(sum[0] + sum[2] > 0) || !isfinite(sum[0] + sum[2])) return qw_v3(0, 0, 0);
    double clear = larger_axis(sum[0], sum[1], sum[2], axis) / (sum[0] + sum[2]),
           length = clear * sqrt(add_moves(m, p, axis, twice));
    for (int k = 0; k < 3; k++) along[k] = length * (axis[0] * p->axis[0][k] + axis[1] * p->axis[1][k]);
    return qw_v3_of_doubles(along);
}

static void find_block(void *user, uint32_t begin, uint32_t end)
{
    const moving *m = user;
    for (uint32_t f = begin; f < end; f++) {
        polygon p;
        m->motion[f] = measure(m->input, f, &p) ? most_change(m, &p) : qw_v3(0, 0, 0);
    }
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

double qw_share_of_group(const qw_attribute *weights, uint32_t v, uint32_t group)
{
    double sum = 0, own = 0;
    for (size_t k = (size_t)v * weights->components; k < (size_t)(v + 1) * weights->components; k++) {
        sum += (double)weights->values[k];
        if (weights->group[k] == group) own += (double)weights->values[k];
    }
    return sum > 0 ? own / sum : 0;
}

double *qw_largest_offsets(qw_env *env, const qw_clean_input *in, const qw_attribute *attributes, uint32_t count)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t v = 0; v < in->vertex_count; v++)
        for (size_t k = 0; k < 3; k++)
            low[k] = fmin(low[k], in->position[3 * v + k]), high[k] = fmax(high[k], in->position[3 * v + k]);
    double least = LEAST_OFFSET * sqrt(qw_distance2_doubles(low, high)), *largest = QW_NEW_ZERO(env, double, count);
    for (uint32_t i = 0; i < count; i++) {
        for (uint32_t v = 0; qw_is_target(&attributes[i]) && v < attributes[i].count; v++)
            largest[i] = fmax(largest[i], qw_offset_at(&attributes[i], v));
        if (!(largest[i] > least)) largest[i] = 0;
        qw_heartbeat(env);
    }
    return largest;
}

qw_vec3 *qw_motion_of_faces(qw_env *env, const qw_clean_input *input, const qw_attribute *attributes, uint32_t count,
                            const double *largest)
{
    bool moves = false;
    for (uint32_t i = 0; i < count; i++) moves |= attributes[i].kind == QW_WEIGHTS || largest[i] > 0;
    if (!moves) return NULL;
    moving m = {input, attributes, count, largest, QW_NEW(env, qw_vec3, input->face_count)};
    qw_parallel(env, input->face_count, QW_GRAIN_HEAVY, find_block, &m);
    return m.motion;
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

struct qw_motion_field {
    const qw_trimesh *mesh;
    const qw_bvh *tree;
    const lines *at; /* lines[mesh->vertex_count] */
};

typedef struct taking {
    const qw_motion_field *of;
    const qw_vec3 *point, *normal;
    qw_vec3 *taken;
} taking;

/* The direction in which the surface is stretched most by motion at each point, as long as that is much. */
static void take_block(void *user, uint32_t begin, uint32_t end)
{
    const taking *t = user;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        qw_hit hit = qw_bvh_nearest(t->of->tree, t->point[i], t->normal[i], QW_SAME_SHEET, INFINITY, hint);
        t->taken[i] = qw_v3(0, 0, 0);
        if (hit.face == QW_NONE) continue;
        lines mean = {0};
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 6; c++)
                mean.of[c] += hit.weight[k] * t->of->at[t->of->mesh->corner[3 * (size_t)hit.face + (size_t)k]].of[c];
        qw_vec3 x = qw_any_orthogonal(t->normal[i]), y = qw_cross(t->normal[i], x);
        double axis[2], length = sqrt(larger_axis((double)product(&mean, x, x), (double)product(&mean, x, y),
                                                  (double)product(&mean, y, y), axis));
        if (!isfinite(length)) continue;
        t->taken[i] = qw_scale(qw_madd(qw_scale(x, (float)axis[0]), (float)axis[1], y), (float)length);
        hint = hit.face;
    }
}

qw_motion_field *qw_motion_begin(qw_env *env, const qw_clean *clean, const qw_vec3 *motion)
{
    assert(motion);
    qw_motion_field *field = QW_NEW(env, qw_motion_field, 1);
    *field = (qw_motion_field){&clean->mesh, qw_bvh_build(env, &clean->mesh), lines_of_clean(env, clean, motion)};
    return field;
}

qw_vec3 *qw_motion_at_points(qw_env *env, const qw_motion_field *field, const qw_vec3 *point, const qw_vec3 *normal,
                             uint32_t count)
{
    taking t = {field, point, normal, QW_NEW(env, qw_vec3, count)};
    qw_parallel(env, count, QW_GRAIN_HEAVY, take_block, &t);
    return t.taken;
}
