/* Distances by sampling: points spread evenly over a surface, each with its exact distance to the other surface.
 *
 * Sample i of n lies at the fraction (i + hash(i)) / n of the area summed over the triangles (of the length summed over
 * the sharp edges), so samples are stratified and the same on every run. Quads are cut into fans, polygons where there
 * are any as cleaning does it; triangles without an area are left out. Both surfaces share a frame, so that single
 * precision is precise wherever the coordinates lie. Samples, vertices and faces are visited in the order of their own
 * tree, so that one query finds in the caches what the last one left there; no figure depends on the order. Where each
 * sample looks at very much of the other surface, as in soups, fewer samples, vertices and faces are taken (effort.h).
 *
 * Which faces are flipped is said in flips.h.
 */
#include "products/measure/distance.h"

#include "base/sort.h"
#include "base/elementary.h"
#include "geometry/effort.h"
#include "geometry/flips.h"
#include "products/measure/follow.h"

#include <assert.h>
#include <float.h>
#include <string.h>

enum {
    SAMPLES_A_FACE = 50,   /* of the finer surface */
    LEAST_SAMPLES = 20000, /* of a surface: twenty of them lie beyond the 99.9th percentile */
    MOST_SAMPLES = 200000,
    LEAST_CURVE_SAMPLES = 2000,
    MOST_CURVE_SAMPLES = 40000
};

/* Distance between samples along sharp edges, in mean edges of the quads. */
static const double SAMPLE_STEP = 0.1;

static const double sharp_angle = 35.0 * 3.14159265358979323846 / 180.0;

/* ---- sampling */

typedef struct sampling {
    const qw_surface *from, *to;
    uint32_t samples;
    uint64_t *order; /* uint64_t[samples]: place of the triangle in from's tree << 32 | sample, sorted */
    uint32_t step;   /* between vertices that are visited */
    float *distance; /* float[samples] */
    float farthest;  /* of them */
    float *largest;  /* float[blocks of faces] */
    uint32_t *first; /* uint32_t[vertices]: the first face of from with this corner, or QW_NONE */
} sampling;

static qw_hit nearest(const qw_surface *to, qw_vec3 point, uint32_t hint)
{
    return qw_bvh_nearest(to->bvh, point, qw_v3(0, 0, 0), -1, FLT_MAX, hint);
}

static uint32_t triangle_of_sample(const sampling *s, uint32_t i)
{
    uint32_t last = s->from->mesh.face_count;
    return qw_find_in(s->from->area_end, last, s->from->area_end[last - 1] * ((i + qw_hashed(i, 0)) / s->samples));
}

static qw_vec3 point_of_sample(const sampling *s, uint32_t i, uint32_t triangle)
{
    float u = (float)qw_hashed(i, 1), v = (float)qw_hashed(i, 2);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return qw_surface_point(s->from, triangle, u, v);
}

static void place_samples(void *user, uint32_t begin, uint32_t end)
{
    const sampling *s = user;
    for (uint32_t i = begin; i < end; i++)
        s->order[i] = (uint64_t)qw_bvh_place_of(s->from->bvh, triangle_of_sample(s, i)) << 32 | i;
}

static void sample_surface(void *user, uint32_t begin, uint32_t end)
{
    const sampling *s = user;
    uint32_t hint = QW_NONE;
    for (uint32_t k = begin; k < end; k++) {
        uint32_t i = (uint32_t)s->order[k], triangle = qw_bvh_face_at(s->from->bvh, (uint32_t)(s->order[k] >> 32));
        qw_hit hit = nearest(s->to, point_of_sample(s, i, triangle), hint);
        hint = hit.face;
        s->distance[i] = sqrtf(hit.distance2);
    }
}

static void list_first_faces(const qw_trimesh *mesh, uint32_t *first)
{
    memset(first, 0xff, mesh->vertex_count * sizeof *first);
    for (uint32_t f = mesh->face_count; f-- > 0;)
        for (int k = 0; k < 3; k++) first[mesh->corner[3 * (size_t)f + (size_t)k]] = f;
}

/* What is nearer than `most`, or on the surface but for rounding, ends the search. Returns the larger of `most` and the
   distance of the vertex. */
static float visit_vertex(const sampling *s, uint32_t v, float most, uint32_t *hint)
{
    qw_bvh_query query = {.point = s->from->mesh.position[v], .least_dot = -1, .hint = *hint};
    query.max_distance = FLT_MAX, query.enough2 = fmaxf(most * most, qw_bvh_rounding2(s->to->bvh));
    qw_hit hit = qw_bvh_find(s->to->bvh, &query, NULL);
    *hint = hit.face;
    return hit.distance2 < query.enough2 ? most : fmaxf(most, sqrtf(hit.distance2));
}

