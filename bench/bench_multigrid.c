/* Times multigrid against plain conjugate gradients on graphs like those of a mesh: a square grid whose cells are
 * halved by either diagonal at random, two unknowns a place and a quarter turn at random between neighbours. Not built
 * by default: cc -O3 -Iinclude -Isrc bench/bench_multigrid.c build/libquadwright_static.a -lcadical -lstdc++ -lm
 * -lpthread bench_multigrid [side] [dual] [spread] [cones] [ground] [smooth] [shuffle] [threads] dual: 0 vertices, 1
 * triangles; spread: of the weights; cones: a side; ground: 0 none, 1 a place, 2 a line; smooth: the right side.
 */
#include "solve/multigrid.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SIDE, DUAL, SPREAD, CONES, GROUND, SMOOTH, SHUFFLE, THREADS, OPTIONS };

typedef struct link {
    uint32_t i, j;
    float value;
} link;

typedef struct bench {
    uint32_t option[OPTIONS];
    qw_env *env;
    uint64_t random;
    uint32_t places, link_count;
    link *links;
    uint8_t *turn;   /* uint8_t[places] */
    uint32_t *order; /* uint32_t[places] */
} bench;

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double unit(bench *b)
{
    b->random = b->random * 6364136223846793005u + 1442695040888963407u;
    return (double)(b->random >> 40) / (1 << 24);
}

/* A turn between the places and, across the cut, one more: both unknowns of the one are those of the other, up to sign.
 */
static void join(bench *b, uint32_t v, uint32_t w, bool cut)
{
    float weight = (float)pow(b->option[SPREAD], unit(b));
    uint32_t turn = (uint32_t)(b->turn[w] - b->turn[v] + cut) & 3;
    for (uint32_t k = 0; k < 2; k++) {
        uint32_t to = k + turn;
        b->links[b->link_count++] = (link){2 * b->order[v] + k, 2 * b->order[w] + (to & 1), to & 2 ? weight : -weight};
    }
}

static void make_links(bench *b)
{
    uint32_t side = b->option[SIDE], period = b->option[CONES] ? side / b->option[CONES] : 2 * side;
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            uint32_t v = y * side + x, diagonal = unit(b) < 0.5;
            bool cut = x % period == period / 2 && y % period > period / 2;
            if (!b->option[DUAL]) {
                if (x + 1 < side) join(b, v, v + 1, cut);
                if (y + 1 < side) join(b, v, v + side, false);
                if (x + 1 < side && y + 1 < side && diagonal) join(b, v, v + side + 1, cut);
                if (x > 0 && y + 1 < side && !diagonal)
                    join(b, v, v + side - 1, (x - 1) % period == period / 2 && y % period > period / 2);
            } else { /* triangle 2v lies left, 2v + 1 right */
                uint32_t up = 2 * (v + side) + (y + 1 < side && (v * 2654435761u >> 20 & 1));
                join(b, 2 * v, 2 * v + 1, false);
                if (x + 1 < side) join(b, 2 * v + 1, 2 * (v + 1), cut);
                if (y + 1 < side) join(b, 2 * v + diagonal, up, false);
            }
        }
}

static qw_csr assemble(bench *b)
{
    uint32_t n = 2 * b->places, *first = QW_NEW_ZERO(b->env, uint32_t, n + 2),
             *column = QW_NEW(b->env, uint32_t, 2 * b->link_count);
    float *value = QW_NEW(b->env, float, 2 * b->link_count);
    double *diagonal = QW_NEW_ZERO(b->env, double, n);
    for (uint32_t k = 0; k < b->link_count; k++) first[b->links[k].i + 2]++, first[b->links[k].j + 2]++;
    for (uint32_t i = 0; i < n; i++) first[i + 2] += first[i + 1];
    for (uint32_t k = 0; k < b->link_count; k++)
        for (int way = 0; way < 2; way++) {
            link e = b->links[k];
            uint32_t i = way ? e.j : e.i, at = first[i + 1]++;
            column[at] = way ? e.i : e.j;
            value[at] = e.value;
            diagonal[i] += fabsf(e.value);
        }
    uint32_t grounded = b->option[GROUND] == 0 ? 0 : b->option[GROUND] == 1 ? 1 : b->option[SIDE];
    for (uint32_t i = 0; i < 2 * grounded; i++) diagonal[2 * b->order[i / 2 + b->places / 2] + (i & 1)] += 1;
    return (qw_csr){n, first, column, value, diagonal};
}

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    (void)env;
    const qw_csr *a = user;
    for (uint32_t i = 0; i < a->row_count; i++) {
        y[i] = a->diagonal[i] * x[i];
        for (uint32_t k = a->first[i]; k < a->first[i + 1]; k++) y[i] += (double)a->value[k] * x[a->column[k]];
    }
}

