#include "remesh/quantise/closed.h"

#include "base/constants.h"
#include "remesh/quantise/network.h"
#include "solve/multigrid.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Relative residual. The gaps that it leaves are far below what rounding changes: 24 meshes came out no worse at
   1e-2 than at 1e-3. */
static const double TOLERANCE = 5e-3;

/* A triangle whose area is less than this share of what it should be makes its edges this much stiffer (after Bommes et
   al. 2009, "local stiffening"). */
static const float LEAST_SHARE = 0.25f, STIFFER = 3.0f, STIFFEST = 1e4f;
/* No second solve where so few triangles, or so small a share of them, are squeezed: rounding and repair cope with
   them (docs/dev/decisions/closed-offsets.md). */
static const uint32_t FEW_SQUEEZED = 40;
static const float SMALL_SHARE = 0.002f;

/* Rounds in which sizes give way. The first applies the square of the stretch, which is near what many rounds lead to;
   the second applies the stretch itself and so takes back what was too much. */
enum { GIVES = 2 };
/* A triangle is not taken to be stretched by more than this, nor squeezed by less than its inverse. */
static const float MOST_STRETCH = 3;

static float weight_inverse(const qw_real2 *own, const float *stiffness, uint32_t e)
{
    qw_real2 x = own[e];
    return fmaxf(x.x * x.x + x.y * x.y, (float)QW_SHORTEST_EDGE * (float)QW_SHORTEST_EDGE) / stiffness[e];
}

typedef struct rows {
    const qw_offset_mesh *m;
    const qw_real2 *own; /* qw_real2[edge_count], the edges themselves: m->real before sizes gave way */
    const float *stiffness;
    uint32_t *first, *column; /* three entries a row */
    float *value, *right;
    double *diagonal;
} rows;

/* The rows of the normal equations: one for each of a triangle's two coordinates, with its neighbours' across its
 * three edges. */
static void fill_rows(void *user, uint32_t begin, uint32_t end)
{
    rows *r = user;
    const qw_offset_mesh *m = r->m;
    for (uint32_t f = begin; f < end; f++) {
        for (uint32_t i = 6 * f; i < 6 * f + 6; i++)
            r->column[i] = i / 3, r->value[i] = 0; /* the entry of a boundary or a constrained component */
        r->diagonal[2 * f] = r->diagonal[2 * f + 1] = 0;
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t h = 3 * f + i, e = m->edge[h], t = m->twin[h];
            float w = weight_inverse(r->own, r->stiffness, e);
            for (unsigned k = 0; k < 2; k++) {
                if (qw_is_fixed(m->fixed[e], k)) continue;
                qw_row here = qw_row_of(m->rot[h], k);
                uint32_t row = 2 * f + here.row;
                r->diagonal[row] += (double)w;
                if (t == QW_NONE) continue;
                qw_row there = qw_row_of(m->rot[t], k);
                r->column[3 * row + i] = 2 * (t / 3) + there.row;
                r->value[3 * row + i] = (float)(here.sign * there.sign) * w;
            }
        }
    }
}

/* The right side: what the real offsets around each triangle sum up to. */
static void fill_right(void *user, uint32_t begin, uint32_t end)
{
    rows *r = user;
    const qw_offset_mesh *m = r->m;
    for (uint32_t f = begin; f < end; f++) {
        r->right[2 * f] = r->right[2 * f + 1] = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            for (unsigned k = 0; k < 2; k++) {
                uint32_t e = m->edge[h];
                if (qw_is_fixed(m->fixed[e], k)) continue;
                qw_row here = qw_row_of(m->rot[h], k);
                r->right[2 * f + here.row] += (float)here.sign * (k ? m->real[e].y : m->real[e].x);
            }
    }
}

typedef struct correction {
    const qw_offset_mesh *m;
    const qw_real2 *own;
    const float *stiffness, *multiplier;
    qw_real2 *closed;
} correction;

/* Where slivers alone hold a part together the solution can have any length. Integers are made of it: so none is longer
   than an offset may be. */
static float bounded(float x) { return fminf(fmaxf(x, -(float)QW_LONGEST_OFFSET), (float)QW_LONGEST_OFFSET); }

/* The closed offsets: the real ones, corrected by the multipliers of the triangles on both sides. */
static void correct_edges(void *user, uint32_t begin, uint32_t end)
{
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
        float w = weight_inverse(c->own, c->stiffness, e);
        c->closed[e].x = qw_is_fixed(m->fixed[e], 0) ? 0 : bounded(m->real[e].x - w * sum[0]);
        c->closed[e].y = qw_is_fixed(m->fixed[e], 1) ? 0 : bounded(m->real[e].y - w * sum[1]);
    }
}