/* The largest distance is mostly at a corner, which no sample hits. from's faces in the order of its tree, each with
   the vertices that it is the first of; one largest a block. */
static void visit_vertices(void *user, uint32_t begin, uint32_t end)
{
    const sampling *s = user;
    uint32_t hint = QW_NONE;
    float most = s->farthest;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t f = qw_bvh_face_at(s->from->bvh, i);
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t v = s->from->mesh.corner[h];
            if (s->first[v] == f && v % s->step == 0) most = visit_vertex(s, v, most, &hint);
        }
    }
    s->largest[begin / QW_GRAIN] = most;
}

static qw_probes probes_of(const sampling *s)
{
    assert(s->samples > 0);
    qw_probes probes = {0};
    for (uint32_t i; qw_next_probe(&probes, s->samples, &i);)
        probes.effort += nearest(s->to, point_of_sample(s, i, triangle_of_sample(s, i)), QW_NONE).looked;
    return probes;
}

typedef struct spread {
    double mean, p999, most;
} spread;

/* Distances of samples, evenly by area, and of all vertices, from one surface to another: their mean, percentile
   of 99.9 and largest. */
static spread distance_between(qw_env *env, const qw_surface *from, const qw_surface *to)
{
    assert(from->area_end && to->bvh);
    uint32_t blocks = qw_block_count(from->mesh.face_count, QW_GRAIN);
    uint32_t wanted = qw_wanted_samples(from->mesh.face_count, to->mesh.face_count, SAMPLES_A_FACE, LEAST_SAMPLES,
                                        MOST_SAMPLES);
    sampling s = {.from = from, .to = to, .samples = wanted, .step = 1, .largest = QW_NEW(env, float, blocks)};
    qw_probes probes = probes_of(&s);
    s.samples = qw_affordable(&probes, wanted), s.step = qw_affordable_step(&probes, from->mesh.vertex_count);
    s.distance = QW_NEW(env, float, s.samples), s.order = QW_NEW(env, uint64_t, s.samples);
    qw_parallel(env, s.samples, QW_GRAIN, place_samples, &s);
    qw_sort_u64(s.order, s.samples);
    qw_parallel(env, s.samples, QW_GRAIN, sample_surface, &s);
    qw_free(env, s.order);
    spread r = {0};
    for (uint32_t i = 0; i < s.samples; i++) {
        r.mean += s.distance[i];
        s.farthest = fmaxf(s.farthest, s.distance[i]);
    }
    r.most = s.farthest;
    s.first = QW_NEW(env, uint32_t, from->mesh.vertex_count);
    list_first_faces(&from->mesh, s.first);
    qw_parallel(env, from->mesh.face_count, QW_GRAIN, visit_vertices, &s);
    qw_free(env, s.first);
    for (uint32_t b = 0; b < blocks; b++) r.most = fmax(r.most, s.largest[b]);
    r.mean /= s.samples;
    r.p999 = qw_percentile(s.distance, s.samples, 0.999);
    qw_free(env, s.distance);
    qw_free(env, s.largest);
    return r;
}

/* ---- flipped faces */

typedef struct flip_task {
    const qw_surface *from;
    qw_flip_judge judge;
    uint32_t step;     /* between faces that are judged */
    uint32_t *polygon; /* uint32_t[triangles]: the face that a triangle is the first of, or QW_NONE */
    uint32_t *counts;
} flip_task;

static bool is_flipped(const qw_flip_judge *judge, const qw_surface *from, uint32_t face, uint32_t *hint)
{
    assert(from->face_begin[face] <= from->face_begin[face + 1]);
    uint32_t first = from->face_begin[face], last = from->face_begin[face + 1];
    return qw_is_flipped(judge, from->mesh.position, from->mesh.corner + 3 * (size_t)first, last - first,
                         &QW_FLIP_MEASURED, hint);
}

static uint32_t *list_polygons(qw_env *env, const qw_surface *from, uint32_t faces)
{
    uint32_t *polygon = QW_NEW(env, uint32_t, from->mesh.face_count);
    memset(polygon, 0xff, from->mesh.face_count * sizeof *polygon);
    for (uint32_t f = 0; f < faces; f++)
        if (from->face_begin[f] < from->face_begin[f + 1]) polygon[from->face_begin[f]] = f;
    return polygon;
}

/* Triangles in the order of their tree. Those without an area are in no tree: a face that has no others is not
   flipped. */
static void count_flipped(void *user, uint32_t begin, uint32_t end)
{
    const flip_task *task = user;
    uint32_t hint = QW_NONE, count = 0;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t f = task->polygon[qw_bvh_face_at(task->from->bvh, i)];
        if (f != QW_NONE && f % task->step == 0) count += is_flipped(&task->judge, task->from, f, &hint);
    }
    task->counts[begin / QW_GRAIN] = count;
}

