#include "base/env.h"

#include "base/mechanisms.h"
#include "base/platform.h"
#include "base/pool.h"

#include <assert.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* After so long without a word the host is told where the run is, whatever the stage is doing. */
static const double HEARTBEAT = 0.02;

enum { MAX_SCOPES = 64, ALIGNMENT = 64, MESSAGE_SIZE = 512 };

/* Precedes every block. Blocks of one scope form a doubly linked ring through the scope's own head. */
typedef struct block {
    struct block *previous, *next;
    size_t size; /* bytes asked of the host, header and padding included */
    void *base;  /* what the host gave */
    uint32_t scope;
    void (*release)(void *resource); /* not NULL: this block stands for a deferred release */
    void *resource;
} block;

_Static_assert(sizeof(block) <= ALIGNMENT, "a header fits before an aligned block");

typedef struct frame {
    jmp_buf target;
    uint32_t scope;
    struct frame *outer;
} frame;

/* Scopes that were set aside: their rings, the outermost first. */
typedef struct pile {
    uint32_t outer, count; /* outer: the scope outside them */
    block scopes[QW_STAGE_COUNT];
} pile;

struct qw_env {
    qw_host host;
    qw_pool *pool;
    frame *frame;
    uint32_t scope;
    block scopes[MAX_SCOPES]; /* ring heads */
    pile aside[QW_ASIDE_SLOTS];
    size_t bytes, peak;
    qw_status status;
    int64_t element;
    char message[MESSAGE_SIZE];
    qw_stage stage;
    double stage_begin, stage_share, fraction;
    /* the stages from round_begin on (of all) are told as round_share, beyond round_from */
    double round_begin, round_from, round_share;
    bool works_on;          /* though the run is finished: for what is asked of its result */
    uint32_t small;         /* how often little was done since the clock was read */
    double told;            /* when the host was last told, in seconds */
    uintptr_t caller;       /* the thread of the last parallel loop's */
    _Atomic bool cancelled; /* by the host within a parallel loop: its blocks that have not begun are left out */
#ifdef QW_SWITCHES
    qw_switches own, *switches; /* switches: own, or those of the run whose lane this is */
#endif
};

static const double stage_weight[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) weight,
#include "quadwright/stages.def"
};

static void *default_resize(void *user, void *old, size_t old_size, size_t new_size)
{
    (void)user, (void)old_size;
    if (new_size == 0) {
        free(old);
        return NULL;
    }
    return realloc(old, new_size);
}

qw_env *qw_env_create(const qw_host *host, uint32_t threads)
{
    qw_host h = {0};
    if (host) h = *host;
    if (!h.resize) h.resize = default_resize;
    qw_env *env = h.resize(h.resize_user, NULL, 0, sizeof *env);
    if (!env) return NULL;
    memset(env, 0, sizeof *env);
    env->host = h;
    env->element = -1;
    for (int i = 0; i < MAX_SCOPES; i++) env->scopes[i].previous = env->scopes[i].next = &env->scopes[i];
    env->told = qw_seconds_now();
    if (!h.parallel) env->pool = qw_pool_create(threads);
#ifdef QW_SWITCHES
    env->switches = &env->own;
    qw_switches_begin(&env->own);
#endif
    return env;
}

#ifdef QW_SWITCHES
qw_switches *qw_env_switches(qw_env *env) { return env->switches; }
void qw_env_share_switches(qw_env *lane, qw_env *run) { lane->switches = run->switches; }
#else
void qw_env_share_switches(qw_env *lane, qw_env *run) { (void)lane, (void)run; }
#endif

static void release_block(qw_env *env, block *b)
{
    b->previous->next = b->next;
    b->next->previous = b->previous;
    env->bytes -= b->size;
    if (b->release) b->release(b->resource);
    env->host.resize(env->host.resize_user, b->base, b->size, 0);
}

static void release_ring(qw_env *env, block *head)
{
    while (head->next != head) release_block(env, head->next);
}

static void release_scope(qw_env *env, uint32_t scope) { release_ring(env, &env->scopes[scope]); }

void qw_env_destroy(qw_env *env)
{
    if (!env) return;
    for (uint32_t slot = 0; slot < QW_ASIDE_SLOTS; slot++) qw_scopes_drop(env, slot);
    for (uint32_t s = env->scope + 1; s-- > 0;) release_scope(env, s);
    qw_pool_destroy(env->pool);
#ifdef QW_SWITCHES
    qw_switches_end(&env->own);
#endif
    env->host.resize(env->host.resize_user, env, sizeof *env, 0);
}

