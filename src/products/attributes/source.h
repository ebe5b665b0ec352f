/* The surface that attributes are taken from: the polygons as the caller gave them, before anything was welded, split
 * or dropped, cut into triangles that face as the result does. */
#pragma once

#include "geometry/bvh.h"
#include "remesh/clean/clean.h"

typedef struct qw_source {
    const qw_clean_input *input;
    qw_trimesh mesh;     /* positions and corners only; components with frames of their own lie in their slots */
    uint32_t *face;      /* uint32_t[mesh.face_count]: the polygon of each triangle */
    uint32_t *corner;    /* uint32_t[3 mesh.face_count]: number of each corner among all corners of the input */
    uint32_t *component; /* uint32_t[mesh.face_count]: of the clean surface */
    qw_vec3 *normal;     /* qw_vec3[mesh.face_count]: unit, or 0 */
    qw_bvh *bvh;
} qw_source;

/* Triangles of polygons of which cleaning left nothing (duplicates, small components) are left out. component:
   uint32_t[clean->mesh.face_count], of the clean surface. In the caller's scope; refers to the input. */
qw_source qw_source_build(qw_env *env, const qw_clean_input *input, const qw_clean *clean, const uint32_t *component);
