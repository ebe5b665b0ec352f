/* Sharp edges of a surface. */
#pragma once

#include "geometry/trimesh.h"

/* Marks feature edges: interior edges whose normals differ by more than the angle (radians). With angle < 0 creases are
   found: edges above 40 degrees are seeds, loose ends grow straight on along edges above 25 degrees, and a network of
   such edges stays when the surface beside it is smooth (folds of organic shapes and noise are not) and it is no
   quad_edge (shorter than quad_edge / 2, or quad_edge / 4 when it has no loose end). Where more than half of the sharp
   length is folds, only the clearest stay; where sharp edges are longer than 6 quad edges in the mean and have 0.8 of
   the turn of the whole surface, all but quad edges do. quad_edge: the edge length that the quads would have. Returns
   the number of marked edges; *used: the angle in radians that decided (the seeds' when it was found). Allocates
   mesh->mark. */
int64_t qw_find_features(qw_env *env, qw_trimesh *mesh, double angle, float quad_edge, double *used);
