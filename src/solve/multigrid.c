/* Conjugate gradients, preconditioned by aggregation multigrid with K-cycles (Notay, "An aggregation-based algebraic
 * multigrid method", 2010; Notay and Vassilevski, "Recursive Krylov-based multigrid cycles", 2008), for graphs with
 * signs.
 *
 * Unknowns are joined by fours along their strongest couplings: in pairs, then pairs of pairs. The four move as one in
 * the coarser system, x_i = +-X_a, with the signs that their couplings ask for (a negative entry: the same sign). The
 * coarser matrix is P'AP, again a signed Laplacian. Each system is solved by two steps of conjugate gradients,
 * preconditioned by: Gauss-Seidel forward, the correction from the next coarser system, Gauss-Seidel backward. The
 * smallest is solved by its inverse.
 *
 * Gauss-Seidel runs inside fixed blocks of rows; couplings between blocks see the values from before the sweep. Half of
 * their size is added to the diagonal, without which unknowns all of whose neighbours are in other blocks would swing
 * back and forth (the l1 smoother: Baker, Falgout, Kolev, Yang, "Multigrid smoothers for ultraparallel computing",
 * 2011).
 */
#include "solve/multigrid.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* GRAIN: rows a block; part of the result's definition. DENSE: rows that are solved by the inverse, which then takes no
   longer than a sweep over the next finer system. MAX_LEVELS bounds the recursion: each system has at most SHRINK of
   the rows of the one before. PARTS: of a coarse matrix that are made side by side, each with its own marks. GROUPED:
   rows that are grouped by themselves. LARGEST: pairs that may go together; without it those at a hub would all move as
   one. */
enum {
    GRAIN = 2048,
    DENSE = 64,
    MAX_LEVELS = 32,
    LARGEST = 4,
    SUMS = 3,
    PARTS = 4,
    GROUPED = 4096,
    RESTRICTED = 512,
    LEAST_HALF = 384
};
static const double SHRINK = 0.6;

/* More groups than this share of their members: rows are in no order in which neighbours are near, and are grouped all
 * at once. */
static const double SCATTERED = 0.4;

/* Rows with this much more diagonal than couplings are as good as solved by the sweeps alone and have no part in
 * coarser systems. */
static const double DOMINANT = 2;

/* A coupling below this part of a row's strongest joins nothing (Notay's threshold). */
static const double STRONG = 0.25;

/* A coarse diagonal, or a pivot, below this part of what it was made from is rounding: an isolated part without ground.
 */
static const double ROUNDING = 1e-10;

/* A coarse system needs no second step when the first brought the residual to this (Notay's threshold is 0.25; with 0.5
   some solutions take an iteration more, all of them less work), and no step brings the outer residual down further
   than floats can between two computations anew. */
static const double ENOUGH = 0.5, ROUND = 1e-5;

/* Members and groups are packed with their sign: index << 1 | negative. */
typedef struct level {
    uint32_t n;
    uint32_t grain; /* rows a block: GRAIN, or half of all where there are no more than two of those and a half is
                       LEAST_HALF and more */
    bool three;     /* every row has three entries: loops of known length take two thirds of the time */
    const uint32_t *first, *column; /* as qw_csr */
    const float *value;
    const double *exact;    /* double[n], the diagonal */
    float *diagonal;        /* float[n] */
    float *inverse;         /* float[n], of the smoother's diagonal; 0: left alone */
    uint32_t *group;        /* uint32_t[n], packed unknown of the next level, or QW_NONE */
    uint32_t *member_first; /* uint32_t[next n + 1] */
    uint32_t *member;       /* uint32_t[member_first[next n]], packed unknowns of this level */
    float *r, *y;           /* float[n]: right-hand side, and what the sweeps began with it */
    float *z[2], *v;        /* float[n]: what the two steps found, and A z[0] */
    double *sum[SUMS];      /* double[blocks] */
    float factor[2];        /* the solution is factor[0] z[0] + factor[1] z[1] */
    float step;             /* of r along -v, before it is swept */
    uint32_t way;           /* which z is being made */
    float *dense;           /* NULL, or float[n * n], the inverse */
    struct level *next;     /* NULL: the coarsest */
} level;

struct qw_multigrid {
    const qw_csr *matrix;
    uint32_t level_count;
    level levels[MAX_LEVELS];
    float *p, *q; /* float[n], the outer direction and A times it */
};

