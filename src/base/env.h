/* The run's environment: memory, failure, log and progress, all through the host's hooks and none of it global.
 *
 * Failure unwinds. qw_fail records code, stage, element and a sentence, then jumps to the innermost qw_protect, which
 * frees every block allocated inside it. So no function here returns a status to be passed along, and qw_alloc never
 * returns NULL. Two rules follow: a worker inside qw_parallel neither allocates nor fails; and a resource that is not a
 * qw_alloc block (a file, a SAT solver) is registered with qw_defer, which runs its release when its scope ends in
 * either way.
 *
 * Memory goes by scopes, like stack frames: qw_scope_begin ... qw_scope_end frees all that was allocated between them
 * except what qw_keep moved one scope outward. A stage begins a scope for its scratch and keeps its results.
 */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { QW_WORD = 64 };     /* bits of a word of a set */
#define QW_NONE UINT32_MAX /* "no index" wherever a uint32_t index may be missing */

typedef struct qw_env qw_env;

/* NULL when there is no memory for it. host may be NULL; its hooks are copied. threads: 0 for one a processor. */
qw_env *qw_env_create(const qw_host *host, uint32_t threads);
void qw_env_destroy(qw_env *env);
void qw_env_set_threads(qw_env *env, uint32_t threads);
/* How many at most work on it at a time; UINT32_MAX where the host runs its tasks. For how work is cut into parts only:
   no result may depend on it. */
uint32_t qw_env_threads(const qw_env *env);

/* Runs body(user); a failure inside comes back as a status and leaves no block behind. May be nested. */
qw_status qw_protect(qw_env *env, void (*body)(void *user), void *user);

/* Records the failure and unwinds. element: the index of what is wrong, or -1. */
_Noreturn void qw_fail_at(qw_env *env, qw_status status, int64_t element, const char *file, int line,
                          const char *format, ...) __attribute__((format(printf, 6, 7)));
#define qw_fail(env, status, element, ...) qw_fail_at((env), (status), (element), __FILE__, __LINE__, __VA_ARGS__)
const char *qw_env_message(const qw_env *env); /* "" when nothing failed */
int64_t qw_env_element(const qw_env *env);

/* Blocks are aligned to 64 bytes. A count of 0 gives a valid block. Overflow of count * size fails like missing memory.
 */
void *qw_alloc(qw_env *env, size_t count, size_t size);
void *qw_alloc_zero(qw_env *env, size_t count, size_t size);
/* Keeps the contents and the scope. block may be NULL. */
void *qw_resize(qw_env *env, void *block, size_t count, size_t size);
/* For arrays that grow: makes *capacity at least needed, geometrically, and returns the block. */
void *qw_grow(qw_env *env, void *block, size_t *capacity, size_t needed, size_t size);
void qw_free(qw_env *env, void *block); /* NULL is allowed */
#define QW_NEW(env, type, count)      ((type *)qw_alloc((env), (count), sizeof(type)))
#define QW_NEW_ZERO(env, type, count) ((type *)qw_alloc_zero((env), (count), sizeof(type)))

void qw_scope_begin(qw_env *env);
void qw_scope_end(qw_env *env);
void qw_keep(qw_env *env, void *block); /* to the scope outside the current one; NULL is allowed */
/* Sets the innermost scopes aside, `count` of them, with all that they hold: the scope outside them is the current one
   then. qw_scopes_take_up makes them the innermost again, over the same scope; qw_scopes_drop frees them. A slot holds
   one such pile of scopes; what it held before is freed. */
enum { QW_ASIDE_SLOTS = 3 };
void qw_scopes_set_aside(qw_env *env, uint32_t slot, uint32_t count);
void qw_scopes_take_up(qw_env *env, uint32_t slot);
void qw_scopes_drop(qw_env *env, uint32_t slot);
/* Runs release(resource) when the current scope ends or is unwound. Latest first. */
void qw_defer(qw_env *env, void (*release)(void *resource), void *resource);

size_t qw_env_bytes(const qw_env *env);
size_t qw_env_peak(const qw_env *env);
void qw_env_reset_peak(qw_env *env); /* the peak becomes what is held now */

/* Progress: the run is cut into stages by their weights; a stage says how far it is. Fails with QW_CANCELLED when told
   so. What the host is told never falls until it is reset, also where a stage is run again. */
void qw_env_reset_progress(qw_env *env);
void qw_enter_stage(qw_env *env, qw_stage stage);
void qw_progress(qw_env *env, double fraction_of_stage);
/* The run goes back to a stage: what follows from there takes a share of what is left. */
void qw_progress_back(qw_env *env, qw_stage stage);
/* The run is finished: nothing is left to be cancelled. */
void qw_progress_done(qw_env *env);
/* Long work on a finished result: the host is told how far that is, from 0, under the number of no stage
   (QW_STAGE_COUNT), until qw_end_work, with which the run is finished again. Fails with QW_CANCELLED when told so; what
   is told never falls. */
void qw_begin_work(qw_env *env);
void qw_progress_work(qw_env *env, double fraction);
void qw_end_work(qw_env *env);
/* Where 20 ms have gone by without a word, tells the host again how far it is, or unwinds as qw_progress does. qw_alloc
   and qw_parallel call it; so should loops of some length that do neither. */
void qw_heartbeat(qw_env *env);
/* The two halves of it, for code of others that has to be left in its own way: whether the host, where it has not been
   told for 20 ms, wants to go on; and the unwinding. */
bool qw_is_still_wanted(qw_env *env);
_Noreturn void qw_cancel(qw_env *env);
/* As qw_heartbeat for what waits for something outside, a pipe or a disk, and so also after the run is finished:
   the host can call off the writing of a result as it can the run. */
void qw_heartbeat_outside(qw_env *env);
/* The 20 ms are counted from here: a call from outside begins, before which nobody waited for a word. */
void qw_heartbeat_begin(qw_env *env);
/* As qw_protect, for what is asked of a result: the host hears a heartbeat, and can cancel, though the run is done.
 */
qw_status qw_protect_listening(qw_env *env, void (*body)(void *user), void *user);

void qw_log(qw_env *env, qw_log_level level, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Items of a block: light ones are a few additions each, heavy ones a look in a tree, say, searches thousands of steps.
 * As many pass between two calls of qw_heartbeat, too. */
enum { QW_GRAIN_LIGHT = 4096, QW_GRAIN = 1024, QW_GRAIN_HEAVY = 256, QW_GRAIN_SEARCH = 64 };

/* Splits 0..count-1 into blocks of `grain` (the last may be shorter) and runs task(user, begin, end) for each, on the
   run's threads. The split never depends on the number of threads, so a task that writes only what belongs to
   its block gives the same bytes on any machine; sums are kept a block and added up in order by the caller. */
typedef void (*qw_task)(void *user, uint32_t begin, uint32_t end);
void qw_parallel(qw_env *env, uint32_t count, uint32_t grain, qw_task task, void *user);
/* For tasks that take long: as qw_heartbeat, but never unwinds. False once the host has cancelled the run: the
   task's result is not wanted any more. May be called on any thread; only that which called qw_parallel speaks to the
   host. */
bool qw_listen(qw_env *env);
static inline uint32_t qw_block_count(uint32_t count, uint32_t grain) { return count / grain + (count % grain != 0); }
