/* Polygons of a file or a host, as cleaning takes them. */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct qw_clean_input {
    uint32_t vertex_count, face_count;
    const double *position;     /* double[vertex_count][3] */
    const uint32_t *face_begin; /* uint32_t[face_count + 1] */
    const uint32_t *corner;
    bool separate_corners;
    uint32_t mark_count;
    const uint32_t *mark;      /* uint32_t[mark_count][2], vertices: edges that were marked */
    const qw_density *density; /* qw_density[vertex_count]: painted; NULL: the same everywhere */
    const double *cut; /* double[cuts][4], normals and offsets of planes: this is the part of a clean surface on one
                          side of each. Nothing is welded then, and boundaries that lie in a plane have no corners but
                          where they end. NULL: any input */
    uint32_t cuts;
    const uint8_t *left_out; /* uint8_t[face_count], 1: no part of the surface; NULL: all are */
} qw_clean_input;