void qw_env_set_threads(qw_env *env, uint32_t threads)
{
    if (env->host.parallel) return;
    qw_pool_destroy(env->pool);
    env->pool = qw_pool_create(threads);
}

uint32_t qw_env_threads(const qw_env *env) { return env->host.parallel ? UINT32_MAX : qw_pool_threads(env->pool); }

static void move_outward(qw_env *env, block *b)
{
    b->previous->next = b->next;
    b->next->previous = b->previous;
    block *head = &env->scopes[--b->scope];
    b->previous = head;
    b->next = head->next;
    b->next->previous = b;
    head->next = b;
}

qw_status qw_protect(qw_env *env, void (*body)(void *user), void *user)
{
    frame here = {.scope = env->scope, .outer = env->frame};
    env->frame = &here;
    env->status = QW_OK;
    env->message[0] = 0;
    env->element = -1;
    env->scope++; /* what the body leaves behind is freed on failure and handed outward on success */
    assert(env->scope < MAX_SCOPES);
    if (setjmp(here.target) != 0) {
        while (env->scope > here.scope) release_scope(env, env->scope--);
        env->frame = here.outer;
        return env->status;
    }
    body(user);
    assert(env->scope == here.scope + 1);
    block *head = &env->scopes[env->scope];
    while (head->previous != head) move_outward(env, head->previous); /* oldest first keeps their order */
    env->scope--;
    env->frame = here.outer;
    return QW_OK;
}

void qw_fail_at(qw_env *env, qw_status status, int64_t element, const char *file, int line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(env->message, sizeof env->message, format, arguments);
    va_end(arguments);
    env->status = status;
    env->element = element;
    qw_log(env, QW_LOG_DEBUG, "%s at %s:%d: %s", qw_status_name(status), file, line, env->message);
    if (!env->frame) abort(); /* a failure outside qw_protect is a programming error */
    longjmp(env->frame->target, 1);
}

const char *qw_env_message(const qw_env *env) { return env->message; }
int64_t qw_env_element(const qw_env *env) { return env->element; }
size_t qw_env_bytes(const qw_env *env) { return env->bytes; }
size_t qw_env_peak(const qw_env *env) { return env->peak; }
void qw_env_reset_peak(qw_env *env) { env->peak = env->bytes; }

static block *header_of(void *data) { return (block *)((char *)data - ALIGNMENT); }

static void *link_block(qw_env *env, void *base, size_t size, uint32_t scope)
{
    uintptr_t data = ((uintptr_t)base + 2 * ALIGNMENT - 1) & ~(uintptr_t)(ALIGNMENT - 1);
    block *b = header_of((void *)data), *head = &env->scopes[scope];
    *b = (block){.previous = head, .next = head->next, .size = size, .base = base, .scope = scope};
    head->next->previous = b;
    head->next = b;
    env->bytes += size;
    if (env->bytes > env->peak) env->peak = env->bytes;
    return (void *)data;
}

/* A block of count * size bytes that lives as long as the scope; fails beyond the memory limit or where memory
   ends. */
static void *alloc_in_scope(qw_env *env, size_t count, size_t size, uint32_t scope)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX / 4)
        qw_fail(env, QW_MEMORY, -1, "%zu items of %zu bytes are more than can be addressed", count, size);
    bytes += 2 * ALIGNMENT;
    size_t limit = env->host.memory_limit;
    if (limit && bytes > limit - (env->bytes < limit ? env->bytes : limit))
        qw_fail(env, QW_MEMORY, -1, "the memory limit of %zu bytes is too low: %zu are held and %zu more are needed",
                limit, env->bytes, bytes);
    void *base = env->host.resize(env->host.resize_user, NULL, 0, bytes);
    if (!base)
        qw_fail(env, QW_MEMORY, -1, "out of memory: %zu bytes are held and %zu more were refused", env->bytes, bytes);
    return link_block(env, base, bytes, scope);
}

/* Whether the host wants to go on. */
static bool tell(qw_env *env)
{
    bool wanted = env->host.progress(env->host.progress_user, env->stage, env->fraction) == 0;
    env->told = qw_seconds_now();
    return wanted;
}

static bool is_long_ago(const qw_env *env) { return env->host.progress && qw_seconds_now() - env->told > HEARTBEAT; }

/* Not where the run is done and nothing is asked of its result: the time until the next one is the host's own. */
static bool is_heartbeat_due(const qw_env *env) { return (env->fraction < 1 || env->works_on) && is_long_ago(env); }

