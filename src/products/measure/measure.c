/* Topology and quality of a polygon mesh.
 *
 * Topology sorts the half-edges by their two vertices and joins what meets along an edge: faces give components,
 * corners give fans (the sheets around a vertex), ends of boundary edges give loops. Quality looks at the quads only,
 * in the input's own doubles times a power of two, so that neither tiny nor huge coordinates lose anything. Distances
 * are in distance.c.
 */
#include "products/measure/measure.h"

#include "base/hash.h"
#include "base/sets.h"
#include "base/elementary.h"
#include "base/sort.h"
#include "products/measure/base_complex.h"
#include "products/measure/distance.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* ---- topology */

/* What is counted side by side: each part has members of the topology and scratch of its own. */
typedef struct topology_task {
    const qw_mesh_view *mesh;
    const qw_polygon_edges *edges;
    qw_topology *topology;
    uint32_t *fan, *loop; /* sets of corners, uint32_t[corner_count] */
    uint8_t *fans;        /* uint8_t[vertex_count]: 0, 1, or 2 for more */
    uint8_t *seen;        /* uint8_t[corner_count]: fans with boundary edges */
    uint32_t *component;  /* sets of faces, uint32_t[face_count] */
    uint64_t *corners;    /* uint64_t[corner_count], sorted face by face */
    qw_hash_table faces;  /* by their corners */
    qw_valences valences;
} topology_task;

typedef struct wanted_face {
    const topology_task *t;
    uint32_t face;
} wanted_face;

static bool is_same_face(const void *wanted, uint32_t g)
{
    const wanted_face *w = wanted;
    const uint32_t *begin = w->t->edges->face_begin, n = begin[g + 1] - begin[g];
    return n == begin[w->face + 1] - begin[w->face] &&
           !memcmp(w->t->corners + begin[g], w->t->corners + begin[w->face], n * sizeof *w->t->corners);
}

/* Faces that repeat a vertex, and faces with the same corners as an earlier one, in any order. */
static void count_bad_faces(const topology_task *t)
{
    const qw_polygon_edges *edges = t->edges;
    for (uint32_t c = 0; c < edges->corner_count; c++) t->corners[c] = t->mesh->corners[c];
    for (uint32_t f = 0; f < t->mesh->face_count; f++) {
        uint64_t *c = t->corners + edges->face_begin[f];
        uint32_t n = edges->face_begin[f + 1] - edges->face_begin[f];
        qw_sort_u64(c, n);
        bool repeats = false;
        uint64_t hash = n;
        for (uint32_t i = 0; i < n; i++) {
            repeats = repeats || (i && c[i] == c[i - 1]);
            hash = qw_mix(hash ^ c[i]);
        }
        t->topology->degenerate_faces += repeats;
        uint32_t *slot = qw_hash_slot(&t->faces, hash, is_same_face, &(wanted_face){t, f});
        if (*slot == QW_NONE) *slot = f;
        else t->topology->duplicate_faces++;
    }
}

/* Directions of the edge with more than one half-edge: 0, 1 or 2. */
static int64_t count_directions(const qw_mesh_view *mesh, const qw_polygon_edges *edges, uint32_t e)
{
    assert(e < edges->edge_count);
    uint32_t first = edges->sorted[edges->edge_begin[e]], count = edges->edge_begin[e + 1] - edges->edge_begin[e],
             along = 0;
    for (uint32_t i = edges->edge_begin[e]; i < edges->edge_begin[e + 1]; i++)
        along += mesh->corners[edges->sorted[i]] == mesh->corners[first];
    return (along > 1) + (count - along > 1);
}

