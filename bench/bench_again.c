/* Measures what a context saves: the time of a run with another count after a first one, against that of a run in a
 * fresh context. Not built by default: cc -O3 -Iinclude bench/bench_again.c build/libquadwright.a -lcadical -lstdc++
 * -lm -lpthread -o bench_again bench_again MESH FACES FACES...
 */
#include <quadwright/quadwright.h>

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double now(void)
{
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static qw_context *with_mesh(const qw_mesh_view *view)
{
    qw_context *context;
    if (qw_create(NULL, &context) != QW_OK || qw_set_mesh(context, view) != QW_OK) exit(1);
    return context;
}

static double timed(qw_context *context, const char *faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = atoll(faces);
    double begin = now();
    if (qw_run(context, &options) != QW_OK) {
        fprintf(stderr, "%s\n", qw_message(context));
        exit(1);
    }
    return now() - begin;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: bench_again MESH FACES FACES...\n");
        return 2;
    }
    qw_mesh *mesh;
    if (qw_load(argv[1], NULL, &mesh) != QW_OK) {
        fprintf(stderr, "%s\n", qw_mesh_message(mesh));
        return 1;
    }
    qw_mesh_view view = qw_mesh_get(mesh);
    qw_context *kept = with_mesh(&view);
    printf("%u faces:", view.face_count);
    for (int i = 2; i < argc; i++) {
        qw_context *fresh = with_mesh(&view);
        double again = timed(kept, argv[i]), first = timed(fresh, argv[i]);
        printf(" to %s %.3f s, fresh %.3f s;", argv[i], again, first);
        qw_destroy(fresh);
    }
    printf("\n");
    qw_destroy(kept);
    qw_mesh_destroy(mesh);
    return 0;
}
