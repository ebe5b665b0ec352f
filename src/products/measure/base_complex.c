/* Lines go straight on by next, twin, next: on a regular vertex that is a permutation of the half-edges, so that all
 * lines together visit each half-edge at most once. Patches and chords are sets joined across edges.
 */
#include "products/measure/base_complex.h"

#include "base/sets.h"
#include "base/sort.h"
#include "geometry/edges.h"
#include "geometry/quadmesh.h"

#include <assert.h>

/* Lists the faces of four corners, and these corners. */
static void find_quads(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, qw_base_complex *b)
{
    for (uint32_t f = 0; f < mesh->face_count; f++) b->quads += edges->face_begin[f + 1] - edges->face_begin[f] == 4;
    b->face = QW_NEW(env, uint32_t, b->quads);
    b->corner = QW_NEW(env, uint32_t, 4 * (size_t)b->quads);
    uint32_t q = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t begin = edges->face_begin[f];
        if (edges->face_begin[f + 1] - begin != 4) continue;
        for (uint32_t i = 0; i < 4; i++) b->corner[4 * (size_t)q + i] = mesh->corners[begin + i];
        b->face[q++] = f;
    }
}

typedef struct grid_vertices {
    uint8_t *rim;     /* uint8_t[vertex_count]: on a boundary of the quads */
    uint8_t *special; /* uint8_t[vertex_count] */
} grid_vertices;

/* Which vertices are irregular, and which lie on a rim. */
static grid_vertices find_special(qw_env *env, const qw_base_complex *b, uint32_t vertex_count)
{
    assert(b->corner && b->twin);
    grid_vertices v = {QW_NEW_ZERO(env, uint8_t, vertex_count), QW_NEW_ZERO(env, uint8_t, vertex_count)};
    uint32_t *valence = QW_NEW_ZERO(env, uint32_t, vertex_count);
    for (uint32_t h = 0; h < 4 * b->quads; h++) {
        valence[b->corner[h]]++;
        if (b->twin[h] == QW_NONE) v.rim[b->corner[h]] = v.rim[b->corner[qw_quad_next(h)]] = 1;
    }
    for (uint32_t i = 0; i < vertex_count; i++) v.special[i] = valence[i] > 0 && valence[i] != (v.rim[i] ? 2 : 4);
    qw_free(env, valence);
    return v;
}

/* Marks of the mesh become lines; where they end, turn or cross, and at marked corners, vertices are special. */
static void take_creases(qw_env *env, qw_base_complex *b, const qw_mesh_view *mesh, grid_vertices *v)
{
    uint32_t count = mesh->marked_edge_count, *edges = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count);
    uint64_t *key = QW_NEW(env, uint64_t, (size_t)count + 1);
    for (uint32_t m = 0; m < count; m++) {
        uint32_t from = mesh->marked_edges[2 * (size_t)m], to = mesh->marked_edges[2 * (size_t)m + 1];
        key[m] = qw_pair_key(from, to);
        if (from == to) v->special[from] = 1;
    }
    qw_sort_u64(key, count);
    for (uint32_t h = 0; h < 4 * b->quads; h++) {
        uint64_t own = qw_pair_key(b->corner[h], b->corner[qw_quad_next(h)]);
        size_t at = qw_first_not_below(key, count, own);
        b->line[h] = at < count && key[at] == own;
        edges[b->corner[h]] += b->line[h];
    }
    for (uint32_t h = 0; h < 4 * b->quads; h++) {
        uint32_t across = b->twin[qw_quad_next(h)], end = b->corner[qw_quad_next(h)];
        if (b->line[h] && across != QW_NONE && !b->line[qw_quad_next(across)]) v->special[end] = 1;
        if (edges[end] > 2) v->special[end] = 1;
    }
    qw_free(env, key), qw_free(env, edges);
}

/* Marks the line that leaves along h, up to the vertex where it ends. */
static void mark_line(const qw_base_complex *b, const grid_vertices *v, uint32_t h)
{
    assert(h < 4 * b->quads);
    for (uint32_t steps = 0; steps < 4 * b->quads; steps++) {
        b->line[h] = 1;
        if (b->twin[h] != QW_NONE) b->line[b->twin[h]] = 1;
        uint32_t next = qw_quad_next(h), end = b->corner[next];
        if (v->special[end] || v->rim[end] || b->twin[next] == QW_NONE) return;
        h = qw_quad_next(b->twin[next]);
    }
}

static void find_lines(qw_env *env, qw_base_complex *b, const qw_mesh_view *mesh)
{
    grid_vertices v = find_special(env, b, mesh->vertex_count);
    b->line = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)b->quads);
    if (mesh->marked_edge_count > 0) take_creases(env, b, mesh, &v);
    for (uint32_t h = 0; h < 4 * b->quads; h++) {
        if (b->twin[h] == QW_NONE) b->line[h] = 1;
        if (v.special[b->corner[h]]) mark_line(b, &v, h);
    }
    qw_free(env, v.rim), qw_free(env, v.special);
}

