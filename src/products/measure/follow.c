/* Samples of the surface, spread evenly by area as those of the distances are. Each has its principal directions at
 * the scale of the quads and the quad whose centre is nearest; the angle is that between the directions and the lines
 * that join the middles of the quad's opposite edges.
 *
 * Symmetry: the planes through the centre of area along the axes and along the principal axes of the surface are
 * tried. One counts where 95 % of the samples, mirrored, lie on the surface again; between equal ones the first.
 */
#include "products/measure/follow.h"

#include "base/axes.h"
#include "base/elementary.h"
#include "geometry/effort.h"
#include "base/constants.h"

#include <assert.h>
#include <float.h>
#include <string.h>

enum {
    SAMPLES_A_FACE = 8,   /* of the finer surface */
    LEAST_SAMPLES = 2000, /* where it has few faces */
    MOST_SAMPLES = 16000,
    LEAST_CLEAR = 30,       /* samples with clear directions; follow is not given for fewer */
    PLANES = 6,             /* three axes, three principal axes */
    MIRRORED = 2000,        /* samples mirrored at each plane */
    MOST_VERTICES = 200000, /* mirrored for the mean distance; of more as many, evenly */
    PIECES_A_TRIANGLE = 32, /* of a ball, that are looked at in the time that a triangle takes */
};

static const double degrees = 180 / 3.14159265358979323846;
/* A mirrored sample may be off by so much of the box's diagonal. */
static const double mirror_gap = 0.0035;

/* The share of the samples within that gap; and by which share of it another plane must be better. */
static const double MIRROR_GAIN = 0.1;

/* ---- follow */

typedef struct follow_task {
    const qw_surface *in;
    const qw_ball_curvature *curvature;
    const qw_curve_tree *centres;
    const qw_vec3 *axis; /* qw_vec3[2 quads], unit: lines between the middles of opposite edges */
    float reach;         /* a quad whose centre is farther says nothing; in the frame */
    uint32_t samples;    /* that are taken: fewer than are wanted where each takes much (effort.h) */
    float *angle;        /* float[samples]: degrees */
    float *weight;       /* float[samples] */
    uint8_t *clear;      /* uint8_t[samples]: has principal directions */
} follow_task;

typedef struct sample {
    uint32_t triangle;
    qw_vec3 point;
} sample;

static sample sample_at(const qw_surface *s, uint32_t i, uint32_t samples)
{
    assert(s->area_end && s->mesh.face_count > 0 && i < samples);
    uint32_t last = s->mesh.face_count;
    sample r = {.triangle = qw_find_in(s->area_end, last, s->area_end[last - 1] * ((i + qw_hashed(i, 0)) / samples))};
    float u = (float)qw_hashed(i, 1), v = (float)qw_hashed(i, 2);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    r.point = qw_surface_point(s, r.triangle, u, v);
    return r;
}

/* Degrees between a direction and the nearer of a quad's two axes. */
static float angle_to(const qw_vec3 axis[2], qw_vec3 direction)
{
    float c = fmaxf(fabsf(qw_dot(axis[0], direction)), fabsf(qw_dot(axis[1], direction)));
    return (float)(qw_acos(fmin((double)c, 1)) * degrees);
}

/* For each sample the angle between the edges nearest to it and the direction of curvature; weight 0 where that is
   not clear. */
static void follow_samples(void *user, uint32_t begin, uint32_t end)
{
    const follow_task *t = user;
    for (uint32_t i = begin; i < end; i++) {
        sample s = sample_at(t->in, i, t->samples);
        qw_principal p = qw_ball_curvature_at(t->curvature, s.point, t->in->normal[s.triangle]);
        t->clear[i] = p.weight > 0;
        t->weight[i] = 0;
        if (!t->clear[i]) continue;
        qw_curve_hit hit = qw_curve_nearest(t->centres, s.point, t->reach);
        if (hit.segment == QW_NONE) continue;
        t->weight[i] = p.weight;
        t->angle[i] = angle_to(t->axis + 2 * (size_t)hit.segment, p.direction);
    }
}

static void quad_axes(const qw_vec3 p[4], qw_vec3 axis[2])
{
    axis[0] = qw_normalize(qw_sub(qw_add(p[1], p[2]), qw_add(p[0], p[3])));
    axis[1] = qw_normalize(qw_sub(qw_add(p[3], p[2]), qw_add(p[0], p[1])));
}

static qw_vec3 quad_centre(const qw_vec3 p[4])
{
    return qw_scale(qw_add(qw_add(p[0], p[1]), qw_add(p[2], p[3])), 0.25f);
}

