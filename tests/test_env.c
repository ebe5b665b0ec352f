/* Memory scopes, failure, the host's hooks, and the parallel primitive. */
#define _POSIX_C_SOURCE 200809L /* nanosleep */

#include "suite.h"
#include "base/env.h"

#include "base/pool.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

/* A host that counts what it gives, poisons what it takes back, and can refuse. */
typedef struct ledger {
    int64_t blocks, bytes, requests;
    int64_t refuse_at; /* this request, counted from 1; 0: none */
} ledger;

static void *counting_resize(void *user, void *block, size_t old_size, size_t new_size)
{
    ledger *l = user;
    if (new_size == 0) {
        memset(block, 0xDD, old_size);
        l->blocks--;
        l->bytes -= (int64_t)old_size;
        free(block);
        return NULL;
    }
    if (++l->requests == l->refuse_at) return NULL;
    void *fresh = malloc(new_size);
    assert_non_null(fresh);
    memset(fresh, 0xCC, new_size);
    l->blocks++;
    l->bytes += (int64_t)new_size;
    assert_null(block); /* the library never asks the host to move a block */
    return fresh;
}

typedef struct fixture {
    qw_env *env;
    ledger ledger;
    int step;
    char order[16];
    uint32_t calls;
    double fraction; /* the last one heard */
    qw_stage stage;  /* and its stage */
} fixture;

static void note(fixture *f, char c)
{
    size_t length = strlen(f->order);
    assert_true(length + 1 < sizeof f->order);
    f->order[length] = c;
}

static void note_a(void *user) { note(user, 'a'); }
static void note_b(void *user) { note(user, 'b'); }
static void note_c(void *user) { note(user, 'c'); }

static void run_limited(void (*body)(void *user), size_t limit)
{
    fixture f = {0};
    qw_host host = {.resize = counting_resize, .resize_user = &f.ledger, .memory_limit = limit};
    f.env = qw_env_create(&host, 1);
    assert_non_null(f.env);
    assert_int_equal(qw_protect(f.env, body, &f), QW_OK);
    qw_env_destroy(f.env);
    assert_int_equal(f.ledger.blocks, 0);
    assert_int_equal(f.ledger.bytes, 0);
}

static void run(void (*body)(void *user)) { run_limited(body, 0); }

static void scope_body(void *user)
{
    fixture *f = user;
    int64_t before = f->ledger.blocks;
    qw_scope_begin(f->env);
    char *kept = QW_NEW(f->env, char, 100), *twice = QW_NEW(f->env, char, 10);
    memset(kept, 7, 100);
    for (size_t count = 0; count < 300; count++) assert_int_equal((uintptr_t)qw_alloc(f->env, count, 3) % 64, 0);
    for (int i = 0; i < 50; i++) assert_int_equal(QW_NEW_ZERO(f->env, char, 50)[i], 0);
    qw_keep(f->env, kept);
    qw_keep(f->env, NULL);
    qw_scope_begin(f->env);
    int *deep = QW_NEW(f->env, int, 5);
    deep[4] = 44;
    qw_keep(f->env, deep);
    qw_scope_end(f->env);
    qw_keep(f->env, deep);
    qw_free(f->env, twice);
    qw_scope_end(f->env);
    assert_int_equal(f->ledger.blocks, before + 2);
    for (int i = 0; i < 100; i++) assert_int_equal(kept[i], 7);
    assert_int_equal(deep[4], 44);
    qw_free(f->env, kept);
    qw_free(f->env, deep);
    qw_free(f->env, NULL);
    assert_int_equal(f->ledger.blocks, before);
    assert_int_equal(qw_env_bytes(f->env), 0);
}

static void resize_body(void *user)
{
    fixture *f = user;
    size_t capacity = 0;
    uint32_t *grown = NULL;
    qw_scope_begin(f->env);
    for (uint32_t i = 0; i < 10000; i++) {
        grown = qw_grow(f->env, grown, &capacity, i + 1, sizeof *grown);
        assert_true(capacity > i);
        grown[i] = i;
    }
    assert_true(capacity < 20000);
    qw_scope_begin(f->env);
    grown = qw_resize(f->env, grown, 20000, sizeof *grown); /* stays in its own scope */
    qw_scope_end(f->env);
    grown = qw_resize(f->env, grown, 9000, sizeof *grown);
    for (uint32_t i = 0; i < 9000; i++) assert_int_equal(grown[i], i);
    assert_true(f->ledger.requests < 100);
    qw_scope_end(f->env);
    assert_int_equal(qw_env_bytes(f->env), 0);
}