static void count_patches(qw_env *env, qw_base_complex *b)
{
    assert(b->line && b->twin);
    uint32_t *set = QW_NEW(env, uint32_t, b->quads);
    qw_sets_begin(set, b->quads);
    b->patches = b->quads;
    for (uint32_t h = 0; h < 4 * b->quads; h++)
        if (!b->line[h] && b->twin[h] != QW_NONE) b->patches -= qw_join_sets(set, h / 4, b->twin[h] / 4);
    qw_free(env, set);
}

/* The direction of its quad that half-edge h is crossed in, as 2 quad + direction. */
static uint32_t direction_of(uint32_t h) { return h / 4 * 2 + (h & 1); }

/* uint8_t[2 quads]: 1 at the root of a set that has both directions of a quad. */
static uint8_t *find_crossing(qw_env *env, qw_base_complex *b, uint32_t *set)
{
    uint8_t *crosses = QW_NEW_ZERO(env, uint8_t, 2 * (size_t)b->quads);
    for (uint32_t q = 0; q < b->quads; q++) {
        uint32_t root = qw_set_of(set, 2 * q);
        if (root != qw_set_of(set, 2 * q + 1)) continue;
        b->crossing += !crosses[root];
        crosses[root] = 1;
    }
    return crosses;
}

/* Gives the sets of directions numbers: those first that cross themselves, by falling size. */
static void number_chords(qw_env *env, qw_base_complex *b, uint32_t *set, uint32_t *size)
{
    uint64_t *order = QW_NEW(env, uint64_t, b->chord_count);
    uint8_t *crosses = find_crossing(env, b, set);
    uint32_t n = 0;
    for (uint32_t c = 0; c < 2 * b->quads; c++)
        if (size[c]) order[n++] = (uint64_t)(INT32_MAX - size[c]) << 32 | (uint64_t)!crosses[c] << 63 | c;
    assert(n == b->chord_count);
    qw_sort_u64(order, n);
    b->length = QW_NEW(env, uint32_t, n);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t root = (uint32_t)order[i];
        b->length[i] = size[root];
        size[root] = i; /* from here on its number */
    }
    for (uint32_t c = 0; c < 2 * b->quads; c++) b->chord[c] = size[qw_set_of(set, c)];
    qw_free(env, crosses), qw_free(env, order);
}

/* Numbers the chords, the rows of quads across opposite sides, and says for both directions of each quad which it
   is. */
static void find_chords(qw_env *env, qw_base_complex *b)
{
    uint32_t directions = 2 * b->quads;
    uint32_t *set = QW_NEW(env, uint32_t, directions), *size = QW_NEW_ZERO(env, uint32_t, directions);
    qw_sets_begin(set, directions);
    b->chord_count = directions;
    for (uint32_t h = 0; h < 4 * b->quads; h++)
        if (b->twin[h] != QW_NONE) b->chord_count -= qw_join_sets(set, direction_of(h), direction_of(b->twin[h]));
    for (uint32_t c = 0; c < directions; c++) size[qw_set_of(set, c)]++;
    b->chord = QW_NEW(env, uint32_t, directions);
    number_chords(env, b, set, size);
    qw_free(env, set), qw_free(env, size);
}

qw_base_complex qw_find_base_complex(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges)
{
    assert(edges->face_begin && edges->sorted);
    qw_base_complex b = {0};
    find_quads(env, mesh, edges, &b);
    uint32_t fault;
    b.twin = qw_find_twins(env, 4, b.corner, b.quads, mesh->vertex_count, &fault);
    find_lines(env, &b, mesh);
    count_patches(env, &b);
    find_chords(env, &b);
    return b;
}

double qw_simple_share(const qw_base_complex *b, const qw_mesh_view *mesh)
{
    assert(b->chord && b->corner);
    double all = 0, simple = 0, scale = qw_common_frame(mesh, NULL).scale;
    for (uint32_t q = 0; q < b->quads; q++) {
        qw_dvec3 p[4];
        for (uint32_t i = 0; i < 4; i++) p[i] = qw_dpoint(mesh, b->corner[4 * q + i], scale);
        double area = qw_dlength(qw_dcross(qw_dsub(p[2], p[0]), qw_dsub(p[3], p[1])));
        for (uint32_t i = 0; i < 2; i++) {
            all += area;
            if (b->chord[2 * q + i] >= b->crossing) simple += area;
        }
    }
    return all > 0 ? simple / all : 1;
}
