#include "remesh/relax/relax_grids.h"
#include "base/groups.h"

#include <assert.h>
#include <string.h>

/* DENSE: clusters whose system is solved as it is. */
enum { MOST_GRIDS = 12, DENSE = 48 };

/* A mark on groups that are joined later. */
static const uint32_t LATE = 0x80000000u;

typedef struct grid {
    qw_relax_matrix a;
    qw_vec3 (*axis)[2];       /* [count] */
    uint32_t *group;          /* [count], of the next grid */
    uint32_t *first, *member; /* of each group: member[first[a]..first[a + 1]] */
    uint32_t *slot;           /* [row[count]]: the block of the next grid to which each goes */
    float (*share)[4];        /* [count]: the next grid's unknowns, by the own axes */
    /* all but the finest */
    float (*inverse)[4]; /* [count], of the blocks on the diagonal */
    qw_vec2 *r, *z;      /* [count] */
} grid;

struct qw_relax_grids {
    uint32_t count;
    grid grid[MOST_GRIDS];
    float *dense; /* float[2 n][2 n], Cholesky's factor of the coarsest, the diagonal inverted; or NULL */
};

void qw_invert_block(const float a[4], float to[4])
{
    float det = a[0] * a[3] - a[1] * a[2], trace = a[0] + a[3];
    memset(to, 0, 4 * sizeof *to);
    if (det > 1e-6f * trace * trace) {
        to[0] = a[3] / det, to[1] = -a[1] / det, to[2] = -a[2] / det, to[3] = a[0] / det;
        return;
    }
    /* one axis only, as on a curve, or none */
    if (a[0] > 0 && a[0] >= a[3]) to[0] = 1 / a[0];
    else if (a[3] > 0) to[3] = 1 / a[3];
}

/* ---- pattern */

/* Those of which no neighbour has a group yet make one with all of them; who is left goes with a neighbour. */
static uint32_t make_groups(grid *g)
{
    const qw_relax_matrix *a = &g->a;
    uint32_t groups = 0, *group = g->group;
    memset(group, 0xff, a->count * sizeof *group);
    for (uint32_t v = 0; v < a->count; v++) {
        bool open = true;
        for (uint32_t k = a->row[v]; k < a->row[v + 1] && open; k++) open = group[a->column[k]] == QW_NONE;
        for (uint32_t k = a->row[v]; k < a->row[v + 1] && open; k++) group[a->column[k]] = groups;
        groups += open;
    }
    for (uint32_t v = 0; v < a->count; v++)
        for (uint32_t k = a->row[v]; k < a->row[v + 1] && group[v] == QW_NONE; k++) {
            uint32_t of = group[a->column[k]];
            if (of != QW_NONE && !(of & LATE)) group[v] = of | LATE;
        }
    for (uint32_t v = 0; v < a->count; v++) group[v] &= ~LATE;
    return groups;
}

/* The next grid's pattern, and where the blocks go. */
static void make_pattern(qw_env *env, grid *g, grid *next, uint32_t groups)
{
    assert(groups > 0 && groups <= g->a.count);
    uint32_t *at = QW_NEW(env, uint32_t, groups), end = 0;
    memset(at, 0xff, groups * sizeof *at);
    next->a = (qw_relax_matrix){groups, QW_NEW(env, uint32_t, (size_t)groups + 1),
                                QW_NEW(env, uint32_t, g->a.row[g->a.count]), NULL};
    g->slot = QW_NEW(env, uint32_t, g->a.row[g->a.count]);
    for (uint32_t a = 0; a < groups; a++) {
        uint32_t begin = next->a.row[a] = end;
        at[a] = end;
        next->a.column[end++] = a;
        for (uint32_t m = g->first[a]; m < g->first[a + 1]; m++)
            for (uint32_t v = g->member[m], k = g->a.row[v]; k < g->a.row[v + 1]; k++) {
                uint32_t b = g->group[g->a.column[k]];
                if (at[b] == QW_NONE || at[b] < begin) at[b] = end, next->a.column[end++] = b;
                g->slot[k] = at[b];
            }
    }
    next->a.row[groups] = end;
    next->a.column = qw_resize(env, next->a.column, end, sizeof *next->a.column);
    next->a.block = qw_alloc(env, end, sizeof *next->a.block);
    qw_free(env, at);
}

