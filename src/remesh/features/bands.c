/* Curve edges are looked at in pairs that an edge of the mesh connects, or two at a vertex between, as the mesh is
 * about as fine as curves may be close. Edges of curves connect none: what lies on both sides of the foot of a rib, at
 * its end, is not beside it. */
#include "remesh/features/bands.h"

#include "base/sets.h"
#include "base/sort.h"

#include <assert.h>
#include <math.h>

/* Cosine of a quarter of a right angle: wider sectors are kept open, see remesh/field/sectors.c. */
static const float PARALLEL = 0.92387953f;
/* Of `least`: below a fifth of an edge a row of quads would be too thin; see remesh/quantise/narrow_bands.h for wider
 * ones. */
static const float CLOSE = 0.4f;
static const float OVERLAP = 0.25f; /* of the shorter edge that must lie beside the other */
/* Each neighbour of a vertex is compared with so many that follow it around the vertex. */
enum { MOST_AROUND = 64 };
/* Widths, as multiples of CLOSE, of bands that have room or none as a whole. */
static const float THINNEST = 0.5f, WIDEST = 2;

/* Two curve edges side by side. */
typedef struct pair {
    uint32_t band;
    float width, overlap; /* in units of CLOSE times `least`; in units of the mesh */
} pair;

/* Sums over the bands that are decided together, kept at the first of them. */
typedef struct total {
    float length, narrow;  /* of places that are side by side, and of those of them that are too narrow */
    float thinnest, cover; /* the least width, and the least share of an arc that lies in its band */
} total;

typedef struct finder {
    const qw_trimesh *mesh;
    const uint32_t *outgoing;
    const qw_feature_graph *graph;
    const float *least;
    uint64_t *key; /* uint64_t[count], ascending: lower half-edges of the pairs */
    pair *pair;    /* pair[count] */
    size_t count;
    uint64_t *band; /* uint64_t[bands], ascending: the two arcs of each, qw_pair_key */
    size_t bands;
    uint32_t *whole; /* uint32_t[bands]: sets of those that are one */
    total *total;    /* total[bands] */
    uint32_t *at[2]; /* room for the curve edges at a vertex */
} finder;

/* ---- pairs */

/* The distance between two edges where they lie side by side, and how long that is; INFINITY where they do not. */
static pair side_by_side(const qw_trimesh *mesh, uint32_t a, uint32_t b)
{
    assert(a < 3 * mesh->face_count && b < 3 * mesh->face_count);
    const pair none = {.width = INFINITY};
    qw_vec3 p = mesh->position[mesh->corner[a]], da = qw_edge_way(mesh, a), db = qw_edge_way(mesh, b);
    float la = qw_length(da), lb = qw_length(db);
    if (!(la > 0 && lb > 0)) return none;
    qw_vec3 d = qw_scale(da, 1 / la);
    float turn = qw_dot(d, db) / lb;
    if (fabsf(turn) < PARALLEL) return none;
    qw_vec3 from = qw_sub(mesh->position[mesh->corner[b]], p), to = qw_add(from, db);
    float x = qw_dot(from, d), y = qw_dot(to, d), low = fmaxf(fminf(x, y), 0), high = fminf(fmaxf(x, y), la);
    if (high - low < OVERLAP * fminf(la, lb)) return none;
    float middle = (low + high) / 2, t = fabsf(y - x) > 0 ? (middle - x) / (y - x) : 0;
    return (pair){.width = qw_length(qw_sub(qw_madd(from, t, db), qw_scale(d, middle))), .overlap = high - low};
}

/* Half the wanted edge length around an edge, times CLOSE. */
static float limit_at(const finder *f, uint32_t h)
{
    return CLOSE * (f->least[f->mesh->corner[h]] + f->least[f->mesh->corner[qw_next(h)]]) / 2;
}

static pair measure(const finder *f, uint64_t key)
{
    uint32_t a = (uint32_t)(key >> 32), b = (uint32_t)key;
    pair p = side_by_side(f->mesh, a, b);
    p.width /= (limit_at(f, a) + limit_at(f, b)) / 2;
    return p;
}

/* Adds the pair of marked half-edges that face each other, if a band between them is narrow enough; on the first
 * call, when there are no keys yet, it only counts. */
