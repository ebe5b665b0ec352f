#include "remesh/relax/relax_solve.h"

#include <assert.h>
#include <string.h>

/* ---- pattern */

static uint32_t find_slot(const qw_relax_system *s, uint32_t v, uint32_t end, uint32_t to)
{
    for (uint32_t k = s->row[v]; k < end; k++)
        if (s->column[k] == to) return k;
    return end;
}

/* The sparse matrix of 2 by 2 blocks, one for each two vertices of a quad, with room for its solution. In the
 * current scope. */
qw_relax_system qw_relax_system_create(qw_env *env, const qw_quadmesh *quads, const uint32_t *begin,
                                       const uint32_t *around)
{
    assert(quads->face_count < QW_NONE / 16 && begin && around);
    assert(begin[quads->vertex_count] == 4 * quads->face_count);
    uint32_t n = quads->vertex_count, corners = 4 * quads->face_count;
    qw_relax_system s = {.count = n, .begin = begin, .around = around};
    s.row = QW_NEW(env, uint32_t, (size_t)n + 1);
    s.column = QW_NEW(env, uint32_t, (size_t)3 * corners + n); /* a quad has three other corners */
    s.slot = QW_NEW(env, uint32_t, (size_t)4 * corners);
    uint32_t end = 0;
    for (uint32_t v = 0; v < n; v++) {
        s.row[v] = end;
        s.column[end++] = v;
        for (uint32_t k = begin[v]; k < begin[v + 1]; k++)
            for (uint32_t i = 0; i < 4; i++) {
                uint32_t to = quads->corner[(around[k] & ~3u) + i], at = find_slot(&s, v, end, to);
                if (at == end) s.column[end++] = to;
                s.slot[4 * (size_t)k + i] = at;
            }
    }
    s.row[n] = end;
    s.block = qw_alloc(env, end, sizeof *s.block);
    s.inverse = qw_alloc(env, n, sizeof *s.inverse);
    s.side = QW_NEW(env, qw_vec2, n), s.x = QW_NEW(env, qw_vec2, n);
    s.r = QW_NEW(env, qw_vec2, n), s.z = QW_NEW(env, qw_vec2, n), s.p = QW_NEW(env, qw_vec2, n),
    s.q = QW_NEW(env, qw_vec2, n);
    qw_relax_matrix fine = {n, s.row, s.column, s.block};
    s.grids = qw_relax_grids_create(env, &fine);
    s.sum = QW_NEW_ZERO(env, double, (size_t)qw_block_count(n, QW_GRAIN_HEAVY) + 1);
    return s;
}

/* ---- values */

typedef struct filling {
    qw_relax_system *s;
    const qw_relax_model *model;
    float damping;
} filling;

/* The matrix rows and right side of each vertex, out of the models of the quads around it. */
static void fill_rows(void *user, uint32_t first, uint32_t last)
{
    const filling *f = user;
    qw_relax_system *s = f->s;
    for (uint32_t v = first; v < last; v++) {
        memset(s->block[s->row[v]], 0, (s->row[v + 1] - s->row[v]) * sizeof *s->block);
        qw_vec2 side = {0, 0};
        for (uint32_t k = s->begin[v]; k < s->begin[v + 1]; k++) {
            uint32_t face = s->around[k] / 4, c = 2 * (s->around[k] % 4), lane = face % QW_LANES;
            const qw_relax_model *m = &f->model[face / QW_LANES];
            const qw_lanes *upper = m->matrix[c], *lower = m->matrix[c + 1];
            side.x -= m->gradient[c][lane], side.y -= m->gradient[c + 1][lane];
            for (uint32_t i = 0; i < 4; i++) {
                float *to = s->block[s->slot[4 * (size_t)k + i]];
                to[0] += upper[2 * i][lane], to[1] += upper[2 * i + 1][lane], to[2] += lower[2 * i][lane],
                    to[3] += lower[2 * i + 1][lane];
            }
        }
        float *own = s->block[s->row[v]];
        own[0] *= 1 + f->damping, own[3] *= 1 + f->damping;
        qw_invert_block(own, s->inverse[v]);
        s->side[v] = side;
    }
}

void qw_relax_system_fill(qw_env *env, qw_relax_system *s, const qw_relax_model *model, qw_vec3 (*axis)[2],
                          float damping)
{
    assert(s->grids && model && axis && damping >= 0);
    filling f = {s, model, damping};
    qw_parallel(env, s->count, QW_GRAIN_HEAVY, fill_rows, &f);
    qw_relax_grids_fill(env, s->grids, axis);
}

