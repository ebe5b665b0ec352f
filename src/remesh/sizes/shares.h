/* How many quads each component of a surface gets: what it needs, not its area alone. Half of them are shared by area,
 * half so that the quads of all components bow alike, and none gets fewer than it takes to exist:
 * docs/dev/decisions/parts.md. */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_part {
    double area, bend; /* bend: the integral of the curvature over the area */
    double extent;     /* diagonal of its box, in diagonals of the whole */
    /* quads: with which it looks like something, and without which it does not exist */
    double least, bare;
    bool is_closed; /* without a boundary */
} qw_part;

/* Sets share, double[count], in quads, of which there are so many in all. */
void qw_share_quads(const qw_part *part, uint32_t count, double quads, double *share);

/* The integral of the curvature over each component: double[census->components], in the current scope. Curvature is
   the root of the sum of both squared principal ones; what turns one way and back again within some triangles, as noise
   does, counts for little, and sharp edges not at all. */
double *qw_component_bends(qw_env *env, const qw_trimesh *mesh, const qw_census *census);
