#include "remesh/working/mesh_blocks.h"

#include <assert.h>
#include <string.h>

/* Of a face with corners in several blocks. No block has this number. */
static const uint32_t SEAM = QW_NONE - 1;

typedef struct marking {
    qw_edit *edit;
    uint32_t *face_block;
} marking;

static void begin_vertices(void *user, uint32_t begin, uint32_t end)
{
    qw_edit *e = ((const marking *)user)->edit;
    for (uint32_t v = begin; v < end; v++) e->vertex[v].inner = e->vertex[v].out != QW_NONE;
}

static uint32_t block_of(const qw_edit *e, uint32_t f)
{
    assert(f < e->face_count);
    if (qw_edit_dead(e, f)) return QW_NONE;
    const uint32_t *c = e->face[f].corner;
    uint16_t block = e->vertex[c[0]].block;
    return e->vertex[c[1]].block == block && e->vertex[c[2]].block == block ? block : SEAM;
}

static void find_blocks(void *user, uint32_t begin, uint32_t end)
{
    const marking *m = user;
    for (uint32_t f = begin; f < end; f++) m->face_block[f] = block_of(m->edit, f);
}

/* Returns the block that all corners of a face are in, SEAM, or QW_NONE for dead faces: uint32_t[face_count]. */
static uint32_t *mark_inner(qw_edit *e)
{
    marking m = {e, QW_NEW(e->env, uint32_t, e->face_count)};
    qw_parallel(e->env, e->vertex_count, QW_GRAIN_LIGHT, begin_vertices, &m);
    qw_parallel(e->env, e->face_count, QW_GRAIN_LIGHT, find_blocks, &m);
    for (uint32_t f = 0; f < e->face_count; f++)
        for (uint32_t i = 0; i < 3 && m.face_block[f] == SEAM; i++) e->vertex[e->face[f].corner[i]].inner = 0;
    return m.face_block;
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
    assert(e->live_faces <= e->face_count);
    if (e->block_count < 2) return qw_blocks_none(e);
    uint32_t *block = mark_inner(e);
    qw_blocks b = {.count = e->block_count};
    b.begin = QW_NEW_ZERO(e->env, uint32_t, (size_t)b.count + 2), b.item = QW_NEW(e->env, uint32_t, e->live_faces);
    for (uint32_t f = 0; f < e->face_count; f++)
        if (block[f] < SEAM) b.begin[block[f] + 2]++;
    add_up(b.begin, b.count);
    for (uint32_t f = 0; f < e->face_count; f++)
        if (block[f] < SEAM) b.item[b.begin[block[f] + 1]++] = f;
    qw_free(e->env, block);
    return b;
}

qw_blocks qw_blocks_of_vertices(qw_edit *e)
{
    assert(e->live_vertices <= e->vertex_count);
    if (e->block_count < 2) return qw_blocks_none(e);
    qw_free(e->env, mark_inner(e));
    qw_blocks b = {.count = e->block_count};
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
    /* [blocks->count]: what a task returned, vertices and faces that it took, its last round */
    uint32_t *done, *vertices, *faces, *round;
} run;

/* Runs a task on each block with counters of its own, and notes what they came to. */
static void run_blocks(void *user, uint32_t begin, uint32_t end)
{
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
    assert(task);
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