static double total(const level *l, int which)
{
    double sum = 0;
    for (uint32_t i = 0; i < qw_block_count(l->n, l->grain); i++) sum += l->sum[which][i];
    return sum;
}

/* Signs are as good as random, so a branch would be mispredicted half of the time. */
static inline float with_sign(float value, uint32_t packed)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits ^= packed << 31;
    memcpy(&value, &bits, sizeof bits);
    return value;
}

/* ---- coarser systems */

/* Pairs of unknowns, or single ones, and the scratch to sum up couplings between them. All is done inside fixed blocks
   of rows, side by side: the pairs and groups of the block from `begin` on are numbered from there, and couplings to
   other blocks join nothing. */
typedef struct pairing {
    level *l;
    uint32_t *pair;             /* uint32_t[n], packed pair of an unknown, or QW_NONE */
    uint32_t *unknown[2];       /* uint32_t[n]: plain members of a pair; the second may be QW_NONE */
    uint32_t *mark;             /* uint32_t[n], the pair that last saw this one */
    uint32_t *seen;             /* uint32_t[n] */
    float *weight;              /* float[n] */
    uint32_t *group;            /* uint32_t[n], packed group of a pair */
    uint8_t *size_of;           /* uint8_t[n], pairs of a group */
    uint32_t *groups, *members; /* [blocks]: how many there are; later, how many are in the blocks before */
} pairing;

typedef struct range {
    uint32_t begin, end;
} range;

static bool within(range rows, uint32_t i) { return i - rows.begin < rows.end - rows.begin; }

static bool is_dominant(const level *l, uint32_t i)
{
    double sum = 0;
    for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) sum += fabsf(l->value[k]);
    return l->exact[i] >= DOMINANT * sum || !(l->exact[i] > 0);
}

/* Returns the end of the block's pairs. */
static uint32_t make_pairs(pairing *p, range rows)
{
    assert(rows.begin <= rows.end && rows.end <= p->l->n);
    enum { OPEN = QW_NONE - 1 };
    const level *l = p->l;
    uint32_t next = rows.begin;
    for (uint32_t i = rows.begin; i < rows.end; i++) p->pair[i] = is_dominant(l, i) ? QW_NONE : OPEN;
    for (uint32_t i = rows.begin; i < rows.end; i++) {
        if (p->pair[i] != OPEN) continue;
        uint32_t best = QW_NONE;
        float most = 0, strongest = 0;
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) {
            float size = fabsf(l->value[k]);
            if (size > strongest) strongest = size;
            if (size > most && within(rows, l->column[k]) && p->pair[l->column[k]] == OPEN) most = size, best = k;
        }
        uint32_t pair = next++;
        p->pair[i] = pair << 1;
        p->unknown[0][pair] = i;
        p->unknown[1][pair] = QW_NONE;
        p->mark[pair] = QW_NONE;
        if (best == QW_NONE || most < STRONG * strongest) continue;
        p->pair[l->column[best]] = pair << 1 | (l->value[best] > 0);
        p->unknown[1][pair] = l->column[best];
    }
    return next;
}

/* Lists the pairs of the block beside a pair, from seen[rows.begin] on, and sums up what couples it to each. Returns
 * their number. */
static uint32_t sum_couplings(pairing *p, range rows, uint32_t pair)
{
    const level *l = p->l;
    uint32_t count = 0, *seen = p->seen + rows.begin;
    for (int m = 0; m < 2; m++) {
        uint32_t i = p->unknown[m][pair];
        if (i == QW_NONE) continue;
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) {
            if (!within(rows, l->column[k])) continue;
            uint32_t packed = p->pair[l->column[k]], other = packed >> 1;
            if (packed == QW_NONE || other == pair) continue;
            if (p->mark[other] != pair) {
                p->mark[other] = pair;
                seen[count++] = other;
                p->weight[other] = 0;
            }
            p->weight[other] += with_sign(l->value[k], packed ^ p->pair[i]);
        }
    }
    return count;
}

/* Pairs of pairs. A pair whose strong neighbours are all taken goes with the strongest that has room. Returns the
 * number of groups. */
