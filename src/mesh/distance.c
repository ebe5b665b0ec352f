/* Distances by sampling: points spread evenly over a surface, each with its exact distance to the other surface.
 *
 * Sample i of n lies at the fraction (i + hash(i)) / n of the area summed over the triangles (of the length summed over
 * the sharp edges), so samples are stratified and the same on every run. Quads are cut into fans, polygons where there
 * are any as cleaning does it; triangles without an area are left out. Both surfaces share a frame, so that single
 * precision is precise wherever the coordinates lie.
 *
 * A face is flipped when most of its area opposes the nearest input normal and no input within one edge length agrees
 * with it: on a wall thinner than that, the nearest point may well lie on the other side.
 */
#include "mesh/distance.h"

#include "math/elementary.h"
#include "mesh/bvh.h"
#include "mesh/triangulate.h"

#include <assert.h>
#include <float.h>

enum { SAMPLES = 200000, LEAST_CURVE_SAMPLES = 2000, MOST_CURVE_SAMPLES = 40000, GRAIN = 1024 };

static const double sharp_angle = 35.0 * 3.14159265358979323846 / 180.0;

/* A polygon mesh as triangles. */
typedef struct surface {
    qw_trimesh mesh;      /* position, corner and the counts only */
    uint32_t *face_begin; /* uint32_t[polygons + 1]: the triangles of each polygon */
    double *area_end;     /* double[mesh.face_count]: area of this and all earlier triangles, in the frame */
    qw_vec3 *normal;      /* qw_vec3[mesh.face_count], unit */
    uint8_t *used;        /* uint8_t[mesh.vertex_count]: a corner of some triangle */
    qw_bvh *bvh;
} surface;

/* ---- frame */

static void grow_box(const qw_mesh_view *mesh, double lo[3], double hi[3])
{
    uint64_t corners = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++)
        corners += mesh->face_sizes ? mesh->face_sizes[f] : mesh->uniform_face_size;
    for (uint64_t c = 0; c < corners; c++)
        for (int k = 0; k < 3; k++) {
            double x = mesh->positions[3 * (size_t)mesh->corners[c] + (size_t)k];
            if (x < lo[k]) lo[k] = x;
            if (x > hi[k]) hi[k] = x;
        }
}

