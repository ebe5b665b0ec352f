#include "mesh/blocks.h"

#include <string.h>

static bool in_one_block(const qw_edit *e, uint32_t f)
{
    const uint32_t *c = e->face[f].corner;
    uint16_t block = e->vertex[c[0]].block;
    return e->vertex[c[1]].block == block && e->vertex[c[2]].block == block;
}

static uint32_t mark_inner(qw_edit *e)
{
    uint32_t count = 0;
    for (uint32_t v = 0; v < e->vertex_count; v++) {
        qw_edit_vertex *vertex = &e->vertex[v];
        vertex->inner = vertex->out != QW_NONE;
        if (vertex->block >= count) count = vertex->block + 1u;
    }
    if (count < 2) {
        for (uint32_t v = 0; v < e->vertex_count; v++) e->vertex[v].inner = 0;
        return 0;
    }
    for (uint32_t f = 0; f < e->face_count; f++) {
        if (qw_edit_dead(e, f) || in_one_block(e, f)) continue;
        for (uint32_t i = 0; i < 3; i++) e->vertex[e->face[f].corner[i]].inner = 0;
    }
    return count;
}

/* begin[k + 1] holds the size of part k: makes it the place where the part's first element goes, and begin[count + 1] the whole. */
static void add_up(uint32_t *begin, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) begin[k + 2] += begin[k + 1];
}

qw_blocks qw_blocks_build(qw_edit *e)
{
    qw_blocks b = {.count = mark_inner(e)};
    if (b.count == 0) return b;
    qw_env *env = e->env;
    b.face_begin = QW_NEW_ZERO(env, uint32_t, (size_t)b.count + 2), b.face = QW_NEW(env, uint32_t, e->live_faces);
    b.vertex_begin = QW_NEW_ZERO(env, uint32_t, (size_t)b.count + 2), b.vertex = QW_NEW(env, uint32_t, e->live_vertices);
    for (uint32_t f = 0; f < e->face_count; f++)
        if (!qw_edit_dead(e, f) && in_one_block(e, f)) b.face_begin[e->vertex[e->face[f].corner[0]].block + 2]++;
    for (uint32_t v = 0; v < e->vertex_count; v++)
        if (e->vertex[v].inner) b.vertex_begin[e->vertex[v].block + 2]++;
    add_up(b.face_begin, b.count);
    add_up(b.vertex_begin, b.count);
    for (uint32_t f = 0; f < e->face_count; f++)
        if (!qw_edit_dead(e, f) && in_one_block(e, f)) b.face[b.face_begin[e->vertex[e->face[f].corner[0]].block + 1]++] = f;
    for (uint32_t v = 0; v < e->vertex_count; v++)
        if (e->vertex[v].inner) b.vertex[b.vertex_begin[e->vertex[v].block + 1]++] = v;
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
