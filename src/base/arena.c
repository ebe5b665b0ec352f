#include "base/arena.h"

#include <stdalign.h>
#include <string.h>

typedef struct header {
    size_t before; /* where the header of the block before is, or SIZE_MAX */
    size_t size;   /* of the block, 0 once it was given back */
} header;

enum { ALIGNMENT = alignof(max_align_t), HEADER = (sizeof(header) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT };

static header *header_at(const qw_arena *a, size_t at) { return (header *)(void *)(a->at + at); }

void qw_arena_begin(qw_arena *arena, void *bytes, size_t size) { *arena = (qw_arena){bytes, size, 0, SIZE_MAX}; }

static void give_back(qw_arena *a, void *block)
{
    ((header *)(void *)((unsigned char *)block - HEADER))->size = 0;
    while (a->last != SIZE_MAX && header_at(a, a->last)->size == 0) {
        a->top = a->last;
        a->last = header_at(a, a->last)->before;
    }
}

static void *take(qw_arena *a, size_t size)
{
    size_t room = a->size - a->top, padding = ALIGNMENT - 1;
    if (room < HEADER + padding || size > room - HEADER - padding) return NULL;
    header *h = header_at(a, a->top);
    *h = (header){a->last, size};
    a->last = a->top;
    a->top += HEADER + (size + padding) / ALIGNMENT * ALIGNMENT;
    return (unsigned char *)h + HEADER;
}

void *qw_arena_resize(void *user, void *block, size_t old_size, size_t new_size)
{
    qw_arena *a = user;
    if (new_size == 0) {
        if (block) give_back(a, block);
        return NULL;
    }
    void *fresh = take(a, new_size);
    if (!fresh || !block) return fresh;
    memcpy(fresh, block, old_size < new_size ? old_size : new_size);
    give_back(a, block);
    return fresh;
}