qw_frame qw_common_frame(const qw_mesh_view *mesh, const qw_mesh_view *other)
{
    double lo[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, hi[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX}, half = 0;
    grow_box(mesh, lo, hi);
    if (other) grow_box(other, lo, hi);
    qw_frame frame = {.scale = 1};
    if (lo[0] > hi[0]) return frame;
    for (int k = 0; k < 3; k++) {
        frame.center[k] = 0.5 * lo[k] + 0.5 * hi[k];
        half = fmax(half, 0.5 * hi[k] - 0.5 * lo[k]);
    }
    int exponent;
    if (half > 0) {
        frexp(half, &exponent);
        frame.scale = ldexp(1, exponent < -1000 ? 1000 : -exponent - 2);
    }
    return frame;
}

/* ---- surface */

static void add_triangle(surface *s, const qw_mesh_view *view, double scale, uint32_t a, uint32_t b, uint32_t c)
{
    qw_dvec3 p = qw_dpoint(view, a, scale);
    qw_dvec3 n = qw_dcross(qw_dsub(qw_dpoint(view, b, scale), p), qw_dsub(qw_dpoint(view, c, scale), p));
    double length = qw_dlength(n);
    if (!(length > 0)) return;
    uint32_t t = s->mesh.face_count++;
    s->used[a] = s->used[b] = s->used[c] = 1;
    s->mesh.corner[3 * (size_t)t] = a;
    s->mesh.corner[3 * (size_t)t + 1] = b;
    s->mesh.corner[3 * (size_t)t + 2] = c;
    s->area_end[t] = (t ? s->area_end[t - 1] : 0) + 0.5 * length;
    s->normal[t] = qw_v3((float)(n.x / length), (float)(n.y / length), (float)(n.z / length));
}

static bool has_polygons(const qw_mesh_view *view, const uint32_t *face_begin)
{
    for (uint32_t f = 0; f < view->face_count; f++)
        if (face_begin[f + 1] - face_begin[f] > 4) return true;
    return false;
}

static void cut_fans(surface *s, const qw_mesh_view *view, const uint32_t *face_begin, double scale)
{
    for (uint32_t f = 0; f < view->face_count; f++) {
        const uint32_t *c = view->corners + face_begin[f];
        s->face_begin[f] = s->mesh.face_count;
        for (uint32_t k = 1; k + 1 < face_begin[f + 1] - face_begin[f]; k++)
            add_triangle(s, view, scale, c[0], c[k], c[k + 1]);
    }
}

/* A fan of a polygon that is not convex would cover what the polygon does not. */
static void cut_polygons(qw_env *env, surface *s, const qw_mesh_view *view, const uint32_t *face_begin, double scale)
{
    qw_triangles t = qw_triangulate(env, &(qw_clean_input){.vertex_count = view->vertex_count,
                                                           .face_count = view->face_count,
                                                           .position = view->positions,
                                                           .face_begin = face_begin,
                                                           .corner = view->corners});
    uint32_t i = 0;
    for (uint32_t f = 0; f < view->face_count; f++) {
        s->face_begin[f] = s->mesh.face_count;
        for (; i < t.count && t.source[i] == f; i++)
            add_triangle(s, view, scale, t.corner[3 * (size_t)i], t.corner[3 * (size_t)i + 1],
                         t.corner[3 * (size_t)i + 2]);
    }
    qw_free(env, t.corner), qw_free(env, t.source);
}

static surface make_surface(qw_env *env, const qw_mesh_view *view, const uint32_t *face_begin, const qw_frame *frame)
{
    size_t most = face_begin[view->face_count];
    if (most > UINT32_MAX / 3)
        qw_fail(env, QW_TOO_LARGE, -1, "%zu corners are too many to be cut into triangles", most);
    surface s = {.mesh.vertex_count = view->vertex_count};
    s.mesh.position = QW_NEW(env, qw_vec3, view->vertex_count);
    s.mesh.corner = QW_NEW(env, uint32_t, 3 * most);
    s.face_begin = QW_NEW(env, uint32_t, (size_t)view->face_count + 1);
    s.area_end = QW_NEW(env, double, most);
    s.normal = QW_NEW(env, qw_vec3, most);
    s.used = QW_NEW_ZERO(env, uint8_t, view->vertex_count);
    for (uint32_t v = 0; v < view->vertex_count; v++) {
        const double *p = view->positions + 3 * (size_t)v, *c = frame->center;
        s.mesh.position[v] = qw_v3((float)((p[0] - c[0]) * frame->scale), (float)((p[1] - c[1]) * frame->scale),
                                   (float)((p[2] - c[2]) * frame->scale));
    }
    if (has_polygons(view, face_begin)) cut_polygons(env, &s, view, face_begin, frame->scale);
    else cut_fans(&s, view, face_begin, frame->scale);
    s.face_begin[view->face_count] = s.mesh.face_count;
    s.bvh = qw_bvh_build(env, &s.mesh);
    return s;
}

/* ---- sampling */

/* The k-th number of sample i, 0 to 1. */
static double hashed(uint32_t i, uint32_t k) { return (double)(qw_mix((uint64_t)k << 32 | i) >> 11) * 0x1p-53; }

/* First index whose running sum is above x. */
static uint32_t find_in(const double *sums, uint32_t count, double x)
{
    uint32_t lo = 0, hi = count - 1;
    while (lo < hi) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (sums[middle] > x) hi = middle;
        else lo = middle + 1;
    }
    return lo;
}

static qw_vec3 point_at(const surface *s, uint32_t triangle, float u, float v)
{
    const uint32_t *c = s->mesh.corner + 3 * (size_t)triangle;
    qw_vec3 a = s->mesh.position[c[0]];
    a = qw_madd(a, u, qw_sub(s->mesh.position[c[1]], s->mesh.position[c[0]]));
    return qw_madd(a, v, qw_sub(s->mesh.position[c[2]], s->mesh.position[c[0]]));
}

typedef struct sampling {
    const surface *from, *to;
    float *distance; /* float[SAMPLES] */
    float *largest;  /* float[blocks of vertices] */
} sampling;

static void sample_surface(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const sampling *s = user;
    uint32_t last = s->from->mesh.face_count, hint = QW_NONE;
    double total = s->from->area_end[last - 1];
    for (uint32_t i = begin; i < end; i++) {
        uint32_t t = find_in(s->from->area_end, last, total * ((i + hashed(i, 0)) / SAMPLES));
        float u = (float)hashed(i, 1), v = (float)hashed(i, 2);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        qw_hit hit = qw_bvh_nearest(s->to->bvh, point_at(s->from, t, u, v), qw_v3(0, 0, 0), -1, FLT_MAX, hint);
        hint = hit.face;
        s->distance[i] = sqrtf(hit.distance2);
    }
}

/* The largest distance is mostly at a corner, which no sample hits. from's vertices; one largest a block. */
static void visit_vertices(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const sampling *s = user;
    uint32_t hint = QW_NONE;
    float most = 0;
    for (uint32_t v = begin; v < end; v++) {
        if (!s->from->used[v]) continue;
        qw_hit hit = qw_bvh_nearest(s->to->bvh, s->from->mesh.position[v], qw_v3(0, 0, 0), -1, FLT_MAX, hint);
        hint = hit.face;
        most = fmaxf(most, sqrtf(hit.distance2));
    }
    s->largest[block] = most;
}

