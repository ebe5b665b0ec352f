#include "wrap/guard.h"

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

void qw_guard_add(qw_guard *g, uint32_t face)
{
    qw_guard_box r = range_of(g->skin, g->skin->corner + 3 * (size_t)face);
    g->box = qw_grow(g->env, g->box, &g->box_capacity, (size_t)face + 1, sizeof *g->box);
    g->box[face] = r;
    walk w = walk_over(g, &r);
    do {
        uint32_t e = g->spare;
        if (e != QW_NONE) {
            g->spare = g->entry[e].next;
        } else {
            g->entry = qw_grow(g->env, g->entry, &g->capacity, g->used + 1, sizeof *g->entry);
            e = (uint32_t)g->used++;
        }
        uint32_t *first = &g->first[cell_of(g, &w)];
        g->entry[e] = (qw_guard_entry){face, *first};
        *first = e;
    } while (step(&w));
}

void qw_guard_remove(qw_guard *g, uint32_t face)
{
    walk w = walk_over(g, &g->box[face]);
    do {
        uint32_t *link = &g->first[cell_of(g, &w)];
        while (g->entry[*link].face != face) link = &g->entry[*link].next;
        uint32_t e = *link;
        *link = g->entry[e].next;
        g->entry[e].next = g->spare, g->spare = e;
    } while (step(&w));
}

qw_guard qw_guard_begin(qw_env *env, qw_skin *skin)
{
    qw_guard g = {.env = env, .skin = skin, .side = skin->frame.side, .spare = QW_NONE};
    size_t count = 1;
    for (int k = 0; k < 3; k++) g.cells[k] = skin->frame.cells[k] + 1, count *= g.cells[k];
    g.first = QW_NEW(env, uint32_t, count);
    memset(g.first, 0xff, count * sizeof *g.first);
    for (uint32_t f = 0; f < skin->face_count; f++)
        if (!qw_skin_dead(skin, f)) qw_guard_add(&g, f);
    return g;
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
    points_of(s, x, p), points_of(s, y, q);
    return qw_triangles_collide(p, q, (int)shared);
}

static bool has_area(const qw_skin *s, const uint32_t c[3])
{
    double n[3];
    qw_exact_normal(&s->position[c[0]], &s->position[c[1]], &s->position[c[2]], n);
    return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

static void begin_round(qw_guard *g)
{
    size_t before = g->seen_count;
    if (before < g->skin->face_count) {
        g->seen = qw_grow(g->env, g->seen, &g->seen_count, g->skin->face_count, sizeof *g->seen);
        memset(g->seen + before, 0, (g->seen_count - before) * sizeof *g->seen);
    }
    if (++g->round == 0) memset(g->seen, 0, g->seen_count * sizeof *g->seen), g->round = 1;
}

/* Whether the triangle meets one of the skin that has not been looked at in this round. */
static bool meets_others(qw_guard *g, const uint32_t now[3], const qw_guard_box *r)
{
    walk w = walk_over(g, r);
    do {
        for (uint32_t e = g->first[cell_of(g, &w)]; e != QW_NONE; e = g->entry[e].next) {
            uint32_t f = g->entry[e].face;
            if (!overlap(r, &g->box[f]) || g->seen[f] == g->round) continue;
            if (collide(g->skin, now, g->skin->corner + 3 * (size_t)f)) return true;
        }
    } while (step(&w));
    return false;
}

bool qw_guard_allows(qw_guard *g, const qw_guard_edit *edit)
{
    const qw_skin *s = g->skin;
    g->asked++;
    g->refused++;
    for (uint32_t i = 0; i < edit->now_count; i++)
        if (!has_area(s, edit->now[i])) return false;
    for (uint32_t i = 0; i < edit->now_count; i++)
        for (uint32_t j = 0; j < i; j++)
            if (collide(s, edit->now[i], edit->now[j])) return false;
    begin_round(g);
    for (uint32_t i = 0; i < edit->old_count; i++) g->seen[edit->old[i]] = g->round;
    for (uint32_t i = 0; i < edit->now_count; i++) {
        qw_guard_box r = range_of(s, edit->now[i]);
        if (meets_others(g, edit->now[i], &r)) return false;
    }
    g->refused--;
    return true;
}

bool qw_guard_move(qw_guard *g, uint32_t v, qw_wrap_lattice_point to)
{
    qw_skin *s = g->skin;
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
    bool allowed = qw_guard_allows(g, &edit);
    if (!allowed) {
        s->position[v] = from;
        return false;
    }
    s->position[v] = from;
    for (uint32_t i = 0; i < edit.old_count; i++) qw_guard_remove(g, edit.old[i]);
    s->position[v] = to;
    for (uint32_t i = 0; i < edit.old_count; i++) qw_guard_add(g, edit.old[i]);
    return true;
}