static void add_pair(finder *f, uint32_t a, uint32_t b)
{
    assert(a < 3 * f->mesh->face_count && b < 3 * f->mesh->face_count);
    uint32_t ra = f->graph->arc_of[a], rb = f->graph->arc_of[b];
    /* side by side from one node on they are an acute corner: one of them gives way there, but only near the corner
       (remesh/quantise/acute_corners.h) */
    if (ra == rb || qw_arcs_share_node(f->graph, ra, rb)) return;
    uint64_t key = qw_pair_key(qw_lower_half(f->mesh, a), qw_lower_half(f->mesh, b));
    if (!(measure(f, key).width < WIDEST)) return;
    if (f->key) f->key[f->count] = key;
    f->count++;
}

/* All curve edges at one vertex against all at the other. */
static void add_pairs_at(finder *f, uint32_t u, uint32_t v)
{
    if (!f->graph->degree[u] || !f->graph->degree[v] || u == v) return;
    uint32_t m = qw_curves_at(f->graph, f->mesh, f->outgoing, u, f->at[0]),
             n = qw_curves_at(f->graph, f->mesh, f->outgoing, v, f->at[1]);
    for (uint32_t i = 0; i < m; i++)
        for (uint32_t k = 0; k < n; k++) add_pair(f, f->at[0][i], f->at[1][k]);
}

/* All at each neighbour of a vertex that lies on no curve against all at the others. */
static void add_pairs_around(finder *f, uint32_t v)
{
    assert(v < f->mesh->vertex_count);
    const qw_trimesh *mesh = f->mesh;
    uint32_t first = f->outgoing[v], h = first;
    do {
        uint32_t u = mesh->corner[qw_next(h)], left = f->graph->degree[u] ? MOST_AROUND : 0;
        for (uint32_t k = qw_around(mesh, h); k != first && left-- > 0; k = qw_around(mesh, k))
            add_pairs_at(f, u, mesh->corner[qw_next(k)]);
        h = qw_around(mesh, h);
    } while (h != first);
}

static void add_pairs(finder *f)
{
    const qw_trimesh *mesh = f->mesh;
    f->count = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (qw_lower_half(mesh, h) == h && f->graph->arc_of[h] == QW_NONE)
            add_pairs_at(f, mesh->corner[h], mesh->corner[qw_next(h)]);
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (!f->graph->degree[v]) add_pairs_around(f, v);
}

/* ---- bands */

/* The place of a band; bands: there is none. */
static size_t find_band(const finder *f, uint32_t a, uint32_t b)
{
    uint64_t key = qw_pair_key(a, b);
    size_t low = qw_first_not_below(f->band, f->bands, key);
    return low < f->bands && f->band[low] == key ? low : f->bands;
}

/* Gathers the pairs by the two arcs on whose edges they lie: each two arcs make one band. */
static void make_bands(qw_env *env, finder *f)
{
    const uint32_t *arc_of = f->graph->arc_of;
    f->band = QW_NEW(env, uint64_t, f->count), f->pair = QW_NEW(env, pair, f->count);
    for (size_t i = 0; i < f->count; i++)
        f->band[i] = qw_pair_key(arc_of[f->key[i] >> 32], arc_of[(uint32_t)f->key[i]]);
    f->bands = qw_sort_once(f->band, f->count);
    f->whole = QW_NEW(env, uint32_t, f->bands), f->total = QW_NEW(env, total, f->bands);
    qw_sets_begin(f->whole, (uint32_t)f->bands);
    for (size_t i = 0; i < f->count; i++) {
        f->pair[i] = measure(f, f->key[i]);
        f->pair[i].band = (uint32_t)find_band(f, arc_of[f->key[i] >> 32], arc_of[(uint32_t)f->key[i]]);
    }
}

