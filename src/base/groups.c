#include "base/groups.h"

uint32_t *qw_group(qw_env *env, const uint32_t *of, uint32_t count, uint32_t groups, uint32_t **first)
{
    uint32_t *at = QW_NEW_ZERO(env, uint32_t, (size_t)groups + 2), *thing = QW_NEW(env, uint32_t, count);
    for (uint32_t i = 0; i < count; i++)
        if (of[i] != QW_NONE) at[of[i] + 2]++;
    for (uint32_t g = 0; g < groups; g++) at[g + 2] += at[g + 1];
    for (uint32_t i = 0; i < count; i++)
        if (of[i] != QW_NONE) thing[at[of[i] + 1]++] = i;
    *first = at;
    return thing;
}