static uint32_t join_pairs(pairing *p, range rows, uint32_t pair_end)
{
    assert(rows.begin <= rows.end && rows.end <= p->l->n);
    uint32_t next = rows.begin, *group = p->group;
    for (uint32_t i = rows.begin; i < pair_end; i++) group[i] = QW_NONE;
    for (uint32_t i = rows.begin; i < pair_end; i++) {
        if (group[i] != QW_NONE) continue;
        uint32_t count = sum_couplings(p, rows, i), open = QW_NONE, taken = QW_NONE;
        float most = 0, most_taken = 0, strongest = 0;
        for (uint32_t k = 0; k < count; k++) {
            uint32_t other = p->seen[rows.begin + k];
            float size = fabsf(p->weight[other]);
            if (size > strongest) strongest = size;
            if (group[other] == QW_NONE) {
                if (size > most) most = size, open = other;
            } else if (size > most_taken && p->size_of[group[other] >> 1] < LARGEST) most_taken = size, taken = other;
        }
        if (most > 0 && most >= STRONG * strongest) {
            p->size_of[next] = 2;
            group[open] = next << 1 | (p->weight[open] > 0);
            group[i] = next++ << 1;
        } else if (most_taken > 0 && most_taken >= STRONG * strongest) {
            group[i] = group[taken] ^ (p->weight[taken] > 0);
            p->size_of[group[i] >> 1]++;
        } else {
            p->size_of[next] = 1;
            group[i] = next++ << 1;
        }
    }
    return next - rows.begin;
}

static void group_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    pairing *p = user;
    range rows = {begin, end};
    p->groups[block] = join_pairs(p, rows, make_pairs(p, rows));
    uint32_t members = 0;
    for (uint32_t i = begin; i < end; i++) members += p->pair[i] != QW_NONE;
    p->members[block] = members;
}

/* The block's groups and members in their final places. */
static void list_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const pairing *p = user;
    level *l = p->l;
    uint32_t base = p->groups[block], groups = p->groups[block + 1] - base, at = p->members[block],
             *first = l->member_first + base;
    for (uint32_t a = 0; a < groups; a++) first[a] = 0;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t pair = p->pair[i];
        l->group[i] = pair == QW_NONE ? QW_NONE : (p->group[pair >> 1] ^ (pair & 1)) - 2 * (begin - base);
        if (pair != QW_NONE) first[(l->group[i] >> 1) - base]++;
    }
    for (uint32_t a = 0; a < groups; a++) first[a] = at += first[a];
    for (uint32_t i = end; i-- > begin;)
        if (l->group[i] != QW_NONE) l->member[--first[(l->group[i] >> 1) - base]] = i << 1 | (l->group[i] & 1);
}

/* Makes of each block's counts those of the blocks before it. */
static void add_up(pairing *p, uint32_t blocks, uint32_t *groups, uint32_t *members)
{
    *groups = *members = 0;
    for (uint32_t b = 0; b <= blocks; b++) {
        uint32_t g = b < blocks ? p->groups[b] : 0, m = b < blocks ? p->members[b] : 0;
        p->groups[b] = *groups, p->members[b] = *members;
        *groups += g, *members += m;
    }
}

/* Fills group, member_first and member. Returns the number of unknowns of the next level. */
static uint32_t make_groups(qw_env *env, level *l)
{
    uint32_t n = l->n, blocks = qw_block_count(n, GROUPED);
    l->group = QW_NEW(env, uint32_t, n);
    l->member = QW_NEW(env, uint32_t, n);
    l->member_first = QW_NEW(env, uint32_t, n + 1);
    qw_scope_begin(env);
    pairing p = {
        .l = l, .pair = QW_NEW(env, uint32_t, n), .mark = QW_NEW(env, uint32_t, n), .seen = QW_NEW(env, uint32_t, n)};
    for (int m = 0; m < 2; m++) p.unknown[m] = QW_NEW(env, uint32_t, n);
    p.weight = QW_NEW(env, float, n), p.group = QW_NEW(env, uint32_t, n), p.size_of = QW_NEW(env, uint8_t, n);
    p.groups = QW_NEW(env, uint32_t, blocks + 1), p.members = QW_NEW(env, uint32_t, blocks + 1);
    uint32_t groups, members, grain = GROUPED;
    qw_parallel(env, n, grain, group_task, &p);
    add_up(&p, blocks, &groups, &members);
    if (groups > SCATTERED * members && blocks > 1) { /* neighbours are in other blocks */
        grain = n, blocks = 1;
        qw_parallel(env, n, grain, group_task, &p);
        add_up(&p, blocks, &groups, &members);
    }
    qw_parallel(env, n, grain, list_task, &p);
    l->member_first[groups] = members;
    qw_scope_end(env);
    return groups;
}

