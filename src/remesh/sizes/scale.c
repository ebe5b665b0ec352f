#include "remesh/sizes/scale.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* Dijkstra from the small sizes outward, with a binary heap of (size, vertex); ties by vertex index, so the order is
 * fixed. */
typedef struct heap {
    float *key;
    uint32_t *item, count;
} heap;

static bool before(const heap *q, uint32_t a, uint32_t b)
{
    return q->key[a] < q->key[b] || (q->key[a] == q->key[b] && q->item[a] < q->item[b]);
}

static void swap(heap *q, uint32_t a, uint32_t b)
{
    float k = q->key[a];
    uint32_t i = q->item[a];
    q->key[a] = q->key[b], q->item[a] = q->item[b];
    q->key[b] = k, q->item[b] = i;
}

static void push(heap *q, float key, uint32_t item)
{
    uint32_t at = q->count++;
    q->key[at] = key, q->item[at] = item;
    while (at > 0 && before(q, at, (at - 1) / 2)) swap(q, at, (at - 1) / 2), at = (at - 1) / 2;
}

static void pop(heap *q)
{
    assert(q->count > 0);
    swap(q, 0, --q->count);
    for (uint32_t at = 0;;) {
        uint32_t child = 2 * at + 1;
        if (child >= q->count) return;
        if (child + 1 < q->count && before(q, child + 1, child)) child++;
        if (!before(q, child, at)) return;
        swap(q, at, child);
        at = child;
    }
}

static void grow(qw_env *env, heap *q, size_t *capacity)
{
    size_t items = *capacity;
    q->key = qw_grow(env, q->key, capacity, q->count + 1, sizeof *q->key);
    q->item = qw_grow(env, q->item, &items, q->count + 1, sizeof *q->item);
}

static bool are_equal(const float *size, uint32_t count)
{
    for (uint32_t v = 1; v < count; v++)
        if (size[v] != size[0]) return false;
    return true;
}

void qw_limit_gradation(qw_env *env, const qw_trimesh *mesh, float *size, float slope)
{
    assert(mesh->twin && slope >= 0);
    if (are_equal(size, mesh->vertex_count)) return;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count, *outgoing = qw_trimesh_outgoing(env, mesh);
    size_t capacity = n;
    heap q = {QW_NEW(env, float, n), QW_NEW(env, uint32_t, n), 0};
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) { /* most often nothing is to be limited */
        if (mesh->twin[h] < h) continue;                  /* the edge was seen */
        uint32_t a = mesh->corner[h], b = mesh->corner[qw_next(h)], low = size[a] < size[b] ? a : b,
                 high = low == a ? b : a;
        float rise = size[high] - size[low], run2 = qw_length2(qw_sub(mesh->position[a], mesh->position[b]));
        if (rise * rise < 0.999f * (slope * slope) * run2) continue; /* clearly, as most often: without a root */
        if (size[high] <= size[low] + slope * sqrtf(run2)) continue;
        if (q.count == capacity) grow(env, &q, &capacity);
        push(&q, size[low], low);
    }
    while (q.count > 0) {
        float key = q.key[0];
        uint32_t v = q.item[0], first = outgoing[v], h = first;
        pop(&q);
        if (key > size[v]) continue;
        do {
            uint32_t back = qw_prev(h), ends[2] = {mesh->corner[qw_next(h)], mesh->corner[back]};
            for (int i = 0; i < 2; i++) {
                float most = key + slope * qw_distance(mesh->position[v], mesh->position[ends[i]]);
                if (size[ends[i]] <= most) continue;
                size[ends[i]] = most;
                if (q.count == capacity) grow(env, &q, &capacity);
                push(&q, most, ends[i]);
            }
            h = mesh->twin[back];
        } while (h != QW_NONE && h != first);
    }
    qw_scope_end(env);
}

float *qw_distances(qw_env *env, const qw_trimesh *mesh, const uint8_t *is_from, float farthest)
{
    assert(mesh->twin && is_from);
    float *distance = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) distance[v] = is_from[v] ? 0 : farthest;
    qw_limit_gradation(env, mesh, distance, 1);
    return distance;
}
