/* A plane is improved in rounds: samples of the surface are reflected, each goes with the nearest point of the surface,
 * and of all planes that which brings the samples nearest to those points is next (the closest points of Besl and
 * McKay 1992, for a reflection). With centred samples p and their points q the sum of squares is, but for a constant,
 * 4 (n p)(n q): the normal is the axis of the symmetric part of the sum of p q^T with the least value.
 */
#include "plane.h"

#include "math/axes.h"
#include "mesh/bvh.h"
#include "mesh/polygons.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    SAMPLES = 600, /* of a round; all begin at the same places */
    ROUNDS = 8,
    JUDGED = 2400, /* samples that the result is judged by */
    GRAIN = 64,
    BEGINNINGS = 6 /* three axes, three principal axes of the surface */
};

/* A plane along an axis, and one through the origin, is preferred where the mean distance is no more than so much
   larger, in share and of the diagonal. */
static const double AS_GOOD = 1.05, AS_GOOD_GAP = 2e-4;
static const double MOSTLY = 0.95;

qw_mirror_plane qw_mirror_plane_of(const double normal[3], double offset)
{
    double largest = fmax(fabs(normal[0]), fmax(fabs(normal[1]), fabs(normal[2])));
    assert(largest > 0 && isfinite(largest));
    double n[3] = {normal[0] / largest, normal[1] / largest, normal[2] / largest};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    qw_mirror_plane plane = {.offset = offset / largest / length, .axis = QW_NO_AXIS};
    for (int k = 0; k < 3; k++) plane.normal[k] = n[k] / length;
    for (int k = 0; k < 3; k++)
        if (fabs(plane.normal[k]) == 1) {
            plane.axis = k;
            plane.offset *= plane.normal[k];
            plane.normal[k] = 1;
        }
    return plane;
}

double qw_plane_height(const qw_mirror_plane *plane, const double p[3])
{
    if (plane->axis != QW_NO_AXIS) return p[plane->axis] - plane->offset;
    return plane->normal[0] * p[0] + plane->normal[1] * p[1] + plane->normal[2] * p[2] - plane->offset;
}

void qw_put_on_plane(const qw_mirror_plane *plane, double p[3])
{
    double height = qw_plane_height(plane, p);
    if (plane->axis != QW_NO_AXIS) p[plane->axis] = plane->offset;
    else
        for (int k = 0; k < 3; k++) p[k] -= height * plane->normal[k];
}

void qw_reflect(const qw_mirror_plane *plane, const double p[3], double q[3])
{
    double height = qw_plane_height(plane, p);
    for (int k = 0; k < 3; k++) q[k] = p[k];
    if (plane->axis != QW_NO_AXIS) q[plane->axis] = plane->offset - height;
    else
        for (int k = 0; k < 3; k++) q[k] -= 2 * height * plane->normal[k];
}

/* ---- samples */

typedef struct search {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_bvh *bvh;
    double centre[3]; /* of the area */
    double diagonal;
    double *area_end;  /* double[face_count]: area of the triangles up to here */
    double (*point)[3]; /* double[JUDGED][3], of which every fourth is used in the rounds */
    double (*near)[3];  /* the point of the surface nearest to each reflection */
    float *distance;    /* of the two */
} search;

static void place_samples(search *s)
{
    const qw_trimesh *m = s->mesh;
    uint32_t f = 0;
    for (uint32_t i = 0; i < JUDGED; i++) {
        double at = s->area_end[m->face_count - 1] * (i + 0.5) / JUDGED;
        while (f + 1 < m->face_count && s->area_end[f] < at) f++;
        double u = 0.7548776662466927 * (i + 1), v = 0.5698402909980532 * (i + 1); /* Roberts' sequence */
        u -= floor(u), v -= floor(v);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const uint32_t *c = m->corner + 3 * (size_t)f;
        qw_vec3 a = m->position[c[0]], b = m->position[c[1]], d = m->position[c[2]];
        s->point[i][0] = (double)a.x + u * (double)(b.x - a.x) + v * (double)(d.x - a.x);
        s->point[i][1] = (double)a.y + u * (double)(b.y - a.y) + v * (double)(d.y - a.y);
        s->point[i][2] = (double)a.z + u * (double)(b.z - a.z) + v * (double)(d.z - a.z);
    }
}

