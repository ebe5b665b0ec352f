/* Contexts in threads of their own at the same time, each with its own input, options, number of threads and host: each
 * result is that of the same run alone on one thread. What they should not share, ThreadSanitizer sees. */
#define _POSIX_C_SOURCE 200809L
#include "suite.h"
#include "shapes.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* ---- a host that runs tasks out of order, on a thread of its own and on the caller's */

enum { STRIDE = 7919 }; /* prime */

typedef struct half {
    uint32_t first, count; /* every other task, from the first on */
    void (*task)(void *user, uint32_t i);
    void *user;
} half;

static void *run_half(void *user)
{
    const half *h = user;
    uint32_t stride = h->count % STRIDE ? STRIDE : 1;
    for (uint32_t i = h->first; i < h->count; i += 2) h->task(h->user, (uint32_t)((uint64_t)i * stride % h->count));
    return NULL;
}

static void scattered(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    (void)user;
    half odd = {1, count, task, task_user}, even = {0, count, task, task_user};
    pthread_t helper;
    int failed = pthread_create(&helper, NULL, run_half, &odd);
    run_half(&even);
    if (failed) run_half(&odd);
    else pthread_join(helper, NULL);
}

/* ---- runs */

typedef struct job {
    const shape *input;
    int64_t faces, threads;
    double adaptive;
    const qw_host *host;
    qw_result *result;
    qw_status status;
} job;

static void *run_job(void *user)
{
    job *j = user;
    qw_mesh_view view = shape_view(j->input);
    qw_options options;
    qw_options_init(&options);
    options.faces = j->faces, options.threads = j->threads, options.adaptive = j->adaptive;
    j->status = qw_remesh(&view, &options, j->host, &j->result);
    return NULL;
}

static void assert_same_result(const job *j, const job *alone)
{
    assert_int_equal(j->status, QW_OK);
    qw_mesh_view x = qw_result_mesh(j->result), y = qw_result_mesh(alone->result);
    assert_int_equal(x.vertex_count, y.vertex_count);
    assert_int_equal(x.face_count, y.face_count);
    assert_memory_equal(x.positions, y.positions, (size_t)x.vertex_count * 3 * sizeof(double));
    assert_memory_equal(x.corners, y.corners, (size_t)x.face_count * 4 * sizeof(uint32_t));
}

static void two_at_once(void **state)
{
    (void)state;
    static const qw_host scatters = {.parallel = scattered};
    static const struct {
        int64_t threads[2];
        const qw_host *host[2];
    } pairs[] = {
        {{1, 1}, {NULL, NULL}}, {{2, 3}, {NULL, NULL}}, {{3, 1}, {NULL, &scatters}}, {{1, 1}, {&scatters, &scatters}}};
    shape input[2] = {shape_hand(4), shape_two_cubes(6)};
    const job alone_jobs[2] = {{&input[0], 300, 1, 0.5, NULL, NULL, QW_INTERNAL},
                               {&input[1], 250, 1, 0, NULL, NULL, QW_INTERNAL}};
    job alone[2] = {alone_jobs[0], alone_jobs[1]};
    for (int k = 0; k < 2; k++) {
        run_job(&alone[k]);
        assert_int_equal(alone[k].status, QW_OK);
        assert_true(qw_result_mesh(alone[k].result).face_count > 0);
    }
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        job both[2] = {alone_jobs[0], alone_jobs[1]};
        pthread_t thread[2];
        for (int k = 0; k < 2; k++) {
            both[k].threads = pairs[i].threads[k], both[k].host = pairs[i].host[k];
            assert_int_equal(pthread_create(&thread[k], NULL, run_job, &both[k]), 0);
        }
        for (int k = 0; k < 2; k++) pthread_join(thread[k], NULL);
        for (int k = 0; k < 2; k++) {
            assert_same_result(&both[k], &alone[k]);
            qw_result_destroy(both[k].result);
        }
    }
    for (int k = 0; k < 2; k++) qw_result_destroy(alone[k].result), shape_free(&input[k]);
}

QW_TEST_SUITE(contexts)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(two_at_once)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
