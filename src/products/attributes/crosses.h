/* Cross fields on the elements of the input, and on the points of another surface near by: taken from the one to the
 * other in both directions. A cross is given by one of its four directions, a unit tangent; 0 says that there is none.
 */
#pragma once

#include "products/attributes/source.h"
#include "geometry/quadmesh.h"

/* A cross at each vertex of a surface. */
typedef struct qw_vertex_crosses {
    const qw_trimesh *mesh;
    const qw_vec3 *normal, *direction; /* qw_vec3[mesh->vertex_count] */
} qw_vertex_crosses;

/* The field at points of the surface: qw_vec3[count], tangents to `normal`, in the caller's scope. field: a direction
   an element of the input. A point has a cross where an element within `reach` that faces the same way has one, and
   where those of the corners around it do not contradict one another. */
qw_vec3 *qw_crosses_at_points(qw_env *env, const qw_source *source, qw_domain domain, const qw_vec3 *field,
                              const qw_vec3 *point, const qw_vec3 *normal, uint32_t count, float reach);

/* The mean angle, in degrees, between the lines that join the middles of opposite edges of a quad and the field there;
   negative where no quad finds a cross. */
double qw_mean_field_angle(qw_env *env, const qw_source *source, qw_domain domain, const qw_vec3 *field,
                           const qw_quadmesh *quads, float reach);

/* The crosses at the elements of the input: qw_vec3[elements], in the caller's scope. 0 for an element that has no
   normal or finds nothing within `reach`. */
qw_vec3 *qw_crosses_of_elements(qw_env *env, const qw_source *source, qw_domain domain,
                                const qw_vertex_crosses *crosses, float reach);
