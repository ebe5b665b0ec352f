/* A small thread pool: the only file besides pool.c that knows of threads. */
#pragma once

#include <stdint.h>

typedef struct qw_pool qw_pool;

/* threads: 0 for one a processor. Never fails: with no memory or no threads the pool runs everything on the caller. */
qw_pool *qw_pool_create(uint32_t threads);
void qw_pool_destroy(qw_pool *pool);
/* Runs task(user, i) for i in 0..count-1 on the pool and the calling thread. idle(user), which may be NULL, is called
   now and then while the calling thread waits for the others. Not reentrant. */
void qw_pool_run(qw_pool *pool, uint32_t count, void (*task)(void *user, uint32_t i), void (*idle)(void *user),
                 void *user);
uint32_t qw_pool_threads(const qw_pool *pool);
/* A number that threads change together. */
typedef struct qw_shared {
    _Atomic uint32_t value;
} qw_shared;

void qw_shared_set(qw_shared *n, uint32_t to);
uint32_t qw_shared_get(qw_shared *n);
/* Adds one; returns what it was, which no other thread gets. */
uint32_t qw_shared_next(qw_shared *n);
/* Where it is more than `to`. */
void qw_shared_lower(qw_shared *n, uint32_t to);

/* Which thread this is: one number for each that runs. */
uintptr_t qw_thread_here(void);
