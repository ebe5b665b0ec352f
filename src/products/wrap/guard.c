#include "products/wrap/guard.h"

#include <assert.h>
#include <string.h>

/* ---- cells */

static qw_guard_box range_of(const qw_skin *s, const uint32_t *corner)
{
    qw_guard_box r;
    for (int k = 0; k < 3; k++) {
        int32_t a = s->position[corner[0]].at[k], b = s->position[corner[1]].at[k], c = s->position[corner[2]].at[k];
        r.low[k] = a < b ? a : b, r.high[k] = a > b ? a : b;
        if (c < r.low[k]) r.low[k] = c;
        if (c > r.high[k]) r.high[k] = c;
    }
    return r;
}

static bool overlap(const qw_guard_box *a, const qw_guard_box *b)
{
    for (int k = 0; k < 3; k++)
        if (a->high[k] < b->low[k] || b->high[k] < a->low[k]) return false;
    return true;
}

/* The cells of a range, one after another; at[] must begin as its low corner's. */
typedef struct walk {
    uint32_t low[3], high[3], at[3];
} walk;

static walk walk_over(const qw_guard *g, const qw_guard_box *r)
{
    walk w;
    for (int k = 0; k < 3; k++) {
        w.low[k] = w.at[k] = (uint32_t)(r->low[k] / g->side), w.high[k] = (uint32_t)(r->high[k] / g->side);
        assert(w.high[k] < g->cells[k]);
    }
    return w;
}

static size_t cell_of(const qw_guard *g, const walk *w)
{
    return ((size_t)w->at[2] * g->cells[1] + w->at[1]) * g->cells[0] + w->at[0];
}

static bool step(walk *w)
{
    for (int k = 0; k < 3; k++) {
        if (w->at[k] < w->high[k]) {
            w->at[k]++;
            return true;
        }
        w->at[k] = w->low[k];
    }
    return false;
}

static uint32_t entries_of(const qw_guard *g, const qw_guard_box *r)
{
    walk w = walk_over(g, r);
    return (w.high[0] - w.low[0] + 1) * (w.high[1] - w.low[1] + 1) * (w.high[2] - w.low[2] + 1);
}

static qw_guard_spare *spare_of(qw_guard_room *room) { return room->is_whole ? &room->guard->spare : &room->spare; }

/* Asks for memory where none is free and the room is whole. */
static uint32_t free_entry(qw_guard_room *room)
{
    qw_guard *g = room->guard;
    qw_guard_spare *s = spare_of(room);
    room->left--;
    if (s->count == 0) {
        assert(room->is_whole);
        g->entry = qw_grow(g->env, g->entry, &g->capacity, g->used + 1, sizeof *g->entry);
        return (uint32_t)g->used++;
    }
    s->count--;
    if (s->first == QW_NONE) return s->from++;
    uint32_t e = s->first;
    s->first = g->entry[e].next;
    return e;
}

static void give_back(qw_guard_room *room, uint32_t e)
{
    qw_guard_spare *s = spare_of(room);
    room->guard->entry[e].next = s->first, s->first = e, s->count++, room->left++;
}

void qw_guard_add(qw_guard_room *room, uint32_t face)
{
    qw_guard *g = room->guard;
    qw_guard_box r = range_of(g->skin, g->skin->corner + 3 * (size_t)face);
    if (room->is_whole) g->box = qw_grow(g->env, g->box, &g->box_capacity, (size_t)face + 1, sizeof *g->box);
    g->box[face] = r;
    walk w = walk_over(g, &r);
    do {
        uint32_t e = free_entry(room), *first = &g->first[cell_of(g, &w)];
        g->entry[e] = (qw_guard_entry){face, *first};
        *first = e;
    } while (step(&w));
}

void qw_guard_remove(qw_guard_room *room, uint32_t face)
{
    qw_guard *g = room->guard;
    walk w = walk_over(g, &g->box[face]);
    do {
        uint32_t *link = &g->first[cell_of(g, &w)];
        while (g->entry[*link].face != face) link = &g->entry[*link].next;
        uint32_t e = *link;
        *link = g->entry[e].next;
        give_back(room, e);
    } while (step(&w));
}