/* Row a of P'AP to value and column from `at` on; returns its end. mark: uint32_t[next n], positions, those of other
   rows below `at`. What rounding to float changes of the entries goes to the diagonal, so that a Laplacian without
   ground stays one. */
static uint32_t coarse_row(const level *l, uint32_t a, uint32_t at, uint32_t *mark, uint32_t *column, double *value,
                           double *diagonal)
{
    uint32_t begin = at;
    double own = 0, all = 0;
    for (uint32_t m = l->member_first[a]; m < l->member_first[a + 1]; m++) {
        uint32_t i = l->member[m] >> 1;
        own += l->exact[i];
        all += l->exact[i];
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) {
            uint32_t packed = l->group[l->column[k]], b = packed >> 1;
            if (packed == QW_NONE) continue;
            double entry = with_sign(l->value[k], packed ^ l->member[m]);
            if (b == a) {
                own += entry;
                continue;
            }
            if (mark[b] < begin || mark[b] == QW_NONE) {
                mark[b] = at;
                column[at] = b;
                value[at++ - begin] = 0;
            }
            value[mark[b] - begin] += entry;
        }
    }
    *diagonal = own > ROUNDING * all ? own : 0;
    return at;
}

typedef struct coarsening {
    const level *l, *c;
    uint32_t grain;
    uint32_t *first, *column; /* of the coarse matrix, each part's rows from `begin` on */
    float *value;
    double *exact;
    uint32_t begin[PARTS], end[PARTS];
    uint32_t *mark; /* uint32_t[PARTS * c->n] */
    double *row;    /* double[PARTS * c->n] */
} coarsening;

static void coarse_task(void *user, uint32_t part, uint32_t begin, uint32_t end)
{
    coarsening *w = user;
    uint32_t at = w->begin[part], *mark = w->mark + (size_t)part * w->c->n;
    double *row = w->row + (size_t)part * w->c->n;
    memset(mark, 0xff, w->c->n * sizeof *mark);
    for (uint32_t a = begin; a < end; a++) {
        uint32_t first = w->first[a] = at;
        at = coarse_row(w->l, a, at, mark, w->column, row, &w->exact[a]);
        for (uint32_t k = first; k < at; k++) {
            double entry = row[k - first];
            w->value[k] = (float)entry;
            if (w->exact[a] > 0) w->exact[a] += fabs((double)w->value[k]) - fabs(entry);
        }
    }
    w->end[part] = at;
}

/* Each part has room for all that its rows could hold; afterwards they are moved together. */
static void close_gaps(coarsening *w, uint32_t parts)
{
    uint32_t at = w->end[0];
    for (uint32_t p = 1; p < parts; p++) {
        uint32_t gap = w->begin[p] - at, count = w->end[p] - w->begin[p],
                 last = p + 1 < parts ? (p + 1) * w->grain : w->c->n;
        memmove(w->column + at, w->column + w->begin[p], count * sizeof *w->column);
        memmove(w->value + at, w->value + w->begin[p], count * sizeof *w->value);
        for (uint32_t a = p * w->grain; a < last; a++) w->first[a] -= gap;
        at += count;
    }
    w->first[w->c->n] = at;
}

static void make_coarse(qw_env *env, const level *l, level *c)
{
    uint32_t entries = l->first[l->n], parts = c->n < RESTRICTED ? 1 : PARTS;
    coarsening w = {.l = l, .c = c, .grain = c->n / parts + (c->n % parts != 0)};
    w.first = QW_NEW(env, uint32_t, c->n + 1), w.column = QW_NEW(env, uint32_t, entries),
    w.value = QW_NEW(env, float, entries);
    w.exact = QW_NEW(env, double, c->n);
    qw_scope_begin(env);
    w.mark = QW_NEW(env, uint32_t, (size_t)parts * c->n), w.row = QW_NEW(env, double, (size_t)parts * c->n);
    for (uint32_t m = 0, p = 1, room = 0; p < parts; p++) {
        for (; m < l->member_first[p * w.grain]; m++)
            room += l->first[(l->member[m] >> 1) + 1] - l->first[l->member[m] >> 1];
        w.begin[p] = room;
    }
    qw_parallel(env, c->n, w.grain, coarse_task, &w);
    close_gaps(&w, parts);
    qw_scope_end(env);
    c->first = w.first, c->column = w.column, c->value = w.value, c->exact = w.exact;
}