void qw_cancel(qw_env *env)
{
    qw_fail(env, QW_CANCELLED, -1, "cancelled by the caller during stage \"%s\"", qw_stage_title(env->stage));
}

bool qw_is_still_wanted(qw_env *env) { return !is_heartbeat_due(env) || tell(env); }

void qw_heartbeat(qw_env *env)
{
    if (!qw_is_still_wanted(env)) qw_cancel(env);
}

void qw_heartbeat_begin(qw_env *env) { env->told = qw_seconds_now(); }

qw_status qw_protect_listening(qw_env *env, void (*body)(void *user), void *user)
{
    qw_heartbeat_begin(env);
    env->works_on = true;
    qw_status status = qw_protect(env, body, user);
    env->works_on = false;
    return status;
}

void qw_heartbeat_outside(qw_env *env)
{
    if (is_long_ago(env) && !tell(env))
        qw_fail(env, QW_CANCELLED, -1, "cancelled by the caller while a file was read or written");
}

/* Reading the clock takes longer than a small block, or a loop over few, is worth. */
enum { SMALL_BYTES = 4096, SMALL_COUNT = 64, SMALL_ONES = 16 };

static void heartbeat_now_and_then(qw_env *env)
{
    if (++env->small < SMALL_ONES) return;
    env->small = 0;
    qw_heartbeat(env);
}

void *qw_alloc(qw_env *env, size_t count, size_t size)
{
    if (count < SMALL_BYTES && size < SMALL_BYTES && count * size < SMALL_BYTES) heartbeat_now_and_then(env);
    else qw_heartbeat(env);
    return alloc_in_scope(env, count, size, env->scope);
}

void *qw_alloc_zero(qw_env *env, size_t count, size_t size)
{
    void *data = qw_alloc(env, count, size);
    memset(data, 0, count * size);
    return data;
}

void *qw_resize(qw_env *env, void *data, size_t count, size_t size)
{
    if (!data) return qw_alloc(env, count, size);
    block *b = header_of(data);
    void *fresh = alloc_in_scope(env, count, size, b->scope);
    size_t held = b->size - 2 * ALIGNMENT, wanted = count * size;
    memcpy(fresh, data, held < wanted ? held : wanted);
    release_block(env, b);
    return fresh;
}

void *qw_grow(qw_env *env, void *data, size_t *capacity, size_t needed, size_t size)
{
    if (data && needed <= *capacity) return data;
    size_t wanted = *capacity + *capacity / 2;
    if (wanted < needed) wanted = needed;
    if (wanted < 16) wanted = 16;
    data = qw_resize(env, data, wanted, size);
    *capacity = wanted;
    return data;
}

void qw_free(qw_env *env, void *data)
{
    if (data) release_block(env, header_of(data));
}

void qw_scope_begin(qw_env *env)
{
    assert(env->scope + 1 < MAX_SCOPES);
    env->scope++;
}

void qw_scope_end(qw_env *env)
{
    assert(env->scope > 0);
    release_scope(env, env->scope--);
}

/* All blocks of one ring to another, which is empty. */
static void move_ring(block *from, block *to)
{
    *to = *from;
    if (from->next == from) to->next = to->previous = to;
    else to->next->previous = to->previous->next = to;
    from->next = from->previous = from;
}

void qw_scopes_set_aside(qw_env *env, uint32_t slot, uint32_t count)
{
    assert(slot < QW_ASIDE_SLOTS && count <= QW_STAGE_COUNT && count <= env->scope);
    qw_scopes_drop(env, slot);
    pile *p = &env->aside[slot];
    p->count = count, p->outer = env->scope -= count;
    for (uint32_t i = 0; i < count; i++) move_ring(&env->scopes[p->outer + 1 + i], &p->scopes[i]);
}

void qw_scopes_take_up(qw_env *env, uint32_t slot)
{
    pile *p = &env->aside[slot];
    assert(slot < QW_ASIDE_SLOTS && env->scope == p->outer);
    for (uint32_t i = 0; i < p->count; i++) move_ring(&p->scopes[i], &env->scopes[++env->scope]);
    p->count = 0;
}

void qw_scopes_drop(qw_env *env, uint32_t slot)
{
    assert(slot < QW_ASIDE_SLOTS);
    pile *p = &env->aside[slot];
    while (p->count > 0) release_ring(env, &p->scopes[--p->count]);
}