/* seen: QW_SEEN_ flags of the faces that `to` was made of. Those of its triangles, which are `wanted`; or NULL. */
static uint8_t *spread_seen(qw_env *env, const qw_surface *to, uint32_t faces, const uint8_t *seen, uint8_t wanted)
{
    if (!seen) return NULL;
    uint8_t *triangles = QW_NEW(env, uint8_t, to->mesh.face_count);
    for (uint32_t f = 0; f < faces; f++)
        for (uint32_t t = to->face_begin[f]; t < to->face_begin[f + 1]; t++) triangles[t] = seen[f] & wanted;
    return triangles;
}

/* How many polygons of `from` look the other way than the surface `to` beneath them; of many only a share is
   asked. */
static int64_t flipped_faces(qw_env *env, const qw_surface *from, const qw_surface *to, const uint8_t *both,
                             uint32_t faces, float edge)
{
    uint32_t triangles = from->mesh.face_count, blocks = qw_block_count(triangles, QW_GRAIN);
    flip_task task = {.from = from, .judge = {&to->mesh, to->normal, both, to->bvh, edge, NULL}, .step = 1};
    task.polygon = list_polygons(env, from, faces), task.counts = QW_NEW(env, uint32_t, blocks);
    qw_probes probes = {0};
    qw_flip_judge probe = task.judge;
    probe.effort = &probes.effort;
    for (uint32_t f; qw_next_probe(&probes, faces, &f);) is_flipped(&probe, from, f, &(uint32_t){QW_NONE});
    task.step = qw_affordable_step(&probes, faces);
    qw_parallel(env, triangles, QW_GRAIN, count_flipped, &task);
    int64_t count = 0;
    for (uint32_t b = 0; b < blocks; b++) count += task.counts[b];
    qw_free(env, task.counts);
    qw_free(env, task.polygon);
    return count * task.step;
}

/* By the surface, and by the one that the mesh is known to be made of. */
static void count_both(qw_env *env, const qw_surface *out, const qw_surface *in, const qw_mesh_view *against,
                       const qw_sides *sides, const qw_frame *frame, uint32_t faces, float edge, qw_quality *quality)
{
    uint8_t *sheets = spread_seen(env, in, against->face_count, sides ? sides->seen : NULL, QW_SEEN_BOTH);
    quality->flipped_faces = quality->opposing_faces = flipped_faces(env, out, in, sheets, faces, edge);
    if (!sides || !sides->origin) return;
    qw_polygon_edges edges = qw_find_polygon_edges(env, sides->origin);
    qw_surface origin = qw_surface_make(env, sides->origin, edges.face_begin, frame);
    if (origin.mesh.face_count > 0) quality->flipped_faces = flipped_faces(env, out, &origin, NULL, faces, edge);
}

/* ---- sharp edges */

typedef struct curve_sampling {
    const qw_surface *from;
    const uint32_t *sharp;    /* half-edges */
    const double *length_end; /* of this and all earlier sharp edges */
    uint32_t count, samples;
    const qw_curve_tree *tree;
    float *distance;
} curve_sampling;

static qw_vec3 half_edge_end(const qw_surface *s, uint32_t h, bool far)
{
    return s->mesh.position[s->mesh.corner[far ? qw_next(h) : h]];
}

static qw_curve_hit nearest_edge(const curve_sampling *s, uint32_t i)
{
    double total = s->length_end[s->count - 1];
    uint32_t e = qw_find_in(s->length_end, s->count, total * ((i + qw_hashed(i, 0)) / s->samples)), h = s->sharp[e];
    qw_vec3 p = qw_lerp(half_edge_end(s->from, h, false), half_edge_end(s->from, h, true), (float)qw_hashed(i, 1));
    return qw_curve_nearest(s->tree, p, FLT_MAX);
}

static void sample_curves(void *user, uint32_t begin, uint32_t end)
{
    const curve_sampling *s = user;
    for (uint32_t i = begin; i < end; i++) s->distance[i] = sqrtf(nearest_edge(s, i).distance2);
}

static bool is_open(const uint8_t *seen, uint32_t h) { return seen[h / 3] & QW_SEEN_BEYOND << h % 3; }

/* Edges of the surface between triangles that meet at more than the sharp angle, and beyond which there is room where
 * it is known what is seen; length_end as in curve_sampling. */
