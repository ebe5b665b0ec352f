#include "remesh/quantise/flatten.h"

#include "base/constants.h"
#include "remesh/quantise/closed.h"
#include "remesh/offsets/inversions.h"
#include "base/elementary.h"
#include "solve/multigrid.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Relative residual. At 1e-2 vertices are rounded to the wrong side often enough to show: a sixth more irregular
   vertices over 24 meshes. At 1e-3 there are no more than at 1e-4. */
static const double TOLERANCE = 1e-3;
/* Errors along a surface that the residual does not show grow with the square of its length. Where the surface is a
   band, its area less than COMPACT times the square of its length, the tolerance falls by the square of that share.
   (Meshes have 0.17, a sword, to 10; bands 50 and 200 times as long as wide 0.02 and 0.005.) */
static const double COMPACT = 0.1, LEAST_TOLERANCE = 1e-7;
/* The most by which the last iteration may have lowered the energy, for each unknown. The residual alone would leave
   more where quads are many: it is a share of a right-hand side that grows faster than their number. */
static const double MOST_FALL = 0.01;

typedef struct layout {
    const qw_offset_mesh *m;
    uint8_t *turn;   /* uint8_t[3 face_count], quarter turns from the frame of the corner's vertex to its triangle's */
    uint8_t *pinned; /* uint8_t[vertex_count], QW_FIXED_ bits in the vertex's frame */
    uint32_t *first, *column;
    float *value, *right, *u;
    double *diagonal;
    const float *stiffness; /* float[edge_count] */
    double *energy;         /* of each block of edges */
} layout;

static float weight_of(const layout *l, uint32_t e)
{
    assert(e < l->m->edge_count);
    qw_real2 x = l->m->real[e];
    return l->stiffness[e] / fmaxf(x.x * x.x + x.y * x.y, (float)QW_SHORTEST_EDGE * (float)QW_SHORTEST_EDGE);
}

/* Turns from the frames of the tail and head of h to that of its edge. */
static unsigned tail_turn(const layout *l, uint32_t h) { return (unsigned)(l->turn[h] + 4u - l->m->rot[h]) & 3u; }
static unsigned head_turn(const layout *l, uint32_t h)
{
    assert(h < 3 * l->m->face_count);
    return (unsigned)(l->turn[qw_next(h)] + 4u - l->m->rot[h]) & 3u;
}

static uint8_t swapped(uint8_t bits)
{
    return (uint8_t)((bits & QW_FIXED_X ? QW_FIXED_Y : 0) | (bits & QW_FIXED_Y ? QW_FIXED_X : 0));
}

/* The turns from edges' frames to those of their vertices, and along which axes vertices may not move. */
static void find_frames(qw_env *env, layout *l)
{
    const qw_offset_mesh *m = l->m;
    uint32_t *outgoing = qw_offset_outgoing(env, m);
    qw_star star = {0};
    l->turn = QW_NEW_ZERO(env, uint8_t, (size_t)3 * m->face_count);
    l->pinned = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (outgoing[v] == QW_NONE) continue;
        qw_star_at(env, m, outgoing[v], &star);
        for (uint32_t i = 0; i < star.count; i++) l->turn[star.out[i]] = star.turn[i];
        if (!star.movable || m->constraint[v] == QW_VERTEX_CORNER) l->pinned[v] = QW_FIXED_X | QW_FIXED_Y;
    }
    for (uint32_t e = 0; e < m->edge_count; e++) {
        uint32_t h = m->half[e];
        if (!m->fixed[e]) continue;
        l->pinned[m->corner[h]] |= tail_turn(l, h) & 1u ? swapped(m->fixed[e]) : m->fixed[e];
        l->pinned[m->corner[qw_next(h)]] |= head_turn(l, h) & 1u ? swapped(m->fixed[e]) : m->fixed[e];
    }
}

/* One half of an edge's part in the system: vertex v with turn `mine`, the vertex u at the other end with turn
   `theirs`; gap is what the edge asks v to move by, in the edge's frame. */