static void peak_body(void *user)
{
    fixture *f = user;
    qw_scope_begin(f->env);
    qw_alloc(f->env, 1, 100000);
    qw_scope_end(f->env);
    assert_true(qw_env_bytes(f->env) == 0 && qw_env_peak(f->env) >= 100000);
    qw_env_reset_peak(f->env);
    assert_int_equal(qw_env_peak(f->env), 0);
    char *small = qw_alloc(f->env, 1, 1);
    assert_true(qw_env_peak(f->env) == qw_env_bytes(f->env) && qw_env_bytes(f->env) > 0);
    qw_free(f->env, small);
}

static void defer_body(void *user)
{
    fixture *f = user;
    qw_scope_begin(f->env);
    qw_defer(f->env, note_a, f);
    qw_scope_begin(f->env);
    qw_defer(f->env, note_b, f);
    qw_defer(f->env, note_c, f);
    qw_scope_end(f->env);
    assert_string_equal(f->order, "cb"); /* latest first */
    qw_scope_end(f->env);
    assert_string_equal(f->order, "cba");
}

static void fail_deep(void *user)
{
    fixture *f = user;
    qw_defer(f->env, note_a, f);
    qw_alloc(f->env, 10, 10);
    for (int depth = 0; depth < 20; depth++) {
        qw_scope_begin(f->env);
        qw_alloc(f->env, 10, 10);
    }
    qw_defer(f->env, note_b, f);
    qw_fail(f->env, QW_FORMAT_SYNTAX, 42, "line %d is wrong", 17);
}

static void outlive(void *user)
{
    fixture *f = user;
    qw_defer(f->env, note_a, f); /* what is left of a body that succeeds goes to the scope outside, in the same order */
    qw_defer(f->env, note_b, f);
}

static void fail_after_inner(void *user)
{
    fixture *f = user;
    assert_int_equal(qw_protect(f->env, fail_deep, f), QW_FORMAT_SYNTAX);
    f->step = 1;
    qw_fail(f->env, QW_NO_FACES, -1, "second");
}

static void protect_body(void *user)
{
    fixture *f = user;
    size_t before = qw_env_bytes(f->env);
    assert_int_equal(qw_protect(f->env, fail_deep, f), QW_FORMAT_SYNTAX);
    assert_string_equal(f->order, "ba");
    assert_string_equal(qw_env_message(f->env), "line 17 is wrong");
    assert_int_equal(qw_env_element(f->env), 42);
    assert_int_equal(qw_env_bytes(f->env), before);

    assert_int_equal(qw_protect(f->env, fail_after_inner, f), QW_NO_FACES);
    assert_int_equal(f->step, 1);
    assert_string_equal(qw_env_message(f->env), "second");
    assert_int_equal(qw_env_element(f->env), -1);
    assert_int_equal(qw_env_bytes(f->env), before);

    memset(f->order, 0, sizeof f->order);
    qw_scope_begin(f->env);
    assert_int_equal(qw_protect(f->env, outlive, f), QW_OK);
    assert_string_equal(qw_env_message(f->env), "");
    assert_string_equal(f->order, "");
    qw_scope_end(f->env);
    assert_string_equal(f->order, "ba");
}

/* A bit of everything that allocates; checks by itself that what it reads is what it wrote. */
static void work(void *user)
{
    fixture *f = user;
    size_t capacity = 0;
    memset(f->order, 0, sizeof f->order);
    qw_scope_begin(f->env);
    qw_defer(f->env, note_a, f);
    int *kept = QW_NEW(f->env, int, 1000);
    for (int i = 0; i < 1000; i++) kept[i] = i;
    qw_scope_begin(f->env);
    int *grown = NULL;
    for (size_t i = 0; i < 200; i++) {
        grown = qw_grow(f->env, grown, &capacity, i + 1, sizeof *grown);
        grown[i] = kept[i];
    }
    qw_defer(f->env, note_b, f);
    qw_keep(f->env, grown);
    qw_scope_end(f->env);
    for (int i = 0; i < 200; i++) assert_int_equal(grown[i], i);
    kept = qw_resize(f->env, kept, 2000, sizeof *kept);
    assert_int_equal(kept[999], 999);
    qw_scope_end(f->env);
}

