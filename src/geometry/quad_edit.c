#include "geometry/quad_edit.h"

#include <assert.h>
#include <string.h>

static void *copy_of(qw_env *env, const void *from, size_t count, size_t size)
{
    void *to = qw_alloc_zero(env, count, size);
    if (from) memcpy(to, from, count * size);
    return to;
}

qw_quad_edit qw_quad_edit_open(qw_env *env, const qw_quadmesh *mesh)
{
    assert(mesh->twin && mesh->corner);
    qw_quad_edit e = {.env = env, .mesh = *mesh, .live_faces = mesh->face_count};
    size_t n = mesh->vertex_count, sides = (size_t)4 * mesh->face_count;
    e.mesh.position = copy_of(env, mesh->position, n, sizeof *mesh->position);
    e.mesh.corner = copy_of(env, mesh->corner, sides, sizeof *mesh->corner);
    e.mesh.twin = copy_of(env, mesh->twin, sides, sizeof *mesh->twin);
    e.mesh.kind = copy_of(env, mesh->kind, n, sizeof *mesh->kind);
    e.mesh.mark = copy_of(env, mesh->mark, sides, sizeof *mesh->mark);
    e.mesh.component = copy_of(env, mesh->component, n, sizeof *mesh->component);
    e.gone = QW_NEW_ZERO(env, uint8_t, mesh->face_count);
    e.out = qw_quadmesh_outgoing(env, &e.mesh);
    return e;
}

void qw_quad_edit_pack(qw_quad_edit *e)
{
    assert(e->live_faces <= e->mesh.face_count);
    qw_quadmesh *m = &e->mesh;
    uint32_t *face = QW_NEW(e->env, uint32_t, m->face_count), *vertex = QW_NEW(e->env, uint32_t, m->vertex_count),
             faces = 0, vertices = 0;
    memset(vertex, 0xff, m->vertex_count * sizeof *vertex);
    for (uint32_t f = 0; f < m->face_count; f++) {
        face[f] = e->gone[f] ? QW_NONE : faces++;
        for (uint32_t i = 0; i < 4 && !e->gone[f]; i++) vertex[m->corner[4 * f + i]] = 0;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (vertex[v] == QW_NONE) continue;
        m->position[vertices] = m->position[v];
        m->kind[vertices] = m->kind[v];
        m->component[vertices] = m->component[v];
        vertex[v] = vertices++;
    }
    for (uint32_t h = 0; h < 4 * m->face_count; h++) {
        if (e->gone[h / 4]) continue;
        uint32_t to = 4 * face[h / 4] + h % 4, t = m->twin[h];
        m->corner[to] = vertex[m->corner[h]];
        m->mark[to] = m->mark[h];
        m->twin[to] = t == QW_NONE ? QW_NONE : 4 * face[t / 4] + t % 4;
    }
    m->face_count = faces, m->vertex_count = vertices;
    qw_free(e->env, face), qw_free(e->env, vertex), qw_free(e->env, e->out);
    memset(e->gone, 0, faces);
    e->out = qw_quadmesh_outgoing(e->env, m);
    e->writes = 0;
}

void qw_quad_edit_keep(const qw_quad_edit *e)
{
    const qw_quadmesh *m = &e->mesh;
    qw_keep(e->env, m->position), qw_keep(e->env, m->kind), qw_keep(e->env, m->component);
    qw_keep(e->env, m->corner), qw_keep(e->env, m->twin), qw_keep(e->env, m->mark);
}

static void put(qw_quad_edit *e, void *at, const void *value, uint32_t size)
{
    if (e->keeps_journal) {
        e->journal = qw_grow(e->env, e->journal, &e->journal_capacity, e->writes + 1, sizeof *e->journal);
        qw_quad_write *w = &e->journal[e->writes++];
        w->at = at, w->size = size;
        memcpy(w->old, at, size);
    }
    memcpy(at, value, size);
}

void qw_quad_edit_undo(qw_quad_edit *e, size_t writes)
{
    assert(e->keeps_journal && writes <= e->writes);
    while (e->writes > writes) {
        const qw_quad_write *w = &e->journal[--e->writes];
        memcpy(w->at, w->old, w->size);
        if (w->at >= (void *)e->gone && w->at < (void *)(e->gone + e->mesh.face_count)) e->live_faces++;
    }
}

void qw_quad_edit_put(qw_quad_edit *e, uint32_t *at, uint32_t value) { put(e, at, &value, sizeof value); }
void qw_quad_edit_put_byte(qw_quad_edit *e, uint8_t *at, uint8_t value) { put(e, at, &value, sizeof value); }
void qw_quad_edit_place(qw_quad_edit *e, uint32_t v, qw_vec3 position)
{
    assert(v < e->mesh.vertex_count);
    put(e, &e->mesh.position[v], &position, sizeof position);
}

