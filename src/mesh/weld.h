/* Joining of vertices: renames corners to the lowest vertex of each group and returns how many vertices were renamed. */
#ifndef QW_MESH_WELD_H
#define QW_MESH_WELD_H

#include "base/env.h"

/* Equal as numbers (-0 is 0). only: uint8_t[vertex_count], vertices that may be joined; NULL for all. */
uint32_t qw_weld_equal(qw_env *env, const double *position, uint32_t vertex_count, const uint8_t *only, uint32_t *corner,
                       uint32_t face_count);

#endif
