/* Strips of quads, side by side, as integers of a complex make them: how large a part of them crosses itself.
 *
 * A strip is a curve half-way between two lattice lines. It crosses edges of the complex at half-integer places, as
 * many as a component of the offset is long, and passes each triangle straight on: what it meets is known from the
 * places alone, without any quad (normal curves, as of Haken 1961). A quad lies where two strips cross. */
#pragma once

#include "remesh/quantise/complex.h"

typedef struct qw_strip_counts {
    uint32_t strips, crossing; /* of all, those that cross themselves */
    double area;               /* quads, each once for either of its two strips */
    double crossing_area;      /* of it in strips that cross themselves */
} qw_strip_counts;

/* The places that a triangle has along one axis of its frame: first, first + by, ... at coordinates least + 1/2, ... */
typedef struct qw_strip_rows {
    int32_t least;
    uint32_t count, first;
    int32_t by;
} qw_strip_rows;

/* Room to count strips in, zeroed before the first count; for complexes of the same edges. */
typedef struct qw_strip_room {
    uint32_t *first;     /* uint32_t[2 edges + 1]: see strips.c */
    qw_strip_rows *rows; /* qw_strip_rows[2 faces]: along x, along y; none in those without a positive area */
    /* [places]; those of a strip at the lowest of its places, which names it */
    uint32_t *strip;       /* the name */
    uint32_t *beyond;      /* uint32_t[2 places]: where the strip goes on in the triangle of the first half-edge, and of
                              the second: 2 place + the half-edge that it arrives by, or QW_NONE */
    double *part;          /* double[2 places]: quads of the strip in either triangle, put down at one of its ends */
    double *length;        /* of a strip: quads, those twice where it crosses itself */
    uint32_t *face, *last; /* of a strip: the last triangle in which it is a column, the last column there */
    uint32_t *before;      /* of a column's place: the column before it of the same strip, or QW_NONE */
    uint8_t *crosses;      /* of a strip: whether it crosses itself */
    size_t first_room, rows_room, strip_room, beyond_room, part_room, length_room, face_room, last_room, before_room,
        crosses_room;
} qw_strip_room;

/* c: closed, with integers in c->d. Triangles without a positive area count nothing. */
qw_strip_counts qw_count_strips(qw_env *env, const qw_complex *c, qw_strip_room *room);

/* Lays out the places of all edges and links them through all triangles. */
void qw_lay_strips(qw_env *env, const qw_complex *c, qw_strip_room *room);
/* Links the places anew in these triangles, all that have a side whose integers have changed. */
void qw_link_strips(qw_env *env, const qw_complex *c, qw_strip_room *room, const uint32_t *face, uint32_t count);
/* Follows the strips as they are linked. Ends once more than so many quads cross themselves: these are counted then,
   the others may be not. */
qw_strip_counts qw_follow_strips(const qw_complex *c, qw_strip_room *room, double most);