void qw_keep(qw_env *env, void *data)
{
    if (!data) return;
    block *b = header_of(data);
    assert(b->scope == env->scope && env->scope > 0);
    move_outward(env, b);
}

void qw_defer(qw_env *env, void (*release)(void *resource), void *resource)
{
    block *b = header_of(qw_alloc(env, 0, 1));
    b->release = release;
    b->resource = resource;
}

/* What all stages and each further round take of what is left then: whether there are more rounds is known at the end
 * of each. */
static const double ALL_STAGES = 0.9, A_ROUND = 0.6;

void qw_env_reset_progress(qw_env *env)
{
    env->fraction = env->round_begin = env->round_from = 0;
    env->round_share = ALL_STAGES;
}

/* The weight of the stages before this one, of all. */
static double weight_before(qw_stage stage)
{
    double before = 0, total = 0;
    for (int i = 0; i < QW_STAGE_COUNT; i++) {
        if (i < (int)stage) before += stage_weight[i];
        total += stage_weight[i];
    }
    return before / total;
}

void qw_enter_stage(qw_env *env, qw_stage stage)
{
    if (stage == 0) qw_env_reset_progress(env); /* a new run */
    env->stage = stage;
    env->stage_begin = weight_before(stage);
    env->stage_share = weight_before((qw_stage)(stage + 1)) - env->stage_begin;
    qw_progress(env, 0.0);
}

void qw_progress(qw_env *env, double fraction_of_stage)
{
    double of_all = env->stage_begin + env->stage_share * fraction_of_stage;
    double fraction = env->round_from + env->round_share * (of_all - env->round_begin) / (1 - env->round_begin);
    if (fraction > env->fraction) env->fraction = fraction;
    if (env->host.progress && !tell(env)) qw_cancel(env);
}

void qw_progress_back(qw_env *env, qw_stage stage)
{
    env->round_begin = weight_before(stage);
    env->round_from = env->fraction;
    env->round_share = A_ROUND * (1 - env->fraction);
}

void qw_progress_done(qw_env *env)
{
    env->fraction = 1;
    if (env->host.progress) tell(env);
}

void qw_begin_work(qw_env *env)
{
    env->stage = QW_STAGE_COUNT, env->fraction = 0;
    qw_progress_work(env, 0);
}

void qw_progress_work(qw_env *env, double fraction)
{
    if (fraction > env->fraction) env->fraction = fraction;
    if (env->host.progress && !tell(env)) qw_cancel(env);
}

void qw_end_work(qw_env *env) { env->stage = (qw_stage)(QW_STAGE_COUNT - 1), env->fraction = 1; }

void qw_log(qw_env *env, qw_log_level level, const char *format, ...)
{
    if (!env->host.log) return;
    char text[MESSAGE_SIZE + 128];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    env->host.log(env->host.log_user, level, text);
}

/* Tasks as the host's hook sees them: one index a block. */
typedef struct blocks {
    uint32_t count, grain;
    qw_task task;
    void *user;
    qw_env *env;
} blocks;

bool qw_listen(qw_env *env)
{
    if (!env->cancelled && env->host.progress && qw_thread_here() == env->caller && is_heartbeat_due(env) && !tell(env))
        env->cancelled = true;
    return !env->cancelled;
}

static void run_block(void *user, uint32_t index)
{
    blocks *b = user;
    if (b->env->cancelled) return;
    uint32_t begin = index * b->grain, end = b->count - begin > b->grain ? begin + b->grain : b->count;
    b->task(b->user, begin, end);
    (void)qw_listen(b->env);
}

static void listen_idly(void *user) { (void)qw_listen(((blocks *)user)->env); }

void qw_parallel(qw_env *env, uint32_t count, uint32_t grain, qw_task task, void *user)
{
    blocks b = {.count = count, .grain = grain, .task = task, .user = user, .env = env};
    uint32_t block_count = qw_block_count(count, grain);
    if (block_count == 0) return;
    bool small = block_count == 1 && count < SMALL_COUNT;
    env->caller = qw_thread_here();
    if (small) task(user, 0, count);
    else if (block_count == 1) run_block(&b, 0);
    else if (env->host.parallel) env->host.parallel(env->host.parallel_user, block_count, run_block, &b);
    else qw_pool_run(env->pool, block_count, run_block, listen_idly, &b);
    if (env->cancelled) {
        env->cancelled = false;
        qw_cancel(env);
    }
    if (small) heartbeat_now_and_then(env);
    else qw_heartbeat(env);
}