qw_guard qw_guard_begin(qw_env *env, qw_skin *skin)
{
    qw_guard g = {.env = env, .skin = skin, .side = skin->frame.side, .spare = {.first = QW_NONE}};
    size_t count = 1;
    for (int k = 0; k < 3; k++) g.cells[k] = skin->frame.cells[k] + 1, count *= g.cells[k];
    g.first = QW_NEW(env, uint32_t, count);
    memset(g.first, 0xff, count * sizeof *g.first);
    g.rooms = qw_grow(env, NULL, &g.rooms_capacity, 1, sizeof *g.rooms); /* in the scope of the guard */
    qw_guard_room room = qw_guard_everywhere(&g);
    for (uint32_t f = 0; f < skin->face_count; f++)
        if (!qw_skin_dead(skin, f)) qw_guard_add(&room, f);
    return g;
}

/* ---- rooms */

qw_guard_room qw_guard_everywhere(qw_guard *g)
{
    qw_guard_room room = {.guard = g, .is_whole = true};
    for (int k = 0; k < 3; k++) room.box.high[k] = INT32_MAX;
    return room;
}

/* Its spare entries are those of before, and where these are too few a new range. */
qw_guard_room qw_guard_enter(qw_guard *g, uint32_t number, const qw_guard_box *box, uint32_t entries)
{
    g->rooms = qw_grow(g->env, g->rooms, &g->rooms_capacity, (size_t)number + 1, sizeof *g->rooms);
    while (g->room_count <= number) g->rooms[g->room_count++] = (qw_guard_spare){.first = QW_NONE};
    qw_guard_room room = {.guard = g, .box = *box, .number = number, .spare = g->rooms[number]};
    qw_guard_spare *s = &room.spare;
    if (s->count < entries) {
        for (; s->from < s->to; s->count--) give_back(&room, s->from++);
        s->from = (uint32_t)g->used, s->to = s->from + entries, s->count += entries;
        g->used += entries;
        g->entry = qw_grow(g->env, g->entry, &g->capacity, g->used, sizeof *g->entry);
    }
    assert(s->count >= entries);
    room.left = entries;
    return room;
}

void qw_guard_leave(const qw_guard_room *room) { room->guard->rooms[room->number] = room->spare; }

static bool is_within(const qw_guard_box *inner, const qw_guard_box *outer)
{
    for (int k = 0; k < 3; k++)
        if (inner->low[k] < outer->low[k] || inner->high[k] > outer->high[k]) return false;
    return true;
}

bool qw_room_holds(qw_guard_room *room, uint32_t v)
{
    const int32_t *at = room->guard->skin->position[v].at;
    qw_guard_box here = {{at[0], at[1], at[2]}, {at[0], at[1], at[2]}};
    bool holds = room->is_whole || is_within(&here, &room->box);
    room->reaches_out |= !holds;
    return holds;
}

/* Whether all that the edit touches lies in the room, which has the entries that it takes. */
static bool has_space(qw_guard_room *room, const qw_guard_edit *edit)
{
    const qw_guard *g = room->guard;
    int64_t left = room->left;
    if (room->is_whole) return true;
    for (uint32_t i = 0; i < edit->old_count; i++) {
        if (!is_within(&g->box[edit->old[i]], &room->box)) return false;
        left += entries_of(g, &g->box[edit->old[i]]);
    }
    for (uint32_t i = 0; i < edit->now_count; i++) {
        qw_guard_box r = range_of(g->skin, edit->now[i]);
        if (!is_within(&r, &room->box)) return false;
        left -= entries_of(g, &r);
    }
    return left >= 0;
}

/* ---- pairs */

static void points_of(const qw_skin *s, const uint32_t corner[3], qw_wrap_lattice_point p[3])
{
    for (int i = 0; i < 3; i++) p[i] = s->position[corner[i]];
}

/* Whether two triangles with these corners have a point in common that they should not. */
static bool collide(const qw_skin *s, const uint32_t a[3], const uint32_t b[3])
{
    uint32_t x[3], y[3], shared = 0;
    bool taken[3] = {false, false, false}, used[3] = {false, false, false};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (a[i] == b[j]) x[shared] = a[i], y[shared++] = b[j], used[i] = taken[j] = true;
    if (shared == 3) return true;
    uint32_t m = shared, n = shared;
    for (int i = 0; i < 3; i++)
        if (!used[i]) x[m++] = a[i];
    for (int j = 0; j < 3; j++)
        if (!taken[j]) y[n++] = b[j];
    qw_wrap_lattice_point p[3], q[3];
    assert(m == 3 && n == 3);
    points_of(s, x, p), points_of(s, y, q);
    return qw_triangles_collide(p, q, (int)shared);
}

