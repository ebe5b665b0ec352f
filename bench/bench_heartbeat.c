/* Measures how long progress is silent: the longest time between two calls of the host's progress hook, by stage, which
 * is also the longest that a cancel waits. Not built by default: cc -O3 -Iinclude bench/bench_heartbeat.c
 * build/libquadwright.a -lcadical -lstdc++ -lm -lpthread -o bench_heartbeat bench_heartbeat MESH [faces]
 */
#include <quadwright/quadwright.h>

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct pauses {
    double last, longest[QW_STAGE_COUNT];
    long calls;
} pauses;

static double now(void)
{
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int hear(void *user, qw_stage stage, double fraction)
{
    pauses *s = user;
    double t = now();
    (void)fraction;
    if (s->calls++ > 0 && t - s->last > s->longest[stage]) s->longest[stage] = t - s->last;
    s->last = t;
    return 0;
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: bench_heartbeat MESH [faces]\n");
        return 2;
    }
    qw_mesh *mesh;
    if (qw_load(argv[1], NULL, &mesh) != QW_OK) {
        fprintf(stderr, "%s\n", qw_mesh_message(mesh));
        return 1;
    }
    qw_mesh_view view = qw_mesh_get(mesh);
    pauses s = {0};
    qw_host host = {.progress = hear, .progress_user = &s};
    qw_options options;
    qw_options_init(&options);
    options.faces = argc > 2 ? atoll(argv[2]) : 10000;
    qw_result *result;
    s.last = now();
    double begin = s.last;
    if (qw_remesh(&view, &options, &host, &result) != QW_OK) {
        fprintf(stderr, "%s\n", qw_result_message(result));
        return 1;
    }
    printf("%u triangles, %ld calls in %.2f s; longest pauses in ms:", view.face_count, s.calls, now() - begin);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++)
        if (s.longest[stage] > 0.001) printf(" %s %.0f", qw_stage_title((qw_stage)stage), 1e3 * s.longest[stage]);
    printf("\n");
    qw_result_destroy(result);
    qw_mesh_destroy(mesh);
    return 0;
}