/* The inverse by elimination of the rows in order, without those that have no diagonal left. */
static void invert(qw_env *env, level *l)
{
    assert(l->diagonal && l->value);
    uint32_t n = l->n;
    l->dense = QW_NEW(env, float, n *n);
    qw_scope_begin(env);
    double *a = QW_NEW_ZERO(env, double, n *n);
    for (uint32_t i = 0; i < n; i++) {
        a[i * n + i] = l->exact[i];
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) a[i * n + l->column[k]] += (double)l->value[k];
    }
    for (uint32_t k = 0; k < n; k++) { /* sweeps: a becomes minus its inverse on the rows taken */
        double pivot = a[k * n + k];
        if (!(pivot > ROUNDING * l->exact[k])) continue;
        for (uint32_t i = 0; i < n; i++) {
            if (i == k) continue;
            double factor = a[i * n + k] / pivot;
            for (uint32_t j = 0; j < n; j++)
                if (j != k) a[i * n + j] -= factor * a[k * n + j];
        }
        for (uint32_t i = 0; i < n; i++)
            if (i != k) a[i * n + k] /= pivot, a[k * n + i] /= pivot;
        a[k * n + k] = -1 / pivot;
    }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            l->dense[i * n + j] = a[i * n + i] < 0 && a[j * n + j] < 0 ? (float)-a[i * n + j] : 0;
    qw_scope_end(env);
}

static void diagonal_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    level *l = user;
    for (uint32_t i = begin; i < end; i++) {
        double outside = 0;
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++)
            if (l->column[k] - begin >= end - begin) outside += fabsf(l->value[k]);
        l->diagonal[i] = (float)l->exact[i];
        l->inverse[i] = l->exact[i] > 0 ? (float)(1 / (l->exact[i] + 0.5 * outside)) : 0;
    }
}

static void make_vectors(qw_env *env, level *l)
{
    l->grain = l->n < 2 * LEAST_HALF || l->n > 2 * GRAIN ? GRAIN : (l->n + 1) / 2;
    float **vectors[] = {&l->diagonal, &l->inverse, &l->r, &l->y, &l->z[0], &l->z[1], &l->v};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) *vectors[i] = QW_NEW(env, float, l->n);
    for (int i = 0; i < SUMS; i++) l->sum[i] = QW_NEW(env, double, qw_block_count(l->n, l->grain));
    qw_parallel(env, l->n, l->grain, diagonal_task, l);
}

static bool has_three(const qw_csr *a)
{
    bool three = true;
    for (uint32_t i = 0; i <= a->row_count && three; i++) three = a->first[i] == 3 * i;
    return three;
}

qw_multigrid *qw_multigrid_build(qw_env *env, const qw_csr *matrix)
{
    assert(matrix->row_count < QW_NONE / 2);
    qw_multigrid *grids = QW_NEW_ZERO(env, qw_multigrid, 1);
    grids->matrix = matrix;
    level *l = grids->levels;
    *l = (level){.n = matrix->row_count,
                 .three = has_three(matrix),
                 .first = matrix->first,
                 .column = matrix->column,
                 .value = matrix->value};
    l->exact = matrix->diagonal;
    for (;;) {
        make_vectors(env, l);
        grids->level_count++;
        if (grids->level_count > 1 && l->n <= DENSE) {
            invert(env, l);
            break;
        }
        if (grids->level_count == MAX_LEVELS) break;
        uint32_t n = make_groups(env, l);
        if (n == 0 || n > SHRINK * l->n) break;
        l[1] = (level){.n = n};
        make_coarse(env, l, l + 1);
        l->next = l + 1;
        l++;
    }
    grids->p = QW_NEW(env, float, matrix->row_count);
    grids->q = QW_NEW(env, float, matrix->row_count);
    return grids;
}

void qw_multigrid_refresh(qw_env *env, qw_multigrid *grids)
{
    assert(grids);
    for (level *l = grids->levels; l; l = l->next) {
        qw_parallel(env, l->n, l->grain, diagonal_task, l);
        if (l->dense) {
            qw_free(env, l->dense);
            invert(env, l);
        }
        level *c = l->next;
        if (!c) return;
        qw_free(env, (void *)c->first), qw_free(env, (void *)c->column), qw_free(env, (void *)c->value),
            qw_free(env, (void *)c->exact);
        make_coarse(env, l, c);
    }
}

