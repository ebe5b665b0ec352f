#define _GNU_SOURCE
#include "base/pool.h"

#include "base/platform.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <time.h>

enum {
    MAX_THREADS = 256,
    SPINS = 4000, /* pauses before a thread offers its processor to others, some 50 microseconds: most gaps between jobs
                     are shorter */
    YIELDS = 50000,    /* offers before it sleeps, some 20 milliseconds: on a virtual machine whose host is busy it may
                          take as long to be woken */
    IDLE_EVERY = 1000, /* steps of waiting; divides SPINS + YIELDS */
    NAP = 20000000,
    SECOND = 1000000000, /* nanoseconds */
    OPEN = 1 << 16       /* bit of `entered` */
};

struct qw_pool {
    pthread_mutex_t lock;
    pthread_cond_t work, done;
    pthread_t threads[MAX_THREADS];
    uint32_t wanted, thread_count; /* beside the caller: that may be begun, and that run */
    atomic_uint round;             /* counts jobs; changed under the lock */
    atomic_bool quit;              /* likewise */
    uint32_t sleepers;             /* guarded by the lock; workers that wait for work */
    atomic_uint entered;           /* workers within the current job, and OPEN while more may enter */
    uint32_t count;
    void (*task)(void *user, uint32_t i);
    void *user;
    atomic_uint next;
#ifdef __GLIBC__
    cpu_set_t processors; /* where the caller may run; none where that could not be asked */
    int avoided;          /* the one of them that workers keep off: the caller's, when it last began a job */
#endif
};

/* Linux may begin or wake a thread on the processor of the one that makes or wakes it. There it waits for milliseconds,
   as long as many a run takes: the caller is busy with the same job. So workers keep off the caller's processor,
   wherever that moves to. */
#ifdef __GLIBC__
static cpu_set_t others_than(const qw_pool *pool, int here)
{
    cpu_set_t others = pool->processors;
    if (here >= 0 && here < CPU_SETSIZE) CPU_CLR((unsigned)here, &others);
    return others;
}

static void begin_elsewhere(qw_pool *pool, pthread_attr_t *attributes)
{
    if (pthread_getaffinity_np(pthread_self(), sizeof pool->processors, &pool->processors) != 0)
        CPU_ZERO(&pool->processors);
    pool->avoided = sched_getcpu();
    cpu_set_t others = others_than(pool, pool->avoided);
    if (CPU_COUNT(&others) > 0) pthread_attr_setaffinity_np(attributes, sizeof others, &others);
}

static void keep_off(qw_pool *pool)
{
    int here = sched_getcpu();
    if (here == pool->avoided) return;
    pool->avoided = here;
    cpu_set_t others = others_than(pool, here);
    if (CPU_COUNT(&others) == 0) return;
    for (uint32_t i = 0; i < pool->thread_count; i++) pthread_setaffinity_np(pool->threads[i], sizeof others, &others);
}
#else
static void begin_elsewhere(qw_pool *pool, pthread_attr_t *attributes) { (void)pool, (void)attributes; }
static void keep_off(qw_pool *pool) { (void)pool; }
#endif

static void pause_a_little(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

/* A step of waiting, of which there are SPINS + YIELDS. */
static void wait_a_little(int step)
{
    if (step < SPINS) pause_a_little();
    else sched_yield();
}

static void drain(qw_pool *pool)
{
    for (;;) {
        uint32_t i = atomic_fetch_add_explicit(&pool->next, 1, memory_order_relaxed);
        if (i >= pool->count) return;
        pool->task(pool->user, i);
    }
}

/* Whoever comes late finds the job closed and touches nothing of it: the caller waits for none that had not begun. */
static bool enter(qw_pool *pool)
{
    unsigned entered = atomic_load(&pool->entered);
    while (entered & OPEN)
        if (atomic_compare_exchange_weak(&pool->entered, &entered, entered + 1)) return true;
    return false;
}

static void leave(qw_pool *pool)
{
    if (atomic_fetch_sub(&pool->entered, 1) != 1) return;
    pthread_mutex_lock(&pool->lock);
    pthread_cond_signal(&pool->done);
    pthread_mutex_unlock(&pool->lock);
}

/* Returns once there is another round than `seen`, or the pool ends: awake for a while, then asleep. */
static void wait_for_round(qw_pool *pool, unsigned seen)
{
    for (int i = 0; i < SPINS + YIELDS; i++) {
        if (atomic_load(&pool->round) != seen || atomic_load(&pool->quit)) return;
        wait_a_little(i);
    }
    pthread_mutex_lock(&pool->lock);
    pool->sleepers++;
    while (atomic_load(&pool->round) == seen && !atomic_load(&pool->quit)) pthread_cond_wait(&pool->work, &pool->lock);
    pool->sleepers--;
    pthread_mutex_unlock(&pool->lock);
}

/* What a thread of the pool does: works on every round that it can enter, until the pool ends. */
static void *worker(void *user)
{
    qw_pool *pool = user;
    unsigned seen = 0;
    for (;;) {
        wait_for_round(pool, seen);
        if (atomic_load(&pool->quit)) return NULL;
        seen = atomic_load(&pool->round);
        if (!enter(pool)) continue;
        drain(pool);
        leave(pool);
    }
}

/* For so long at most, or until the last worker has left. */
static void sleep_until_done(qw_pool *pool)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += NAP;
    if (until.tv_nsec >= SECOND) until.tv_sec++, until.tv_nsec -= SECOND;
    pthread_mutex_lock(&pool->lock);
    if (atomic_load(&pool->entered) != 0) pthread_cond_timedwait(&pool->done, &pool->lock, &until);
    pthread_mutex_unlock(&pool->lock);
}

