#include "geometry/parts.h"

#include <assert.h>

qw_parts qw_sort_parts(qw_env *env, const qw_trimesh *mesh, const uint32_t *component, uint32_t count)
{
    qw_parts p = {.mesh = mesh, .count = count};
    uint32_t faces = mesh->face_count;
    p.face = QW_NEW(env, uint32_t, faces), p.number = QW_NEW(env, uint32_t, faces);
    p.begin = QW_NEW_ZERO(env, uint32_t, (size_t)count + 1);
    p.vertex = QW_NEW(env, uint32_t, mesh->vertex_count), p.visited = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count);
    for (uint32_t f = 0; f < faces; f++) {
        assert(component[f] < count);
        p.number[f] = p.begin[component[f] + 1]++;
    }
    for (uint32_t c = 0; c < count; c++) p.begin[c + 1] += p.begin[c];
    for (uint32_t f = 0; f < faces; f++) p.face[p.begin[component[f]] + p.number[f]] = f;
    return p;
}

qw_trimesh qw_take_part(qw_env *env, qw_parts *p, uint32_t component)
{
    assert(component < p->count);
    const uint32_t *face = p->face + p->begin[component];
    uint32_t faces = p->begin[component + 1] - p->begin[component];
    qw_trimesh part = {.face_count = faces, .corner = QW_NEW(env, uint32_t, 3 * (size_t)faces)};
    p->taken++;
    part.twin = QW_NEW(env, uint32_t, 3 * (size_t)faces);
    part.position = QW_NEW(env, qw_vec3, 3 * (size_t)faces);
    for (uint32_t h = 0; h < 3 * faces; h++) {
        uint32_t from = 3 * face[h / 3] + h % 3, v = p->mesh->corner[from], t = p->mesh->twin[from];
        if (p->visited[v] != p->taken) {
            p->visited[v] = p->taken, p->vertex[v] = part.vertex_count;
            part.position[part.vertex_count++] = p->mesh->position[v];
        }
        part.corner[h] = p->vertex[v];
        part.twin[h] = t == QW_NONE ? QW_NONE : 3 * p->number[t / 3] + t % 3;
    }
    return part;
}