static void body(void *user)
{
    bench *b = user;
    uint32_t side = b->option[SIDE];
    b->places = side * side * (b->option[DUAL] ? 2 : 1);
    uint32_t n = 2 * b->places;
    b->links = QW_NEW(b->env, link, 3 * n);
    b->turn = QW_NEW(b->env, uint8_t, b->places);
    b->order = QW_NEW(b->env, uint32_t, b->places);
    for (uint32_t i = 0; i < b->places; i++) b->turn[i] = (uint8_t)(4 * unit(b)), b->order[i] = i;
    for (uint32_t i = b->places; b->option[SHUFFLE] && i > 1; i--) {
        uint32_t j = (uint32_t)(unit(b) * i), t = b->order[i - 1];
        b->order[i - 1] = b->order[j], b->order[j] = t;
    }
    make_links(b);
    qw_csr a = assemble(b);
    float *right = QW_NEW_ZERO(b->env, float, n), *x = QW_NEW_ZERO(b->env, float, n);
    double *wide = QW_NEW(b->env, double, n), *guess = QW_NEW_ZERO(b->env, double, n);
    /* A divergence, which has no part in any null space: of noise, or of a field constant in the grid. */
    for (uint32_t k = 0; k < b->link_count; k++) {
        link e = b->links[k];
        double flow = (b->option[SMOOTH] ? sin(1e-4 * k) : unit(b) - 0.5) * fabsf(e.value);
        right[e.i] += (float)flow;
        right[e.j] += (float)(e.value > 0 ? flow : -flow);
    }
    for (uint32_t i = 0; i < n; i++) wide[i] = right[i];
    for (int repeat = 0; repeat < 3; repeat++) {
        qw_scope_begin(b->env);
        memset(x, 0, n * sizeof *x);
        double begin = seconds();
        qw_multigrid *grids = qw_multigrid_build(b->env, &a);
        double built = seconds();
        qw_cg_result r = qw_multigrid_solve_with(b->env, grids, right, x, 1e-4, 200);
        printf("%u rows, %u entries: built %.1f ms, solved %.1f ms, %u iterations, residual %.2g\n", n, a.first[n],
               1e3 * (built - begin), 1e3 * (seconds() - built), r.iterations, r.residual);
        qw_scope_end(b->env);
    }
    double begin = seconds();
    qw_cg_result r = qw_cg_solve(b->env, n, apply, &a, a.diagonal, wide, guess, 1e-4, 5000);
    printf("plain: %.1f ms, %u iterations, residual %.2g\n", 1e3 * (seconds() - begin), r.iterations, r.residual);
}

int main(int argc, char **argv)
{
    bench b = {.option = {340, 1, 1, 0, 1, 0, 0, 2}, .random = 1};
    for (int i = 1; i < argc && i <= OPTIONS; i++) b.option[i - 1] = (uint32_t)atoi(argv[i]);
    b.env = qw_env_create(NULL, b.option[THREADS]);
    qw_status status = b.env ? qw_protect(b.env, body, &b) : QW_MEMORY;
    if (status != QW_OK) printf("%s\n", qw_status_text(status));
    qw_env_destroy(b.env);
    return status != QW_OK;
}