typedef struct spread {
    double mean, p999, most;
} spread;

static spread distance_between(qw_env *env, const surface *from, const surface *to)
{
    uint32_t blocks = qw_block_count(from->mesh.vertex_count, GRAIN);
    sampling s = {from, to, QW_NEW(env, float, SAMPLES), QW_NEW(env, float, blocks)};
    qw_parallel(env, SAMPLES, GRAIN, sample_surface, &s);
    qw_parallel(env, from->mesh.vertex_count, GRAIN, visit_vertices, &s);
    spread r = {0};
    for (uint32_t i = 0; i < SAMPLES; i++) {
        r.mean += s.distance[i];
        r.most = fmax(r.most, s.distance[i]);
    }
    for (uint32_t b = 0; b < blocks; b++) r.most = fmax(r.most, s.largest[b]);
    r.mean /= SAMPLES;
    r.p999 = qw_percentile(s.distance, SAMPLES, 0.999);
    qw_free(env, s.distance);
    qw_free(env, s.largest);
    return r;
}

/* ---- flipped faces */

enum { POINTS = 4 }; /* a triangle: its centre, and one towards each corner */
static const float point_u[POINTS] = {1.0f / 3, 1.0f / 6, 2.0f / 3, 1.0f / 6},
                   point_v[POINTS] = {1.0f / 3, 1.0f / 6, 1.0f / 6, 2.0f / 3};

typedef struct flip_task {
    const surface *from, *to;
    float edge; /* one mean edge, in the frame */
    uint32_t *counts;
} flip_task;

static double area_of(const surface *s, uint32_t t) { return s->area_end[t] - (t ? s->area_end[t - 1] : 0); }

static bool is_suspect(const flip_task *task, uint32_t begin, uint32_t end, uint32_t *hint)
{
    double all = 0, opposed = 0, agreed = 0;
    for (uint32_t t = begin; t < end; t++) all += area_of(task->from, t);
    for (uint32_t t = begin; t < end; t++)
        for (int k = 0; k < POINTS; k++) {
            qw_vec3 p = point_at(task->from, t, point_u[k], point_v[k]);
            *hint = qw_bvh_nearest(task->to->bvh, p, qw_v3(0, 0, 0), -1, FLT_MAX, *hint).face;
            bool against = qw_dot(task->from->normal[t], task->to->normal[*hint]) < -0.2f;
            *(against ? &opposed : &agreed) += area_of(task->from, t) / POINTS;
            if (agreed >= 0.4 * all) return false;
        }
    return opposed > 0.6 * all;
}

static bool finds_agreement(const flip_task *task, uint32_t begin, uint32_t end)
{
    for (uint32_t t = begin; t < end; t++)
        for (int k = 0; k < POINTS; k++) {
            qw_vec3 p = point_at(task->from, t, point_u[k], point_v[k]);
            if (qw_bvh_nearest(task->to->bvh, p, task->from->normal[t], 0.2f, task->edge, QW_NONE).face != QW_NONE)
                return true;
        }
    return false;
}

static void count_flipped(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const flip_task *task = user;
    uint32_t hint = QW_NONE, count = 0;
    for (uint32_t f = begin; f < end; f++) {
        uint32_t first = task->from->face_begin[f], last = task->from->face_begin[f + 1];
        count += is_suspect(task, first, last, &hint) && !finds_agreement(task, first, last);
    }
    task->counts[block] = count;
}

static int64_t flipped_faces(qw_env *env, const surface *from, const surface *to, uint32_t faces, float edge)
{
    uint32_t blocks = qw_block_count(faces, GRAIN);
    flip_task task = {from, to, edge, QW_NEW(env, uint32_t, blocks)};
    qw_parallel(env, faces, GRAIN, count_flipped, &task);
    int64_t count = 0;
    for (uint32_t b = 0; b < blocks; b++) count += task.counts[b];
    qw_free(env, task.counts);
    return count;
}

/* ---- sharp edges */

typedef struct curve_sampling {
    const surface *from;
    const uint32_t *sharp;    /* half-edges */
    const double *length_end; /* of this and all earlier sharp edges */
    uint32_t count, samples;
    const qw_curve_tree *tree;
    float *distance;
} curve_sampling;

static qw_vec3 half_edge_end(const surface *s, uint32_t h, bool far)
{
    return s->mesh.position[s->mesh.corner[far ? qw_next(h) : h]];
}