static void load_quad(const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_surface *s, uint32_t face,
                      qw_vec3 p[4])
{
    for (uint32_t k = 0; k < 4; k++) p[k] = s->mesh.position[mesh->corners[edges->face_begin[face] + k]];
}

/* The mean of these angles, and the shares within 10 and beyond 30 degrees; nothing where few are clear. */
static void sum_follow(const follow_task *t, qw_quality *quality)
{
    uint32_t clear = 0;
    double weight = 0, angle = 0, within = 0, beyond = 0;
    for (uint32_t i = 0; i < t->samples; i++) {
        clear += t->clear[i];
        if (!(t->weight[i] > 0)) continue;
        double w = (double)t->weight[i], a = (double)t->angle[i];
        weight += w, angle += w * a;
        if (a < 10) within += w;
        if (a > 30) beyond += w;
    }
    if (clear < LEAST_CLEAR || !(weight > 0)) return;
    quality->follow = angle / weight;
    quality->follow10 = within / weight;
    quality->follow30 = beyond / weight;
}

static double ball_radius(const qw_surface *in, uint32_t quads)
{
    return sqrt(in->area_end[in->mesh.face_count - 1] / quads);
}

/* Sets how far the quads' lines turn from the principal directions of the surface `in`, at samples of it where these
   are clear. edge: the mean edge of the quads. */
static void measure_follow(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_surface *out,
                           const qw_mesh_view *against, const qw_surface *in, double edge, qw_quality *quality)
{
    uint32_t quads = 0;
    qw_vec3 *axis = QW_NEW(env, qw_vec3, 2 * (size_t)mesh->face_count),
            *centre = QW_NEW(env, qw_vec3, mesh->face_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        if (edges->face_begin[f + 1] - edges->face_begin[f] != 4) continue;
        qw_vec3 p[4];
        load_quad(mesh, edges, out, f, p);
        quad_axes(p, axis + 2 * (size_t)quads);
        centre[quads++] = quad_centre(p);
    }
    follow_task t = {.in = in, .axis = axis, .reach = (float)(2 * edge)};
    t.curvature = qw_ball_curvature_make(env, in, against, ball_radius(in, quads));
    t.centres = qw_curve_tree_build(env, centre, centre, quads);
    uint32_t wanted = qw_wanted_samples(in->mesh.face_count, quads, SAMPLES_A_FACE, LEAST_SAMPLES, MOST_SAMPLES);
    qw_probes probes = {0};
    for (uint32_t i; qw_next_probe(&probes, wanted, &i);)
        probes.effort += qw_ball_effort(t.curvature, sample_at(in, i, wanted).point) / PIECES_A_TRIANGLE;
    t.samples = qw_affordable(&probes, wanted);
    t.angle = QW_NEW(env, float, t.samples);
    t.weight = QW_NEW(env, float, t.samples);
    t.clear = QW_NEW(env, uint8_t, t.samples);
    qw_parallel(env, t.samples, QW_GRAIN_SEARCH, follow_samples, &t);
    sum_follow(&t, quality);
}

/* ---- mirror */

typedef struct plane {
    qw_vec3 point, normal;
} plane;

static qw_vec3 mirrored(const plane *p, qw_vec3 x)
{
    return qw_madd(x, -2 * qw_dot(qw_sub(x, p->point), p->normal), p->normal);
}

/* Sums over the triangles: of the area times the place, and of the products of coordinates about the centre. */
static void centre_of_area(const qw_surface *s, double centre[3])
{
    for (uint32_t t = 0; t < s->mesh.face_count; t++)
        for (uint32_t i = 0; i < 3; i++) {
            qw_vec3 p = s->mesh.position[s->mesh.corner[3 * t + i]];
            double third = qw_surface_area(s, t) / 3;
            centre[0] += third * (double)p.x, centre[1] += third * (double)p.y, centre[2] += third * (double)p.z;
        }
    for (int k = 0; k < 3; k++) centre[k] /= s->area_end[s->mesh.face_count - 1];
}

/* Adds the second moments of the surface's area about `centre` to m. */
static void products_of_area(const qw_surface *s, const double centre[3], double m[3][3])
{
    for (uint32_t t = 0; t < s->mesh.face_count; t++) {
        double d[4][3] = {{0}}; /* the corners, and their sum */
        for (uint32_t i = 0; i < 3; i++) {
            qw_vec3 p = s->mesh.position[s->mesh.corner[3 * t + i]];
            d[i][0] = (double)p.x - centre[0], d[i][1] = (double)p.y - centre[1], d[i][2] = (double)p.z - centre[2];
            for (int k = 0; k < 3; k++) d[3][k] += d[i][k];
        }
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 3; j++)
                for (int k = 0; k < 3; k++) m[j][k] += qw_surface_area(s, t) / 12 * d[i][j] * d[i][k];
    }
}

