#include "whole/rim_weld.h"

#include "base/hash.h"
#include "base/sets.h"
#include "base/sort.h"

/* The edges of the rims by their places. */
typedef struct rim_edges {
    const uint32_t *place; /* uint32_t[vertices of the input]: the first vertex at the place of each */
    uint32_t *from, *to;   /* uint32_t[count]: vertices of the input */
    uint64_t *key;         /* uint64_t[count], sorted: the lower of both places, and the edge */
    uint8_t *met;          /* uint8_t[count], 1: a polygon beyond it is known */
    size_t count;
} rim_edges;

/* The key of the first edge between two places. */
static uint64_t key_of(const uint32_t *place, uint32_t a, uint32_t b)
{
    return (uint64_t)(place[a] < place[b] ? place[a] : place[b]) << 32;
}

/* All edges of the old rims, sorted by the places of their ends. */
static rim_edges index_edges(qw_env *env, const uint32_t *place, const qw_old_rims *rims)
{
    uint32_t all = rims->begin[rims->count];
    rim_edges e = {place,
                   QW_NEW(env, uint32_t, all),
                   QW_NEW(env, uint32_t, all),
                   QW_NEW(env, uint64_t, all),
                   QW_NEW_ZERO(env, uint8_t, all),
                   0};
    for (uint32_t l = 0; l < rims->count; l++)
        for (uint32_t i = rims->begin[l]; i < rims->begin[l + 1]; i++) {
            uint32_t from = rims->vertex[i], to = rims->vertex[i + 1 < rims->begin[l + 1] ? i + 1 : rims->begin[l]];
            if (from == QW_NONE || to == QW_NONE) continue;
            e.from[e.count] = from, e.to[e.count] = to;
            e.key[e.count] = key_of(place, from, to) | e.count;
            e.count++;
        }
    qw_sort_u64(e.key, e.count);
    return e;
}

/* How well an edge of a polygon from a to b fits beyond a rim's: 4, the same vertices the other way; by place, 3 the
   other way and 2 the same way; 0: it lies elsewhere, or another is there that fits as well. */
static int fits(const rim_edges *e, uint32_t i, uint32_t a, uint32_t b)
{
    const uint32_t *p = e->place;
    if (e->from[i] == b && e->to[i] == a) return 4;
    if (e->met[i]) return 0;
    if (p[e->from[i]] == p[b] && p[e->to[i]] == p[a]) return 3;
    return p[e->from[i]] == p[a] && p[e->to[i]] == p[b] ? 2 : 0;
}

/* The edge of a rim that fits best, or QW_NONE; *how: as above. */
static uint32_t edge_beside(const rim_edges *e, uint32_t a, uint32_t b, int *how)
{
    uint64_t key = key_of(e->place, a, b);
    uint32_t best = QW_NONE;
    *how = 0;
    for (size_t k = qw_first_not_below(e->key, e->count, key); k < e->count && e->key[k] >> 32 == key >> 32; k++) {
        uint32_t i = (uint32_t)e->key[k];
        int fit = fits(e, i, a, b);
        if (fit > *how) *how = fit, best = i;
    }
    return best;
}

/* In a first pass the polygons that have the rims' own vertices, in a second the others. */
static void weld_polygons(const qw_clean_input *in, rim_edges *e, const uint8_t *left_out, bool own, uint32_t *same)
{
    for (uint32_t f = 0; f < in->face_count; f++) {
        uint32_t begin = in->face_begin[f], n = in->face_begin[f + 1] - begin;
        for (uint32_t k = 0; k < n && left_out[f]; k++) {
            uint32_t a = in->corner[begin + k], b = in->corner[begin + (k + 1) % n];
            int how;
            uint32_t i = edge_beside(e, a, b, &how);
            if (how == 0 || own != (how == 4)) continue;
            e->met[i] = 1;
            qw_join_sets(same, how == 2 ? a : b, e->from[i]), qw_join_sets(same, how == 2 ? b : a, e->to[i]);
        }
    }
}

uint32_t *qw_weld_along_rims(qw_env *env, const qw_clean_input *input, const uint8_t *left_out, const qw_old_rims *rims)
{
    uint32_t *same = QW_NEW(env, uint32_t, input->vertex_count);
    uint32_t *place = qw_find_places(env, input->position, input->vertex_count, NULL);
    rim_edges e = index_edges(env, place, rims);
    qw_sets_begin(same, input->vertex_count);
    weld_polygons(input, &e, left_out, true, same), weld_polygons(input, &e, left_out, false, same);
    for (uint32_t v = 0; v < input->vertex_count; v++) same[v] = qw_set_of(same, v);
    qw_free(env, e.from), qw_free(env, e.to), qw_free(env, e.key), qw_free(env, e.met), qw_free(env, place);
    return same;
}