/* ---- cycle */

/* Loops over rows are written once, with `three` known when they are compiled. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))
ALWAYS_INLINE uint32_t row_begin(const level *l, uint32_t i, bool three) { return three ? 3 * i : l->first[i]; }
ALWAYS_INLINE uint32_t row_count(const level *l, uint32_t i, bool three)
{
    return three ? 3 : l->first[i + 1] - l->first[i];
}

/* Couplings of row i, without the diagonal. */
ALWAYS_INLINE float couplings(const level *l, const float *v, uint32_t i, bool three)
{
    const uint32_t begin = row_begin(l, i, three), count = row_count(l, i, three), *column = l->column + begin;
    const float *value = l->value + begin;
    float sum = 0;
    for (uint32_t k = 0; k < count; k++) sum += value[k] * v[column[k]];
    return sum;
}

/* The forward sweep from 0: y = r / (lower triangle). Other entries read y[i], still 0, in place of a branch. */
ALWAYS_INLINE void sweep_rows(level *l, uint32_t begin, uint32_t end, bool three)
{
    float *y = l->y;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t first = row_begin(l, i, three), count = row_count(l, i, three), *column = l->column + first;
        const float *value = l->value + first;
        float sum = l->r[i];
        y[i] = 0;
        for (uint32_t k = 0; k < count; k++) {
            uint32_t j = column[k];
            sum -= value[k] * y[j - begin < i - begin ? j : i];
        }
        y[i] = sum * l->inverse[i];
    }
}

static void sweep_forward(level *l, uint32_t begin, uint32_t end)
{
    if (l->three) sweep_rows(l, begin, end, true);
    else sweep_rows(l, begin, end, false);
}

ALWAYS_INLINE void restrict_rows(level *l, uint32_t begin, uint32_t end, bool three)
{
    for (uint32_t a = begin; a < end; a++) {
        float sum = 0;
        for (uint32_t m = l->member_first[a]; m < l->member_first[a + 1]; m++) {
            uint32_t i = l->member[m] >> 1;
            sum += with_sign(l->r[i] - l->diagonal[i] * l->y[i] - couplings(l, l->y, i, three), l->member[m]);
        }
        l->next->r[a] = sum;
    }
}

static void restrict_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    level *l = user;
    if (l->three) restrict_rows(l, begin, end, true);
    else restrict_rows(l, begin, end, false);
}

static void sweep_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    sweep_forward(user, begin, end);
}

static void prolong_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    level *l = user;
    const level *c = l->next;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t packed = l->group[i], a = packed >> 1;
        if (packed == QW_NONE) continue;
        float value = c->factor[0] * c->z[0][a];
        if (c->factor[1] != 0) value += c->factor[1] * c->z[1][a];
        l->y[i] += with_sign(value, packed);
    }
}

ALWAYS_INLINE void backward_rows(const level *l, float *z, uint32_t begin, uint32_t end, bool three)
{
    const float *y = l->y;
    for (uint32_t i = end; i-- > begin;) {
        const uint32_t first = row_begin(l, i, three), count = row_count(l, i, three), *column = l->column + first;
        const float *value = l->value + first;
        float sum = l->r[i] - l->diagonal[i] * y[i];
        for (uint32_t k = 0; k < count; k++) {
            uint32_t j = column[k];
            const float *from = j - begin < end - begin ? z : y;
            sum -= value[k] * from[j];
        }
        z[i] = y[i] + sum * l->inverse[i];
    }
}

/* The backward sweep, from y to z. */
static void backward_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    level *l = user;
    float *z = l->z[l->way];
    memcpy(z + begin, l->y + begin, (end - begin) * sizeof *z);
    if (l->three) backward_rows(l, z, begin, end, true);
    else backward_rows(l, z, begin, end, false);
}

/* v = A z[0], with z . v, z . r and r . r; in the second step only the sums with z[1]: z . A z, z . r and z . v. */
static void multiply_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    level *l = user;
    const float *z = l->z[l->way];
    double sum[SUMS] = {0};
    for (uint32_t i = begin; i < end; i++) {
        float product = l->diagonal[i] * z[i] + couplings(l, z, i, false);
        sum[0] += (double)z[i] * product;
        sum[1] += (double)z[i] * l->r[i];
        sum[2] += l->way ? (double)z[i] * l->v[i] : (double)l->r[i] * l->r[i];
        if (!l->way) l->v[i] = product;
    }
    for (int k = 0; k < SUMS; k++) l->sum[k][block] = sum[k];
}

