#include "integer/closed.h"

#include "base/constants.h"
#include "integer/network.h"
#include "solve/multigrid.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { MAX_ITERATIONS = 60, GRAIN = 2048 };
/* Relative residual. The gaps that it leaves are far below what rounding changes: 24 meshes came out no worse at
   1e-2 than at 1e-3. */
static const double TOLERANCE = 5e-3;

/* A triangle whose area is less than this share of what it should be makes its edges this much stiffer (after Bommes et
   al. 2009, "local stiffening"). */
static const float LEAST_SHARE = 0.25f, STIFFER = 3.0f, STIFFEST = 1e4f;
/* No second solve where so few triangles, or so small a share of them, are squeezed: rounding and repair cope with
   them (docs/decisions/closed-offsets.md). */
static const uint32_t FEW_SQUEEZED = 40;
static const float SMALL_SHARE = 0.002f;

static float weight_inverse(const qw_offset_mesh *m, const float *stiffness, uint32_t e)
{
    qw_real2 x = m->real[e];
    return fmaxf(x.x * x.x + x.y * x.y, (float)QW_SHORTEST_EDGE * (float)QW_SHORTEST_EDGE) / stiffness[e];
}

typedef struct rows {
    const qw_offset_mesh *m;
    const float *stiffness;
    uint32_t *first, *column; /* three entries a row */
    float *value, *right;
    double *diagonal;
} rows;

static bool is_constrained(const qw_offset_mesh *m, uint32_t e, unsigned k)
{
    return (m->fixed[e] & (k ? QW_FIXED_Y : QW_FIXED_X)) != 0;
}

static void fill_rows(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    rows *r = user;
    const qw_offset_mesh *m = r->m;
    for (uint32_t f = begin; f < end; f++) {
        for (uint32_t i = 6 * f; i < 6 * f + 6; i++)
            r->column[i] = i / 3, r->value[i] = 0; /* the entry of a boundary or a constrained component */
        r->right[2 * f] = r->right[2 * f + 1] = 0;
        r->diagonal[2 * f] = r->diagonal[2 * f + 1] = 0;
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t h = 3 * f + i, e = m->edge[h], t = m->twin[h];
            float w = weight_inverse(m, r->stiffness, e);
            for (unsigned k = 0; k < 2; k++) {
                if (is_constrained(m, e, k)) continue;
                qw_row here = qw_row_of(m->rot[h], k);
                uint32_t row = 2 * f + here.row;
                r->right[row] += (float)here.sign * (k ? m->real[e].y : m->real[e].x);
                r->diagonal[row] += (double)w;
                if (t == QW_NONE) continue;
                qw_row there = qw_row_of(m->rot[t], k);
                r->column[3 * row + i] = 2 * (t / 3) + there.row;
                r->value[3 * row + i] = (float)(here.sign * there.sign) * w;
            }
        }
    }
}

typedef struct correction {
    const qw_offset_mesh *m;
    const float *stiffness, *multiplier;
    qw_real2 *closed;
} correction;

static void correct_edges(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const correction *c = user;
    const qw_offset_mesh *m = c->m;
    for (uint32_t e = begin; e < end; e++) {
        float sum[2] = {0, 0};
        uint32_t sides[2] = {m->half[e], m->twin[m->half[e]]};
        for (int s = 0; s < 2; s++) {
            if (sides[s] == QW_NONE) continue;
            for (unsigned k = 0; k < 2; k++) {
                qw_row row = qw_row_of(m->rot[sides[s]], k);
                sum[k] += (float)row.sign * c->multiplier[2 * (sides[s] / 3) + row.row];
            }
        }
        float w = weight_inverse(m, c->stiffness, e);
        c->closed[e].x = is_constrained(m, e, 0) ? 0 : m->real[e].x - w * sum[0];
        c->closed[e].y = is_constrained(m, e, 1) ? 0 : m->real[e].y - w * sum[1];
    }
}

static qw_real2 along(const qw_offset_mesh *m, const qw_real2 *d, uint32_t h)
{
    return qw_turn_real(m->rot[h], d[m->edge[h]]);
}

/* A triangle's own area counts as at least this share of its squared longest edge, and as this, in squared wanted
   lengths: slivers say nothing. */
static const float LEAST_AREA = 1e-3f, NO_AREA = 1e-12f;

float qw_area_share(const qw_offset_mesh *m, const qw_real2 *d, uint32_t f)
{
    assert(f < m->face_count && m->real && d);
    qw_real2 a = along(m, d, 3 * f), b = along(m, d, 3 * f + 1), x = along(m, m->real, 3 * f),
             y = along(m, m->real, 3 * f + 1);
    float right = x.x * y.y - x.y * y.x, longest = fmaxf(x.x * x.x + x.y * x.y, y.x * y.x + y.y * y.y);
    return (a.x * b.y - a.y * b.x) / fmaxf(right, LEAST_AREA * longest + NO_AREA);
}

uint32_t qw_stiffen(const qw_offset_mesh *m, const qw_real2 *closed, float *stiffness)
{
    assert(closed && stiffness);
    uint32_t squeezed = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        if (qw_area_share(m, closed, f) >= LEAST_SHARE) continue;
        squeezed++;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            stiffness[m->edge[h]] = fminf(stiffness[m->edge[h]] * STIFFER, STIFFEST);
    }
    return squeezed;
}

qw_real2 *qw_closed_offsets(qw_env *env, const qw_offset_mesh *m, uint32_t rounds, float *stiffness,
                            qw_closed_counts *counts)
{
    assert(m->real && stiffness && counts);
    uint32_t n = 2 * m->face_count;
    *counts = (qw_closed_counts){0};
    qw_real2 *closed = QW_NEW(env, qw_real2, m->edge_count);
    qw_scope_begin(env);
    rows r = {.m = m, .stiffness = stiffness};
    r.first = QW_NEW(env, uint32_t, (size_t)n + 1);
    for (uint32_t i = 0; i <= n; i++) r.first[i] = 3 * i;
    r.column = QW_NEW(env, uint32_t, (size_t)3 * n);
    r.value = QW_NEW(env, float, (size_t)3 * n);
    r.right = QW_NEW(env, float, n);
    r.diagonal = QW_NEW(env, double, n);
    float *multiplier = QW_NEW_ZERO(env, float, n);
    for (uint32_t e = 0; e < m->edge_count; e++) stiffness[e] = 1;
    const qw_csr matrix = {n, r.first, r.column, r.value, r.diagonal};
    qw_multigrid *grids = NULL;
    for (uint32_t round = 0;; round++) {
        qw_parallel(env, m->face_count, GRAIN, fill_rows, &r);
        if (grids) qw_multigrid_refresh(env, grids); /* few weights have changed: the groups stay */
        else grids = qw_multigrid_build(env, &matrix);
        qw_cg_result result = qw_multigrid_solve_with(env, grids, r.right, multiplier, TOLERANCE, MAX_ITERATIONS);
        counts->iterations += result.iterations;
        counts->residual = result.residual;
        correction c = {m, stiffness, multiplier, closed};
        qw_parallel(env, m->edge_count, GRAIN, correct_edges, &c);
        if (round == rounds) break;
        counts->squeezed = qw_stiffen(m, closed, stiffness);
        if (counts->squeezed <= FEW_SQUEEZED || (float)counts->squeezed <= SMALL_SHARE * (float)m->face_count) break;
        counts->rounds++;
    }
    qw_scope_end(env);
    return closed;
}
