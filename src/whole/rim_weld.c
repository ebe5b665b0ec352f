#include "whole/rim_weld.h"

#include "base/sort.h"

#include <string.h>

/* The edges of the rims by their places. */
typedef struct rim_edges {
    const qw_clean_input *input;
    uint32_t *from, *to; /* uint32_t[count]: vertices of the input */
    uint64_t *key;       /* uint64_t[count], sorted: hash of both places, and the edge */
    uint8_t *met;        /* uint8_t[count], 1: a polygon beyond it is known */
    size_t count;
} rim_edges;

/* 32 bits of a place in the upper half: the same for 0 and -0. */
static uint64_t hash_of_place(const qw_clean_input *input, uint32_t v)
{
    const double *p = input->position + 3 * (size_t)v;
    uint64_t h = 1469598103934665603u, bits[3];
    double q[3] = {p[0] + 0.0, p[1] + 0.0, p[2] + 0.0}; /* -0 is 0 */
    memcpy(bits, q, sizeof bits);
    for (int k = 0; k < 3; k++) h = (h ^ bits[k]) * 1099511628211u, h ^= h >> 29;
    return h & 0xffffffff00000000u;
}

static bool at_one_place(const qw_clean_input *input, uint32_t a, uint32_t b)
{
    const double *p = input->position + 3 * (size_t)a, *q = input->position + 3 * (size_t)b;
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

static rim_edges index_edges(qw_env *env, const qw_clean_input *input, const qw_old_rims *rims)
{
    uint32_t all = rims->begin[rims->count];
    rim_edges e = {input,
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
            e.key[e.count] = (hash_of_place(input, from) + hash_of_place(input, to)) | e.count;
            e.count++;
        }
    qw_sort_u64(e.key, e.count);
    return e;
}

/* How well an edge of a polygon from a to b fits beyond a rim's: 4, the same vertices the other way; by place, 3 the
   other way and 2 the same way; 0: it lies elsewhere, or another is there that fits as well. */
static int fits(const rim_edges *e, uint32_t i, uint32_t a, uint32_t b)
{
    if (e->from[i] == b && e->to[i] == a) return 4;
    if (e->met[i]) return 0;
    if (at_one_place(e->input, e->from[i], b) && at_one_place(e->input, e->to[i], a)) return 3;
    return at_one_place(e->input, e->from[i], a) && at_one_place(e->input, e->to[i], b) ? 2 : 0;
}

/* The edge of a rim that fits best, or QW_NONE; *how: as above. */
static uint32_t edge_beside(const rim_edges *e, uint32_t a, uint32_t b, int *how)
{
    uint64_t key = hash_of_place(e->input, a) + hash_of_place(e->input, b);
    size_t low = 0, high = e->count;
    uint32_t best = QW_NONE;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (e->key[middle] < key) low = middle + 1;
        else high = middle;
    }
    *how = 0;
    for (; low < e->count && (e->key[low] & 0xffffffff00000000u) == key; low++) {
        uint32_t i = e->key[low] & 0xffffffffu;
        int fit = fits(e, i, a, b);
        if (fit > *how) *how = fit, best = i;
    }
    return best;
}

static uint32_t root_of(uint32_t *same, uint32_t v)
{
    while (same[v] != v) v = same[v] = same[same[v]];
    return v;
}

static void unite(uint32_t *same, uint32_t a, uint32_t b)
{
    a = root_of(same, a), b = root_of(same, b);
    if (a < b) same[b] = a;
    else same[a] = b;
}

/* In a first pass the polygons that have the rims' own vertices, in a second the others. */
static void weld_polygons(rim_edges *e, const uint8_t *left_out, bool own, uint32_t *same)
{
    const qw_clean_input *in = e->input;
    for (uint32_t f = 0; f < in->face_count; f++) {
        uint32_t begin = in->face_begin[f], n = in->face_begin[f + 1] - begin;
        for (uint32_t k = 0; k < n && left_out[f]; k++) {
            uint32_t a = in->corner[begin + k], b = in->corner[begin + (k + 1) % n];
            int how;
            uint32_t i = edge_beside(e, a, b, &how);
            if (how == 0 || own != (how == 4)) continue;
            e->met[i] = 1;
            unite(same, how == 2 ? a : b, e->from[i]), unite(same, how == 2 ? b : a, e->to[i]);
        }
    }
}

uint32_t *qw_weld_along_rims(qw_env *env, const qw_clean_input *input, const uint8_t *left_out, const qw_old_rims *rims)
{
    uint32_t *same = QW_NEW(env, uint32_t, input->vertex_count);
    rim_edges e = index_edges(env, input, rims);
    for (uint32_t v = 0; v < input->vertex_count; v++) same[v] = v;
    weld_polygons(&e, left_out, true, same), weld_polygons(&e, left_out, false, same);
    for (uint32_t v = 0; v < input->vertex_count; v++) same[v] = root_of(same, v);
    qw_free(env, e.from), qw_free(env, e.to), qw_free(env, e.key), qw_free(env, e.met);
    return same;
}
