/* Edges that the input marks as sharp. Cleaning renumbers vertices, parts some and joins others, but moves none at
 * which a mark ends: a mark is found again by the places of its ends, as a hash of both. */
#include "remesh/clean/marks.h"

#include "base/hash.h"
#include "base/sort.h"

#include <assert.h>

static uint64_t hash_place(qw_vec3 p) { return qw_hash_place((double[3]){p.x, p.y, p.z}); }

/* The same both ways. */
static uint64_t hash_edge(qw_vec3 a, qw_vec3 b)
{
    uint64_t x = hash_place(a), y = hash_place(b);
    return x < y ? qw_mix(x) ^ y : qw_mix(y) ^ x;
}

static qw_vec3 place_of(const qw_clean_input *input, const qw_frame *frame, uint32_t v)
{
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = (input->position[3 * (size_t)v + (size_t)k] - frame->center[k]) * frame->scale;
    return qw_v3((float)p[0], (float)p[1], (float)p[2]);
}

static bool contains(const uint64_t *sorted, size_t count, uint64_t key)
{
    size_t at = qw_first_not_below(sorted, count, key);
    return at < count && sorted[at] == key;
}

qw_mark_ends qw_find_mark_ends(qw_env *env, const qw_clean_input *input, const qw_frame *frame)
{
    assert(frame->scale > 0);
    qw_mark_ends ends = {QW_NEW(env, uint64_t, 2 * (size_t)input->mark_count), 2 * (size_t)input->mark_count};
    for (size_t i = 0; i < ends.count; i++) ends.key[i] = hash_place(place_of(input, frame, input->mark[i]));
    qw_sort_u64(ends.key, ends.count);
    return ends;
}

bool qw_is_mark_end(const qw_mark_ends *ends, qw_vec3 place)
{
    assert(ends->key || ends->count == 0);
    return contains(ends->key, ends->count, hash_place(place));
}

int64_t qw_add_marks(qw_env *env, const qw_clean_input *input, const qw_frame *frame, qw_trimesh *mesh)
{
    assert(frame->scale > 0 && mesh->mark);
    qw_scope_begin(env);
    uint64_t *key = QW_NEW(env, uint64_t, input->mark_count);
    for (size_t i = 0; i < input->mark_count; i++)
        key[i] = hash_edge(place_of(input, frame, input->mark[2 * i]), place_of(input, frame, input->mark[2 * i + 1]));
    qw_sort_u64(key, input->mark_count);
    int64_t count = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t t = mesh->twin[h];
        if (t == QW_NONE || t < h || mesh->mark[h]) continue;
        if (!contains(key, input->mark_count,
                      hash_edge(mesh->position[mesh->corner[h]], mesh->position[mesh->corner[qw_next(h)]])))
            continue;
        mesh->mark[h] = mesh->mark[t] = QW_MARK_FEATURE;
        count++;
    }
    qw_scope_end(env);
    return count;
}

int64_t qw_take_marks(qw_env *env, const qw_clean_input *input, const qw_frame *frame, qw_trimesh *mesh)
{
    assert(!mesh->mark);
    mesh->mark = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)mesh->face_count);
    return qw_add_marks(env, input, frame, mesh);
}