/* Closes the job and waits until the workers within it have left. */
static void finish(qw_pool *pool, void (*idle)(void *user), void *user)
{
    atomic_fetch_and(&pool->entered, ~(unsigned)OPEN);
    for (int i = 0; atomic_load(&pool->entered) != 0; i++) {
        if (i < SPINS + YIELDS) wait_a_little(i);
        else sleep_until_done(pool), i = SPINS + YIELDS;
        if (idle && i >= SPINS && i % IDLE_EVERY == 0) idle(user);
    }
}

qw_pool *qw_pool_create(uint32_t threads)
{
    if (threads == 0) threads = qw_processor_count();
    if (threads > MAX_THREADS) threads = MAX_THREADS;
    if (threads == 1) return NULL;
    qw_pool *pool = calloc(1, sizeof *pool);
    if (!pool) return NULL;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->done, NULL);
    pool->wanted = threads - 1;
    return pool;
}

/* With the first job for more than one: what only reads or writes a file needs no threads. Those that can't be had are
 * done without. */
static void begin_threads(qw_pool *pool)
{
    pthread_attr_t attributes;
    if (pthread_attr_init(&attributes) == 0) {
        begin_elsewhere(pool, &attributes);
        while (pool->thread_count < pool->wanted &&
               pthread_create(&pool->threads[pool->thread_count], &attributes, worker, pool) == 0)
            pool->thread_count++;
        pthread_attr_destroy(&attributes);
    }
    pool->wanted = pool->thread_count;
}

void qw_pool_destroy(qw_pool *pool)
{
    if (!pool) return;
    pthread_mutex_lock(&pool->lock);
    atomic_store(&pool->quit, true);
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);
    for (uint32_t i = 0; i < pool->thread_count; i++) pthread_join(pool->threads[i], NULL);
    pthread_cond_destroy(&pool->work);
    pthread_cond_destroy(&pool->done);
    pthread_mutex_destroy(&pool->lock);
    free(pool);
}

void qw_shared_set(qw_shared *n, uint32_t to) { atomic_store(&n->value, to); }

uint32_t qw_shared_get(qw_shared *n) { return atomic_load(&n->value); }

uint32_t qw_shared_next(qw_shared *n) { return atomic_fetch_add(&n->value, 1); }

void qw_shared_lower(qw_shared *n, uint32_t to)
{
    for (uint32_t is = atomic_load(&n->value); to < is;)
        if (atomic_compare_exchange_weak(&n->value, &is, to)) return;
}

uintptr_t qw_thread_here(void) { return (uintptr_t)pthread_self(); }

uint32_t qw_pool_threads(const qw_pool *pool) { return pool ? pool->wanted + 1 : 1; }

void qw_pool_run(qw_pool *pool, uint32_t count, void (*task)(void *user, uint32_t i), void (*idle)(void *user),
                 void *user)
{
    if (pool && count > 1 && pool->thread_count < pool->wanted) begin_threads(pool);
    if (!pool || pool->thread_count == 0 || count <= 1) {
        for (uint32_t i = 0; i < count; i++) task(user, i);
        return;
    }
    keep_off(pool);
    pool->count = count;
    pool->task = task;
    pool->user = user;
    atomic_store(&pool->next, 0);
    atomic_store(&pool->entered, OPEN);
    pthread_mutex_lock(&pool->lock);
    atomic_fetch_add(&pool->round, 1);
    if (pool->sleepers) pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);
    drain(pool);
    finish(pool, idle, user);
}