static void measure_area(search *s)
{
    const qw_trimesh *m = s->mesh;
    double sum = 0;
    qw_vec3 lo = {FLT_MAX, FLT_MAX, FLT_MAX}, hi = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (uint32_t f = 0; f < m->face_count; f++) {
        double area = 0.5 * (double)qw_length(qw_face_cross(m, f));
        s->area_end[f] = sum += area;
        for (int i = 0; i < 3; i++) {
            qw_vec3 p = m->position[m->corner[3 * (size_t)f + (size_t)i]];
            s->centre[0] += area / 3 * (double)p.x, s->centre[1] += area / 3 * (double)p.y;
            s->centre[2] += area / 3 * (double)p.z;
            lo = qw_v3(fminf(lo.x, p.x), fminf(lo.y, p.y), fminf(lo.z, p.z));
            hi = qw_v3(fmaxf(hi.x, p.x), fmaxf(hi.y, p.y), fmaxf(hi.z, p.z));
        }
    }
    for (int k = 0; k < 3; k++) s->centre[k] /= sum;
    s->diagonal = (double)qw_distance(lo, hi);
}

typedef struct reflect_task {
    search *s;
    const qw_mirror_plane *plane;
    uint32_t step;
} reflect_task;

static void reflect_samples(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const reflect_task *t = user;
    search *s = t->s;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        double q[3];
        qw_reflect(t->plane, s->point[i * t->step], q);
        qw_vec3 p = qw_v3((float)q[0], (float)q[1], (float)q[2]);
        qw_hit hit = qw_bvh_nearest(s->bvh, p, qw_v3(0, 0, 0), -1, FLT_MAX, hint);
        hint = hit.face;
        s->near[i][0] = (double)hit.point.x, s->near[i][1] = (double)hit.point.y, s->near[i][2] = (double)hit.point.z;
        s->distance[i] = sqrtf(hit.distance2);
    }
}

static double reflect_all(search *s, const qw_mirror_plane *plane, uint32_t count)
{
    reflect_task task = {s, plane, JUDGED / count};
    double sum = 0;
    qw_parallel(s->env, count, GRAIN, reflect_samples, &task);
    for (uint32_t i = 0; i < count; i++) sum += (double)s->distance[i];
    return sum / count / s->diagonal;
}

/* ---- rounds */

/* The plane that suits the samples and their nearest points best, its normal free or kept. */
static qw_mirror_plane next_plane(search *s, const qw_mirror_plane *plane, bool is_free)
{
    double middle[2][3] = {{0}}, m[3][3] = {{0}}, axis[3][3], normal[3];
    for (uint32_t i = 0; i < SAMPLES; i++)
        for (int k = 0; k < 3; k++)
            middle[0][k] += s->point[i * (JUDGED / SAMPLES)][k] / SAMPLES, middle[1][k] += s->near[i][k] / SAMPLES;
    memcpy(normal, plane->normal, sizeof normal);
    if (is_free) {
        for (uint32_t i = 0; i < SAMPLES; i++)
            for (int j = 0; j < 3; j++)
                for (int k = 0; k < 3; k++) {
                    double p = s->point[i * (JUDGED / SAMPLES)][j] - middle[0][j], q = s->near[i][k] - middle[1][k];
                    m[j][k] += p * q / 2, m[k][j] += p * q / 2;
                }
        qw_principal_axes(m, axis);
        int least = m[1][1] < m[0][0] ? 1 : 0;
        if (m[2][2] < m[least][least]) least = 2;
        memcpy(normal, axis[least], sizeof normal);
    }
    double offset = 0;
    for (int k = 0; k < 3; k++) offset += normal[k] * (middle[0][k] + middle[1][k]) / 2;
    return qw_mirror_plane_of(normal, offset);
}

