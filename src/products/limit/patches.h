/* The limit surface of quads as bicubic Bezier patches, one a quad: exactly where its vertices are regular, and beside
 * others as Loop and Schaefer (2008) have it: Bezier points inside a patch by the vertex's own valence, those on edges
 * and corners the means of what lies around them, so that patches meet without gaps, and smoothly but at irregular
 * vertices.
 */
#pragma once

#include "io/step.h"
#include "geometry/quadmesh.h"

/* Where the points of a patch lie as seen from corner i of its quad: the corner itself, steps ahead along its
   half-edge, and up, back along the one before. */
static const int QW_PATCH_CORNER[4] = {0, 12, 15, 3}, QW_PATCH_AHEAD[4] = {4, 1, -4, -1},
                 QW_PATCH_UP[4] = {1, -4, -1, 4};

static inline bool qw_is_sharp_side(const qw_quadmesh *q, uint32_t h)
{
    return q->twin[h] == QW_NONE || (q->mark && q->mark[h]);
}

/* quads: linked, with their marks and kinds; position: double[quads->vertex_count][3]. In the current scope. */
qw_patches qw_make_patches(qw_env *env, const qw_quadmesh *quads, const double *position);