qw_relax_grids *qw_relax_grids_create(qw_env *env, const qw_relax_matrix *fine)
{
    assert(fine->row && fine->row[0] == 0);
    qw_relax_grids *g = QW_NEW_ZERO(env, qw_relax_grids, 1);
    g->grid[0].a = *fine;
    g->count = 1;
    while (g->count < MOST_GRIDS) {
        grid *l = &g->grid[g->count - 1];
        if (l->a.count <= DENSE) break;
        l->group = QW_NEW(env, uint32_t, l->a.count);
        uint32_t groups = make_groups(l);
        if (2 * groups > l->a.count) break;
        l->member = qw_group(env, l->group, l->a.count, groups, &l->first);
        make_pattern(env, l, l + 1, groups);
        l->share = qw_alloc(env, l->a.count, sizeof *l->share);
        l[1].axis = qw_alloc(env, groups, sizeof *l[1].axis);
        l[1].inverse = qw_alloc(env, groups, sizeof *l[1].inverse);
        l[1].r = QW_NEW(env, qw_vec2, groups), l[1].z = QW_NEW(env, qw_vec2, groups);
        g->count++;
    }
    uint32_t n = 2 * g->grid[g->count - 1].a.count;
    if (g->count > 1 && n <= 2 * DENSE) g->dense = QW_NEW(env, float, (size_t)n *n);
    return g;
}

/* ---- values */

/* Of the plane in which the members move; where all of them are on curves, of one along the first's. */
static qw_vec3 plane_normal(const grid *g, uint32_t a)
{
    qw_vec3 n = {0, 0, 0}, along = {0, 0, 0};
    for (uint32_t m = g->first[a]; m < g->first[a + 1]; m++) {
        qw_vec3 *axis = g->axis[g->member[m]];
        n = qw_add(n, qw_cross(axis[0], axis[1]));
        if (qw_length2(along) == 0) along = axis[0];
    }
    n = qw_normalize(n);
    if (qw_length2(n) > 0.5f) return n;
    return qw_length2(along) > 0.5f ? qw_any_orthogonal(along) : qw_v3(0, 0, 1);
}

/* How the movement of a cluster's plane moves each of its members. */
static void share_block(void *user, uint32_t begin, uint32_t end)
{
    grid *g = user, *next = g + 1;
    for (uint32_t a = begin; a < end; a++) {
        qw_vec3 n = plane_normal(g, a), *to = next->axis[a];
        to[0] = qw_any_orthogonal(n), to[1] = qw_cross(n, to[0]);
        for (uint32_t m = g->first[a]; m < g->first[a + 1]; m++) {
            uint32_t v = g->member[m];
            for (int i = 0; i < 4; i++) g->share[v][i] = qw_dot(g->axis[v][i / 2], to[i % 2]);
        }
    }
}

/* The matrix of the next grid: P' A P, by clusters, and the inverse of its diagonal blocks. */
static void coarse_block(void *user, uint32_t begin, uint32_t end)
{
    grid *g = user, *next = g + 1;
    for (uint32_t a = begin; a < end; a++) {
        memset(next->a.block[next->a.row[a]], 0, (next->a.row[a + 1] - next->a.row[a]) * sizeof *next->a.block);
        for (uint32_t m = g->first[a]; m < g->first[a + 1]; m++) {
            uint32_t v = g->member[m];
            const float *p = g->share[v];
            for (uint32_t k = g->a.row[v]; k < g->a.row[v + 1]; k++) {
                const float *b = g->a.block[k], *q = g->share[g->a.column[k]];
                float *to = next->a.block[g->slot[k]];
                float x[4] = {b[0] * q[0] + b[1] * q[2], b[0] * q[1] + b[1] * q[3], b[2] * q[0] + b[3] * q[2],
                              b[2] * q[1] + b[3] * q[3]};
                to[0] += p[0] * x[0] + p[2] * x[2], to[1] += p[0] * x[1] + p[2] * x[3];
                to[2] += p[1] * x[0] + p[3] * x[2], to[3] += p[1] * x[1] + p[3] * x[3];
            }
        }
        qw_invert_block(next->a.block[next->a.row[a]], next->inverse[a]);
    }
}

/* Unknowns without ground, as of what can't move, are left alone. */
static void factor(qw_relax_grids *g)
{
    assert(g->dense && g->grid[g->count - 1].a.count <= DENSE);
    const qw_relax_matrix *a = &g->grid[g->count - 1].a;
    uint32_t n = 2 * a->count;
    float *l = g->dense;
    memset(l, 0, (size_t)n * n * sizeof *l);
    for (uint32_t v = 0; v < a->count; v++)
        for (uint32_t k = a->row[v]; k < a->row[v + 1]; k++)
            for (uint32_t i = 0; i < 4; i++) l[(2 * v + i / 2) * n + 2 * a->column[k] + i % 2] = a->block[k][i];
    for (uint32_t i = 0; i < n; i++) {
        float own = l[i * n + i], was = own;
        for (uint32_t j = 0; j < i; j++) {
            float sum = l[i * n + j];
            for (uint32_t k = 0; k < j; k++) sum -= l[i * n + k] * l[j * n + k];
            l[i * n + j] = sum *= l[j * n + j];
            own -= sum * sum;
        }
        l[i * n + i] = own > 1e-5f * was ? 1 / sqrtf(own) : 0; /* inverted */
    }
}