static uint32_t find_sharp(qw_env *env, const qw_surface *s, const qw_mesh_view *view, const uint8_t *seen,
                           uint32_t **sharp, double **length_end)
{
    assert(sharp && length_end);
    qw_polygon_edges edges = qw_surface_edges(env, s, view);
    *sharp = QW_NEW(env, uint32_t, edges.corner_count);
    *length_end = QW_NEW(env, double, edges.corner_count);
    uint32_t count = 0;
    float least_cosine = (float)qw_cos(sharp_angle);
    double length = 0;
    for (uint32_t e = 0; e < edges.edge_count; e++)
        for (uint32_t i = edges.edge_begin[e]; i + 1 < edges.edge_begin[e + 1]; i++) {
            uint32_t h = edges.sorted[i], g = edges.sorted[i + 1];
            if (qw_dot(s->normal[h / 3], s->normal[g / 3]) >= least_cosine) continue;
            if (seen && !(is_open(seen, h) && is_open(seen, g))) continue;
            length += qw_distance(half_edge_end(s, h, false), half_edge_end(s, h, true));
            (*sharp)[count] = h;
            (*length_end)[count++] = length;
        }
    return count;
}

static qw_curve_tree *edge_tree(qw_env *env, const qw_surface *s, const qw_mesh_view *mesh,
                                const qw_polygon_edges *edges)
{
    assert(edges->sorted && edges->edge_begin);
    qw_vec3 *from = QW_NEW(env, qw_vec3, edges->edge_count), *to = QW_NEW(env, qw_vec3, edges->edge_count);
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        uint32_t c = edges->sorted[edges->edge_begin[e]];
        from[e] = s->mesh.position[mesh->corners[c]];
        to[e] = s->mesh.position[mesh->corners[qw_polygon_next(edges, c)]];
    }
    return qw_curve_tree_build(env, from, to, edges->edge_count);
}

/* How far samples on the sharp edges of the input are from the nearest edge of the mesh: mean and 95 %, in edges. */
static void measure_sharp(qw_env *env, const qw_surface *out, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_surface *in, const qw_mesh_view *against, const uint8_t *seen, double edge,
                          qw_quality *quality)
{
    uint32_t *sharp;
    double *length_end;
    uint8_t *triangles = spread_seen(env, in, against->face_count, seen, UINT8_MAX);
    uint32_t count = find_sharp(env, in, against, triangles, &sharp, &length_end);
    if (count <= 3 || !(length_end[count - 1] > 0)) return;
    double wanted = length_end[count - 1] / (SAMPLE_STEP * edge);
    curve_sampling s = {.from = in, .sharp = sharp, .length_end = length_end, .count = count};
    s.samples = wanted < LEAST_CURVE_SAMPLES  ? LEAST_CURVE_SAMPLES
                : wanted > MOST_CURVE_SAMPLES ? MOST_CURVE_SAMPLES
                                              : (uint32_t)wanted;
    s.tree = edge_tree(env, out, mesh, edges);
    qw_probes probes = {0};
    for (uint32_t i; qw_next_probe(&probes, s.samples, &i);) probes.effort += nearest_edge(&s, i).looked;
    s.samples = qw_affordable(&probes, s.samples);
    s.distance = QW_NEW(env, float, s.samples);
    qw_parallel(env, s.samples, QW_GRAIN, sample_curves, &s);
    double sum = 0;
    for (uint32_t i = 0; i < s.samples; i++) sum += s.distance[i];
    quality->sharp_mean = sum / s.samples / edge;
    quality->sharp_p95 = qw_percentile(s.distance, s.samples, 0.95) / edge;
}

void qw_measure_distances(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_mesh_view *against, const qw_sides *sides, qw_quality *quality)
{
    assert(quality->mean_edge > 0);
    qw_scope_begin(env);
    qw_polygon_edges input = qw_find_polygon_edges(env, against);
    qw_frame frame = qw_common_frame(mesh, against);
    double edge = quality->mean_edge * frame.scale;
    qw_surface out = qw_surface_make(env, mesh, edges->face_begin, &frame),
               in = qw_surface_make(env, against, input.face_begin, &frame);
    if (out.mesh.face_count > 0 && in.mesh.face_count > 0) {
        spread there = distance_between(env, &out, &in), back = distance_between(env, &in, &out);
        quality->out_to_in_mean = there.mean / edge;
        quality->in_to_out_mean = back.mean / edge;
        quality->chamfer = 0.5 * (there.mean + back.mean) / edge;
        quality->hausdorff_p999 = fmax(there.p999, back.p999) / edge;
        quality->hausdorff = fmax(there.most, back.most) / edge;
        count_both(env, &out, &in, against, sides, &frame, mesh->face_count, (float)edge, quality);
        measure_sharp(env, &out, mesh, edges, &in, against, sides ? sides->seen : NULL, edge, quality);
        qw_measure_shape(env, mesh, edges, &out, against, &in, frame.scale, quality);
    }
    qw_scope_end(env);
}