void qw_quad_edit_glue(qw_quad_edit *e, uint32_t a, uint32_t b)
{
    assert((a == QW_NONE || a < 4 * e->mesh.face_count) && (b == QW_NONE || b < 4 * e->mesh.face_count));
    qw_quadmesh *m = &e->mesh;
    uint8_t mark = (a == QW_NONE ? 0 : m->mark[a]) | (b == QW_NONE ? 0 : m->mark[b]);
    if (a != QW_NONE) qw_quad_edit_put(e, &m->twin[a], b), qw_quad_edit_put_byte(e, &m->mark[a], mark);
    if (b != QW_NONE) qw_quad_edit_put(e, &m->twin[b], a), qw_quad_edit_put_byte(e, &m->mark[b], mark);
}

void qw_quad_edit_relabel(qw_quad_edit *e, uint32_t from, uint32_t to)
{
    assert(from < e->mesh.vertex_count && to < e->mesh.vertex_count);
    uint32_t first = e->out[from], h = first;
    do {
        qw_quad_edit_put(e, &e->mesh.corner[h], to);
        h = qw_quad_around(&e->mesh, h);
    } while (h != QW_NONE && h != first);
}

void qw_quad_edit_set_out(qw_quad_edit *e, uint32_t v, uint32_t leaving)
{
    assert(v < e->mesh.vertex_count);
    uint32_t first = leaving;
    while (e->mesh.twin[first] != QW_NONE) {
        first = qw_quad_next(e->mesh.twin[first]);
        if (first == leaving) break;
    }
    qw_quad_edit_put(e, &e->out[v], first);
}

void qw_quad_edit_remove(qw_quad_edit *e, uint32_t f)
{
    assert(f < e->mesh.face_count);
    qw_quad_edit_put_byte(e, &e->gone[f], 1);
    e->live_faces--;
}

void qw_quad_edit_reserve(qw_quad_edit *e, uint32_t more)
{
    assert(e->mesh.face_count < QW_NONE / 4 - more);
    qw_env *env = e->env;
    qw_quadmesh *m = &e->mesh;
    size_t vertices = (size_t)m->vertex_count + more, sides = 4 * ((size_t)m->face_count + more);
    m->position = qw_resize(env, m->position, vertices, sizeof *m->position),
    m->kind = qw_resize(env, m->kind, vertices, sizeof *m->kind);
    m->component = qw_resize(env, m->component, vertices, sizeof *m->component),
    m->corner = qw_resize(env, m->corner, sides, sizeof *m->corner);
    m->twin = qw_resize(env, m->twin, sides, sizeof *m->twin),
    m->mark = qw_resize(env, m->mark, sides, sizeof *m->mark);
}

/* Share of the way to the middle of their neighbours that both halves of a split vertex move. */
static const float SPLIT_STEP = 0.33f;

uint32_t qw_quad_split_vertex(qw_quadmesh *m, const uint32_t *fan, uint32_t n, uint32_t cut, uint32_t part)
{
    assert(part > 0 && part < n && cut < n);
    uint32_t p = fan[cut], q = fan[(cut + part) % n], v = m->corner[p], w = m->vertex_count++, f = m->face_count++,
             h = 4 * f;
    uint32_t corner[4] = {v, m->corner[qw_quad_next(p)], w, m->corner[qw_quad_next(q)]},
             twin[4] = {m->twin[p], p, m->twin[q], q};
    qw_vec3 at = m->position[v], to_v = {0, 0, 0}, to_w = {0, 0, 0};
    for (uint32_t i = 0; i < n; i++) {
        uint32_t out = fan[(cut + i) % n];
        qw_vec3 step = qw_sub(m->position[m->corner[qw_quad_next(out)]], at);
        if (i > 0 && i < part) to_w = qw_add(to_w, qw_scale(step, SPLIT_STEP / (float)(part - 1)));
        if (i > part) to_v = qw_add(to_v, qw_scale(step, SPLIT_STEP / (float)(n - part - 1)));
    }
    for (uint32_t i = 0; i < part; i++) m->corner[fan[(cut + i) % n]] = w;
    m->position[v] = qw_add(at, to_v), m->position[w] = qw_add(at, to_w);
    m->kind[w] = m->kind[v], m->component[w] = m->component[v];
    for (uint32_t i = 0; i < 4; i++) {
        m->corner[h + i] = corner[i], m->mark[h + i] = 0;
        m->twin[h + i] = twin[i], m->twin[twin[i]] = h + i;
    }
    return f;
}
