/* Primitives are boxes, put into 8 x 8 x 8 cells by their centres; those of a cell are one thread's. It sorts them
 * along a Z curve through the cell (Morton 1966) of 128 steps a side and splits where the highest bit changes, which
 * halves the cell's longest side (Lauterbach et al. 2009). Those that are still in one step get a curve of their own.
 * On a surface, where triangles lie evenly, this is about as good a tree as one by areas, for a fifth of the work.
 *
 * Past BALANCED_DEPTH ranges are halved, which bounds the depth.
 */
#include "geometry/box_tree.h"

#include "base/sort.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    LEAF_SIZE = 4,
    BALANCED_DEPTH = 30,
    CELL_BITS = 3,
    STEP_BITS = 7,
    CELLS = 1 << 3 * CELL_BITS,
    FEW = 2048, /* primitives that one thread sorts in less time than others need to begin */
    BLOCK = 16384
};

/* A key is where a primitive lies on the curve, with the primitive in the low half. */
static inline uint32_t code_of(uint64_t key) { return (uint32_t)(key >> 32); }

/* The cube that holds the centres of a range, each coordinate times two. */
typedef struct grid {
    float lo[3], hi[3], scale; /* steps a unit of length */
} grid;

typedef struct build {
    qw_box_tree *tree;
    const qw_box *boxes;
    uint64_t *keys, *spare;    /* uint64_t[count] */
    grid *grids;               /* one a block of BLOCK primitives: what holds its centres; [0] in the end the whole's */
    uint32_t (*places)[CELLS]; /* one a block: how many of its primitives are in a cell, then where the next one goes */
    uint32_t cell_begin[CELLS + 1], cell_node[CELLS], cell_depth[CELLS];
} build;

static const grid empty_grid = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}, 0};

static inline void hold_centre(grid *g, const qw_box *it)
{
    for (int k = 0; k < 3; k++) {
        float c = it->lo[k] + it->hi[k];
        g->lo[k] = qw_min_of(g->lo[k], c), g->hi[k] = qw_max_of(g->hi[k], c);
    }
}

/* False where all centres are one, or nearly. */
static bool divide(grid *g, int bits)
{
    float extent = 0;
    for (int k = 0; k < 3; k++) extent = qw_max_of(extent, g->hi[k] - g->lo[k]);
    g->scale = (float)(1 << bits) / extent;
    return extent > 0 && g->scale < FLT_MAX;
}