/* The best plane that rounds from this one come by. *gap: its mean distance over the diagonal. */
static qw_mirror_plane improve(search *s, qw_mirror_plane plane, bool is_free, double *gap)
{
    qw_mirror_plane best = plane;
    *gap = DBL_MAX;
    for (int round = 0; round < ROUNDS; round++) {
        double found = reflect_all(s, &plane, SAMPLES);
        if (!(found < *gap)) break;
        *gap = found, best = plane;
        plane = next_plane(s, &plane, is_free);
    }
    return best;
}

static qw_mirror_plane through_centre(const search *s, const double normal[3])
{
    double offset = 0;
    for (int k = 0; k < 3; k++) offset += normal[k] * s->centre[k];
    return qw_mirror_plane_of(normal, offset);
}

static bool is_as_good(double gap, double best) { return gap <= AS_GOOD * best + AS_GOOD_GAP; }

/* The best of the planes along the axes that are asked for. */
static qw_mirror_plane along_axes(search *s, int axis, double *gap)
{
    qw_mirror_plane best = {.axis = QW_NO_AXIS};
    *gap = DBL_MAX;
    for (int k = 0; k < 3; k++) {
        double normal[3] = {k == 0, k == 1, k == 2}, found;
        if (axis != QW_NO_AXIS && axis != k) continue;
        qw_mirror_plane plane = through_centre(s, normal);
        plane = improve(s, plane, false, &found);
        if (found < *gap && (*gap == DBL_MAX || !is_as_good(*gap, found))) *gap = found, best = plane;
    }
    return best;
}

static qw_mirror_plane along_any(search *s, double *gap)
{
    double m[3][3] = {{0}}, axis[3][3];
    qw_mirror_plane best = along_axes(s, QW_NO_AXIS, gap);
    for (uint32_t i = 0; i < JUDGED; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) m[j][k] += (s->point[i][j] - s->centre[j]) * (s->point[i][k] - s->centre[k]);
    qw_principal_axes(m, axis);
    for (int b = 0; b < BEGINNINGS; b++) {
        double normal[3] = {b == 0, b == 1, b == 2}, found;
        qw_mirror_plane plane = improve(s, through_centre(s, b < 3 ? normal : axis[b - 3]), true, &found);
        if (found < *gap && !is_as_good(*gap, found)) *gap = found, best = plane;
    }
    return best;
}

/* The plane of the frame in the coordinates of the input. Through the origin of these where that is as good. */
static qw_mirror_plane in_input(search *s, const qw_frame *frame, const qw_mirror_plane *plane, double gap)
{
    double offset = plane->offset / frame->scale, to_origin = 0;
    for (int k = 0; k < 3; k++) offset += plane->normal[k] * frame->center[k], to_origin -= plane->normal[k] * frame->center[k];
    qw_mirror_plane centred = *plane;
    centred.offset = to_origin * frame->scale;
    if (is_as_good(reflect_all(s, &centred, SAMPLES), gap)) offset = 0;
    return qw_mirror_plane_of(plane->normal, offset);
}

qw_mirror_search qw_find_mirror_plane(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame, int axis)
{
    assert(mesh->face_count > 0 && axis >= 0 && axis <= QW_NO_AXIS);
    qw_scope_begin(env);
    search s = {.env = env, .mesh = mesh, .bvh = qw_bvh_build(env, mesh)};
    s.area_end = QW_NEW(env, double, mesh->face_count);
    s.point = qw_alloc(env, JUDGED, sizeof *s.point), s.near = qw_alloc(env, JUDGED, sizeof *s.near);
    s.distance = QW_NEW(env, float, JUDGED);
    measure_area(&s);
    place_samples(&s);
    double gap;
    qw_mirror_plane plane = axis == QW_NO_AXIS ? along_any(&s, &gap) : along_axes(&s, axis, &gap);
    qw_mirror_search found = {.plane = in_input(&s, frame, &plane, gap)};
    qw_mirror_plane judged = found.plane;
    for (int k = 0; k < 3; k++) judged.offset -= judged.normal[k] * frame->center[k];
    judged.offset *= frame->scale;
    found.gap = reflect_all(&s, &judged, JUDGED);
    found.most = qw_percentile(s.distance, JUDGED, MOSTLY) / s.diagonal;
    qw_scope_end(env);
    return found;
}
