/* Normals of quads for shading. */
#pragma once

#include "geometry/quadmesh.h"

/* Of unit length, the mean of the quads around a vertex weighted by their angles there; split: of those between sharp
   edges, which are the marked ones at which the quads turn. float[vertices or, split, corners][3], in the caller's
   scope. */
float *qw_shading_normals(qw_env *env, const qw_quadmesh *quads, bool split);

/* Quads together with other polygons. */
typedef struct qw_polygon_fans {
    uint32_t vertex_count, face_count, corner_count;
    const double *position;    /* double[vertex_count][3] */
    const uint32_t *face_size; /* uint32_t[face_count] */
    const uint32_t *corner;    /* uint32_t[corner_count] */
    /* uint8_t[marked]: of the edges from the first corners to the next, as of a qw_quadmesh; or NULL */
    const uint8_t *mark;
    uint32_t marked;
} qw_polygon_fans;

/* The same of them; an edge between polygons of which one has no marks is sharp by its angle. float[vertices or, split,
   corners][3]. */
float *qw_polygon_shading_normals(qw_env *env, const qw_polygon_fans *polygons, bool split);