/* Two zero bits before each of ten. */
static inline uint32_t spread(uint32_t x)
{
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

static inline uint32_t code_in(const grid *g, const qw_box *it, uint32_t last)
{
    uint32_t code = 0;
    for (int k = 0; k < 3; k++) {
        uint32_t step = (uint32_t)((it->lo[k] + it->hi[k] - g->lo[k]) * g->scale);
        code |= spread(step < last ? step : last) << (2 - k);
    }
    return code;
}

/* Where a sorted range is split: where the highest bit that is not the same in all of them changes. */
static uint32_t highest_change(const uint64_t *keys, uint32_t begin, uint32_t end)
{
    assert(begin + 1 < end);
    uint32_t differ = code_of(keys[begin]) ^ code_of(keys[end - 1]), low = begin, high = end - 1;
    while (differ & (differ - 1)) differ &= differ - 1;
    while (high - low > 1) { /* keys[low] has not the bit, keys[high] has it */
        uint32_t middle = low + (high - low) / 2;
        if ((code_of(keys[middle]) ^ code_of(keys[begin])) & differ) high = middle;
        else low = middle;
    }
    return high;
}

/* ---- cells */

static void hold_block(void *user, uint32_t begin, uint32_t end)
{
    const build *b = user;
    grid g = empty_grid;
    for (uint32_t i = begin; i < end; i++) hold_centre(&g, &b->boxes[i]);
    b->grids[begin / BLOCK] = g;
}

/* The coarse cell of each box of a block, and how many boxes are in each. */
static void code_block(void *user, uint32_t begin, uint32_t end)
{
    const build *b = user;
    uint32_t *count = b->places[begin / BLOCK];
    memset(count, 0, sizeof b->places[begin / BLOCK]);
    for (uint32_t i = begin; i < end; i++) {
        uint32_t cell = code_in(b->grids, &b->boxes[i], (1 << CELL_BITS) - 1);
        b->spare[i] = (uint64_t)cell << 32 | i;
        count[cell]++;
    }
}

static void place_block(void *user, uint32_t begin, uint32_t end)
{
    const build *b = user;
    uint32_t *next = b->places[begin / BLOCK];
    for (uint32_t i = begin; i < end; i++) b->keys[next[code_of(b->spare[i])]++] = b->spare[i];
}

/* Sorts boxes into coarse cells along a space-filling curve, by counting. */
static void sort_into_cells(qw_env *env, build *b, uint32_t count)
{
    uint32_t blocks = (count + BLOCK - 1) / BLOCK;
    b->grids = QW_NEW(env, grid, blocks), b->places = qw_alloc(env, blocks, sizeof *b->places);
    qw_parallel(env, count, BLOCK, hold_block, b);
    for (uint32_t i = 1; i < blocks; i++)
        for (int k = 0; k < 3; k++) {
            b->grids[0].lo[k] = qw_min_of(b->grids[0].lo[k], b->grids[i].lo[k]);
            b->grids[0].hi[k] = qw_max_of(b->grids[0].hi[k], b->grids[i].hi[k]);
        }
    if (!divide(b->grids, CELL_BITS)) b->grids[0].scale = 0;
    qw_parallel(env, count, BLOCK, code_block, b);
    uint32_t sum = 0;
    for (uint32_t cell = 0; cell < CELLS; cell++) {
        b->cell_begin[cell] = sum;
        for (uint32_t i = 0; i < blocks; i++) {
            uint32_t here = b->places[i][cell];
            b->places[i][cell] = sum;
            sum += here;
        }
    }
    b->cell_begin[CELLS] = sum;
    qw_parallel(env, count, BLOCK, place_block, b);
}

/* ---- within a cell */

/* By code, of 3 * STEP_BITS bits; equal ones stay in order. */
static void sort_keys(uint64_t *keys, uint64_t *spare, uint32_t count)
{
    if (count <= QW_SHORT_RUN) {
        for (uint32_t i = 1; i < count; i++) {
            uint64_t x = keys[i];
            uint32_t k = i;
            for (; k > 0 && code_of(keys[k - 1]) > code_of(x); k--) keys[k] = keys[k - 1];
            keys[k] = x;
        }
        return;
    }
    enum { DIGITS = 1 << STEP_BITS };
    uint32_t begin[3][DIGITS] = {{0}};
    for (uint32_t i = 0; i < count; i++)
        for (int d = 0; d < 3; d++) begin[d][keys[i] >> (32 + d * STEP_BITS) & (DIGITS - 1)]++;
    for (int d = 0; d < 3; d++) {
        uint32_t sum = 0;
        for (int i = 0; i < DIGITS; i++) {
            uint32_t here = begin[d][i];
            begin[d][i] = sum;
            sum += here;
        }
        for (uint32_t i = 0; i < count; i++)
            spare[begin[d][keys[i] >> (32 + d * STEP_BITS) & (DIGITS - 1)]++] = keys[i];
        uint64_t *swap = keys;
        keys = spare, spare = swap;
    }
    memcpy(spare, keys, count * sizeof *keys); /* an odd number of passes */
}

/* Sorts the range along a curve of its own. False where there is none. */
static bool sort_range(const build *b, uint32_t begin, uint32_t end)
{
    assert(begin < end);
    grid g = empty_grid;
    for (uint32_t i = begin; i < end; i++) hold_centre(&g, &b->boxes[(uint32_t)b->keys[i]]);
    if (!divide(&g, STEP_BITS)) return false;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t index = (uint32_t)b->keys[i];
        b->keys[i] = (uint64_t)code_in(&g, &b->boxes[index], (1 << STEP_BITS) - 1) << 32 | index;
    }
    sort_keys(b->keys + begin, b->spare + begin, end - begin);
    return true;
}

static void close_leaf(const build *b, qw_box_node *n, uint32_t begin, uint32_t end)
{
    assert(begin < end);
    *n = (qw_box_node){{FLT_MAX, FLT_MAX, FLT_MAX}, begin, {-FLT_MAX, -FLT_MAX, -FLT_MAX}, end - begin};
    for (uint32_t i = begin; i < end; i++) {
        const qw_box *it = &b->boxes[(uint32_t)b->keys[i]];
        for (int k = 0; k < 3; k++)
            n->centre[k] = qw_min_of(n->centre[k], it->lo[k]), n->half[k] = qw_max_of(n->half[k], it->hi[k]);
    }
}

/* From the least and the largest coordinates, which stand there until the parent is closed. */
static void centre_node(qw_box_node *n)
{
    for (int k = 0; k < 3; k++) {
        float lo = n->centre[k], hi = n->half[k], c = 0.5f * lo + 0.5f * hi;
        n->centre[k] = c;
        n->half[k] = qw_max_of(hi - c, c - lo) * 1.000001f;
    }
}

static void close_node(qw_box_node *nodes, uint32_t at, uint32_t left)
{
    qw_box_node *a = &nodes[left], *b = &nodes[left + 1], n = {.first = left, .count = 0};
    for (int k = 0; k < 3; k++)
        n.centre[k] = qw_min_of(a->centre[k], b->centre[k]), n.half[k] = qw_max_of(a->half[k], b->half[k]);
    centre_node(a), centre_node(b);
    nodes[at] = n;
}

/* What is left to do: a range to split, or where `left` is not 0 a node to close whose children are done. */
typedef struct chore {
    uint32_t node, begin, end, depth, left;
    bool sorted;
} chore;

