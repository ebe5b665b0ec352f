/* Curvature of the input surface at the scale of the quads: which way a quad should run so that it bows as little as can
 * be.
 *
 * The tensor of Cohen-Steiner and Morvan (2003, Restricted Delaunay Triangulations and Normal Cycle): each edge of the
 * surface bends it, by its dihedral angle, along the edge's length. Summed over the part of the surface within reach
 * that faces the same way, over that part's area, it is the curvature at that scale, whatever the triangles are like:
 * relief smaller than that averages out, a round edge or a sharp one counts as what the quads will see of it. */
#ifndef QW_FIELD_CURVATURE_H
#define QW_FIELD_CURVATURE_H

#include "mesh/trimesh.h"

/* For each of `count` points the direction in which the surface bends most or least (a cross does not tell them apart),
   as a tangent to the unit normal. Its length is the difference of the principal curvatures times the scale (1: a quad
   bows a sixteenth of its edge more one way than the other), less where both are nearly as large. surface: of the
   input. point, normal: qw_vec3[count]; scale: float[count], the edge lengths wanted there. In the current scope. */
qw_vec3 *qw_curvature_directions(qw_env *env, const qw_trimesh *surface, const qw_vec3 *point, const qw_vec3 *normal,
                                 const float *scale, uint32_t count);

#endif