/* A band that ends at nodes u and v, by arcs from there; bands: none does. */
static size_t band_at(const finder *f, uint32_t u, uint32_t v, bool joins)
{
    assert(u < f->mesh->vertex_count && v < f->mesh->vertex_count);
    uint32_t m = qw_curves_at(f->graph, f->mesh, f->outgoing, u, f->at[0]),
             n = qw_curves_at(f->graph, f->mesh, f->outgoing, v, f->at[1]);
    size_t first = f->bands;
    for (uint32_t i = 0; i < m; i++)
        for (uint32_t k = 0; k < n; k++) {
            size_t band = find_band(f, f->graph->arc_of[f->at[0][i]], f->graph->arc_of[f->at[1][k]]);
            if (band == f->bands) continue;
            if (first == f->bands) first = band;
            else if (joins) qw_join_sets(f->whole, (uint32_t)first, (uint32_t)band);
        }
    return first;
}

/* The band across whose end an arc lies, which is as long as the band is wide; bands: it lies across none. */
static size_t band_of_end(const finder *f, const qw_feature_arc *arc, bool joins)
{
    uint32_t u = arc->node[0], v = arc->node[1];
    if (u == QW_NONE || u == v || !isfinite(arc->strength)) return f->bands;
    if (!(arc->length < WIDEST * CLOSE * fminf(f->least[u], f->least[v]))) return f->bands;
    return band_at(f, u, v, joins);
}

/* Sums over each band, and over bands that are one as a whole: length, narrow length, width and how much of the
 * shorter arc is covered. */
static void add_up(finder *f)
{
    assert(f->bands <= f->count);
    for (size_t b = 0; b < f->bands; b++) f->total[b] = (total){.thinnest = INFINITY};
    for (size_t i = 0; i < f->count; i++) f->total[f->pair[i].band].length += f->pair[i].overlap;
    for (size_t b = 0; b < f->bands; b++) {
        const qw_feature_arc *arc = f->graph->arc;
        float shorter = fminf(arc[f->band[b] >> 32].length, arc[(uint32_t)f->band[b]].length);
        f->total[b].cover = f->total[b].length / shorter, f->total[b].length = 0;
    }
    for (size_t b = 0; b < f->bands; b++) {
        total *t = &f->total[qw_set_of(f->whole, (uint32_t)b)];
        t->cover = fminf(t->cover, f->total[b].cover);
    }
    for (size_t i = 0; i < f->count; i++) {
        const pair *p = &f->pair[i];
        total *t = &f->total[qw_set_of(f->whole, p->band)];
        t->length += p->overlap, t->narrow += p->width < 1 ? p->overlap : 0;
        t->thinnest = fminf(t->thinnest, p->width);
    }
}

static bool has_no_room(const finder *f, const pair *p)
{
    const total *t = &f->total[qw_set_of(f->whole, p->band)];
    bool is_mostly_narrow = t->narrow > t->length / 2;
    if (is_mostly_narrow && t->cover > 0.5f) return true;
    return p->width < 1 && (is_mostly_narrow || t->thinnest < THINNEST);
}

qw_bands qw_find_bands(qw_env *env, const qw_trimesh *mesh, const qw_feature_graph *graph, const float *least)
{
    assert(mesh->twin && least);
    finder f = {.mesh = mesh, .outgoing = qw_trimesh_outgoing(env, mesh), .graph = graph, .least = least};
    uint32_t most = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) most = graph->degree[v] > most ? graph->degree[v] : most;
    qw_bands bands = {.is_across = QW_NEW_ZERO(env, uint8_t, graph->arc_count)};
    for (int i = 0; i < 2; i++) f.at[i] = QW_NEW(env, uint32_t, most);
    add_pairs(&f);
    f.key = QW_NEW(env, uint64_t, f.count);
    add_pairs(&f);
    f.count = qw_sort_once(f.key, f.count);
    make_bands(env, &f);
    for (uint32_t i = 0; i < graph->arc_count; i++) band_of_end(&f, &graph->arc[i], true);
    add_up(&f);
    bands.narrow = f.key;
    uint8_t *gives_way = QW_NEW_ZERO(env, uint8_t, f.bands);
    for (size_t i = 0; i < f.count; i++) {
        if (!has_no_room(&f, &f.pair[i])) continue;
        gives_way[f.pair[i].band] = 1;
        bands.narrow[bands.narrow_count++] = f.key[i];
    }
    for (uint32_t i = 0; i < graph->arc_count; i++) {
        size_t band = band_of_end(&f, &graph->arc[i], false);
        bands.is_across[i] = band < f.bands && gives_way[band];
    }
    return bands;
}