/* What an edge tells by itself, and the components, which faces share that meet along an edge. */
static void count_edges(const topology_task *t)
{
    assert(t->component && t->topology);
    const qw_polygon_edges *edges = t->edges;
    qw_topology *topology = t->topology;
    qw_sets_begin(t->component, t->mesh->face_count);
    topology->components = t->mesh->face_count;
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        uint32_t begin = edges->edge_begin[e], count = edges->edge_begin[e + 1] - begin,
                 f = edges->face[edges->sorted[begin]];
        topology->boundary_edges += count == 1;
        topology->nonmanifold_edges += count > 2;
        topology->inconsistent_edges += count_directions(t->mesh, edges, e);
        for (uint32_t i = 1; i < count; i++)
            topology->components -= qw_join_sets(t->component, f, edges->face[edges->sorted[begin + i]]);
    }
}

/* Joins the corners that share a fan. */
static void join_fans(const topology_task *t)
{
    const qw_polygon_edges *edges = t->edges;
    qw_sets_begin(t->fan, edges->corner_count);
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        uint32_t begin = edges->edge_begin[e];
        if (edges->edge_begin[e + 1] - begin != 2) continue;
        uint32_t c = edges->sorted[begin], d = edges->sorted[begin + 1];
        uint32_t after_c = qw_polygon_next(edges, c), after_d = qw_polygon_next(edges, d);
        bool same = t->mesh->corners[c] == t->mesh->corners[d];
        qw_join_sets(t->fan, c, same ? d : after_d);
        qw_join_sets(t->fan, after_c, same ? after_d : d);
    }
}

/* Euler's number with a vertex for each fan, non-manifold vertices, and those of no face. */
static void count_fans(const topology_task *t)
{
    qw_topology *topology = t->topology;
    join_fans(t);
    topology->euler = topology->faces - topology->edges;
    for (uint32_t c = 0; c < t->edges->corner_count; c++) {
        if (qw_set_of(t->fan, c) != c) continue;
        uint8_t *n = &t->fans[t->mesh->corners[c]];
        topology->euler++;
        if (*n == 1) topology->nonmanifold_vertices++;
        if (*n < 2) ++*n;
    }
    for (uint32_t v = 0; v < t->mesh->vertex_count; v++) topology->isolated_vertices += t->fans[v] == 0;
}

/* Boundary loops: the fans that boundary edges meet, less the edges that join two of them. */
static void count_loops(const topology_task *t)
{
    const qw_polygon_edges *edges = t->edges;
    qw_sets_begin(t->loop, edges->corner_count);
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        if (edges->edge_begin[e + 1] - edges->edge_begin[e] != 1) continue;
        uint32_t c = edges->sorted[edges->edge_begin[e]], a = qw_set_of(t->fan, c),
                 b = qw_set_of(t->fan, qw_polygon_next(edges, c));
        t->topology->boundary_loops += !t->seen[a];
        t->seen[a] = 1;
        t->topology->boundary_loops += !t->seen[b];
        t->seen[b] = 1;
        t->topology->boundary_loops -= qw_join_sets(t->loop, a, b);
    }
}

/* Irregular vertices inside and on the boundary, and how many have which valence. */
static void count_valences(const topology_task *t)
{
    qw_count_valences(t->mesh, t->edges, &t->valences);
    for (uint32_t v = 0; v < t->mesh->vertex_count; v++) {
        uint32_t n = t->valences.valence[v];
        if (n == 0) continue;
        if (t->valences.on_boundary[v]) {
            t->topology->irregular_boundary += n != 3;
        } else {
            t->topology->irregular += n != 4;
            t->topology->valence[n < 9 ? n : 9]++;
        }
    }
}

enum { TOPOLOGY_PARTS = 4 };

/* The longest first. */
static void count_part(void *user, uint32_t part, uint32_t end)
{
    (void)end;
    const topology_task *t = user;
    if (part == 0) count_fans(t), count_loops(t);
    if (part == 1) count_edges(t);
    if (part == 2) count_bad_faces(t);
    if (part == 3) count_valences(t);
}

