/* A vertex tries steps to all sides, each put back onto whatever the vertex lies on, and takes the one after which the
 * quads around it cost least. What a quad costs, where a step leads and how long it is are the caller's. */
#pragma once

#include "geometry/quadmesh.h"

/* Where a vertex is. up, on: as the caller wants them, the normal there and the triangle or half-edge below it. */
typedef struct qw_spot {
    double at[3];
    qw_vec3 up;
    uint32_t on;
} qw_spot;

typedef struct qw_step_search {
    const uint32_t *corner;   /* uint32_t[4 quads] */
    qw_vec3 *position;        /* qw_vec3[vertices], which are moved; NULL: in double precision */
    double *place;            /* double[vertices][3]; NULL: in single precision */
    uint32_t *begin, *around; /* half-edges that leave each vertex: around[begin[v] .. begin[v + 1]) */
    uint8_t *awake;           /* uint8_t[vertices]: 1: something around has changed since its last search */
    int lengths;              /* of steps; each is half the one before and begins where that one led */
    void *user;
    /* The length of the longest step; 0: v stays. Sets two of the directions; the second 0: steps along the first only.
       here->at is set; others of it may be. */
    double (*frame)(void *user, uint32_t v, qw_spot *here, qw_vec3 axis[2]);
    /* Replaces `spot`, from where the step goes, by where it leads; false: nowhere. */
    bool (*land)(void *user, uint32_t v, const double to[3], qw_spot *spot);
    void (*put)(void *user, uint32_t v, const qw_spot *spot); /* what else moves with v; NULL: nothing */
    double (*cost)(void *user, uint32_t v, uint32_t quad);    /* of a quad at v, as v is put; not below 0 */
} qw_step_search;

/* Marks (1) the vertices that are so many edges from marked ones, too: uint8_t[quads->vertex_count], 0 or 1. */
void qw_grow_marks(const qw_quadmesh *quads, int rings, uint8_t *marks);

/* Searches those of the vertices that are awake one after the other, and wakes what is around each that has moved.
   vertex: uint32_t[count]; NULL: 0 to count. Returns whether any has. */
bool qw_search_all(const qw_step_search *search, const uint32_t *vertex, uint32_t count);