static void test_refused(void **state)
{
    (void)state;
    int64_t n = 1;
    qw_status status = QW_MEMORY;
    for (; status != QW_OK; n++) {
        fixture f = {.ledger.refuse_at = n};
        qw_host host = {.resize = counting_resize, .resize_user = &f.ledger};
        f.env = qw_env_create(&host, 1);
        if (!f.env) {
            assert_int_equal(n, 1); /* only the first request may fail so early */
            continue;
        }
        status = qw_protect(f.env, work, &f);
        if (status != QW_OK) {
            assert_int_equal(status, QW_MEMORY);
            assert_non_null(strstr(qw_env_message(f.env), "out of memory"));
            assert_int_equal(f.ledger.requests, n); /* nothing more is asked for on the way out */
        }
        assert_int_equal(qw_env_bytes(f.env), 0);
        assert_int_equal(f.ledger.blocks, 1); /* the environment itself */
        assert_true(strlen(f.order) <= 2);
        f.ledger.refuse_at = 0;
        assert_int_equal(qw_protect(f.env, work, &f), QW_OK); /* it can be used again */
        qw_env_destroy(f.env);
        assert_int_equal(f.ledger.blocks, 0);
    }
    assert_true(n > 8);
}

static void too_much(void *user)
{
    fixture *f = user;
    for (;;) qw_alloc(f->env, 1, 1000);
}

static void overflow(void *user)
{
    fixture *f = user;
    f->step ? qw_alloc(f->env, SIZE_MAX / 2, 3) : qw_alloc(f->env, SIZE_MAX / 2, 1);
}

static void limit_body(void *user)
{
    fixture *f = user;
    assert_int_equal(qw_protect(f->env, too_much, f), QW_MEMORY);
    assert_non_null(strstr(qw_env_message(f->env), "limit"));
    assert_true(qw_env_peak(f->env) <= 100000 && qw_env_peak(f->env) > 90000);
    assert_int_equal(qw_env_bytes(f->env), 0);
    qw_free(f->env, qw_alloc(f->env, 1, 90000));
    for (f->step = 0; f->step < 2; f->step++) assert_int_equal(qw_protect(f->env, overflow, f), QW_MEMORY);
}

enum { COUNT = 100003 };

typedef struct parallel_case {
    uint32_t grain;
    double *value;       /* double[COUNT] */
    double *sum;         /* double[blocks] */
    atomic_uint *visits; /* atomic_uint[blocks] */
    atomic_uint wrong;
} parallel_case;

static void sum_block(void *user, uint32_t begin, uint32_t end)
{
    parallel_case *c = user;
    if (begin % c->grain != 0 || end <= begin || end - begin > c->grain || end > COUNT) atomic_fetch_add(&c->wrong, 1);
    if (end - begin < c->grain && end != COUNT) atomic_fetch_add(&c->wrong, 1);
    atomic_fetch_add(&c->visits[begin / c->grain], 1);
    c->sum[begin / c->grain] = 0;
    for (uint32_t i = begin; i < end; i++) {
        c->value[i] = 1.0 / (i + 1);
        c->sum[begin / c->grain] += c->value[i];
    }
}

static double parallel_sum(qw_env *env, uint32_t grain)
{
    uint32_t blocks = qw_block_count(COUNT, grain);
    parallel_case c = {.grain = grain};
    c.value = QW_NEW_ZERO(env, double, COUNT);
    c.sum = QW_NEW(env, double, blocks);
    c.visits = QW_NEW_ZERO(env, atomic_uint, blocks);
    qw_parallel(env, COUNT, grain, sum_block, &c);
    assert_int_equal(atomic_load(&c.wrong), 0);
    double sum = 0;
    for (uint32_t b = 0; b < blocks; b++) {
        assert_int_equal(atomic_load(&c.visits[b]), 1);
        sum += c.sum[b];
    }
    for (uint32_t i = 0; i < COUNT; i++) assert_true(c.value[i] == 1.0 / (i + 1));
    return sum;
}