static qw_real2 along(const qw_offset_mesh *m, const qw_real2 *d, uint32_t h)
{
    return qw_turn_real(m->rot[h], d[m->edge[h]]);
}

/* A triangle's own area counts as at least this share of its squared longest edge, and as this, in squared wanted
   lengths: slivers say nothing. */
static const float LEAST_AREA = 1e-3f, NO_AREA = 1e-12f;

/* The area of triangle f by the offsets d (real, in the edges' frames) over the area by its own edges, m->real. */
static float area_share(const qw_offset_mesh *m, const qw_real2 *d, uint32_t f)
{
    assert(f < m->face_count && m->real && d);
    qw_real2 a = along(m, d, 3 * f), b = along(m, d, 3 * f + 1), x = along(m, m->real, 3 * f),
             y = along(m, m->real, 3 * f + 1);
    float right = x.x * y.y - x.y * y.x, longest = fmaxf(x.x * x.x + x.y * x.y, y.x * y.x + y.y * y.y);
    return (a.x * b.y - a.y * b.x) / fmaxf(right, LEAST_AREA * longest + NO_AREA);
}

/* Makes the edges of squeezed triangles stiffer; how many there are. */
static uint32_t stiffen(const qw_offset_mesh *m, const qw_real2 *closed, float *stiffness)
{
    assert(closed && stiffness);
    uint32_t squeezed = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        if (area_share(m, closed, f) >= LEAST_SHARE) continue;
        squeezed++;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            stiffness[m->edge[h]] = fminf(stiffness[m->edge[h]] * STIFFER, STIFFEST);
    }
    return squeezed;
}

/* ---- sizes give way */

typedef struct giving {
    const qw_offset_mesh *m;
    const qw_real2 *own, *closed;
    qw_real2 *wanted;  /* m->real, written */
    qw_real2 *stretch; /* qw_real2[face_count], along the axes of the triangle's frame */
    float give;
    bool is_first; /* of the rounds */
} giving;

static float clamped(float stretch) { return fminf(fmaxf(stretch, 1 / MOST_STRETCH), MOST_STRETCH); }

/* A linear map takes the triangle's own edges to the closed offsets. Its diagonal says by what factor the triangle is
   stretched along each axis of its frame; its other two entries turn the lines. The stretch that is wanted has the same
   ratio between the axes, and changes the area by the square root of what the map does. */
static void stretch_block(void *user, uint32_t begin, uint32_t end)
{
    const giving *g = user;
    for (uint32_t f = begin; f < end; f++) {
        qw_real2 a = along(g->m, g->own, 3 * f), b = along(g->m, g->own, 3 * f + 1), c = along(g->m, g->closed, 3 * f),
                 d = along(g->m, g->closed, 3 * f + 1);
        float area = a.x * b.y - a.y * b.x, longest = fmaxf(a.x * a.x + a.y * a.y, b.x * b.x + b.y * b.y);
        g->stretch[f] = (qw_real2){1, 1};
        if (!(area > LEAST_AREA * longest)) continue;
        float x = clamped((c.x * b.y - d.x * a.y) / area), y = clamped((d.y * a.x - c.y * b.x) / area),
              size = sqrtf(sqrtf(x * y)), ratio = sqrtf(x / y);
        if (g->is_first) size *= size, ratio *= ratio;
        g->stretch[f] = (qw_real2){size * ratio, size / ratio};
    }
}

/* The wanted offset of an edge: its own, stretched by the geometric mean of its triangles' factors, as far as `give`
   lets it. */
static void give_block(void *user, uint32_t begin, uint32_t end)
{
    const giving *g = user;
    const qw_offset_mesh *m = g->m;
    for (uint32_t e = begin; e < end; e++) {
        uint32_t h = m->half[e], t = m->twin[h];
        qw_real2 s = g->stretch[h / 3], o = t == QW_NONE ? s : g->stretch[t / 3];
        if (m->rot[h] & 1u) s = (qw_real2){s.y, s.x};
        if (m->rot[t == QW_NONE ? h : t] & 1u) o = (qw_real2){o.y, o.x};
        g->wanted[e].x = g->own[e].x * (1 + g->give * (sqrtf(s.x * o.x) - 1));
        g->wanted[e].y = g->own[e].y * (1 + g->give * (sqrtf(s.y * o.y) - 1));
    }
}