/* A step of r along v, and the forward sweep of the second cycle. */
static void reduce_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    level *l = user;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) {
        l->r[i] -= l->step * l->v[i];
        sum += (double)l->r[i] * l->r[i];
    }
    l->sum[0][block] = sum;
    sweep_forward(l, begin, end);
}

static void solve_level(qw_env *env, level *l);

/* From r and the forward sweep in y to z[way]. */
static void cycle(qw_env *env, level *l, uint32_t way)
{
    if (l->next) {
        qw_parallel(env, l->next->n, RESTRICTED, restrict_task, l);
        if (!l->next->dense) qw_parallel(env, l->next->n, l->next->grain, sweep_task, l->next);
        solve_level(env, l->next);
        qw_parallel(env, l->n, l->grain, prolong_task, l);
    }
    l->way = way;
    qw_parallel(env, l->n, l->grain, backward_task, l);
}

static void multiply_dense(level *l)
{
    memset(l->z[0], 0, l->n * sizeof(float));
    for (uint32_t j = 0; j < l->n; j++) {
        const float *column = l->dense + j * l->n;
        float *restrict z = l->z[0], factor = l->r[j];
        for (uint32_t i = 0; i < l->n; i++) z[i] += factor * column[i];
    }
    l->factor[0] = 1;
    l->factor[1] = 0;
}

/* Two steps of flexible conjugate gradients from 0. Solves for r, which it overwrites. Recurs once a level. */
static void solve_level(qw_env *env, level *l)
{
    assert(l->r && l->y);
    if (l->dense) {
        multiply_dense(l);
        return;
    }
    l->factor[0] = l->factor[1] = 0;
    cycle(env, l, 0);
    qw_parallel(env, l->n, l->grain, multiply_task, l);
    double zv = total(l, 0), zr = total(l, 1), before = total(l, 2);
    if (!(zv > 0)) return;
    l->factor[0] = l->step = (float)(zr / zv);
    qw_parallel(env, l->n, l->grain, reduce_task, l);
    if (total(l, 0) <= ENOUGH * ENOUGH * before) return;
    cycle(env, l, 1);
    qw_parallel(env, l->n, l->grain, multiply_task, l);
    double cross = total(l, 2), own = total(l, 0) - cross * cross / zv;
    if (!(own > 0)) return;
    l->factor[1] = (float)(total(l, 1) / own);
    l->factor[0] -= (float)(cross / zv * (total(l, 1) / own));
}

/* ---- outer */

typedef struct solver {
    qw_env *env;
    qw_multigrid *grids;
    level *top;
    const float *b;
    float *given; /* float[n], the caller's x */
    double *x;
    double *before; /* double[n], x when the round began */
    float alpha, beta;
} solver;

static void run(solver *s, qw_task task) { qw_parallel(s->env, s->top->n, s->top->grain, task, s); }

static void widen_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    solver *s = user;
    for (uint32_t i = begin; i < end; i++) s->x[i] = s->given[i];
}

static void narrow_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    solver *s = user;
    for (uint32_t i = begin; i < end; i++) s->given[i] = (float)s->x[i];
}

static void remember_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    solver *s = user;
    memcpy(s->before + begin, s->x + begin, (end - begin) * sizeof(double));
}

static void norm_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    solver *s = user;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) sum += (double)s->b[i] * s->b[i];
    s->top->sum[0][block] = sum;
}

/* r = b - A x, and its forward sweep. */
static void residual_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    solver *s = user;
    level *l = s->top;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) {
        double r = (double)s->b[i] - l->exact[i] * s->x[i];
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) r -= (double)l->value[k] * s->x[l->column[k]];
        l->r[i] = (float)r;
        sum += r * r;
    }
    l->sum[0][block] = sum;
    sweep_forward(l, begin, end);
}

/* v = A z, with z . v, z . r and z . q. */
static void product_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    solver *s = user;
    level *l = s->top;
    const float *z = l->z[0], *q = s->grids->q;
    double sum[SUMS] = {0};
    for (uint32_t i = begin; i < end; i++) {
        l->v[i] = l->diagonal[i] * z[i] + (l->three ? couplings(l, z, i, true) : couplings(l, z, i, false));
        sum[0] += (double)z[i] * l->v[i];
        sum[1] += (double)z[i] * l->r[i];
        sum[2] += (double)z[i] * q[i];
    }
    for (int k = 0; k < SUMS; k++) l->sum[k][block] = sum[k];
}

