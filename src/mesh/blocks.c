#include "mesh/blocks.h"

#include <string.h>

/* The block that all corners of a face are in, or QW_NONE. */
static uint32_t block_of(const qw_edit *e, uint32_t f)
{
    const uint32_t *c = e->face[f].corner;
    uint16_t block = e->vertex[c[0]].block;
    return e->vertex[c[1]].block == block && e->vertex[c[2]].block == block ? block : QW_NONE;
}

/* face_block: uint32_t[face_count], or NULL; QW_NONE for dead faces too. Returns the number of blocks, 0 for one. */
static uint32_t mark_inner(qw_edit *e, uint32_t *face_block)
{
    uint32_t count = 0;
    for (uint32_t v = 0; v < e->vertex_count; v++)
        if (e->vertex[v].block >= count) count = e->vertex[v].block + 1u;
    for (uint32_t v = 0; v < e->vertex_count; v++) e->vertex[v].inner = count > 1 && e->vertex[v].out != QW_NONE;
    if (count < 2) return 0;
    for (uint32_t f = 0; f < e->face_count; f++) {
        bool dead = qw_edit_dead(e, f);
        uint32_t block = dead ? QW_NONE : block_of(e, f);
        if (face_block) face_block[f] = block;
        if (dead || block != QW_NONE) continue;
        for (uint32_t i = 0; i < 3; i++) e->vertex[e->face[f].corner[i]].inner = 0;
    }
    return count;
}

/* begin[k + 2] holds the size of part k: makes begin[k + 1] the place where the part's first element goes. */
static void add_up(uint32_t *begin, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) begin[k + 2] += begin[k + 1];
}

qw_blocks qw_blocks_none(qw_edit *e)
{
    for (uint32_t v = 0; v < e->vertex_count; v++) e->vertex[v].inner = 0;
    return (qw_blocks){0};
}

qw_blocks qw_blocks_of_faces(qw_edit *e)
{
    uint32_t *block = QW_NEW(e->env, uint32_t, e->face_count);
    qw_blocks b = {.count = mark_inner(e, block)};
    if (b.count > 0) {
        b.begin = QW_NEW_ZERO(e->env, uint32_t, (size_t)b.count + 2), b.item = QW_NEW(e->env, uint32_t, e->live_faces);
        for (uint32_t f = 0; f < e->face_count; f++)
            if (block[f] != QW_NONE) b.begin[block[f] + 2]++;
        add_up(b.begin, b.count);
        for (uint32_t f = 0; f < e->face_count; f++)
            if (block[f] != QW_NONE) b.item[b.begin[block[f] + 1]++] = f;
    }
    qw_free(e->env, block);
    return b;
}

qw_blocks qw_blocks_of_vertices(qw_edit *e)
{
    qw_blocks b = {.count = mark_inner(e, NULL)};
    if (b.count == 0) return b;
    b.begin = QW_NEW_ZERO(e->env, uint32_t, (size_t)b.count + 2), b.item = QW_NEW(e->env, uint32_t, e->live_vertices);
    for (uint32_t v = 0; v < e->vertex_count; v++)
        if (e->vertex[v].inner) b.begin[e->vertex[v].block + 2]++;
    add_up(b.begin, b.count);
    for (uint32_t v = 0; v < e->vertex_count; v++)
        if (e->vertex[v].inner) b.item[b.begin[e->vertex[v].block + 1]++] = v;
    return b;
}

typedef struct run {
    const qw_reshape *r;
    const qw_blocks *blocks;
    qw_block_task task;
    void *user;
    uint32_t *done, *vertices, *faces, *round; /* [blocks->count]: what a task returned, vertices and faces that it took, its last round */
} run;

static void run_blocks(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const run *a = user;
    for (uint32_t b = begin; b < end; b++) {
        qw_reshape own = *a->r;
        a->done[b] = a->task(a->user, &own, a->blocks, b);
        a->vertices[b] = a->r->edit.live_vertices - own.edit.live_vertices;
        a->faces[b] = a->r->edit.live_faces - own.edit.live_faces;
        a->round[b] = own.edit.round;
    }
}

uint32_t qw_blocks_run(qw_reshape *r, const qw_blocks *blocks, qw_block_task task, void *user)
{
    qw_env *env = r->edit.env;
    uint32_t count = blocks->count, done = 0;
    qw_scope_begin(env);
    run a = {.r = r, .blocks = blocks, .task = task, .user = user};
    a.done = QW_NEW(env, uint32_t, count), a.vertices = QW_NEW(env, uint32_t, count);
    a.faces = QW_NEW(env, uint32_t, count), a.round = QW_NEW(env, uint32_t, count);
    qw_parallel(env, count, 1, run_blocks, &a);
    for (uint32_t b = 0; b < count; b++) {
        done += a.done[b];
        r->edit.live_vertices -= a.vertices[b];
        r->edit.live_faces -= a.faces[b];
        if (a.round[b] > r->edit.round) r->edit.round = a.round[b];
    }
    qw_scope_end(env);
    return done;
}
