/* What the components of a surface need before anything is wanted: quads that keep their topology, lengths that they
 * cover.
 */
#pragma once

#include "remesh/sizes/shares.h"

/* The least number of quads in which all components keep their topology, and the sum of their lengths: the diagonals of
   their bounding boxes, or of their needles one behind the other. */
double qw_faces_needed(qw_env *env, const qw_trimesh *surface, const qw_census *census);
double qw_total_extent(qw_env *env, const qw_trimesh *surface, const qw_census *census);

/* Loops that need quads around them: two for each handle, one for each hole except the first of a component. */
double qw_needed_loops(qw_env *env, const qw_trimesh *mesh, const qw_census *census);

/* Length of the edges that are marked. */
double qw_marked_length(const qw_trimesh *mesh);

/* The component of each vertex: uint32_t[surface->vertex_count], in the current scope. */
uint32_t *qw_vertex_components(qw_env *env, const qw_trimesh *surface, const qw_census *census);

/* What each component needs: qw_part[census->components], in the current scope. */
qw_part *qw_list_parts(qw_env *env, const qw_trimesh *surface, const qw_census *census);

/* How many of so many quads each component of a surface gets: double[census->components]. *part, if not NULL: what they
   need, qw_part[census->components]. Both in the current scope. */
double *qw_component_shares(qw_env *env, const qw_trimesh *surface, const qw_census *census, double quads,
                            qw_part **part);
