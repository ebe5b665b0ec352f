#include "field/scale.h"

#include "math/elementary.h"

#include <stdlib.h>
#include <string.h>

/* Normals that turn by less than this (radians) over a quad are as good as flat: on a plane what is left is rounding.
 */
static const double FLAT = 0.005;

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
    if (are_equal(size, mesh->vertex_count)) return;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count, *outgoing = qw_trimesh_outgoing(env, mesh);
    size_t capacity = n;
    heap q = {QW_NEW(env, float, n), QW_NEW(env, uint32_t, n), 0};
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) { /* most often nothing is to be limited */
        uint32_t a = mesh->corner[h], b = mesh->corner[qw_next(h)], low = size[a] < size[b] ? a : b,
                 high = low == a ? b : a;
        if (size[high] <= size[low] + slope * qw_distance(mesh->position[a], mesh->position[b])) continue;
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

/* Mean turning of the normal a unit of length around each vertex: a curvature that needs no second derivatives. */
static float *turning(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal)
{
    float *turn = QW_NEW_ZERO(env, float, mesh->vertex_count), *length = QW_NEW_ZERO(env, float, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        float t = qw_length(qw_sub(normal[u], normal[v])), l = qw_distance(mesh->position[u], mesh->position[v]);
        turn[u] += t, turn[v] += t, length[u] += l, length[v] += l;
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++) turn[v] = length[v] > 0 ? turn[v] / length[v] : 0.0f;
    qw_free(env, length);
    return turn;
}

static double quads_of(const qw_trimesh *mesh, const float *size)
{
    double sum = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        const uint32_t *c = mesh->corner + 3 * f;
        double s = (size[c[0]] + size[c[1]] + size[c[2]]) / 3.0;
        sum += 0.5 * qw_length(qw_face_cross(mesh, f)) / (s * s);
    }
    return sum;
}

void qw_scale_by_curvature(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, float strength, float *size)
{
    qw_scope_begin(env);
    double wanted = quads_of(mesh, size);
    float *turn = turning(env, mesh, normal);
    /* a quad of size s on curvature k bows by about s^2 k / 8: equal bow means s ~ k^(-1/2), bounded on both sides */
    double mean = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) mean += turn[v];
    mean /= mesh->vertex_count ? mesh->vertex_count : 1;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        double flat = 0.05 * mean + FLAT / size[v];
        float ratio = (float)((turn[v] + flat) / (mean + flat));
        float factor = fminf(fmaxf(1 / sqrtf(ratio), 1.0f / 3.0f), 1.6f);
        size[v] *= (float)qw_pow(factor, strength);
    }
    qw_limit_gradation(env, mesh, size, 0.4f);
    double fit = sqrt(quads_of(mesh, size) / wanted);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) size[v] = (float)(size[v] * fit);
    qw_scope_end(env);
}