/* Counts all that there is of topology; its parts are counted side by side. */
static void measure_topology(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                             qw_topology *topology)
{
    assert(edges->face_begin && topology);
    *topology = (qw_topology){.vertices = mesh->vertex_count, .edges = edges->edge_count, .faces = mesh->face_count};
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t n = edges->face_begin[f + 1] - edges->face_begin[f];
        *(n == 4 ? &topology->quads : n == 3 ? &topology->triangles : &topology->other_polygons) += 1;
    }
    qw_scope_begin(env);
    topology_task t = {.mesh = mesh, .edges = edges, .topology = topology};
    t.fan = QW_NEW(env, uint32_t, edges->corner_count);
    t.loop = QW_NEW(env, uint32_t, edges->corner_count);
    t.fans = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count);
    t.seen = QW_NEW_ZERO(env, uint8_t, edges->corner_count);
    t.component = QW_NEW(env, uint32_t, mesh->face_count);
    t.corners = QW_NEW(env, uint64_t, edges->corner_count);
    t.faces = qw_hash_table_create(env, mesh->face_count);
    t.valences = qw_begin_valences(env, mesh);
    qw_parallel(env, TOPOLOGY_PARTS, 1, count_part, &t);
    qw_scope_end(env);
}

/* ---- quality */

/* Sums for a mean and a deviation, about a value near the mean. */
typedef struct moments {
    double about, count, sum, squares;
} moments;

static inline void add_moment(moments *m, double x)
{
    x -= m->about;
    m->count += 1;
    m->sum += x;
    m->squares += x * x;
}

static void merge_moments(moments *m, const moments *other)
{
    m->count += other->count;
    m->sum += other->sum;
    m->squares += other->squares;
}

static double mean_of(const moments *m) { return m->about + m->sum / m->count; }

static double variation_of(const moments *m)
{
    double shift = m->sum / m->count, variance = m->squares / m->count - shift * shift;
    return sqrt(variance > 0 ? variance : 0) / fmax(mean_of(m), 1e-300);
}

/* One block's share of the figures. */
typedef struct corner_sums {
    moments edge, area;
    double angle_squares, least_jacobian, jacobians, aspects, most_aspect, most_warp;
    int64_t negative, low;
} corner_sums;

typedef struct quality_task {
    const qw_mesh_view *mesh;
    const qw_polygon_edges *edges;
    const uint32_t *quads; /* faces with four corners */
    double scale;          /* a power of two */
    double first_edge, first_area;
    float *deviation; /* float[4 quads]: |angle - 90| */
    corner_sums *blocks;
} quality_task;

static double quad_area(const qw_dvec3 p[4])
{
    qw_dvec3 d = qw_dsub(p[2], p[0]);
    double one = qw_dlength(qw_dcross(qw_dsub(p[1], p[0]), d)), two = qw_dlength(qw_dcross(d, qw_dsub(p[3], p[0])));
    return 0.5 * (one + two);
}

static void load_quad(const quality_task *t, uint32_t quad, qw_dvec3 p[4])
{
    const uint32_t *c = t->mesh->corners + t->edges->face_begin[t->quads[quad]];
    for (int k = 0; k < 4; k++) p[k] = qw_dpoint(t->mesh, c[k], t->scale);
}

/* Below it a solver may do badly. */
static const double LOW_JACOBIAN = 0.3;

