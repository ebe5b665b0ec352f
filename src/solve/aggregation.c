#include "solve/aggregation.h"

#include <assert.h>
#include <math.h>

/* GROUPED: rows a block. LARGEST: pairs that may go together; without it those at a hub would all move as one. */
enum { GROUPED = 4096, LARGEST = 4 };

/* More groups than this share of their members: rows are in no order in which neighbours are near, and are grouped all
   at once. */
static const double SCATTERED = 0.4;

/* Rows with this much more diagonal than couplings are as good as solved by the sweeps alone and have no part in
   coarser systems. */
static const double DOMINANT = 2;

/* A coupling below this part of a row's strongest joins nothing (Notay's threshold). */
static const double STRONG = 0.25;

/* Pairs of unknowns, or single ones, and the scratch to sum up couplings between them. All is done inside fixed blocks
   of rows, side by side: the pairs and groups of the block from `begin` on are numbered from there, and couplings to
   other blocks join nothing. */
typedef struct pairing {
    qw_grid *l;
    uint32_t *pair;             /* uint32_t[n], packed pair of an unknown, or QW_NONE */
    uint32_t *unknown[2];       /* uint32_t[n]: plain members of a pair; the second may be QW_NONE */
    uint32_t *mark;             /* uint32_t[n], the pair that last saw this one */
    uint32_t *seen;             /* uint32_t[n] */
    float *weight;              /* float[n] */
    uint32_t *group;            /* uint32_t[n], packed group of a pair */
    uint8_t *size_of;           /* uint8_t[n], pairs of a group */
    uint32_t grain;             /* rows a block */
    uint32_t *groups, *members; /* [blocks]: how many there are; later, how many are in the blocks before */
} pairing;

typedef struct range {
    uint32_t begin, end;
} range;

static bool within(range rows, uint32_t i) { return i - rows.begin < rows.end - rows.begin; }

static bool is_dominant(const qw_grid *l, uint32_t i)
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
    const qw_grid *l = p->l;
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
    const qw_grid *l = p->l;
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
            p->weight[other] += qw_with_sign(l->value[k], packed ^ p->pair[i]);
        }
    }
    assert(count <= rows.end - rows.begin);
    return count;
}

/* Pairs of pairs, packed: 2 * number + 1 where the pair's sign is turned against its group. A pair whose strong
 * neighbours are all taken goes with the strongest that has room. Returns the number of groups. */
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

static void group_task(void *user, uint32_t begin, uint32_t end)
{
    pairing *p = user;
    range rows = {begin, end};
    p->groups[begin / p->grain] = join_pairs(p, rows, make_pairs(p, rows));
    uint32_t members = 0;
    for (uint32_t i = begin; i < end; i++) members += p->pair[i] != QW_NONE;
    p->members[begin / p->grain] = members;
}

/* The block's groups and members in their final places. */
static void list_task(void *user, uint32_t begin, uint32_t end)
{
    const pairing *p = user;
    qw_grid *l = p->l;
    uint32_t block = begin / p->grain, base = p->groups[block], groups = p->groups[block + 1] - base,
             at = p->members[block], *first = l->member_first + base;
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

uint32_t qw_make_aggregates(qw_env *env, qw_grid *l)
{
    assert(l->first && l->exact);
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
    uint32_t groups, members;
    p.grain = GROUPED;
    qw_parallel(env, n, p.grain, group_task, &p);
    add_up(&p, blocks, &groups, &members);
    if (groups > SCATTERED * members && blocks > 1) { /* neighbours are in other blocks */
        p.grain = n, blocks = 1;
        qw_parallel(env, n, p.grain, group_task, &p);
        add_up(&p, blocks, &groups, &members);
    }
    qw_parallel(env, n, p.grain, list_task, &p);
    l->member_first[groups] = members;
    qw_scope_end(env);
    return groups;
}
