#include "products/wrap/skin_blocks.h"
#include "base/groups.h"

#include <assert.h>
#include <string.h>

enum { BLOCK = 8 }; /* cells along a side; a triangle of the skin is seldom longer than two */

typedef struct blocks {
    qw_env *env;
    qw_guard *guard;
    const qw_block_work *work;
    uint32_t across[3], count;
    uint32_t *begin, *item; /* uint32_t[count + 1], uint32_t[begin[count]]: the items of each block, in order */
    uint32_t *chosen;       /* blocks that are worked through at once */
    qw_guard_room *room;    /* qw_guard_room[chosen]: theirs */
    uint8_t *late;          /* uint8_t[items]: 1: reaches out of its room, or has left it */
} blocks;

static uint32_t block_of(const blocks *b, uint32_t v)
{
    const int32_t *p = b->guard->skin->position[v].at;
    uint32_t at[3];
    for (int k = 0; k < 3; k++) at[k] = (uint32_t)(p[k] / (BLOCK * b->guard->side));
    assert(at[0] < b->across[0] && at[1] < b->across[1] && at[2] < b->across[2]);
    return (at[2] * b->across[1] + at[1]) * b->across[0] + at[0];
}

static void sort_items(blocks *b, uint32_t count)
{
    uint32_t *block = QW_NEW(b->env, uint32_t, count);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t v = b->work->vertex_of(b->work->user, b->guard->skin, i);
        block[i] = v == QW_NONE ? QW_NONE : block_of(b, v);
    }
    b->item = qw_group(b->env, block, count, b->count, &b->begin);
    qw_free(b->env, block);
}

static uint32_t kind_of(const blocks *b, uint32_t block)
{
    uint32_t x = block % b->across[0], y = block / b->across[0] % b->across[1], z = block / b->across[0] / b->across[1];
    return x % 2 + 2 * (y % 2) + 4 * (z % 2);
}

/* Those of a kind, half a block wider on each side, share no cell. */
static qw_guard_room room_of(const blocks *b, uint32_t block)
{
    const uint32_t at[3] = {block % b->across[0], block / b->across[0] % b->across[1],
                            block / b->across[0] / b->across[1]};
    int32_t side = BLOCK * b->guard->side, half = BLOCK / 2 * b->guard->side;
    qw_guard_box box;
    for (int k = 0; k < 3; k++) {
        box.low[k] = (int32_t)at[k] * side - half, box.high[k] = ((int32_t)at[k] + 1) * side + half - 1;
        if (box.low[k] < 0) box.low[k] = 0;
    }
    return qw_guard_enter(b->guard, block, &box, 2 * (b->begin[block + 1] - b->begin[block]) + 4 * BLOCK * BLOCK);
}

/* Does a step on each item of some blocks; one that needs more room than its block has comes later. */
static void work_through(void *user, uint32_t begin, uint32_t end)
{
    const blocks *b = user;
    for (uint32_t c = begin; c < end; c++) {
        uint32_t hint = QW_NONE, first = b->begin[b->chosen[c]], last = b->begin[b->chosen[c] + 1];
        if (!qw_listen(b->env)) return;
        assert(first <= last);
        for (uint32_t i = first; i < last; i++) {
            qw_guard_room *room = &b->room[c];
            if (b->late[b->item[i]]) continue;
            room->reaches_out = false;
            b->work->step(b->work->user, room, b->item[i], &hint);
            b->late[b->item[i]] = room->reaches_out;
        }
    }
}

/* Earlier edits may have taken an item elsewhere: where others may be at work it is not even looked at. */
static void put_off_what_left(blocks *b, uint32_t c)
{
    for (uint32_t i = b->begin[b->chosen[c]]; i < b->begin[b->chosen[c] + 1]; i++) {
        uint32_t v = b->work->vertex_of(b->work->user, b->guard->skin, b->item[i]);
        b->late[b->item[i]] = v != QW_NONE && !qw_room_holds(&b->room[c], v);
    }
}

static void work_on_kind(blocks *b, uint32_t kind)
{
    uint32_t chosen = 0;
    for (uint32_t i = 0; i < b->count; i++)
        if (b->begin[i] < b->begin[i + 1] && kind_of(b, i) == kind)
            b->chosen[chosen] = i, b->room[chosen++] = room_of(b, i);
    for (uint32_t c = 0; c < chosen; c++) put_off_what_left(b, c);
    qw_parallel(b->env, chosen, 1, work_through, b);
    qw_heartbeat(b->env);
    for (uint32_t c = 0; c < chosen; c++) qw_guard_leave(&b->room[c]);
}

static uint32_t most_of_a_kind(const blocks *b)
{
    uint32_t most = 0, of_kind[8] = {0};
    for (uint32_t i = 0; i < b->count; i++)
        if (b->begin[i] < b->begin[i + 1]) of_kind[kind_of(b, i)]++;
    for (int kind = 0; kind < 8; kind++)
        if (of_kind[kind] > most) most = of_kind[kind];
    return most;
}

uint32_t qw_living_vertex(void *user, const qw_skin *s, uint32_t v)
{
    (void)user;
    return s->out[v] == QW_NONE ? QW_NONE : v;
}

void qw_in_blocks(qw_env *env, qw_guard *g, uint32_t count, const qw_block_work *work)
{
    blocks b = {.env = env, .guard = g, .work = work, .count = 1};
    uint32_t hint = QW_NONE;
    for (int k = 0; k < 3; k++) b.across[k] = g->cells[k] / BLOCK + 1, b.count *= b.across[k];
    qw_scope_begin(env);
    sort_items(&b, count);
    uint32_t most = most_of_a_kind(&b);
    b.chosen = QW_NEW(env, uint32_t, most), b.room = QW_NEW(env, qw_guard_room, most);
    b.late = QW_NEW_ZERO(env, uint8_t, count);
    for (uint32_t kind = 0; kind < 8; kind++) work_on_kind(&b, kind);
    qw_guard_room whole = qw_guard_everywhere(g);
    for (uint32_t i = 0; i < count; i++) {
        if (!b.late[i]) continue;
        qw_heartbeat(env);
        work->step(work->user, &whole, i, &hint);
    }
    qw_scope_end(env);
}
