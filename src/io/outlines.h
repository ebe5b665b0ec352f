/* Edges between faces that differ in something.
 *
 * Many files give the faces on either side of such an edge vertices of their own: programs that keep one set of
 * attributes a vertex can hold no other. There the two sides of an edge are told by their positions. */
#pragma once

#include "base/env.h"

typedef struct qw_outlines {
    uint32_t vertex_count, face_count;
    const double *position;     /* double[vertex_count][3] */
    const uint32_t *face_begin; /* uint32_t[face_count + 1] */
    const uint32_t *corner;     /* uint32_t[face_begin[face_count]] */
} qw_outlines;

/* A face at an edge, and its corners at either end: the same end for all faces there. */
typedef struct qw_side {
    uint32_t face, low, high;
} qw_side;

typedef bool qw_is_outline(const void *user, const qw_side *x, const qw_side *y);

/* uint32_t[*edges][2]: vertices of the edges at which two faces differ, NULL where there is none. Faces that share both
 * vertices are at one edge; a face that shares them with none is at one with another such at the same positions, if
 * there is just one. only: uint8_t[vertex_count]: edges between these; NULL: all. place: as qw_find_places has it, or
 * NULL. In the caller's scope. */
uint32_t *qw_find_borders(qw_env *env, const qw_outlines *of, const uint32_t *place, const uint8_t *only,
                          qw_is_outline *differ, const void *user, uint32_t *edges);