static void sample_curves(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const curve_sampling *s = user;
    double total = s->length_end[s->count - 1];
    for (uint32_t i = begin; i < end; i++) {
        uint32_t e = find_in(s->length_end, s->count, total * ((i + hashed(i, 0)) / s->samples)), h = s->sharp[e];
        qw_vec3 p = qw_lerp(half_edge_end(s->from, h, false), half_edge_end(s->from, h, true), (float)hashed(i, 1));
        s->distance[i] = sqrtf(qw_curve_nearest(s->tree, p, FLT_MAX).distance2);
    }
}

/* Edges of the surface between triangles that meet at more than the sharp angle; length_end as in curve_sampling. */
static uint32_t find_sharp(qw_env *env, const surface *s, const qw_mesh_view *view, uint32_t **sharp,
                           double **length_end)
{
    qw_mesh_view triangles = *view;
    triangles.face_count = s->mesh.face_count;
    triangles.uniform_face_size = 3;
    triangles.face_sizes = NULL;
    triangles.corners = s->mesh.corner;
    qw_polygon_edges edges = qw_find_polygon_edges(env, &triangles);
    *sharp = QW_NEW(env, uint32_t, edges.corner_count);
    *length_end = QW_NEW(env, double, edges.corner_count);
    uint32_t count = 0;
    float least_cosine = (float)qw_cos(sharp_angle);
    double length = 0;
    for (uint32_t e = 0; e < edges.edge_count; e++)
        for (uint32_t i = edges.edge_begin[e]; i + 1 < edges.edge_begin[e + 1]; i++) {
            uint32_t h = edges.sorted[i], g = edges.sorted[i + 1];
            if (qw_dot(s->normal[h / 3], s->normal[g / 3]) >= least_cosine) continue;
            length += qw_distance(half_edge_end(s, h, false), half_edge_end(s, h, true));
            (*sharp)[count] = h;
            (*length_end)[count++] = length;
        }
    return count;
}

static qw_curve_tree *edge_tree(qw_env *env, const surface *s, const qw_mesh_view *mesh, const qw_polygon_edges *edges)
{
    qw_vec3 *from = QW_NEW(env, qw_vec3, edges->edge_count), *to = QW_NEW(env, qw_vec3, edges->edge_count);
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        uint32_t c = edges->sorted[edges->edge_begin[e]];
        from[e] = s->mesh.position[mesh->corners[c]];
        to[e] = s->mesh.position[mesh->corners[qw_polygon_next(edges, c)]];
    }
    return qw_curve_tree_build(env, from, to, edges->edge_count);
}

static void measure_sharp(qw_env *env, const surface *out, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const surface *in, const qw_mesh_view *against, double edge, qw_quality *quality)
{
    uint32_t *sharp;
    double *length_end;
    uint32_t count = find_sharp(env, in, against, &sharp, &length_end);
    if (count <= 3 || !(length_end[count - 1] > 0)) return;
    double wanted = length_end[count - 1] / (0.1 * edge);
    curve_sampling s = {.from = in, .sharp = sharp, .length_end = length_end, .count = count};
    s.samples = wanted < LEAST_CURVE_SAMPLES  ? LEAST_CURVE_SAMPLES
                : wanted > MOST_CURVE_SAMPLES ? MOST_CURVE_SAMPLES
                                              : (uint32_t)wanted;
    s.tree = edge_tree(env, out, mesh, edges);
    s.distance = QW_NEW(env, float, s.samples);
    qw_parallel(env, s.samples, GRAIN, sample_curves, &s);
    double sum = 0;
    for (uint32_t i = 0; i < s.samples; i++) sum += s.distance[i];
    quality->sharp_mean = sum / s.samples / edge;
    quality->sharp_p95 = qw_percentile(s.distance, s.samples, 0.95) / edge;
}

void qw_measure_distances(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_mesh_view *against, qw_quality *quality)
{
    qw_scope_begin(env);
    qw_polygon_edges input = qw_find_polygon_edges(env, against);
    qw_frame frame = qw_common_frame(mesh, against);
    double edge = quality->mean_edge * frame.scale;
    surface out = make_surface(env, mesh, edges->face_begin, &frame),
            in = make_surface(env, against, input.face_begin, &frame);
    if (out.mesh.face_count > 0 && in.mesh.face_count > 0) {
        spread there = distance_between(env, &out, &in), back = distance_between(env, &in, &out);
        quality->out_to_in_mean = there.mean / edge;
        quality->in_to_out_mean = back.mean / edge;
        quality->chamfer = 0.5 * (there.mean + back.mean) / edge;
        quality->hausdorff_p999 = fmax(there.p999, back.p999) / edge;
        quality->hausdorff = fmax(there.most, back.most) / edge;
        quality->flipped_faces = flipped_faces(env, &out, &in, mesh->face_count, (float)edge);
        measure_sharp(env, &out, mesh, edges, &in, against, edge, quality);
    }
    qw_scope_end(env);
}
