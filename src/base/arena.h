/* A stretch of memory that blocks are taken from one after another, with the hook of a host's allocator: for an
 * environment of its own on a worker, which may not ask the run's for memory. Blocks are best given back in the
 * opposite order; one given back earlier waits for those above it. */
#pragma once

#include <stddef.h>
#include <stdint.h>

typedef struct qw_arena {
    unsigned char *at;
    size_t size, top, last; /* bytes used; where the last block's header is, or SIZE_MAX */
} qw_arena;

/* bytes: aligned as malloc's are; belongs to the caller. */
void qw_arena_begin(qw_arena *arena, void *bytes, size_t size);
/* As qw_host.resize, user being the arena: NULL where it is full. */
void *qw_arena_resize(void *user, void *block, size_t old_size, size_t new_size);
