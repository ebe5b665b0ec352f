/* Bands: two arcs of the feature graph that run side by side, as on ledges, ribs, fins, grooves and rims of plates.
 * Bands that an arc across their ends joins, as the top of a rib and its two ends, are one: what becomes of them is
 * decided for all of them together.
 *
 *          o-----------------------o        the band of the top, between its two long arcs, and those of the ends,
 *         /|          top         /|        between the upright ones, share the short arcs across
 *        o-----------------------o |
 *        | o                     | o
 *        |/                      |/
 */
#pragma once

#include "remesh/features/graph.h"

typedef struct qw_bands {
    uint64_t *narrow; /* uint64_t[narrow_count], ascending: lower half-edges of two curve edges, qw_pair_key, that lie
                         side by side where there is no room for a row of quads */
    size_t narrow_count;
    uint8_t *is_across; /* uint8_t[arcs]: 1: the arc lies across the end of a band that has no room */
} qw_bands;

/* least: float[vertex_count], half the wanted edge length of the quads. A band less than a fifth of an edge wide has no
   room. One that is from half as wide to twice as wide all along has room or has none as a whole, by what most of its
   length is. In the current scope. */
qw_bands qw_find_bands(qw_env *env, const qw_trimesh *mesh, const qw_feature_graph *graph, const float *least);
