/* Edges, valences, box and percentiles: what all measures of polygon meshes share. */
#include "geometry/polygons.h"

#include <assert.h>
#include <float.h>
#include <string.h>

/* ---- edges */

/* Where each face's corners begin, and the face of each corner. Fails at empty faces and unknown vertices. */
static void find_faces(qw_env *env, const qw_mesh_view *mesh, qw_polygon_edges *edges)
{
    edges->face_begin = QW_NEW(env, uint32_t, (size_t)mesh->face_count + 1);
    uint64_t corners = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t size = mesh->face_sizes ? mesh->face_sizes[f] : mesh->uniform_face_size;
        if (size == 0) qw_fail(env, QW_ARGUMENT, f, "face %u has no corners", f);
        edges->face_begin[f] = (uint32_t)corners;
        corners += size;
        if (corners >= QW_NONE) qw_fail(env, QW_TOO_LARGE, f, "the faces have more corners than 32 bits can number");
    }
    edges->face_begin[mesh->face_count] = edges->corner_count = (uint32_t)corners;
    edges->face = QW_NEW(env, uint32_t, edges->corner_count);
    for (uint32_t f = 0; f < mesh->face_count; f++)
        for (uint32_t c = edges->face_begin[f]; c < edges->face_begin[f + 1]; c++) {
            edges->face[c] = f;
            if (mesh->corners[c] >= mesh->vertex_count)
                qw_fail(env, QW_INDEX_RANGE, f, "face %u names vertex %u of %u", f, mesh->corners[c],
                        mesh->vertex_count);
        }
}

typedef struct pair {
    uint32_t low, high;
} pair;

static pair ends_of(const qw_mesh_view *mesh, const qw_polygon_edges *edges, uint32_t c)
{
    uint32_t a = mesh->corners[c], b = mesh->corners[qw_polygon_next(edges, c)];
    return (pair){a < b ? a : b, a < b ? b : a};
}

/* One stable pass of a radix sort with a digit a vertex. place: uint32_t[vertex_count + 1], scratch. */
static void sort_pass(const pair *ends, bool by_high, const uint32_t *from, uint32_t *to, uint32_t count,
                      uint32_t *place, uint32_t vertex_count)
{
    assert(ends || count == 0);
    memset(place, 0, ((size_t)vertex_count + 1) * sizeof *place);
    for (uint32_t i = 0; i < count; i++) place[(by_high ? ends[i].high : ends[i].low) + 1]++;
    for (uint32_t v = 0; v < vertex_count; v++) place[v + 1] += place[v];
    for (uint32_t i = 0; i < count; i++) {
        uint32_t c = from ? from[i] : i;
        to[place[by_high ? ends[c].high : ends[c].low]++] = c;
    }
}

qw_polygon_edges qw_find_polygon_edges(qw_env *env, const qw_mesh_view *mesh)
{
    qw_polygon_edges edges = {0};
    find_faces(env, mesh, &edges);
    uint32_t n = edges.corner_count;
    edges.sorted = QW_NEW(env, uint32_t, n);
    edges.edge_begin = QW_NEW(env, uint32_t, (size_t)n + 1);
    qw_scope_begin(env);
    pair *ends = QW_NEW(env, pair, n);
    uint32_t *half = QW_NEW(env, uint32_t, n), *place = QW_NEW(env, uint32_t, (size_t)mesh->vertex_count + 1);
    for (uint32_t c = 0; c < n; c++) ends[c] = ends_of(mesh, &edges, c);
    sort_pass(ends, true, NULL, half, n, place, mesh->vertex_count);
    sort_pass(ends, false, half, edges.sorted, n, place, mesh->vertex_count);
    for (uint32_t i = 0; i < n; i++) {
        pair now = ends[edges.sorted[i]];
        pair before = i ? ends[edges.sorted[i - 1]] : (pair){QW_NONE, QW_NONE};
        edges.edge_begin[edges.edge_count] = i; /* stays where this is the first half-edge of its edge */
        edges.edge_count += now.low != before.low || now.high != before.high;
    }
    edges.edge_begin[edges.edge_count] = n;
    qw_scope_end(env);
    return edges;
}

uint32_t *qw_polygon_twins(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, uint32_t *fault)
{
    uint32_t *twin = QW_NEW(env, uint32_t, edges->corner_count);
    memset(twin, 0xff, edges->corner_count * sizeof *twin);
    *fault = QW_NONE;
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        const uint32_t *side = edges->sorted + edges->edge_begin[e];
        uint32_t count = edges->edge_begin[e + 1] - edges->edge_begin[e];
        if (count == 1) continue;
        if (count > 2 || mesh->corners[side[0]] == mesh->corners[side[1]])
            *fault = *fault == QW_NONE ? side[0] : *fault;
        else twin[side[0]] = side[1], twin[side[1]] = side[0];
    }
    return twin;
}

void qw_count_valences(const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_valences *v)
{
    assert(v->valence && v->on_boundary);
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        pair ends = ends_of(mesh, edges, edges->sorted[edges->edge_begin[e]]);
        v->valence[ends.low]++;
        v->valence[ends.high]++;
        if (edges->edge_begin[e + 1] - edges->edge_begin[e] == 1)
            v->on_boundary[ends.low] = v->on_boundary[ends.high] = 1;
    }
}

qw_valences qw_begin_valences(qw_env *env, const qw_mesh_view *mesh)
{
    return (qw_valences){QW_NEW_ZERO(env, uint32_t, mesh->vertex_count), QW_NEW_ZERO(env, uint8_t, mesh->vertex_count)};
}

qw_valences qw_find_valences(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges)
{
    qw_valences v = qw_begin_valences(env, mesh);
    qw_count_valences(mesh, edges, &v);
    return v;
}

/* ---- frame */

/* Makes a box large enough for all vertices that faces name. */
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

/* ---- percentiles */

/* Non-negative floats are ordered as their bits. Their digits of eleven bits, or ten, from the highest down: of the
   values that agree with the wanted one so far as many are counted as have each digit. */
static double value_of_rank(const float *values, size_t count, size_t rank)
{
    assert(rank < count);
    enum { DIGITS = 1 << 11 };
    uint32_t found = 0, known = 0; /* the wanted bits, and which of them are known */
    for (int shift = 21; shift >= -1; shift -= 11) {
        int low = shift < 0 ? 0 : shift;
        uint32_t digit = shift < 0 ? DIGITS / 2 - 1 : DIGITS - 1, bins[DIGITS] = {0};
        for (size_t i = 0; i < count; i++) {
            uint32_t bits;
            memcpy(&bits, &values[i], sizeof bits);
            if ((bits & known) == found) bins[bits >> low & digit]++;
        }
        uint32_t d = 0;
        while (rank >= bins[d]) rank -= bins[d++];
        found |= d << low, known |= digit << low;
    }
    float value;
    memcpy(&value, &found, sizeof value);
    return value;
}

double qw_percentile(const float *values, size_t count, double share)
{
    assert(count > 0 && share >= 0 && share <= 1);
    double place = share * (double)(count - 1);
    size_t rank = (size_t)place;
    double a = value_of_rank(values, count, rank), b = rank + 1 < count ? value_of_rank(values, count, rank + 1) : a;
    return a + (b - a) * (place - (double)rank);
}
