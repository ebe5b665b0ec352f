#include "remesh/quads/quad_components.h"

#include <assert.h>
#include <string.h>

qw_quadmesh qw_pick_components(qw_env *env, const qw_quadmesh *q, const uint8_t *wanted, const qw_quadmesh *more)
{
    assert(q->twin && q->kind && q->mark && q->component && wanted);
    qw_quadmesh r = {0};
    uint32_t *face = QW_NEW(env, uint32_t, q->face_count), *vertex = QW_NEW(env, uint32_t, q->vertex_count);
    size_t vertices = (size_t)q->vertex_count + (more ? more->vertex_count : 0),
           sides = 4 * ((size_t)q->face_count + (more ? more->face_count : 0));
    r.position = QW_NEW(env, qw_vec3, vertices), r.kind = QW_NEW(env, uint8_t, vertices),
    r.component = QW_NEW(env, uint32_t, vertices);
    r.corner = QW_NEW(env, uint32_t, sides), r.twin = QW_NEW(env, uint32_t, sides),
    r.mark = QW_NEW(env, uint8_t, sides);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        vertex[v] = QW_NONE;
        if (!wanted[q->component[v]]) continue;
        r.position[r.vertex_count] = q->position[v], r.kind[r.vertex_count] = q->kind[v],
        r.component[r.vertex_count] = q->component[v];
        vertex[v] = r.vertex_count++;
    }
    for (uint32_t f = 0; f < q->face_count; f++)
        face[f] = wanted[q->component[q->corner[4 * f]]] ? r.face_count++ : QW_NONE;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (face[h / 4] == QW_NONE) continue;
        uint32_t to = 4 * face[h / 4] + h % 4, t = q->twin[h];
        r.corner[to] = vertex[q->corner[h]], r.mark[to] = q->mark[h];
        r.twin[to] = t == QW_NONE ? QW_NONE : 4 * face[t / 4] + t % 4;
    }
    qw_free(env, face), qw_free(env, vertex);
    return r;
}

void qw_append_quads(qw_quadmesh *r, const qw_quadmesh *more)
{
    assert(r->twin && r->component && more->twin && more->component);
    uint32_t vertices = r->vertex_count, sides = 4 * r->face_count;
    memcpy(r->position + vertices, more->position, more->vertex_count * sizeof *more->position);
    memcpy(r->kind + vertices, more->kind, more->vertex_count);
    memcpy(r->component + vertices, more->component, more->vertex_count * sizeof *more->component);
    for (uint32_t h = 0; h < 4 * more->face_count; h++) {
        r->corner[sides + h] = vertices + more->corner[h], r->mark[sides + h] = more->mark[h];
        r->twin[sides + h] = more->twin[h] == QW_NONE ? QW_NONE : sides + more->twin[h];
    }
    r->vertex_count += more->vertex_count, r->face_count += more->face_count;
}

qw_quadmesh qw_join_quads(qw_env *env, const qw_quadmesh *quads, uint32_t count)
{
    size_t vertices = 0, sides = 0;
    for (uint32_t i = 0; i < count; i++) vertices += quads[i].vertex_count, sides += 4 * (size_t)quads[i].face_count;
    qw_quadmesh all = {.position = QW_NEW(env, qw_vec3, vertices),
                       .kind = QW_NEW(env, uint8_t, vertices),
                       .component = QW_NEW(env, uint32_t, vertices),
                       .corner = QW_NEW(env, uint32_t, sides),
                       .twin = QW_NEW(env, uint32_t, sides),
                       .mark = QW_NEW(env, uint8_t, sides)};
    for (uint32_t i = 0; i < count; i++) qw_append_quads(&all, &quads[i]);
    return all;
}

void qw_keep_quads(qw_env *env, const qw_quadmesh *q)
{
    qw_keep(env, q->position), qw_keep(env, q->kind), qw_keep(env, q->component);
    qw_keep(env, q->corner), qw_keep(env, q->twin), qw_keep(env, q->mark);
}
