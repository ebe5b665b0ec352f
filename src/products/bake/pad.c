#include "products/bake/pad.h"

#include <assert.h>

enum { QUEUED = 2 }; /* of covered: it is in the list */

typedef struct padder {
    const qw_picture *picture;
    uint32_t count, texels;
    uint8_t *covered;
} padder;

static uint32_t read(const qw_picture *p, size_t i)
{
    return p->bits == 8 ? ((const uint8_t *)p->pixels)[i] : ((const uint16_t *)p->pixels)[i];
}

static void write(const qw_picture *p, size_t i, uint32_t value)
{
    if (p->bits == 8) ((uint8_t *)p->pixels)[i] = (uint8_t)value;
    else ((uint16_t *)p->pixels)[i] = (uint16_t)value;
}

/* The eight neighbours that are in the picture. */
static uint32_t around(const padder *k, size_t i, size_t to[8])
{
    uint32_t n = 0;
    int64_t x = (int64_t)(i % k->texels), y = (int64_t)(i / k->texels);
    for (int64_t dy = -1; dy <= 1; dy++)
        for (int64_t dx = -1; dx <= 1; dx++) {
            if ((!dx && !dy) || x + dx < 0 || y + dy < 0 || x + dx >= k->texels || y + dy >= k->texels) continue;
            to[n++] = (size_t)(y + dy) * k->texels + (size_t)(x + dx);
        }
    return n;
}

/* Whether all texels around one are filled, or queued to be. */
static bool is_within(const padder *k, size_t i)
{
    size_t x = i % k->texels, y = i / k->texels;
    if (x == 0 || y == 0 || x + 1 == k->texels || y + 1 == k->texels) return false;
    const uint8_t *c = k->covered + i, *above = c - k->texels, *below = c + k->texels;
    return c[-1] && c[1] && above[-1] && above[0] && above[1] && below[-1] && below[0] && below[1];
}

/* Texel i of all maps becomes the mean of those beside it that are covered. */
static void fill(const padder *k, size_t i)
{
    size_t near[8];
    uint32_t n = around(k, i, near), found = 0;
    for (uint32_t a = 0; a < n; a++)
        if (k->covered[near[a]] == 1) near[found++] = near[a];
    assert(found > 0);
    for (uint32_t m = 0; m < k->count; m++) {
        const qw_picture *p = &k->picture[m];
        for (uint32_t c = 0; p->pixels && c < p->channels; c++) {
            uint32_t sum = 0;
            for (uint32_t a = 0; a < found; a++) sum += read(p, near[a] * p->channels + c);
            write(p, i * p->channels + c, (sum + found / 2) / found);
        }
    }
}

/* All texels that no padding has reached become the mean of the whole map. */
static void fill_rest(const padder *k)
{
    size_t all = (size_t)k->texels * k->texels;
    for (uint32_t m = 0; m < k->count; m++) {
        const qw_picture *p = &k->picture[m];
        for (uint32_t c = 0; p->pixels && c < p->channels; c++) {
            uint64_t sum = 0, n = 0;
            for (size_t i = 0; i < all; i++)
                if (k->covered[i] == 1) sum += read(p, i * p->channels + c), n++;
            for (size_t i = 0; i < all && n > 0; i++)
                if (k->covered[i] != 1) write(p, i * p->channels + c, (uint32_t)((sum + n / 2) / n));
        }
    }
}

void qw_pad_pictures(qw_env *env, const qw_picture *picture, uint32_t count, uint8_t *covered, uint32_t texels,
                     uint32_t pad)
{
    padder k = {picture, count, texels, covered};
    size_t all = (size_t)texels * texels, capacity = 0, held = 0, *list = NULL, near[8];
    for (size_t i = 0; i < all; i++) {
        if (covered[i] != 1 || is_within(&k, i)) continue;
        uint32_t n = around(&k, i, near);
        for (uint32_t a = 0; a < n; a++) {
            if (covered[near[a]]) continue;
            list = qw_grow(env, list, &capacity, held + 1, sizeof *list);
            list[held++] = near[a], covered[near[a]] = QUEUED;
        }
    }
    for (size_t begin = 0, end = held; pad > 0 && begin < end; pad--, begin = end, end = held) {
        for (size_t i = begin; i < end; i++) fill(&k, list[i]);
        for (size_t i = begin; i < end; i++) covered[list[i]] = 1;
        for (size_t i = begin; i < end; i++) {
            size_t here = list[i];
            uint32_t n = around(&k, here, near);
            for (uint32_t a = 0; a < n; a++) {
                if (covered[near[a]]) continue;
                list = qw_grow(env, list, &capacity, held + 1, sizeof *list);
                list[held++] = near[a], covered[near[a]] = QUEUED;
            }
        }
    }
    fill_rest(&k);
    qw_free(env, list);
}
