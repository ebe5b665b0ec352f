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

/* What a strip meets in a triangle beside one of its places. */
typedef struct qw_strip_link {
    uint32_t beyond; /* where it goes on: 2 place + the half-edge that it arrives by, or QW_NONE */
    uint32_t column; /* 2 face + the axis that it lies along, or QW_NONE in triangles without a positive area, */
    int32_t at;      /* and its lower coordinate across */
    double part;     /* quads in the triangle */
} qw_strip_link;

/* Strips as they are linked; zeroed before the first count; for complexes of the same edges. */
typedef struct qw_strip_room {
    uint32_t *first, *places; /* uint32_t[2 edges + 1], uint32_t[2 edges]: see strips.c */
    qw_strip_link *link;      /* qw_strip_link[2 places]: in the triangle of the first half-edge, and of the second */
    uint32_t *strip;          /* uint32_t[places]: a place of the strip, which names it */
    double *crossing;         /* double[places], by name: its quads, those twice that it crosses at, or 0 where none */
    uint32_t *before;         /* uint32_t[2 places]: the column before it of the same strip in the triangle */
    uint32_t *last, *follows; /* uint32_t[2 faces]: the last of these columns, and the number of its strip */
    uint32_t crossing_count;  /* strips that cross themselves, */
    double area;              /* and their quads */
    /* of the change at hand */
    uint32_t *number, numbers;        /* uint32_t[places]: which of all strips that were ever followed */
    uint32_t *followed, follow_count; /* uint32_t[places]: places of strips that were followed for it */
    double *crossing_now;             /* double[places], by name */
    uint32_t change_count;            /* modulo 2^32: by how many more cross themselves, */
    double change;                    /* with so many more quads */
    bool is_laid_anew;                /* as an edge had no room for its places */
    size_t room[11];
} qw_strip_room;

/* c: closed, with integers in c->d. Triangles without a positive area count nothing. */
qw_strip_counts qw_count_strips(qw_env *env, const qw_complex *c, qw_strip_room *room);

/* After a count, where integers have changed: links the places anew in these triangles, all that have a side with other
   integers, and follows the strips that meet them. Returns the area in strips that cross themselves, or more than
   `most` where it is. Afterwards the change is kept, or the integers are set back and it is undone. */
double qw_change_strips(qw_env *env, const qw_complex *c, qw_strip_room *room, const uint32_t *face, uint32_t count,
                        double most);
void qw_keep_strips(qw_strip_room *room);
void qw_undo_strips(qw_env *env, const qw_complex *c, qw_strip_room *room, const uint32_t *face, uint32_t count);

/* After a count: lists the places of the strip through one, uint32_t[places]. Returns how many. */
uint32_t qw_list_strip(qw_strip_room *room, uint32_t place, uint32_t *list);
/* The component that has the place: 2 edge + (it is y). */
uint32_t qw_component_of_place(const qw_complex *c, const qw_strip_room *room, uint32_t place);