/* ---- conjugate gradients, preconditioned by the blocks on the diagonal and coarser grids */

static double total(const qw_relax_system *s)
{
    double sum = 0;
    for (uint32_t i = 0; i < qw_block_count(s->count, QW_GRAIN_HEAVY); i++) sum += s->sum[i];
    return sum;
}

/* What the unknown would do by itself, and r . z. */
static inline double condition(qw_relax_system *s, uint32_t v)
{
    s->z[v] = qw_block_times(s->inverse[v], s->r[v]);
    return (double)s->r[v].x * s->z[v].x + (double)s->r[v].y * s->z[v].y;
}

/* x = 0 and the first residual; sums up its product with what the preconditioner makes of it. */
static void start_block(void *user, uint32_t first, uint32_t last)
{
    qw_relax_system *s = user;
    double sum = 0;
    for (uint32_t v = first; v < last; v++) {
        s->x[v] = s->p[v] = (qw_vec2){0, 0};
        s->r[v] = s->side[v];
        sum += condition(s, v);
    }
    s->sum[first / QW_GRAIN_HEAVY] = sum;
}

/* q = A p, and their product. */
static void multiply_block(void *user, uint32_t first, uint32_t last)
{
    qw_relax_system *s = user;
    double sum = 0;
    for (uint32_t v = first; v < last; v++) {
        qw_lanes part = {
            0, 0, 0, 0}; /* a block of the matrix at once; the compiler would take four of them instead, and shuffle */
        for (uint32_t k = s->row[v]; k < s->row[v + 1]; k++) {
            qw_lanes m;
            memcpy(&m, s->block[k], sizeof m);
            qw_vec2 p = s->p[s->column[k]];
            part += m * (qw_lanes){p.x, p.y, p.x, p.y};
        }
        qw_vec2 q = {part[0] + part[1], part[2] + part[3]};
        s->q[v] = q;
        sum += (double)q.x * s->p[v].x + (double)q.y * s->p[v].y;
    }
    s->sum[first / QW_GRAIN_HEAVY] = sum;
}

/* A step along p, the new residual, and its product with what the preconditioner makes of it. */
static void step_block(void *user, uint32_t first, uint32_t last)
{
    qw_relax_system *s = user;
    double sum = 0;
    for (uint32_t v = first; v < last; v++) {
        s->x[v].x += s->alpha * s->p[v].x, s->x[v].y += s->alpha * s->p[v].y;
        s->r[v].x -= s->alpha * s->q[v].x, s->r[v].y -= s->alpha * s->q[v].y;
        sum += condition(s, v);
    }
    s->sum[first / QW_GRAIN_HEAVY] = sum;
}

static void turn_block(void *user, uint32_t first, uint32_t last)
{
    qw_relax_system *s = user;
    for (uint32_t v = first; v < last; v++) {
        qw_vec2 more = qw_correction_at(&s->correction, v);
        s->p[v] = (qw_vec2){s->z[v].x + more.x + s->beta * s->p[v].x, s->z[v].y + more.y + s->beta * s->p[v].y};
    }
}

/* r . z with what the coarser grids add. */
static double product_with_grids(qw_env *env, qw_relax_system *s)
{
    s->correction = qw_relax_grids_correct(env, s->grids, s->r);
    return total(s) + s->correction.product;
}

uint32_t qw_relax_system_solve(qw_env *env, qw_relax_system *s, float tolerance, uint32_t most)
{
    assert(tolerance > 0);
    qw_parallel(env, s->count, QW_GRAIN_HEAVY, start_block, s);
    double rz = product_with_grids(env, s), enough = rz * (double)tolerance * (double)tolerance;
    uint32_t i = 0;
    s->beta = 0;
    for (; i < most && rz > enough && rz > 0; i++) {
        qw_parallel(env, s->count, QW_GRAIN_HEAVY, turn_block, s);
        qw_parallel(env, s->count, QW_GRAIN_HEAVY, multiply_block, s);
        double pq = total(s);
        if (!(pq > 0)) break;
        s->alpha = (float)(rz / pq);
        qw_parallel(env, s->count, QW_GRAIN_HEAVY, step_block, s);
        double next = product_with_grids(env, s);
        s->beta = (float)(next / rz);
        rz = next;
    }
    return i;
}