static void add_end(layout *l, uint32_t v, unsigned mine, uint32_t u, unsigned theirs, float w, qw_real2 gap,
                    uint32_t *used)
{
    assert(v < l->m->vertex_count && u < l->m->vertex_count);
    qw_real2 g = qw_turn_real(4u - mine, gap);
    for (unsigned k = 0; k < 2; k++) {
        uint32_t row = 2 * v + k;
        if (l->pinned[v] & (k ? QW_FIXED_Y : QW_FIXED_X)) continue;
        /* component k of R2(theirs - mine) u */
        unsigned turn = (theirs + 4u - mine) & 3u, from = turn & 1u ? 1u - k : k;
        float sign = (turn == 0 || (turn == 1 && k == 1) || (turn == 3 && k == 0)) ? 1.0f : -1.0f;
        l->diagonal[row] += (double)w;
        l->right[row] += w * (k ? g.y : g.x);
        if (l->pinned[u] & (from ? QW_FIXED_Y : QW_FIXED_X)) continue;
        l->column[used[row]] = 2 * u + from;
        l->value[used[row]++] = -sign * w;
    }
}

/* The least-squares system for the moves of all vertices, as compressed rows. */
static void fill_system(qw_env *env, layout *l)
{
    const qw_offset_mesh *m = l->m;
    uint32_t n = 2 * m->vertex_count, *used = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    l->first = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    for (uint32_t e = 0; e < m->edge_count; e++)
        for (unsigned k = 0; k < 2; k++) {
            l->first[2 * m->corner[m->half[e]] + k + 1]++;
            l->first[2 * m->corner[qw_next(m->half[e])] + k + 1]++;
        }
    for (uint32_t i = 0; i < n; i++) l->first[i + 1] += l->first[i];
    memcpy(used, l->first, n * sizeof *used);
    l->column = QW_NEW(env, uint32_t, l->first[n]);
    l->value = QW_NEW(env, float, l->first[n]);
    l->diagonal = QW_NEW_ZERO(env, double, n);
    l->right = QW_NEW_ZERO(env, float, n);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        uint32_t h = m->half[e], a = m->corner[h], b = m->corner[qw_next(h)];
        unsigned ta = tail_turn(l, h), tb = head_turn(l, h);
        qw_real2 x = m->real[e], gap = {(float)m->d[e].x - x.x, (float)m->d[e].y - x.y}, back = {-gap.x, -gap.y};
        float w = weight_of(l, e);
        add_end(l, a, ta, b, tb, w, gap, used);
        add_end(l, b, tb, a, ta, w, back, used);
    }
    uint32_t at = 0; /* leave out the columns of pinned neighbours */
    for (uint32_t i = 0; i < n; i++) {
        uint32_t begin = l->first[i];
        l->first[i] = at;
        for (uint32_t k = begin; k < used[i]; k++) l->column[at] = l->column[k], l->value[at++] = l->value[k];
    }
    l->first[n] = at;
    qw_free(env, used);
}

static qw_int2 rounded(const layout *l, uint32_t v)
{
    return (qw_int2){(int32_t)qw_floor(l->u[2 * v] + 0.5f), (int32_t)qw_floor(l->u[2 * v + 1] + 0.5f)};
}

/* Where the vertices at the tail and the head of e go, in the edge's frame. */
static void ends_moved(const layout *l, uint32_t e, qw_real2 *tail, qw_real2 *head)
{
    assert(e < l->m->edge_count);
    uint32_t h = l->m->half[e], a = l->m->corner[h], b = l->m->corner[qw_next(h)];
    *tail = qw_turn_real(tail_turn(l, h), (qw_real2){l->u[2 * a], l->u[2 * a + 1]});
    *head = qw_turn_real(head_turn(l, h), (qw_real2){l->u[2 * b], l->u[2 * b + 1]});
}

/* Energy of the edges of a block. */
static void add_energies(void *user, uint32_t begin, uint32_t end)
{
    const layout *l = user;
    const qw_offset_mesh *m = l->m;
    double sum = 0;
    for (uint32_t e = begin; e < end; e++) {
        qw_real2 ua, ub;
        ends_moved(l, e, &ua, &ub);
        float x = (float)m->d[e].x + ub.x - ua.x - m->real[e].x, y = (float)m->d[e].y + ub.y - ua.y - m->real[e].y;
        sum += (double)(weight_of(l, e) * (x * x + y * y));
    }
    l->energy[begin / QW_GRAIN_LIGHT] = sum;
}

