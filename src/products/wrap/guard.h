/* What keeps a skin from intersecting itself: where its triangles lie, and whether some may be replaced by others. As a
 * skin begins without any intersection and no edit is made that the guard does not allow, it never has one. */
#pragma once

#include "products/wrap/skin.h"

enum { QW_GUARD_MOST = 96 }; /* faces that one edit may replace */

typedef struct qw_guard_entry {
    uint32_t face, next; /* next: entry of the same cell, or QW_NONE */
} qw_guard_entry;

/* Entries that are free: a list, and a range that was never used. */
typedef struct qw_guard_spare {
    uint32_t first, from, to, count; /* count: of both */
} qw_guard_spare;

typedef struct qw_guard_box {
    int32_t low[3], high[3]; /* units; high is in it */
} qw_guard_box;

typedef struct qw_guard {
    qw_env *env;
    qw_skin *skin;
    int32_t side; /* units of a cell */
    uint32_t cells[3];
    uint32_t *first; /* uint32_t[cells]: entry, or QW_NONE */
    qw_guard_entry *entry;
    size_t capacity, used;
    qw_guard_box *box; /* qw_guard_box[box_capacity]: of each face that was added */
    size_t box_capacity;
    qw_guard_spare spare;  /* of the whole */
    qw_guard_spare *rooms; /* qw_guard_spare[rooms_capacity], room_count of them: kept until a room is entered again */
    size_t rooms_capacity, room_count;
} qw_guard;

/* Where edits are made for a while. Rooms that share no cell may be used by several threads at once: no edit is made,
 * and nothing is looked at, that reaches out of its room, so what one does is the same whatever the others do. */
typedef struct qw_guard_room {
    qw_guard *guard;
    qw_guard_box box;
    bool is_whole;         /* the only room: it may ask for memory */
    bool reaches_out;      /* set where an edit was not made because the room is too small for it */
    uint32_t number, left; /* entries that it may take, unless it is whole */
    qw_guard_spare spare;  /* its own, unless it is whole; those that it uses lie together */
} qw_guard_room;

/* New triangles in the place of some of the skin's. */
typedef struct qw_guard_edit {
    uint32_t old[QW_GUARD_MOST], old_count;    /* faces that go */
    uint32_t now[QW_GUARD_MOST][3], now_count; /* vertices of those that come */
} qw_guard_edit;

qw_guard qw_guard_begin(qw_env *env, qw_skin *skin);

/* A room of all cells, and that of this number: a box of units with so many free entries. */
qw_guard_room qw_guard_everywhere(qw_guard *g);
qw_guard_room qw_guard_enter(qw_guard *g, uint32_t number, const qw_guard_box *box, uint32_t entries);
void qw_guard_leave(const qw_guard_room *room);

/* Whether a vertex lies in the room: no other one changes its faces then. */
bool qw_room_holds(qw_guard_room *room, uint32_t v);

/* Whether the skin would not intersect itself with the new triangles instead of the old, at the positions that it has
 * now, and the room has space for them. Each new one must have an area. */
bool qw_guard_allows(qw_guard_room *room, const qw_guard_edit *edit);

/* Whether a vertex may be there; moves it, and the guard's faces with it, where it may. */
bool qw_guard_move(qw_guard_room *room, uint32_t v, qw_wrap_lattice_point to);

/* The faces lie where they are now: called before and after an edit with those that change. */
void qw_guard_remove(qw_guard_room *room, uint32_t face);
void qw_guard_add(qw_guard_room *room, uint32_t face);
