#include "base/hash.h"

#include <assert.h>
#include <string.h>

uint64_t qw_hash_real(uint64_t hash, double x)
{
    uint64_t bits;
    x += 0.0; /* -0 becomes 0 */
    memcpy(&bits, &x, sizeof bits);
    return qw_mix(hash ^ bits);
}

uint64_t qw_hash_place(const double p[3]) { return qw_hash_real(qw_hash_real(qw_hash_real(0, p[0]), p[1]), p[2]); }

uint64_t qw_hash_bytes(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; i++) hash = (hash ^ at[i]) * UINT64_C(0x100000001b3);
    return hash;
}

qw_hash_table qw_hash_table_create(qw_env *env, size_t numbers)
{
    size_t size = 16;
    while (size < 2 * numbers) size *= 2;
    qw_hash_table t = {QW_NEW(env, uint32_t, size), size - 1};
    memset(t.slot, 0xff, size * sizeof *t.slot);
    return t;
}

typedef struct wanted_place {
    const double *position, *at;
} wanted_place;

static bool is_same_place(const void *wanted, uint32_t v)
{
    const wanted_place *w = wanted;
    return qw_is_one_place(w->position + 3 * (size_t)v, w->at);
}

uint32_t *qw_find_places(qw_env *env, const double *position, uint32_t count, const uint8_t *only)
{
    assert(position || count == 0);
    size_t looked_at = 0;
    for (uint32_t v = 0; v < count; v++) looked_at += !only || only[v];
    uint32_t *place = QW_NEW(env, uint32_t, count);
    qw_hash_table t = qw_hash_table_create(env, looked_at);
    for (uint32_t v = 0; v < count; v++) {
        wanted_place at = {position, position + 3 * (size_t)v};
        place[v] = v;
        if (only && !only[v]) continue;
        uint32_t *slot = qw_hash_slot(&t, qw_hash_place(at.at), is_same_place, &at);
        if (*slot == QW_NONE) *slot = v;
        place[v] = *slot;
    }
    qw_free(env, t.slot);
    return place;
}
