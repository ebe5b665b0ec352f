/* Blocks of a mesh that is being edited, for passes on several threads with one result.
 *
 * A vertex is inner where it and all its neighbours are of one block. An operation on inner vertices reads and writes
 * only vertices of that block and faces between them (of faces beyond, the link to the neighbour that it changes), and
 * leaves inner what was inner. So each block can be worked on by itself; what lies at the seams is left for a pass of
 * one thread afterwards. Blocks come of qw_edit_pack, which makes them of neighbours along a space-filling curve,
 * whatever the number of threads.
 */
#pragma once

#include "remesh/working/reshape.h"

typedef struct qw_blocks {
    uint32_t count; /* 0 where there is but one block: then no vertex is called inner */
    /* uint32_t[count + 1]: of each block the live faces with all corners in it, or the inner vertices */
    uint32_t *begin, *item;
} qw_blocks;

/* Set `inner` of every vertex. The arrays belong to the current scope. */
qw_blocks qw_blocks_none(qw_edit *edit); /* everything is left to one thread */
qw_blocks qw_blocks_of_faces(qw_edit *e);
qw_blocks qw_blocks_of_vertices(qw_edit *e);

/* Both ends of the edge are inner, and no curve has to be followed beyond them to judge its collapse. */
static inline bool qw_blocks_can_collapse(const qw_edit *e, uint32_t h)
{
    const qw_edit_vertex *a = &e->vertex[qw_edit_tail(e, h)], *b = &e->vertex[qw_edit_head(e, h)];
    return a->inner && b->inner && (a->kind == QW_VERTEX_FREE || b->kind == QW_VERTEX_FREE);
}

/* Both apices of the edge lie inside one block, as flipping walks the fan of an apex. */
static inline bool qw_blocks_can_flip(const qw_edit *e, uint32_t h)
{
    const qw_edit_vertex *apex = &e->vertex[qw_edit_apex(e, h)];
    uint32_t t = qw_edit_twin(e, h);
    return t != QW_NONE && apex->inner && e->vertex[qw_edit_apex(e, t)].block == apex->block;
}

/* Calls task on every block, with a mesh whose counts are its own; they are added up afterwards. Returns the sum of
 * what the tasks return. */
typedef uint32_t (*qw_block_task)(void *user, qw_reshape *r, const qw_blocks *blocks, uint32_t block);
uint32_t qw_blocks_run(qw_reshape *r, const qw_blocks *blocks, qw_block_task task, void *user);