/* The direction, a step along it, and the next forward sweep. */
static void step_task(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    solver *s = user;
    level *l = s->top;
    float *restrict p = s->grids->p, *restrict q = s->grids->q, *restrict r = l->r;
    double *restrict x = s->x;
    const float *restrict z = l->z[0], *restrict v = l->v;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) {
        p[i] = z[i] + s->beta * p[i];
        q[i] = v[i] + s->beta * q[i];
        x[i] += (double)(s->alpha * p[i]);
        r[i] -= s->alpha * q[i];
        sum += (double)r[i] * r[i];
    }
    l->sum[0][block] = sum;
    sweep_forward(l, begin, end);
}

/* Flexible conjugate gradients from where x and r are, by the recurrence for r. Returns the iterations done. */
static uint32_t descend(solver *s, double norm, double tolerance, uint32_t max_iterations)
{
    assert(tolerance >= 0);
    uint32_t iterations = 0, n = s->top->n;
    double residual = INFINITY, pq = INFINITY;
    memset(s->grids->p, 0, n * sizeof(float));
    memset(s->grids->q, 0, n * sizeof(float));
    while (iterations < max_iterations && residual > tolerance) {
        cycle(s->env, s->top, 0);
        run(s, product_task);
        double zq = total(s->top, 2), own = total(s->top, 0) - zq * zq / pq, zr = total(s->top, 1);
        if (!(own > 0) || !(zr > 0)) break; /* rounding has used up the descent, or A is not semidefinite */
        s->beta = (float)(-zq / pq);
        s->alpha = (float)(zr / own);
        run(s, step_task);
        residual = sqrt(total(s->top, 0)) / norm;
        pq = own;
        iterations++;
    }
    return iterations;
}

/* The recurrence, in float, drifts from the true residual. So each round brings it down by no more than floats can, the
   true one is computed anew, and a round that made it worse is undone. */
static qw_cg_result solve(solver *s, double tolerance, uint32_t max_iterations)
{
    qw_cg_result result = {.residual = INFINITY};
    size_t bytes = s->top->n * sizeof(double);
    run(s, norm_task);
    double norm = sqrt(total(s->top, 0));
    if (norm == 0) {
        memset(s->x, 0, bytes);
        return (qw_cg_result){.converged = true};
    }
    run(s, remember_task);
    for (;;) {
        run(s, residual_task);
        double residual = sqrt(total(s->top, 0)) / norm, gain = result.residual / residual;
        if (!(residual < result.residual)) {
            memcpy(s->x, s->before, bytes);
            return result;
        }
        result.residual = residual;
        result.converged = residual <= tolerance;
        if (result.converged || result.iterations >= max_iterations || !(gain >= 2)) return result;
        run(s, remember_task);
        result.iterations += descend(s, norm, fmax(tolerance, ROUND * residual), max_iterations - result.iterations);
    }
}

qw_cg_result qw_multigrid_solve_with(qw_env *env, qw_multigrid *grids, const float *b, float *x, double tolerance,
                                     uint32_t max_iterations)
{
    assert(grids && b && x && tolerance >= 0);
    qw_scope_begin(env);
    uint32_t n = grids->levels->n;
    solver s = {.env = env,
                .grids = grids,
                .top = grids->levels,
                .b = b,
                .given = x,
                .x = QW_NEW(env, double, n),
                .before = QW_NEW(env, double, n)};
    run(&s, widen_task);
    qw_cg_result result = solve(&s, tolerance, max_iterations);
    run(&s, narrow_task);
    qw_scope_end(env);
    return result;
}

qw_cg_result qw_multigrid_solve(qw_env *env, const qw_csr *matrix, const float *b, float *x, double tolerance,
                                uint32_t max_iterations)
{
    assert(matrix->first && b && x && tolerance >= 0);
    qw_scope_begin(env);
    qw_multigrid *grids = qw_multigrid_build(env, matrix);
    qw_cg_result result = qw_multigrid_solve_with(env, grids, b, x, tolerance, max_iterations);
    qw_scope_end(env);
    return result;
}