static double energy_of(qw_env *env, layout *l)
{
    uint32_t count = l->m->edge_count, blocks = qw_block_count(count, QW_GRAIN_LIGHT);
    double sum = 0;
    l->energy = QW_NEW(env, double, blocks);
    qw_parallel(env, count, QW_GRAIN_LIGHT, add_energies, l);
    for (uint32_t b = 0; b < blocks; b++) sum += l->energy[b];
    return count ? sum / count : 0;
}

/* Compactness, in the lattice: the area over the square of the farthest that a vertex is moved. */
static double compactness(const layout *l)
{
    const qw_offset_mesh *m = l->m;
    double most = 1, area = 0;
    for (uint32_t i = 0; i < 2 * m->vertex_count; i++) most = fmax(most, fabs((double)l->u[i]));
    for (uint32_t f = 0; f < m->face_count; f++) {
        qw_real2 a = qw_turn_real(m->rot[3 * f], m->real[m->edge[3 * f]]),
                 b = qw_turn_real(m->rot[3 * f + 1], m->real[m->edge[3 * f + 1]]);
        area += fabs((double)a.x * b.y - (double)a.y * b.x) / 2;
    }
    return area / (most * most);
}

/* Solves for the moves: more exactly on drawn-out surfaces (compactness), and as long as the energy may still fall
 * by much. */
static void solve(qw_env *env, layout *l, double most_fall, qw_flatten_counts *counts)
{
    assert(l->first && l->column && counts);
    qw_csr matrix = {2 * l->m->vertex_count, l->first, l->column, l->value, l->diagonal};
    qw_multigrid *grids = qw_multigrid_build(env, &matrix);
    qw_cg_result result = qw_multigrid_solve_with(env, grids, l->right, l->u, TOLERANCE, QW_MULTIGRID_MOST);
    counts->iterations += result.iterations;
    double share = fmin(compactness(l) / COMPACT, 1), tolerance = TOLERANCE * share * share,
           most = most_fall * matrix.row_count;
    if (result.fall > most) tolerance = fmin(tolerance, result.residual * sqrt(most / result.fall));
    if (tolerance < TOLERANCE) {
        result = qw_multigrid_solve_with(env, grids, l->right, l->u, fmax(tolerance, LEAST_TOLERANCE),
                                         QW_MULTIGRID_MOST);
        counts->iterations += result.iterations;
    }
    counts->residual = result.residual;
}

/* Offsets with every vertex at the lattice point nearest to that. */
static void round_block(void *user, uint32_t begin, uint32_t end)
{
    const layout *l = user;
    const qw_offset_mesh *m = l->m;
    for (uint32_t e = begin; e < end; e++) {
        uint32_t h = m->half[e];
        qw_int2 a = qw_turn(tail_turn(l, h), rounded(l, m->corner[h])),
                b = qw_turn(head_turn(l, h), rounded(l, m->corner[qw_next(h)]));
        m->d[e] = qw_int2_add(m->d[e], qw_int2_sub(b, a));
    }
}

void qw_flatten(qw_env *env, qw_offset_mesh *m, const float *stiffness, qw_flatten_counts *counts)
{
    assert(m->real && stiffness && counts);
    *counts = (qw_flatten_counts){0};
    qw_scope_begin(env);
    layout l = {.m = m, .stiffness = stiffness};
    uint32_t n = 2 * m->vertex_count;
    find_frames(env, &l);
    l.u = QW_NEW_ZERO(env, float, n);
    fill_system(env, &l);
    qw_scope_begin(env);
    solve(env, &l, MOST_FALL, counts);
    qw_scope_end(env);
    counts->energy = energy_of(env, &l);
    qw_parallel(env, m->edge_count, QW_GRAIN_LIGHT, round_block, &l);
    qw_scope_end(env);
}