/* The planes through the middle of the surface along the axes of space and along its own. */
static void candidate_planes(const qw_surface *s, plane planes[PLANES])
{
    double centre[3] = {0}, m[3][3] = {{0}}, axis[3][3];
    centre_of_area(s, centre);
    products_of_area(s, centre, m);
    qw_principal_axes(m, axis);
    for (int k = 0; k < 3; k++) {
        planes[k].normal = qw_v3(k == 0, k == 1, k == 2);
        planes[3 + k].normal = qw_normalize(qw_v3_of_doubles(axis[k]));
    }
    for (int k = 0; k < PLANES; k++) planes[k].point = qw_v3_of_doubles(centre);
}

typedef struct mirror_task {
    const qw_surface *in;
    const plane *planes;         /* plane[PLANES] */
    const qw_vec3 *point;        /* qw_vec3[samples], or of the vertices */
    uint32_t samples;            /* mirrored at each plane */
    const qw_curve_tree *nearby; /* of the vertices */
    uint32_t vertices;           /* of which samples are mirrored */
    float reach;                 /* of samples: what is farther is not looked for */
    float *distance;             /* float[PLANES samples], or of the vertices */
} mirror_task;

static qw_hit nearest_to_mirrored(const mirror_task *t, uint32_t i, uint32_t hint)
{
    qw_vec3 p = mirrored(&t->planes[i / t->samples], t->point[i % t->samples]);
    return qw_bvh_nearest(t->in->bvh, p, qw_v3(0, 0, 0), -1, t->reach, hint);
}

static void mirror_samples(void *user, uint32_t begin, uint32_t end)
{
    const mirror_task *t = user;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        qw_hit hit = nearest_to_mirrored(t, i, hint);
        hint = hit.face;
        t->distance[i] = hit.face == QW_NONE ? t->reach : sqrtf(hit.distance2);
    }
}

static void mirror_vertices(void *user, uint32_t begin, uint32_t end)
{
    const mirror_task *t = user;
    for (uint32_t i = begin; i < end; i++) {
        qw_vec3 p = t->point[(uint64_t)i * t->vertices / t->samples];
        t->distance[i] = sqrtf(qw_curve_nearest(t->nearby, mirrored(t->planes, p), FLT_MAX).distance2);
    }
}

static double diagonal_of(const qw_surface *s)
{
    qw_vec3 lo = {FLT_MAX, FLT_MAX, FLT_MAX}, hi = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (uint32_t v = 0; v < s->mesh.vertex_count; v++) {
        qw_vec3 p = s->mesh.position[v];
        if (!s->used[v]) continue;
        lo = qw_v3(fminf(lo.x, p.x), fminf(lo.y, p.y), fminf(lo.z, p.z));
        hi = qw_v3(fmaxf(hi.x, p.x), fmaxf(hi.y, p.y), fmaxf(hi.z, p.z));
    }
    return (double)qw_distance(lo, hi);
}

/* Of the gap that a plane may leave at the most: so little less is not better. */
static const double NOT_BETTER = 0.999;

/* Of the points as many as can be afforded, evenly; says how many they are. */
static uint32_t thin_mirrored(const mirror_task *t, qw_vec3 *point)
{
    assert(t->point == point);
    qw_probes probes = {0};
    for (uint32_t i; qw_next_probe(&probes, PLANES * t->samples, &i);)
        probes.effort += nearest_to_mirrored(t, i, QW_NONE).looked;
    uint32_t count = qw_affordable(&probes, PLANES * t->samples) / PLANES;
    for (uint32_t i = 0; i < count; i++) point[i] = point[(uint64_t)i * t->samples / count];
    return count;
}

/* Whether the surface has a plane of symmetry, and which of the candidates is it. */
static bool find_mirror(qw_env *env, const qw_surface *in, plane *found)
{
    assert(in->area_end && found);
    plane planes[PLANES];
    qw_vec3 *point = QW_NEW(env, qw_vec3, MIRRORED);
    for (uint32_t i = 0; i < MIRRORED; i++) point[i] = sample_at(in, i, MIRRORED).point;
    candidate_planes(in, planes);
    double best = mirror_gap * diagonal_of(in), least = MIRROR_GAIN * best;
    mirror_task t = {.in = in, .planes = planes, .point = point, .samples = MIRRORED, .reach = (float)best};
    t.samples = thin_mirrored(&t, point);
    t.distance = QW_NEW(env, float, (size_t)PLANES *t.samples);
    qw_parallel(env, PLANES * t.samples, QW_GRAIN_SEARCH, mirror_samples, &t);
    bool any = false;
    for (uint32_t k = 0; k < PLANES; k++) {
        double gap = qw_percentile(t.distance + (size_t)k * t.samples, t.samples, QW_MOST_OF_IT);
        if (!(gap < (any ? best - least : NOT_BETTER * best))) continue;
        best = gap, any = true;
        *found = planes[k];
    }
    qw_free(env, point), qw_free(env, t.distance);
    return any;
}

