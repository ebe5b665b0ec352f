/* A dense surface made coarser at once, before its edges collapse one by one (remesh/working/working.h): vertices that
 * lie in one cell of a grid and hang together there become one of them.
 *
 * A cluster owns what lies nearer to its vertices than to others along the surface. The result is a surface of the same
 * topology where each cluster owns a disc, two of them meet in one line or not at all, and each has three neighbours at
 * least: then it is the dual of a map on the surface. All of this is counted. So is geometry: a cluster is flat to a
 * tenth of its cell, and no triangle faces against the clusters at its corners. A cluster that fails is tried again in
 * cells half as large, and in the end left alone. Vertices on boundaries and sharp edges, and points, are left alone
 * from the start.
 */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_clustered {
    qw_trimesh mesh;     /* its vertices are some of the input's; faces of the first component come first */
    uint32_t *component; /* uint32_t[mesh.face_count]: as in the input */
    uint32_t *origin;    /* uint32_t[mesh.vertex_count]: which vertices of the input they are */
} qw_clustered;

/* component: uint32_t[input->face_count], numbers below `components`. cell: float[input->vertex_count], positive: how
   large the cells are. False where the input is not much finer than them: then nothing is made. In the current scope.
 */
bool qw_cluster(qw_env *env, const qw_trimesh *input, const uint32_t *component, uint32_t components, const float *cell,
                qw_clustered *result);