static bool has_area(const qw_skin *s, const uint32_t c[3])
{
    double n[3];
    qw_exact_normal(&s->position[c[0]], &s->position[c[1]], &s->position[c[2]], n);
    return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

static bool is_among(const uint32_t *faces, uint32_t count, uint32_t f)
{
    for (uint32_t i = 0; i < count; i++)
        if (faces[i] == f) return true;
    return false;
}

/* Whether the walk is at the one with the lowest numbers of the cells that its range and a box share: each face is
 * looked at once. */
static bool is_first_shared(const qw_guard *g, const walk *w, const qw_guard_box *other)
{
    for (int k = 0; k < 3; k++) {
        int32_t begin = (int32_t)w->at[k] * g->side, low = other->low[k];
        if (low >= begin + g->side || (low < begin && w->at[k] != w->low[k])) return false;
    }
    return true;
}

/* Whether a face that stays meets one of the new triangles, which have these boxes. */
static bool meets_new(const qw_skin *s, const qw_guard_edit *edit, const qw_guard_box *now, uint32_t face,
                      const qw_guard_box *box)
{
    for (uint32_t i = 0; i < edit->now_count; i++)
        if (overlap(&now[i], box) && collide(s, edit->now[i], s->corner + 3 * (size_t)face)) return true;
    return false;
}

/* Whether any of the new triangles meets one of the skin that stays: all cells about them are walked over once. */
static bool meet_others(const qw_guard *g, const qw_guard_edit *edit)
{
    assert(edit->now_count <= QW_GUARD_MOST);
    qw_guard_box now[QW_GUARD_MOST], all = {{INT32_MAX, INT32_MAX, INT32_MAX}, {0, 0, 0}};
    for (uint32_t i = 0; i < edit->now_count; i++) {
        now[i] = range_of(g->skin, edit->now[i]);
        for (int k = 0; k < 3; k++) {
            if (now[i].low[k] < all.low[k]) all.low[k] = now[i].low[k];
            if (now[i].high[k] > all.high[k]) all.high[k] = now[i].high[k];
        }
    }
    if (edit->now_count == 0) return false;
    walk w = walk_over(g, &all);
    do {
        for (uint32_t e = g->first[cell_of(g, &w)]; e != QW_NONE; e = g->entry[e].next) {
            uint32_t f = g->entry[e].face;
            const qw_guard_box *box = &g->box[f];
            if (!overlap(&all, box) || !is_first_shared(g, &w, box) || is_among(edit->old, edit->old_count, f))
                continue;
            if (meets_new(g->skin, edit, now, f, box)) return true;
        }
    } while (step(&w));
    return false;
}

bool qw_guard_allows(qw_guard_room *room, const qw_guard_edit *edit)
{
    const qw_skin *s = room->guard->skin;
    if (!has_space(room, edit)) {
        room->reaches_out = true;
        return false;
    }
    for (uint32_t i = 0; i < edit->now_count; i++)
        if (!has_area(s, edit->now[i])) return false;
    for (uint32_t i = 0; i < edit->now_count; i++)
        for (uint32_t j = 0; j < i; j++)
            if (collide(s, edit->now[i], edit->now[j])) return false;
    return !meet_others(room->guard, edit);
}

bool qw_guard_move(qw_guard_room *room, uint32_t v, qw_wrap_lattice_point to)
{
    qw_skin *s = room->guard->skin;
    qw_guard_edit edit = {.old_count = 0};
    qw_wrap_lattice_point from = s->position[v];
    uint32_t h = s->out[v];
    if (qw_same_point(&from, &to)) return true;
    do {
        if (edit.old_count == QW_GUARD_MOST) return false;
        edit.old[edit.old_count++] = h / 3;
        for (int i = 0; i < 3; i++) edit.now[edit.now_count][i] = s->corner[h - h % 3 + (uint32_t)i];
        edit.now_count++;
        h = qw_skin_around(s, h);
    } while (h != s->out[v]);
    s->position[v] = to;
    bool allowed = qw_guard_allows(room, &edit);
    if (!allowed) {
        s->position[v] = from;
        return false;
    }
    s->position[v] = from;
    for (uint32_t i = 0; i < edit.old_count; i++) qw_guard_remove(room, edit.old[i]);
    s->position[v] = to;
    for (uint32_t i = 0; i < edit.old_count; i++) qw_guard_add(room, edit.old[i]);
    return true;
}