static void never(void *user, uint32_t begin, uint32_t end)
{
    (void)user, (void)begin, (void)end;
    abort();
}

static void parallel_body(void *user)
{
    fixture *f = user;
    static const uint32_t threads[] = {1, 2, 3, 8, 0}, grains[] = {1, 7, 1000, 4096, COUNT - 1, COUNT, UINT32_MAX};
    for (size_t g = 0; g < sizeof grains / sizeof *grains; g++) {
        double first = 0;
        for (size_t t = 0; t < sizeof threads / sizeof *threads; t++) {
            qw_env_set_threads(f->env, threads[t]);
            qw_scope_begin(f->env);
            double sum = parallel_sum(f->env, grains[g]);
            qw_scope_end(f->env);
            if (t == 0) first = sum;
            assert_memory_equal(&sum, &first, sizeof sum);
        }
    }
    qw_parallel(f->env, 0, 10, never, f);
}

static void count_task(void *user, uint32_t i)
{
    (void)i;
    atomic_fetch_add((atomic_uint *)user, 1);
}

/* Many small jobs one after another: a worker that is late for one must not take part in the next twice, or not at all.
 */
static void test_pool_rounds(void **state)
{
    (void)state;
    for (uint32_t threads = 1; threads <= 8; threads++) {
        qw_pool *pool = qw_pool_create(threads);
        assert_int_equal(qw_pool_threads(pool), threads);
        atomic_uint total = 0;
        uint32_t expected = 0;
        for (uint32_t round = 0; round < 2000; round++) {
            qw_pool_run(pool, round % 17, count_task, NULL, &total);
            expected += round % 17;
            assert_int_equal(atomic_load(&total), expected);
        }
        qw_pool_destroy(pool);
    }
    qw_pool_destroy(NULL);
    assert_int_equal(qw_pool_threads(NULL), 1);
}

/* A host that runs the blocks backwards. */
static void backwards(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    ((fixture *)user)->calls++;
    while (count-- > 0) task(task_user, count);
}

static void log_hook(void *user, qw_log_level level, const char *message)
{
    fixture *f = user;
    if (level == QW_LOG_INFO && strcmp(message, "seven is 7") == 0) note(f, 'i');
    if (level == QW_LOG_WARNING) assert_true(strlen(message) > 400); /* cut, not overrun */
}

static int progress_hook(void *user, qw_stage stage, double fraction)
{
    fixture *f = user;
    assert_true(fraction >= f->fraction && fraction <= 1);
    assert_true(stage < QW_STAGE_COUNT);
    f->fraction = fraction;
    f->stage = stage;
    return ++f->calls == (uint32_t)f->step; /* cancels at call `step` */
}

static void hook_body(void *user)
{
    fixture *f = user;
    double sum = parallel_sum(f->env, 1000);
    assert_int_equal(f->calls, 1);
    assert_true(sum > 12 && sum < 12.2); /* ln COUNT + 0.577 */
    char longer[2000];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = 0;
    qw_log(f->env, QW_LOG_INFO, "seven is %d", 7);
    qw_log(f->env, QW_LOG_WARNING, "%s", longer);
    assert_string_equal(f->order, "i");
}

static void test_hooks(void **state)
{
    (void)state;
    fixture f = {0};
    qw_host host = {.parallel = backwards, .parallel_user = &f, .log = log_hook, .log_user = &f};
    f.env = qw_env_create(&host, 8);
    assert_int_equal(qw_protect(f.env, hook_body, &f), QW_OK);
    qw_env_destroy(f.env);
}

static void stages_body(void *user)
{
    fixture *f = user;
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
        qw_enter_stage(f->env, (qw_stage)stage);
        for (int i = 1; i <= 4; i++) qw_progress(f->env, 0.25 * i);
        assert_int_equal(f->stage, stage);
        qw_progress(f->env, 0.5); /* never falls */
    }
}