/* How far the vertices are from the reflections of others, in edges, where the surface has a plane of symmetry. */
static void measure_mirror(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_surface *out,
                           const qw_surface *in, double edge, qw_quality *quality)
{
    plane found;
    if (!find_mirror(env, in, &found)) return;
    uint8_t *used = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count);
    for (uint32_t c = 0; c < edges->corner_count; c++) {
        uint32_t f = edges->face[c];
        if (edges->face_begin[f + 1] - edges->face_begin[f] == 4) used[mesh->corners[c]] = 1;
    }
    qw_vec3 *point = QW_NEW(env, qw_vec3, mesh->vertex_count);
    uint32_t count = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (used[v]) point[count++] = out->mesh.position[v];
    mirror_task t = {.planes = &found, .point = point, .nearby = qw_curve_tree_build(env, point, point, count)};
    t.vertices = count, t.samples = count < MOST_VERTICES ? count : MOST_VERTICES;
    t.distance = QW_NEW(env, float, t.samples);
    qw_parallel(env, t.samples, QW_GRAIN_SEARCH, mirror_vertices, &t);
    double sum = 0;
    for (uint32_t i = 0; i < t.samples; i++) sum += (double)t.distance[i];
    quality->mirror = sum / t.samples / edge;
}

void qw_measure_shape(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_surface *out,
                      const qw_mesh_view *against, const qw_surface *in, double scale, qw_quality *quality)
{
    assert(quality->mean_edge > 0);
    double edge = quality->mean_edge * scale;
    bool quads = quality->patches > 0;
    if (!quads) return;
    qw_scope_begin(env);
    measure_follow(env, mesh, edges, out, against, in, edge, quality);
    qw_scope_end(env);
    qw_scope_begin(env);
    measure_mirror(env, mesh, edges, out, in, edge, quality);
    qw_scope_end(env);
}

/* ---- quad by quad */

typedef struct angle_task {
    const qw_mesh_view *mesh;
    const qw_polygon_edges *edges;
    const qw_surface *out, *in;
    const qw_ball_curvature *curvature;
    const uint32_t *quad;
    float *angle, *weight;
} angle_task;

/* For each quad the angle between its axes and the direction of curvature nearest to it, and how much that counts. */
static void find_angles(void *user, uint32_t begin, uint32_t end)
{
    const angle_task *t = user;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        qw_vec3 p[4], axis[2];
        load_quad(t->mesh, t->edges, t->out, t->quad[i], p);
        quad_axes(p, axis);
        qw_hit hit = qw_bvh_nearest(t->in->bvh, quad_centre(p), qw_cross(axis[0], axis[1]), 0, FLT_MAX, hint);
        if (hit.face == QW_NONE) hit = qw_bvh_nearest(t->in->bvh, quad_centre(p), qw_v3(0, 0, 0), -1, FLT_MAX, hint);
        hint = hit.face;
        qw_principal d = qw_ball_curvature_at(t->curvature, hit.point, t->in->normal[hit.face]);
        t->weight[i] = d.weight;
        t->angle[i] = d.weight > 0 ? angle_to(axis, d.direction) : 0;
    }
}

void qw_find_quad_angles(qw_env *env, const qw_mesh_view *mesh, const qw_mesh_view *against, const uint32_t *quad,
                         uint32_t count, float *angle, float *weight)
{
    assert(count == 0 || (quad && angle && weight));
    memset(angle, 0, count * sizeof *angle);
    memset(weight, 0, count * sizeof *weight);
    qw_scope_begin(env);
    qw_polygon_edges edges = qw_find_polygon_edges(env, mesh), input = qw_find_polygon_edges(env, against);
    qw_frame frame = qw_common_frame(mesh, against);
    qw_surface out = qw_surface_make(env, mesh, edges.face_begin, &frame),
               in = qw_surface_make(env, against, input.face_begin, &frame);
    if (in.mesh.face_count > 0 && count > 0) {
        angle_task t = {.mesh = mesh, .edges = &edges, .out = &out, .in = &in, .quad = quad};
        t.curvature = qw_ball_curvature_make(env, &in, against, ball_radius(&in, count));
        t.angle = angle, t.weight = weight;
        qw_parallel(env, count, QW_GRAIN_SEARCH, find_angles, &t);
    }
    qw_scope_end(env);
}