/* Adds what Verdict calls scaled Jacobian, aspect ratio and warpage of a quad. */
static void add_shape(corner_sums *s, const qw_dvec3 p[4], double jacobian)
{
    qw_dvec3 side[4], normal[4];
    double longest = 0, all = 0;
    for (int k = 0; k < 4; k++) {
        side[k] = qw_dsub(p[(k + 1) & 3], p[k]);
        double length = qw_dlength(side[k]);
        longest = fmax(longest, length), all += length;
    }
    for (int k = 0; k < 4; k++) {
        qw_dvec3 n = qw_dcross(side[(k + 3) & 3], side[k]);
        normal[k] = qw_dscale(n, 1 / fmax(qw_dlength(n), 1e-300));
    }
    double areas = qw_dlength(qw_dcross(side[0], side[1])) + qw_dlength(qw_dcross(side[2], side[3]));
    double aspect = 0.5 * longest * all / fmax(areas, 1e-300 * longest * longest);
    double bend = fmin(qw_ddot(normal[0], normal[2]), qw_ddot(normal[1], normal[3]));
    s->jacobians += jacobian, s->low += jacobian < LOW_JACOBIAN;
    s->aspects += aspect, s->most_aspect = fmax(s->most_aspect, aspect);
    s->most_warp = fmax(s->most_warp, fmax(1 - bend * bend * bend, 0));
}

/* Sums of a block of quads, which are added up in their order. */
static void measure_quads(void *user, uint32_t begin, uint32_t end)
{
    const quality_task *t = user;
    corner_sums s = {.edge.about = t->first_edge, .area.about = t->first_area, .least_jacobian = DBL_MAX};
    for (uint32_t q = begin; q < end; q++) {
        qw_dvec3 p[4];
        load_quad(t, q, p);
        qw_dvec3 n = qw_dcross(qw_dsub(p[2], p[0]), qw_dsub(p[3], p[1]));
        n = qw_dscale(n, 1 / fmax(qw_dlength(n), 1e-300));
        double least = DBL_MAX;
        for (int k = 0; k < 4; k++) {
            qw_dvec3 ahead = qw_dsub(p[(k + 1) & 3], p[k]), back = qw_dsub(p[(k + 3) & 3], p[k]);
            double lengths = qw_dlength(ahead) * qw_dlength(back), turn = qw_ddot(qw_dcross(ahead, back), n);
            double cosine = lengths > 0 ? fmin(fmax(qw_ddot(ahead, back) / lengths, -1), 1) : 1;
            double off = qw_acos(cosine) * (180 / QW_PI) - 90;
            add_moment(&s.edge, qw_dlength(ahead));
            s.angle_squares += off * off;
            t->deviation[4 * (size_t)q + (size_t)k] = (float)fabs(off);
            s.negative += turn < 0;
            least = fmin(least, turn / fmax(lengths, 1e-300));
        }
        s.least_jacobian = fmin(s.least_jacobian, least);
        add_shape(&s, p, least);
        add_moment(&s.area, quad_area(p));
    }
    t->blocks[begin / QW_GRAIN_LIGHT] = s;
}

/* Sums up edges, angles, areas and Jacobians of all quads, block by block, and sets their means and extremes. */
static void measure_corners(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, double scale,
                            int64_t quad_count, qw_quality *quality)
{
    assert(quad_count > 0 && edges->face_begin);
    qw_scope_begin(env);
    uint32_t count = (uint32_t)quad_count, blocks = qw_block_count(count, QW_GRAIN_LIGHT),
             *quads = QW_NEW(env, uint32_t, count), n = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++)
        if (edges->face_begin[f + 1] - edges->face_begin[f] == 4) quads[n++] = f;
    quality_task t = {.mesh = mesh, .edges = edges, .quads = quads, .scale = scale};
    t.deviation = QW_NEW(env, float, 4 * (size_t)count);
    t.blocks = QW_NEW(env, corner_sums, blocks);
    qw_dvec3 first[4];
    load_quad(&t, 0, first);
    t.first_edge = qw_dlength(qw_dsub(first[1], first[0]));
    t.first_area = quad_area(first);
    qw_parallel(env, count, QW_GRAIN_LIGHT, measure_quads, &t);
    corner_sums all = t.blocks[0];
    for (uint32_t b = 1; b < blocks; b++) {
        merge_moments(&all.edge, &t.blocks[b].edge);
        merge_moments(&all.area, &t.blocks[b].area);
        all.angle_squares += t.blocks[b].angle_squares;
        all.negative += t.blocks[b].negative;
        all.least_jacobian = fmin(all.least_jacobian, t.blocks[b].least_jacobian);
        all.jacobians += t.blocks[b].jacobians, all.low += t.blocks[b].low, all.aspects += t.blocks[b].aspects;
        all.most_aspect = fmax(all.most_aspect, t.blocks[b].most_aspect);
        all.most_warp = fmax(all.most_warp, t.blocks[b].most_warp);
    }
    quality->angle_rms = sqrt(all.angle_squares / (4.0 * count));
    quality->angle_p99 = qw_percentile(t.deviation, 4 * (size_t)count, 0.99);
    quality->area_cv = variation_of(&all.area);
    quality->mean_edge = mean_of(&all.edge) / scale;
    quality->edge_cv = variation_of(&all.edge);
    quality->min_scaled_jacobian = all.least_jacobian;
    quality->mean_scaled_jacobian = all.jacobians / count;
    quality->low_jacobian = (double)all.low / count;
    quality->mean_aspect = all.aspects / count, quality->max_aspect = all.most_aspect;
    quality->max_warp = all.most_warp;
    quality->negative_corners = all.negative;
    qw_scope_end(env);
}