/* However often the run goes back, there is something left until it is done. */
static void rounds_body(void *user)
{
    fixture *f = user;
    for (int round = 0; round < 5; round++) {
        double before = f->fraction;
        stages_body(f);
        assert_true(f->fraction > before && f->fraction < 1);
        qw_progress_back(f->env, QW_STAGE_WORKING);
        for (int stage = QW_STAGE_WORKING; stage < QW_STAGE_COUNT; stage++) {
            before = f->fraction;
            qw_enter_stage(f->env, (qw_stage)stage);
            qw_progress(f->env, 1);
            assert_true(f->fraction > before && f->fraction < 1);
        }
        f->fraction = 0; /* entering the first stage begins anew */
    }
    qw_progress_done(f->env);
    assert_true(f->fraction == 1);
}

static void test_rounds(void **state)
{
    (void)state;
    fixture f = {.step = 0};
    qw_host host = {.progress = progress_hook, .progress_user = &f};
    f.env = qw_env_create(&host, 1);
    assert_int_equal(qw_protect(f.env, rounds_body, &f), QW_OK);
    qw_env_destroy(f.env);
}

static void test_cancelled(void **state)
{
    (void)state;
    int calls = 6 * QW_STAGE_COUNT;
    for (int at = 1; at <= calls + 1; at++) {
        fixture f = {.step = at};
        qw_host host = {.progress = progress_hook, .progress_user = &f};
        f.env = qw_env_create(&host, 1);
        qw_status status = qw_protect(f.env, stages_body, &f);
        assert_int_equal(status, at <= calls ? QW_CANCELLED : QW_OK);
        assert_int_equal(f.calls, at <= calls ? at : calls);
        if (status == QW_OK) qw_progress_done(f.env), assert_true(f.fraction == 1);
        qw_env_destroy(f.env);
    }
}

/* ---- scopes set aside */

enum { FULL = 100 };

static uint32_t *full_scope(qw_env *env, uint32_t number)
{
    qw_scope_begin(env);
    uint32_t *block = QW_NEW(env, uint32_t, FULL);
    for (uint32_t i = 0; i < FULL; i++) block[i] = number;
    return block;
}

static void aside_body(void *user)
{
    fixture *f = user;
    qw_env *env = f->env;
    uint32_t *outer = full_scope(env, 1), *first = full_scope(env, 2), *second = full_scope(env, 3);
    qw_scope_begin(env); /* holds nothing */
    size_t held = qw_env_bytes(env);
    qw_scopes_set_aside(env, 1, 3);
    assert_int_equal(qw_env_bytes(env), held);
    full_scope(env, 4), full_scope(env, 5);
    qw_scopes_set_aside(env, 0, 2); /* over the same scope, in another slot */
    uint32_t *now = full_scope(env, 6);
    qw_scope_end(env);
    qw_scopes_take_up(env, 1);
    now = qw_resize(env, second, 2 * FULL, sizeof *now); /* it is in the second scope again */
    assert_true(outer[FULL - 1] == 1 && first[FULL - 1] == 2 && now[FULL - 1] == 3);
    qw_scope_end(env), qw_scope_end(env);
    assert_true(first[0] == 2);
    qw_scope_end(env);
    full_scope(env, 7);
    qw_scopes_set_aside(env, 0, 1); /* what was in the slot goes */
    qw_scopes_drop(env, 0), qw_scopes_drop(env, 2);
    qw_scope_end(env);
}

static void test_aside(void **state)
{
    (void)state;
    fixture f = {.env = qw_env_create(NULL, 1)};
    size_t before = qw_env_bytes(f.env);
    assert_int_equal(qw_protect(f.env, aside_body, &f), QW_OK);
    assert_int_equal(qw_env_bytes(f.env), before);
    full_scope(f.env, 1), full_scope(f.env, 2);
    qw_scopes_set_aside(f.env, 2, 2);
    qw_env_destroy(f.env); /* with all that is aside */
}

/* Blocks that take longer than the host is left without a word. */
static void slow_block(void *user, uint32_t begin, uint32_t end)
{
    (void)begin, (void)end;
    const struct timespec while_nothing = {0, 25000000};
    nanosleep(&while_nothing, NULL);
    atomic_fetch_add((atomic_uint *)user, 1);
}