/* ---- the solve */

typedef struct closing {
    rows r;
    qw_multigrid *grids;
    float *multiplier;
    qw_real2 *closed;
} closing;

/* Begins with the multipliers that the last solve left. */
static void solve(qw_env *env, closing *s, qw_closed_counts *counts)
{
    const qw_offset_mesh *m = s->r.m;
    qw_parallel(env, m->face_count, QW_GRAIN, fill_right, &s->r);
    qw_cg_result result = qw_multigrid_solve_with(env, s->grids, s->r.right, s->multiplier, TOLERANCE,
                                                  QW_MULTIGRID_MOST);
    counts->iterations += result.iterations;
    counts->residual = result.residual;
    correction c = {m, s->r.own, s->r.stiffness, s->multiplier, s->closed};
    qw_parallel(env, m->edge_count, QW_GRAIN, correct_edges, &c);
}

/* Lets the wanted lengths give way to what closing stretches, and solves again, a few times. give: share of the
 * stretch that is taken over. */
static void let_sizes_give(qw_env *env, qw_offset_mesh *m, closing *s, float give, qw_closed_counts *counts)
{
    qw_parallel(env, m->face_count, QW_GRAIN, fill_rows, &s->r); /* some edges were made stiffer after the last solve */
    qw_multigrid_refresh(env, s->grids);
    giving g = {.m = m, .own = s->r.own, .closed = s->closed, .wanted = m->real, .give = give};
    g.stretch = QW_NEW(env, qw_real2, m->face_count);
    for (int i = 0; i < GIVES; i++) {
        g.is_first = i == 0;
        qw_parallel(env, m->face_count, QW_GRAIN, stretch_block, &g);
        qw_parallel(env, m->edge_count, QW_GRAIN, give_block, &g);
        solve(env, s, counts);
    }
}

/* Room for the system, in the current scope. */
static closing begin_closing(qw_env *env, const qw_offset_mesh *m, const qw_real2 *own, const float *stiffness,
                             qw_real2 *closed)
{
    assert(m->face_count < QW_NONE / 6);
    uint32_t n = 2 * m->face_count;
    closing s = {.r = {.m = m, .own = own, .stiffness = stiffness}, .closed = closed};
    s.r.first = QW_NEW(env, uint32_t, (size_t)n + 1);
    for (uint32_t i = 0; i <= n; i++) s.r.first[i] = 3 * i;
    s.r.column = QW_NEW(env, uint32_t, (size_t)3 * n);
    s.r.value = QW_NEW(env, float, (size_t)3 * n);
    s.r.right = QW_NEW(env, float, n);
    s.r.diagonal = QW_NEW(env, double, n);
    s.multiplier = QW_NEW_ZERO(env, float, n);
    return s;
}

qw_real2 *qw_closed_offsets(qw_env *env, qw_offset_mesh *m, float give, float *stiffness, qw_closed_counts *counts)
{
    assert(m->real && stiffness && counts && give >= 0 && give <= 1);
    *counts = (qw_closed_counts){0};
    qw_real2 *closed = QW_NEW(env, qw_real2, m->edge_count);
    qw_scope_begin(env);
    qw_real2 *own = QW_NEW(env, qw_real2, m->edge_count);
    memcpy(own, m->real, m->edge_count * sizeof *own);
    for (uint32_t e = 0; e < m->edge_count; e++) stiffness[e] = 1;
    closing s = begin_closing(env, m, own, stiffness, closed);
    const qw_csr matrix = {2 * m->face_count, s.r.first, s.r.column, s.r.value, s.r.diagonal};
    qw_parallel(env, m->face_count, QW_GRAIN, fill_rows, &s.r);
    s.grids = qw_multigrid_build(env, &matrix);
    solve(env, &s, counts);
    counts->squeezed = stiffen(m, closed, stiffness);
    if (counts->squeezed > FEW_SQUEEZED && (float)counts->squeezed > SMALL_SHARE * (float)m->face_count) {
        qw_parallel(env, m->face_count, QW_GRAIN, fill_rows, &s.r);
        qw_multigrid_refresh(env, s.grids); /* few weights have changed: the groups stay */
        solve(env, &s, counts);
    }
    if (give > 0) let_sizes_give(env, m, &s, give, counts);
    qw_scope_end(env);
    return closed;
}
