/* Edits of a skin by many threads. Cells are taken together to cubic blocks, and blocks to eight kinds so that those of
 * a kind lie a block apart: each has a room of its own, half a block wider on every side than itself. Blocks of one
 * kind are worked through at once, one kind after another; what reaches out of its room comes last, in order. What is
 * made does not depend on the number of threads. */
#pragma once

#include "products/wrap/guard.h"

typedef struct qw_block_work {
    void *user;
    /* The vertex by which an item lies in a block, as the skin is now; QW_NONE: nothing is to be done with it. */
    uint32_t (*vertex_of)(void *user, const qw_skin *s, uint32_t item);
    /* Tries the edit of one item in a room that holds that vertex, and so sees its faces as nobody else changes them;
       what it looks at beyond must be in the room. hint: kept from item to item of a block, QW_NONE before the first.
     */
    void (*step)(void *user, qw_guard_room *room, uint32_t item, uint32_t *hint);
} qw_block_work;

/* A vertex_of where the items are vertices: those that are left. */
uint32_t qw_living_vertex(void *user, const qw_skin *s, uint32_t item);

/* For the items 0..count-1. */
void qw_in_blocks(qw_env *env, qw_guard *g, uint32_t count, const qw_block_work *work);