/* Of a mesh without quads: its lengths are still a unit for the distances. */
static void measure_edges(const qw_mesh_view *mesh, const qw_polygon_edges *edges, double scale, qw_quality *quality)
{
    moments m = {0};
    for (uint32_t c = 0; c < edges->corner_count; c++) {
        qw_dvec3 a = qw_dpoint(mesh, mesh->corners[c], scale),
                 b = qw_dpoint(mesh, mesh->corners[qw_polygon_next(edges, c)], scale);
        double length = qw_dlength(qw_dsub(b, a));
        if (c == 0) m.about = length;
        add_moment(&m, length);
    }
    quality->mean_edge = mean_of(&m) / scale;
    quality->edge_cv = variation_of(&m);
}

/* Patches, chords, those that cross themselves, the longest, and the share of simple ones. */
static void measure_loops(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, qw_quality *quality)
{
    qw_scope_begin(env);
    qw_base_complex b = qw_find_base_complex(env, mesh, edges);
    quality->patches = b.patches;
    quality->patch_share = (double)b.patches / b.quads;
    quality->chords = b.chord_count;
    quality->crossing = b.crossing;
    uint32_t longest = b.length[0];
    if (b.crossing < b.chord_count && b.length[b.crossing] > longest) longest = b.length[b.crossing];
    quality->chord_max = longest / sqrt((double)b.quads);
    quality->simple = qw_simple_share(&b, mesh);
    qw_scope_end(env);
}

static const qw_quality nothing_measured = {
#define QW_QUALITY_REAL(name, unit, text)   .name = -1,
#define QW_QUALITY_SIGNED(name, unit, text) .name = -1,
#define QW_QUALITY_WHOLE(name, unit, text)  .name = -1,
#include "quadwright/report.def"
};

void qw_measure_mesh(qw_env *env, const qw_mesh_view *mesh, const qw_mesh_view *against, const qw_sides *sides,
                     qw_topology *topology, qw_quality *quality)
{
    assert(topology && quality);
    *quality = nothing_measured;
    qw_scope_begin(env);
    qw_polygon_edges edges = qw_find_polygon_edges(env, mesh);
    measure_topology(env, mesh, &edges, topology);
    if (mesh->face_count > 0) {
        double scale = qw_common_frame(mesh, NULL).scale;
        if (topology->quads > 0) measure_corners(env, mesh, &edges, scale, topology->quads, quality);
        else measure_edges(mesh, &edges, scale, quality);
        if (topology->quads > 0) measure_loops(env, mesh, &edges, quality);
        if (against && quality->mean_edge > 0) qw_measure_distances(env, mesh, &edges, against, sides, quality);
    }
    qw_scope_end(env);
}
