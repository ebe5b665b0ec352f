/* The limit surface of quads as bicubic Bezier patches, one a quad: exactly where its vertices are regular, and beside
 * others as Loop and Schaefer (2008) have it: Bezier points inside a patch by the vertex's own valence, those on edges
 * and corners the means of what lies around them, so that patches meet without gaps, and smoothly but at irregular
 * vertices.
 */
#ifndef QW_PRODUCTS_LIMIT_PATCHES_H
#define QW_PRODUCTS_LIMIT_PATCHES_H

#include "io/step.h"
#include "geometry/quadmesh.h"

/* quads: linked, with their marks and kinds; position: double[quads->vertex_count][3]. In the current scope. */
qw_patches qw_make_patches(qw_env *env, const qw_quadmesh *quads, const double *position);

#endif