/* Where to split a range of more than LEAF_SIZE. */
static uint32_t split_of(const build *b, chore *c)
{
    assert(c->begin < c->end);
    uint32_t middle = c->begin + (c->end - c->begin) / 2;
    if (c->depth >= BALANCED_DEPTH) return middle;
    if (!c->sorted || code_of(b->keys[c->begin]) == code_of(b->keys[c->end - 1])) {
        if (!sort_range(b, c->begin, c->end)) return middle;
        c->sorted = true;
    }
    return highest_change(b->keys, c->begin, c->end);
}

/* Splits a range of boxes down to leaves, without recursion. */
static void build_subtree(const build *b, chore whole)
{
    chore stack[2 * QW_BOX_STACK];
    uint32_t top = 0;
    stack[top++] = whole;
    while (top > 0) {
        chore c = stack[--top];
        if (c.left) {
            close_node(b->tree->nodes, c.node, c.left);
            continue;
        }
        if (c.end - c.begin <= LEAF_SIZE) {
            close_leaf(b, &b->tree->nodes[c.node], c.begin, c.end);
            continue;
        }
        uint32_t split = split_of(b, &c);
        assert(top + 3 <= 2 * QW_BOX_STACK);
        stack[top++] = (chore){.node = c.node, .left = 2 * split};
        stack[top++] = (chore){2 * split + 1, split, c.end, c.depth + 1, 0, c.sorted};
        stack[top++] = (chore){2 * split, c.begin, split, c.depth + 1, 0, c.sorted};
    }
}

/* The subtrees below some of the coarse cells. */
static void build_cells(void *user, uint32_t begin, uint32_t end)
{
    const build *b = user;
    for (uint32_t i = begin; i < end; i++)
        if (b->cell_begin[i] < b->cell_begin[i + 1])
            build_subtree(b, (chore){.node = b->cell_node[i],
                                     .begin = b->cell_begin[i],
                                     .end = b->cell_begin[i + 1],
                                     .depth = b->cell_depth[i]});
}

/* Nodes above the cells, and each cell's; those above are closed once the cells are done, children before parents. */
static chore *split_cells(qw_env *env, build *b, uint32_t count, uint32_t *above)
{
    assert(count > 0 && above);
    chore *list = QW_NEW(env, chore, 2 * CELLS), stack[QW_BOX_STACK];
    uint32_t top = 0;
    *above = 0;
    stack[top++] = (chore){.node = 0, .begin = 0, .end = count};
    while (top > 0) {
        chore c = stack[--top];
        uint32_t cell = code_of(b->keys[c.begin]);
        if (cell == code_of(b->keys[c.end - 1])) {
            b->cell_node[cell] = c.node, b->cell_depth[cell] = c.depth;
            continue;
        }
        uint32_t split = highest_change(b->keys, c.begin, c.end);
        list[(*above)++] = (chore){.node = c.node, .left = 2 * split};
        stack[top++] = (chore){2 * split, c.begin, split, c.depth + 1, 0, true};
        stack[top++] = (chore){2 * split + 1, split, c.end, c.depth + 1, 0, true};
    }
    return list;
}

qw_box_tree qw_box_tree_build(qw_env *env, const qw_box *boxes, uint32_t count, uint32_t *order)
{
    qw_box_tree t = {.count = count};
    if (count > UINT32_MAX / 2 - 2)
        qw_fail(env, QW_TOO_LARGE, -1, "%u primitives are too many for a bounding volume tree", count);
    t.nodes = qw_alloc(env, 2 * (size_t)count + 2, sizeof(qw_box_node));
    if (count == 0) return t;
    qw_scope_begin(env);
    build *b = QW_NEW(env, build, 1);
    *b = (build){
        .tree = &t, .boxes = boxes, .keys = QW_NEW(env, uint64_t, count), .spare = QW_NEW(env, uint64_t, count)};
    sort_into_cells(env, b, count);
    uint32_t above;
    chore *upper = split_cells(env, b, count, &above);
    qw_parallel(env, CELLS, count < FEW ? CELLS : 1, build_cells, b);
    while (above-- > 0) close_node(t.nodes, upper[above].node, upper[above].left);
    centre_node(t.nodes);
    for (uint32_t i = 0; i < count; i++) order[i] = (uint32_t)b->keys[i];
    qw_scope_end(env);
    float reach2 = 0;
    for (int k = 0; k < 3; k++) {
        float most = fabsf(t.nodes->centre[k]) + t.nodes->half[k];
        reach2 += most * most;
    }
    t.slack2 = 1e-13f * reach2;
    return t;
}

qw_box qw_box_of(const qw_vec3 *points, int count)
{
    assert(count > 0);
    qw_box it = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
    for (int i = 0; i < count; i++) {
        float c[3] = {points[i].x, points[i].y, points[i].z};
        for (int k = 0; k < 3; k++) it.lo[k] = qw_min_of(it.lo[k], c[k]), it.hi[k] = qw_max_of(it.hi[k], c[k]);
    }
    return it;
}
