#include "geometry/loops.h"

#include <assert.h>

static uint32_t next_side(uint32_t sides, uint32_t h) { return h % sides == sides - 1 ? h + 1 - sides : h + 1; }

/* The boundary half-edge that leaves the head of boundary half-edge h. */
static uint32_t next_on_rim(uint32_t sides, const uint32_t *twin, uint32_t h)
{
    uint32_t g = next_side(sides, h);
    while (twin[g] != QW_NONE) g = next_side(sides, twin[g]);
    return g;
}

qw_rims qw_find_rims(qw_env *env, uint32_t sides, const uint32_t *twin, uint32_t face_count)
{
    assert(sides == 3 || sides == 4);
    uint32_t total = sides * face_count, open = 0;
    for (uint32_t h = 0; h < total; h++) open += twin[h] == QW_NONE;
    qw_rims r = {.begin = QW_NEW(env, uint32_t, (size_t)open + 1), .half = QW_NEW(env, uint32_t, open)};
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, total);
    uint32_t filled = 0;
    r.begin[0] = 0;
    for (uint32_t h = 0; h < total; h++) {
        if (twin[h] != QW_NONE || seen[h]) continue;
        for (uint32_t g = h; !seen[g]; g = next_on_rim(sides, twin, g)) seen[g] = 1, r.half[filled++] = g;
        r.begin[++r.count] = filled;
    }
    qw_free(env, seen);
    return r;
}