/* Solves on the coarsest grid by its Cholesky factors. */
static void solve_dense(const qw_relax_grids *g, const qw_vec2 *r, qw_vec2 *z)
{
    assert(g->dense && g->grid[g->count - 1].a.count <= DENSE);
    uint32_t n = 2 * g->grid[g->count - 1].a.count;
    const float *l = g->dense;
    float x[2 * DENSE];
    for (uint32_t i = 0; i < n; i++) {
        float sum = i % 2 ? r[i / 2].y : r[i / 2].x;
        for (uint32_t k = 0; k < i; k++) sum -= l[i * n + k] * x[k];
        x[i] = sum * l[i * n + i];
    }
    for (uint32_t i = n; i-- > 0;) {
        x[i] *= l[i * n + i];
        for (uint32_t k = 0; k < i; k++) x[k] -= l[i * n + k] * x[i];
    }
    for (uint32_t v = 0; 2 * v < n; v++) z[v] = (qw_vec2){x[2 * v], x[2 * v + 1]};
}

void qw_relax_grids_fill(qw_env *env, qw_relax_grids *g, qw_vec3 (*axis)[2])
{
    assert(g->count > 0 && axis);
    g->grid[0].axis = axis;
    for (uint32_t i = 0; i + 1 < g->count; i++) {
        qw_parallel(env, g->grid[i + 1].a.count, QW_GRAIN_SEARCH, share_block, &g->grid[i]);
        qw_parallel(env, g->grid[i + 1].a.count, QW_GRAIN_SEARCH, coarse_block, &g->grid[i]);
    }
    if (g->dense) factor(g);
}

/* ---- use */

typedef struct restriction {
    const grid *g;
    const qw_vec2 *r;
} restriction;

/* What residuals of members are to their clusters. */
static void restrict_block(void *user, uint32_t begin, uint32_t end)
{
    const restriction *w = user;
    const grid *g = w->g;
    for (uint32_t a = begin; a < end; a++) {
        qw_vec2 sum = {0, 0};
        for (uint32_t m = g->first[a]; m < g->first[a + 1]; m++) {
            const float *p = g->share[g->member[m]];
            qw_vec2 r = w->r[g->member[m]];
            sum.x += p[0] * r.x + p[2] * r.y, sum.y += p[1] * r.x + p[3] * r.y;
        }
        g[1].r[a] = sum;
    }
}

/* z of all but the finest grid, from the coarsest on. */
static void solve_coarse(qw_relax_grids *g)
{
    for (uint32_t i = g->count - 1; i > 0; i--) {
        grid *l = &g->grid[i];
        bool last = i + 1 == g->count;
        if (last && g->dense) {
            solve_dense(g, l->r, l->z);
            continue;
        }
        for (uint32_t a = 0; a < l->a.count; a++) {
            l->z[a] = qw_block_times(l->inverse[a], l->r[a]);
            if (last) continue;
            qw_vec2 more = qw_block_times(l->share[a], l[1].z[l->group[a]]);
            l->z[a].x += more.x, l->z[a].y += more.y;
        }
    }
}

qw_relax_correction qw_relax_grids_correct(qw_env *env, qw_relax_grids *g, const qw_vec2 *r)
{
    assert(g->count > 0 && r);
    if (g->count < 2) return (qw_relax_correction){0};
    grid *l = g->grid;
    qw_parallel(env, l[1].a.count, QW_GRAIN_SEARCH, restrict_block, &(restriction){l, r});
    for (uint32_t i = 1; i + 1 < g->count; i++) restrict_block(&(restriction){l + i, l[i].r}, 0, l[i + 1].a.count);
    solve_coarse(g);
    qw_relax_correction c = {l->group, (const float(*)[4])l->share, l[1].z, 0};
    for (uint32_t a = 0; a < l[1].a.count; a++)
        c.product += (double)l[1].r[a].x * l[1].z[a].x + (double)l[1].r[a].y * l[1].z[a].y;
    return c;
}
