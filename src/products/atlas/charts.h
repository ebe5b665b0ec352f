/* Charts: patches between lines of quads joined, one pair after the other, as long as what they make lies flat with
 * little stretch: first where little room is lost around them, then for ever shorter seams; the fewest that pack well
 * enough are taken. Their borders are lines of quads, and where these run nearly along an axis they are laid along it.
 */
#pragma once

#include "products/atlas/joins.h"

/* Whether charts fill enough of the square. */
typedef bool qw_chart_judge(void *user, const qw_charts_made *made);

/* most_stretch: bound of the mean of the larger of s1 and 1 / s2 over a chart (flat.h). longest: the side of
   a tile, INFINITY where any chart can be scaled to fit. weight: double[corner_count]:
   how much a seam along each edge is to be avoided, 1 in the mean; may be NULL. mirror: uint32_t[corner_count]:
   half-edges that lie opposite to one another on a symmetric surface, or QW_NONE: charts are joined on both sides or
   on neither; may be NULL. judge: may be NULL: compact charts. In
   the caller's scope; sets the seams of the mesh. */
qw_charts_made qw_make_charts(qw_env *env, qw_atlas_mesh *mesh, double most_stretch, double longest,
                              const double *weight, const uint32_t *mirror, qw_chart_judge *judge, void *user);
