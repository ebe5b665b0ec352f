/* Quads are flat or nearly so, and where all their vertices lie on a curved surface they lie beneath it. Here vertices
 * leave the surface, along their normals, by as much as brings the quads nearest to it. */
#pragma once

#include "remesh/relax/fit_target.h"

typedef struct qw_fit {
    const qw_bvh *tree;   /* of the surface */
    float strength;       /* 0 to 1: the share of the way there */
    qw_fit_target target; /* what the surface stands for, where it stands for something else */
    /* double[cuts][4]: unit normals and offsets of planes, within which boundary vertices on them move; NULL */
    const double *cut;
    uint32_t cuts;
    const uint8_t *planes; /* uint8_t[quads' vertices]: bit i: those of the vertex' component; NULL: all are */
} qw_fit;

/* Moves quads->position to the least squares of the distances from the surface, integrated over the quads, each cut
   from its first corner to its third. Vertices on curves, at corners and on boundaries stay, but where
   the surface stands for another one, whose edges they move onto. So do those of quads that would get an inverted
   corner. quads: linked, on the surface. */
void qw_fit_quads(qw_env *env, qw_quadmesh *quads, const qw_fit *fit);