typedef struct slow {
    fixture f;
    atomic_uint done;
} slow;

static void slow_body(void *user)
{
    slow *s = user;
    qw_enter_stage(s->f.env, QW_STAGE_CLEAN);
    qw_parallel(s->f.env, 40, 1, slow_block, &s->done);
}

/* A cancel in the middle of a loop is heard there: the blocks under way are finished, the others left out. */
static void test_cancelled_between_blocks(void **state)
{
    (void)state;
    for (uint32_t threads = 1; threads <= 3; threads++) {
        slow s = {.f = {.step = 3}}; /* the first word is that the stage begins */
        qw_host host = {.progress = progress_hook, .progress_user = &s.f};
        s.f.env = qw_env_create(&host, threads);
        assert_int_equal(qw_protect(s.f.env, slow_body, &s), QW_CANCELLED);
        assert_true(atomic_load(&s.done) >= 2 && atomic_load(&s.done) < 40);
        assert_int_equal(s.f.calls, 3);
        qw_env_destroy(s.f.env);
    }
}

/* One block that takes long, on whatever thread: it listens itself where it is the caller's, else the caller does,
 * which waits for it. */
static void long_block(void *user, uint32_t begin, uint32_t end)
{
    (void)begin, (void)end;
    slow *s = user;
    for (int i = 0; i < 200 && qw_listen(s->f.env); i++) {
        const struct timespec while_nothing = {0, 1000000};
        nanosleep(&while_nothing, NULL);
    }
    atomic_fetch_add(&s->done, 1);
}

static void long_body(void *user)
{
    slow *s = user;
    qw_enter_stage(s->f.env, QW_STAGE_CLEAN);
    qw_parallel(s->f.env, 2, 1, long_block, s);
}

static void test_heard_within_blocks(void **state)
{
    (void)state;
    for (uint32_t threads = 1; threads <= 3; threads++)
        for (int step = 3; step <= 1000; step += 997) {
            slow s = {.f = {.step = step}};
            qw_host host = {.progress = progress_hook, .progress_user = &s.f};
            s.f.env = qw_env_create(&host, threads);
            assert_int_equal(qw_protect(s.f.env, long_body, &s), step == 3 ? QW_CANCELLED : QW_OK);
            if (step == 3) assert_int_equal(s.f.calls, 3);
            else assert_true(s.f.calls >= 4 && atomic_load(&s.done) == 2);
            qw_env_destroy(s.f.env);
        }
}

static void test_scopes_left(void **state)
{
    (void)state;
    qw_env_destroy(NULL);
    fixture f = {0};
    qw_host host = {.resize = counting_resize, .resize_user = &f.ledger};
    f.env = qw_env_create(&host, 3);
    qw_alloc(f.env, 1, 1);
    qw_scope_begin(f.env);
    qw_alloc(f.env, 2, 2);
    qw_defer(f.env, note_a, &f);
    qw_env_destroy(f.env); /* takes all along */
    assert_int_equal(f.ledger.blocks, 0);
    assert_string_equal(f.order, "a");
}

#define TEST(name)                        \
    static void test_##name(void **state) \
    {                                     \
        (void)state;                      \
        run(name##_body);                 \
    }
TEST(scope)
TEST(resize)
TEST(peak)
TEST(defer)
TEST(protect)
TEST(parallel)

static void test_limit(void **state)
{
    (void)state;
    run_limited(limit_body, 100000);
}

QW_TEST_SUITE(env)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scope),
        cmocka_unit_test(test_resize),
        cmocka_unit_test(test_peak),
        cmocka_unit_test(test_defer),
        cmocka_unit_test(test_protect),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_parallel),
        cmocka_unit_test(test_pool_rounds),
        cmocka_unit_test(test_hooks),
        cmocka_unit_test(test_cancelled),
        cmocka_unit_test(test_rounds),
        cmocka_unit_test(test_aside),
        cmocka_unit_test(test_scopes_left),
        cmocka_unit_test(test_cancelled_between_blocks),
        cmocka_unit_test(test_heard_within_blocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
