/* How large each quad is wanted, and how far the quads are from that. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"

/* A surface near by, and the wanted edge length at each of its vertices. */
typedef struct qw_wanted {
    const qw_trimesh *mesh;
    const float *size;  /* float[mesh->vertex_count], or NULL: the same everywhere */
    const qw_bvh *tree; /* of the mesh; NULL: it is built where it is needed */
    uint32_t
        *found; /* uint32_t[quads], NULL or set: the triangle nearest to each quad, QW_NONE where none was asked for */
} qw_wanted;

/* The wanted area of each quad but for a factor: float[quads->face_count], in the current scope. wanted NULL: the same
   everywhere. */
float *qw_areas_wanted_of(qw_env *env, const qw_quadmesh *quads, const qw_wanted *wanted);
/* The same of those only whose area is NaN. */
void qw_find_areas_wanted(qw_env *env, const qw_quadmesh *quads, const qw_wanted *wanted, float *area);

/* Multiplies the wanted areas of each component so that they add up to its area. */
void qw_fit_wanted_areas(qw_env *env, const qw_quadmesh *quads, float *wanted);

/* How long a quad is along its sides 0 and 2, and along its sides 1 and 3: from the middle of a side to that of the one
   across. */
typedef struct qw_widths {
    float of[2];
} qw_widths;
qw_widths qw_quad_widths(const qw_quadmesh *quads, uint32_t f);

/* How far quads are from the wanted sizes: the standard deviation of area over wanted area, over its mean; and the
   share of the area in quads that are longer than twice the wanted edge, one way. */
typedef struct qw_size_fit {
    double deviation, long_share;
} qw_size_fit;
qw_size_fit qw_fit_of_sizes(qw_env *env, const qw_quadmesh *quads, const qw_wanted *wanted);
