/* The paper's integer program, for a solver of such: the changes x of the offsets d of least sum |x| for which every
 * triangle closes (Equations 3 and 5), written as a file in CPLEX's LP format, and what this program's flow makes of
 * the same. Run by bench/paper, which builds it with
 *     cc -std=c17 -O2 -Iinclude -Isrc bench/integer_program.c build/libquadwright.a ... -Wl,--wrap=qw_make_regular
 *     integer_program MESH FACES FLOW OUT.lp        prints: variables equations changes seconds
 * Components that curves hold may move too, at HELD each: the flow frees them where nothing else closes. */
#include "quadwright/quadwright.h"

#include "remesh/quantise/network.h"
#include "remesh/quantise/regular.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { HELD = 1000, MOST_CHANGE = 60 };

static const char *target;

qw_regular_counts __real_qw_make_regular(qw_env *env, qw_offset_mesh *m, qw_flow_choice kind, qw_cost_kind cost);
qw_regular_counts __wrap_qw_make_regular(qw_env *env, qw_offset_mesh *m, qw_flow_choice kind, qw_cost_kind cost);

/* One scalar row of a triangle: the sum of what its edges have there is 0. */
static void put_row(FILE *file, const qw_offset_mesh *m, uint32_t f, uint8_t row)
{
    long sum = 0;
    fprintf(file, "r%u_%d:", f, row);
    for (uint32_t i = 0; i < 3; i++)
        for (unsigned k = 0; k < 2; k++) {
            uint32_t h = 3 * f + i, e = m->edge[h];
            qw_row r = qw_row_of(m->rot[h], k);
            if (r.row != row) continue;
            sum += r.sign * (k ? m->d[e].y : m->d[e].x);
            fprintf(file, " %c p%u %c n%u", r.sign > 0 ? '+' : '-', 2 * e + k, r.sign > 0 ? '-' : '+', 2 * e + k);
        }
    fprintf(file, " = %ld\n", -sum);
}

static void put_program(FILE *file, const qw_offset_mesh *m)
{
    fprintf(file, "Minimize\nobj:");
    for (uint32_t v = 0; v < 2 * m->edge_count; v++) {
        bool is_held = m->fixed[v / 2] & (v % 2 ? QW_FIXED_Y : QW_FIXED_X);
        fprintf(file, " + %d p%u + %d n%u%s", is_held ? HELD : 1, v, is_held ? HELD : 1, v, v % 8 == 7 ? "\n" : "");
    }
    fprintf(file, "\nSubject To\n");
    for (uint32_t f = 0; f < m->face_count; f++) put_row(file, m, f, 0), put_row(file, m, f, 1);
    fprintf(file, "Bounds\n");
    for (uint32_t v = 0; v < 2 * m->edge_count; v++)
        fprintf(file, "p%u <= %d\nn%u <= %d\n", v, MOST_CHANGE, v, MOST_CHANGE);
    fprintf(file, "Generals\n");
    for (uint32_t v = 0; v < 2 * m->edge_count; v++) fprintf(file, "p%u n%u%s", v, v, v % 8 == 7 ? "\n" : " ");
    fprintf(file, "\nEnd\n");
}

qw_regular_counts __wrap_qw_make_regular(qw_env *env, qw_offset_mesh *m, qw_flow_choice kind, qw_cost_kind cost)
{
    qw_int2 *before = malloc(m->edge_count * sizeof *before);
    uint8_t *fixed = malloc(m->edge_count);
    FILE *file = target ? fopen(target, "w") : NULL;
    if (!before || !fixed || !file) exit(3);
    memcpy(before, m->d, m->edge_count * sizeof *before), memcpy(fixed, m->fixed, m->edge_count);
    put_program(file, m);
    fclose(file);
    clock_t begun = clock();
    qw_regular_counts counts = __real_qw_make_regular(env, m, kind, cost);
    double seconds = (double)(clock() - begun) / CLOCKS_PER_SEC;
    long freed = 0;
    for (uint32_t e = 0; e < m->edge_count; e++) {
        freed += (fixed[e] & QW_FIXED_X) ? labs((long)m->d[e].x - before[e].x) : 0;
        freed += (fixed[e] & QW_FIXED_Y) ? labs((long)m->d[e].y - before[e].y) : 0;
    }
    printf("%u %u %lld %ld %u %.4f\n", 2 * m->edge_count, 2 * m->face_count, (long long)counts.cost, freed,
           (unsigned)counts.irregular_after, seconds);
    exit(0); /* one program a run */
}

int main(int argc, char **argv)
{
    qw_mesh *mesh;
    qw_options options;
    qw_result *result;
    char message[256];
    if (argc != 5) return fprintf(stderr, "integer_program MESH FACES FLOW OUT.lp\n"), 2;
    target = argv[4];
    if (qw_load(argv[1], NULL, &mesh) != QW_OK) return fprintf(stderr, "%s\n", qw_mesh_message(mesh)), 1;
    qw_options_init(&options);
    const char *const settings[][2] = {
        {"faces", argv[2]}, {"flow", argv[3]}, {"cost", "plain"}, {"threads", "1"}, {"adaptive", "0"}};
    for (int i = 0; i < 5; i++)
        if (qw_option_set(&options, settings[i][0], settings[i][1], message, sizeof message) != QW_OK)
            return fprintf(stderr, "%s\n", message), 2;
    qw_mesh_view view = qw_mesh_get(mesh);
    qw_remesh(&view, &options, NULL, &result);
    return fprintf(stderr, "%s\n", qw_result_message(result)), 1;
}
