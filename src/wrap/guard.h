/* What keeps a skin from intersecting itself: where its triangles lie, and whether some may be replaced by others. As a
 * skin begins without any intersection and no edit is made that the guard does not allow, it never has one. */
#ifndef QW_WRAP_GUARD_H
#define QW_WRAP_GUARD_H

#include "wrap/skin.h"

enum { QW_GUARD_MOST = 96 }; /* faces that one edit may replace */

typedef struct qw_guard_entry {
    uint32_t face, next; /* next: entry of the same cell, or QW_NONE */
} qw_guard_entry;

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
    uint32_t spare;        /* entries that are free: a list */
    uint32_t *seen, round; /* uint32_t[seen_count]: of each face the round that looked at it last */
    size_t seen_count;
    int64_t asked, refused;
} qw_guard;

/* New triangles in the place of some of the skin's. */
typedef struct qw_guard_edit {
    uint32_t old[QW_GUARD_MOST], old_count;    /* faces that go */
    uint32_t now[QW_GUARD_MOST][3], now_count; /* vertices of those that come */
} qw_guard_edit;

qw_guard qw_guard_begin(qw_env *env, qw_skin *skin);

/* Whether the skin would not intersect itself with the new triangles instead of the old, at the positions that it has
 * now. Each new one must have an area. */
bool qw_guard_allows(qw_guard *g, const qw_guard_edit *edit);

/* Whether a vertex may be there; moves it, and the guard's faces with it, where it may. */
bool qw_guard_move(qw_guard *g, uint32_t v, qw_wrap_lattice_point to);

/* The faces lie where they are now: called before and after an edit with those that change. */
void qw_guard_remove(qw_guard *g, uint32_t face);
void qw_guard_add(qw_guard *g, uint32_t face);

#endif
