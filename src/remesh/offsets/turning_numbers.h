/* Vertices around which orientation-preserving offsets go too few times.
 *
 * That no triangle is inverted does not say how often the lattice goes around a vertex. Around a cone of valence 5
 * its triangles may make up one quarter turn instead of five, the rest being without area, and a neighbour then has
 * eight quarters instead of four: the quads get a finger that the surface hasn't. Vertices that zero edges join become
 * one, so it is such clusters that count.
 */
#pragma once

#include "remesh/offsets/inversions.h"

/* Marks a vertex of each cluster that has area around it, but less angle than its index says: uint8_t[vertex_count].
   Clusters at the boundary and those that are no disc are left out. Returns their number. Needs components of -1, 0
   or 1.
 */
uint32_t qw_find_low_turning_numbers(qw_env *env, const qw_offset_mesh *m, uint8_t *mark);

/* Changes offsets near such clusters, by satisfiability, so that each has its angle and no triangle is inverted.
   Returns how many clusters are left. */
uint32_t qw_repair_turning_numbers(qw_env *env, qw_offset_mesh *m, qw_inversion_counts *counts);
