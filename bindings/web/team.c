/* One job at a time. Whoever comes late finds it closed and touches nothing of it, so that the caller waits for none
 * that has not begun. */
#include "team.h"

#ifdef __EMSCRIPTEN_PTHREADS__

#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>

#define EXPORT(name) __attribute__((export_name(#name))) name

enum {
    OPEN = 1 << 16,      /* bit of `entered` */
    SPINS = 20000,       /* looks before a thread sleeps, some 50 microseconds: most gaps between jobs are shorter */
    THREAD_BLOCK = 1024, /* bytes; more than the C library's structure of a thread */
};
static const int64_t NAP = 1000000; /* nanoseconds */

static struct {
    atomic_uint round;   /* counts jobs */
    atomic_uint entered; /* threads within the current job, and OPEN while more may enter */
    atomic_uint next;
    atomic_uint members; /* threads that have joined */
    uint32_t count;
    void (*task)(void *user, uint32_t i);
    void *user;
} team;

static void sleep_while(atomic_uint *word, uint32_t is, int64_t nanoseconds)
{
    __builtin_wasm_memory_atomic_wait32((int *)(void *)word, (int)is, nanoseconds);
}

static void drain(void)
{
    for (;;) {
        uint32_t i = atomic_fetch_add(&team.next, 1);
        if (i >= team.count) return;
        team.task(team.user, i);
    }
}

static bool enter(void)
{
    unsigned entered = atomic_load(&team.entered);
    while (entered & OPEN)
        if (atomic_compare_exchange_weak(&team.entered, &entered, entered + 1)) return true;
    return false;
}

/* What a thread is to the C library: the address of itself comes first in it. */
void *EXPORT(web_thread_block)(void)
{
    void **block = calloc(1, THREAD_BLOCK);
    if (block) *block = block;
    return block;
}

/* Never returns. */
void EXPORT(web_join_team)(void)
{
    uint32_t seen = atomic_load(&team.round);
    atomic_fetch_add(&team.members, 1);
    for (;;) {
        for (int i = 0; i < SPINS && atomic_load(&team.round) == seen; i++) {}
        while (atomic_load(&team.round) == seen) sleep_while(&team.round, seen, -1);
        seen = atomic_load(&team.round);
        if (!enter()) continue;
        drain();
        atomic_fetch_sub(&team.entered, 1);
    }
}

void team_run(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    (void)user;
    if (count <= 1 || atomic_load(&team.members) == 0) {
        for (uint32_t i = 0; i < count; i++) task(task_user, i);
        return;
    }
    team.count = count, team.task = task, team.user = task_user;
    atomic_store(&team.next, 0);
    atomic_store(&team.entered, OPEN);
    atomic_fetch_add(&team.round, 1);
    __builtin_wasm_memory_atomic_notify((int *)(void *)&team.round, UINT32_MAX);
    drain();
    atomic_fetch_and(&team.entered, ~(unsigned)OPEN);
    for (int i = 0; atomic_load(&team.entered) != 0; i++)
        if (i > SPINS) sleep_while(&team.entered, atomic_load(&team.entered), NAP);
}

#else

void team_run(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    (void)user;
    for (uint32_t i = 0; i < count; i++) task(task_user, i);
}

#endif
