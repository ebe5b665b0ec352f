/* Bounding volume trees over triangles and over segments.
 *
 * One builder serves both. Primitives are boxes, put into 8 x 8 x 8 cells by their centres; those of a cell are one
 * thread's. It sorts them along a Z curve through the cell (Morton 1966) of 128 steps a side and splits where the
 * highest bit changes, which halves the cell's longest side (Lauterbach et al. 2009). Those that are still in one step
 * get a curve of their own. On a surface, where triangles lie evenly, this is about as good a tree as one by areas, for
 * a fifth of the work.
 *
 *     node 0 is the root; the two children of a node lie side by side at an even index, in one cache line of 64 bytes
 *     a split of the range begin..end at m puts them at 2m, 2m + 1
 *
 * so 2 * count nodes always suffice and the layout depends on the input alone. Past BALANCED_DEPTH ranges are halved,
 * which bounds the depth and with it the stack of the traversals.
 *
 * Boxes and rejections work in single precision with a margin; the distance to a primitive itself is found in double
 * precision, where slivers are harmless, so that the answer does not depend on the order of the visits or on the hint.
 */
#include "mesh/bvh.h"

#include <assert.h>
#include <float.h>
#include <string.h>

enum {
    LEAF_SIZE = 4,
    BALANCED_DEPTH = 30,
    STACK_SIZE = 64,
    CELL_BITS = 3,
    STEP_BITS = 7,
    CELLS = 1 << 3 * CELL_BITS,
    BLOCK = 16384,
    SHORT_RUN = 24
};

/* A box as centre and half sides needs no comparison to find how far a point is outside. */
typedef struct node {
    float centre[3];
    uint32_t first; /* inner: index of the left child, the right one follows; leaf: first primitive */
    float half[3];  /* a little more than half the sides, for the rounding */
    uint32_t count; /* primitives of a leaf; 0: inner */
} node;

_Static_assert(sizeof(node) == 32, "two nodes fill a cache line");

typedef struct item {
    float lo[3];
    float hi[3];
} item;

typedef struct tree {
    node *nodes;
    uint32_t count; /* primitives */
    float slack2;   /* squared distance below which two points are one, for the rounding of the boxes */
} tree;

/* A disc that contains the triangle: a cheap test that rejects most triangles. */
typedef struct disc {
    qw_vec3 centre, normal; /* of gravity; unit, or zero without an area */
    float radius;
    uint32_t face;
} disc;

_Static_assert(sizeof(disc) == 32, "half a cache line");

typedef struct triangle {
    qw_vec3 a, b, c;
    uint32_t face;
} triangle;

typedef struct segment {
    qw_vec3 from, to;
    uint32_t index;
} segment;

struct qw_bvh {
    tree tree;
    const qw_vec3 *position; /* of the mesh */
    const uint32_t *corner;
    disc *discs;     /* disc[tree.count], in leaf order */
    uint32_t *place; /* uint32_t[tree.count]: where in discs a face is */
};

struct qw_curve_tree {
    tree tree;
    segment *segments; /* segment[tree.count], in leaf order */
};

/* ---- build */

static inline float min_of(float a, float b) { return a < b ? a : b; }
static inline float max_of(float a, float b) { return a > b ? a : b; }

/* A key is where a primitive lies on the curve, with the primitive in the low half. */
static inline uint32_t code_of(uint64_t key) { return (uint32_t)(key >> 32); }

/* The cube that holds the centres of a range, each coordinate times two. */
typedef struct grid {
    float lo[3], hi[3], scale; /* steps a unit of length */
} grid;

typedef struct build {
    tree *tree;
    const item *items;
    uint64_t *keys, *spare;    /* uint64_t[count] */
    grid *grids;               /* one a block of BLOCK primitives: what holds its centres; [0] in the end the whole's */
    uint32_t (*places)[CELLS]; /* one a block: how many of its primitives are in a cell, then where the next one goes */
    uint32_t cell_begin[CELLS + 1], cell_node[CELLS], cell_depth[CELLS];
} build;

static const grid empty_grid = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}, 0};

static inline void hold_centre(grid *g, const item *it)
{
    for (int k = 0; k < 3; k++) {
        float c = it->lo[k] + it->hi[k];
        g->lo[k] = min_of(g->lo[k], c), g->hi[k] = max_of(g->hi[k], c);
    }
}

/* False where all centres are one, or nearly. */
static bool divide(grid *g, int bits)
{
    float extent = 0;
    for (int k = 0; k < 3; k++) extent = max_of(extent, g->hi[k] - g->lo[k]);
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

static inline uint32_t code_in(const grid *g, const item *it, uint32_t last)
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

static void hold_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const build *b = user;
    grid g = empty_grid;
    for (uint32_t i = begin; i < end; i++) hold_centre(&g, &b->items[i]);
    b->grids[block] = g;
}

static void code_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const build *b = user;
    uint32_t *count = b->places[block];
    memset(count, 0, sizeof b->places[block]);
    for (uint32_t i = begin; i < end; i++) {
        uint32_t cell = code_in(b->grids, &b->items[i], (1 << CELL_BITS) - 1);
        b->spare[i] = (uint64_t)cell << 32 | i;
        count[cell]++;
    }
}

static void place_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const build *b = user;
    uint32_t *next = b->places[block];
    for (uint32_t i = begin; i < end; i++) b->keys[next[code_of(b->spare[i])]++] = b->spare[i];
}

static void sort_into_cells(qw_env *env, build *b, uint32_t count)
{
    uint32_t blocks = (count + BLOCK - 1) / BLOCK;
    b->grids = QW_NEW(env, grid, blocks), b->places = qw_alloc(env, blocks, sizeof *b->places);
    qw_parallel(env, count, BLOCK, hold_block, b);
    for (uint32_t i = 1; i < blocks; i++)
        for (int k = 0; k < 3; k++) {
            b->grids[0].lo[k] = min_of(b->grids[0].lo[k], b->grids[i].lo[k]);
            b->grids[0].hi[k] = max_of(b->grids[0].hi[k], b->grids[i].hi[k]);
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
    if (count <= SHORT_RUN) {
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
    for (uint32_t i = begin; i < end; i++) hold_centre(&g, &b->items[(uint32_t)b->keys[i]]);
    if (!divide(&g, STEP_BITS)) return false;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t index = (uint32_t)b->keys[i];
        b->keys[i] = (uint64_t)code_in(&g, &b->items[index], (1 << STEP_BITS) - 1) << 32 | index;
    }
    sort_keys(b->keys + begin, b->spare + begin, end - begin);
    return true;
}

static void close_leaf(const build *b, node *n, uint32_t begin, uint32_t end)
{
    assert(begin < end);
    *n = (node){{FLT_MAX, FLT_MAX, FLT_MAX}, begin, {-FLT_MAX, -FLT_MAX, -FLT_MAX}, end - begin};
    for (uint32_t i = begin; i < end; i++) {
        const item *it = &b->items[(uint32_t)b->keys[i]];
        for (int k = 0; k < 3; k++)
            n->centre[k] = min_of(n->centre[k], it->lo[k]), n->half[k] = max_of(n->half[k], it->hi[k]);
    }
}

/* From the least and the largest coordinates, which stand there until the parent is closed. */
static void centre_node(node *n)
{
    for (int k = 0; k < 3; k++) {
        float lo = n->centre[k], hi = n->half[k], c = 0.5f * lo + 0.5f * hi;
        n->centre[k] = c;
        n->half[k] = max_of(hi - c, c - lo) * 1.000001f;
    }
}

static void close_node(node *nodes, uint32_t at, uint32_t left)
{
    node *a = &nodes[left], *b = &nodes[left + 1], n = {.first = left, .count = 0};
    for (int k = 0; k < 3; k++)
        n.centre[k] = min_of(a->centre[k], b->centre[k]), n.half[k] = max_of(a->half[k], b->half[k]);
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

static void build_subtree(const build *b, chore whole)
{
    chore stack[2 * STACK_SIZE];
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
        assert(top + 3 <= 2 * STACK_SIZE);
        stack[top++] = (chore){.node = c.node, .left = 2 * split};
        stack[top++] = (chore){2 * split + 1, split, c.end, c.depth + 1, 0, c.sorted};
        stack[top++] = (chore){2 * split, c.begin, split, c.depth + 1, 0, c.sorted};
    }
}

static void build_cells(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
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
    chore *list = QW_NEW(env, chore, 2 * CELLS), stack[STACK_SIZE];
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

/* order: uint32_t[count], the primitives in leaf order. The nodes and nothing else stay in the caller's scope. */
static tree build_tree(qw_env *env, const item *items, uint32_t count, uint32_t *order)
{
    tree t = {.count = count};
    if (count > UINT32_MAX / 2 - 2)
        qw_fail(env, QW_TOO_LARGE, -1, "%u primitives are too many for a bounding volume tree", count);
    t.nodes = qw_alloc(env, 2 * (size_t)count + 2, sizeof(node));
    if (count == 0) return t;
    qw_scope_begin(env);
    build *b = QW_NEW(env, build, 1);
    *b = (build){
        .tree = &t, .items = items, .keys = QW_NEW(env, uint64_t, count), .spare = QW_NEW(env, uint64_t, count)};
    sort_into_cells(env, b, count);
    uint32_t above;
    chore *upper = split_cells(env, b, count, &above);
    qw_parallel(env, CELLS, 1, build_cells, b);
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

static item box_of(const qw_vec3 *points, int count)
{
    assert(count > 0);
    item it = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
    for (int i = 0; i < count; i++) {
        float c[3] = {points[i].x, points[i].y, points[i].z};
        for (int k = 0; k < 3; k++) it.lo[k] = min_of(it.lo[k], c[k]), it.hi[k] = max_of(it.hi[k], c[k]);
    }
    return it;
}

/* ---- distances */

typedef struct dvec {
    double x, y, z;
} dvec;

static inline dvec between(qw_vec3 from, qw_vec3 to)
{
    return (dvec){(double)to.x - from.x, (double)to.y - from.y, (double)to.z - from.z};
}
static inline double ddot(dvec a, dvec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline dvec dcross(dvec a, dvec b)
{
    return (dvec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* Parameter in 0..1 of the point of a segment along `along` that is nearest to the end of `to`, both from the same
 * start. */
static inline double nearest_on_segment(dvec along, dvec to)
{
    double l2 = ddot(along, along), t = ddot(along, to);
    return t <= 0 || l2 <= 0 ? 0 : t >= l2 ? 1 : t / l2;
}

/* Barycentric weights v, w of b and c of the nearest point: the regions of Ericson, Real-Time Collision
 * Detection, 5.1.5. */
static void nearest_on_triangle(dvec ab, dvec ac, dvec ap, double *v, double *w)
{
    double d1 = ddot(ab, ap), d2 = ddot(ac, ap), bb = ddot(ab, ab), bc = ddot(ab, ac), cc = ddot(ac, ac);
    double d3 = d1 - bb, d4 = d2 - bc, d5 = d1 - bc, d6 = d2 - cc;
    *v = *w = 0;
    if (d1 <= 0 && d2 <= 0) return;
    if (d3 >= 0 && d4 <= d3) {
        *v = 1;
        return;
    }
    double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        *v = d1 / (d1 - d3);
        return;
    }
    if (d6 >= 0 && d5 <= d6) {
        *w = 1;
        return;
    }
    double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        *w = d2 / (d2 - d6);
        return;
    }
    double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        *w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        *v = 1 - *w;
        return;
    }
    double scale = 1 / (va + vb + vc);
    *v = vb * scale;
    *w = vc * scale;
}

static inline double offset2(dvec ab, dvec ac, dvec ap, double v, double w)
{
    dvec d = {ab.x * v + ac.x * w - ap.x, ab.y * v + ac.y * w - ap.y, ab.z * v + ac.z * w - ap.z};
    return ddot(d, d);
}

/* A triangle that is nearly a segment: the regions above would divide by nothing. */
static void nearest_on_sliver(dvec ab, dvec ac, dvec ap, double *v, double *w)
{
    dvec bc = {ac.x - ab.x, ac.y - ab.y, ac.z - ab.z}, bp = {ap.x - ab.x, ap.y - ab.y, ap.z - ab.z};
    double s = nearest_on_segment(ab, ap), t = nearest_on_segment(ac, ap), u = nearest_on_segment(bc, bp);
    double best = offset2(ab, ac, ap, s, 0), other = offset2(ab, ac, ap, 0, t);
    *v = s, *w = 0;
    if (other < best) best = other, *v = 0, *w = t;
    if (offset2(ab, ac, ap, 1 - u, u) < best) *v = 1 - u, *w = u;
}

static void nearest_on(const triangle *t, qw_vec3 point, qw_hit *best)
{
    dvec ab = between(t->a, t->b), ac = between(t->a, t->c), ap = between(t->a, point), n = dcross(ab, ac);
    double v, w;
    if (ddot(n, n) <= 1e-20 * ddot(ab, ab) * ddot(ac, ac)) nearest_on_sliver(ab, ac, ap, &v, &w);
    else nearest_on_triangle(ab, ac, ap, &v, &w);
    float d2 = (float)offset2(ab, ac, ap, v, w);
    if (d2 > best->distance2 || (d2 == best->distance2 && t->face >= best->face)) return;
    best->face = t->face;
    best->distance2 = d2;
    best->point = qw_v3((float)(t->a.x + ab.x * v + ac.x * w), (float)(t->a.y + ab.y * v + ac.y * w),
                        (float)(t->a.z + ab.z * v + ac.z * w));
    best->weight[0] = (float)(1 - v - w);
    best->weight[1] = (float)v;
    best->weight[2] = (float)w;
}

/* x + |x| is 2 max(x, 0). Never more than the true distance. */
static inline float box_distance2(const node *n, qw_vec3 p)
{
    float x = fabsf(p.x - n->centre[0]) - n->half[0];
    float y = fabsf(p.y - n->centre[1]) - n->half[1];
    float z = fabsf(p.z - n->centre[2]) - n->half[2];
    x += fabsf(x), y += fabsf(y), z += fabsf(z);
    return 0.25f * (x * x + y * y + z * z);
}

/* Nodes still to be visited, nearest on top. */
typedef struct pending {
    uint32_t node[STACK_SIZE];
    float key[STACK_SIZE]; /* squared distance, or distance along the ray */
    uint32_t count;
} pending;

/* Pushes the farther of the two children and returns the nearer; QW_NONE when neither is within the limit. */
static inline uint32_t choose(pending *p, uint32_t left, float left_key, float right_key, float limit)
{
    uint32_t swap = right_key < left_key;
    float near_key = swap ? right_key : left_key, far_key = swap ? left_key : right_key;
    p->node[p->count] = left + (swap ^ 1);
    p->key[p->count] = far_key;
    p->count += far_key <= limit;
    return near_key <= limit ? left + swap : QW_NONE;
}

static inline uint32_t pop(pending *p, float limit)
{
    while (p->count > 0)
        if (p->key[--p->count] <= limit) return p->node[p->count];
    return QW_NONE;
}

/* A limit for boxes that may hold a point as near as the best so far, rounding allowed for. */
static inline float reach(const tree *t, float distance2) { return distance2 * 1.000001f + t->slack2; }

/* ---- triangles */

static inline triangle triangle_of(const qw_bvh *bvh, uint32_t face)
{
    const uint32_t *c = bvh->corner + 3 * (size_t)face;
    return (triangle){bvh->position[c[0]], bvh->position[c[1]], bvh->position[c[2]], face};
}

typedef struct fill {
    qw_bvh *bvh;
    const qw_trimesh *mesh;
    item *items;
    uint32_t *order; /* faces in leaf order */
} fill;

static void fill_boxes(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const fill *f = user;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t *c = f->mesh->corner + 3 * (size_t)i;
        qw_vec3 points[3] = {f->mesh->position[c[0]], f->mesh->position[c[1]], f->mesh->position[c[2]]};
        f->items[i] = box_of(points, 3);
    }
}

static disc disc_of(const triangle *t)
{
    disc d = {.centre = qw_scale(qw_add(qw_add(t->a, t->b), t->c), 1.0f / 3), .face = t->face};
    dvec n = dcross(between(t->a, t->b), between(t->a, t->c));
    double length = sqrt(ddot(n, n));
    if (length > 0) d.normal = qw_v3((float)(n.x / length), (float)(n.y / length), (float)(n.z / length));
    d.radius = 1.000001f *
               max_of(max_of(qw_distance(t->a, d.centre), qw_distance(t->b, d.centre)), qw_distance(t->c, d.centre));
    return d;
}

static void fill_discs(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const fill *f = user;
    for (uint32_t i = begin; i < end; i++) {
        triangle t = triangle_of(f->bvh, f->order[i]);
        f->bvh->discs[i] = disc_of(&t);
        f->bvh->place[f->order[i]] = i;
    }
}

qw_bvh *qw_bvh_build(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->face_count == 0 || (mesh->position && mesh->corner));
    qw_bvh *bvh = QW_NEW_ZERO(env, qw_bvh, 1);
    fill f = {.bvh = bvh,
              .mesh = mesh,
              .items = QW_NEW(env, item, mesh->face_count),
              .order = QW_NEW(env, uint32_t, mesh->face_count)};
    qw_parallel(env, mesh->face_count, 4096, fill_boxes, &f);
    bvh->tree = build_tree(env, f.items, mesh->face_count, f.order);
    qw_free(env, f.items); /* before the discs, which are as large */
    bvh->position = mesh->position, bvh->corner = mesh->corner;
    bvh->place = QW_NEW(env, uint32_t, mesh->face_count), bvh->discs = QW_NEW(env, disc, mesh->face_count);
    qw_parallel(env, mesh->face_count, 4096, fill_discs, &f);
    qw_free(env, f.order);
    return bvh;
}

/* Rejects cheaply what lies too far above its plane or, within the plane, too far from the disc around it. */
static inline void try_disc(const qw_bvh *bvh, uint32_t i, const qw_bvh_query *q, bool test_normal, qw_hit *best)
{
    const disc *t = &bvh->discs[i];
    if (test_normal && qw_dot(t->normal, q->normal) < q->least_dot) return;
    if (q->label && q->label[t->face] != q->wanted) return;
    qw_vec3 d = qw_sub(q->point, t->centre);
    float slack2 = bvh->tree.slack2, height = qw_dot(d, t->normal),
          room2 = best->distance2 * 1.00001f + slack2 - height * height * 0.99999f;
    if (room2 < 0) return;
    float room = t->radius + sqrtf(room2);
    if (qw_length2(d) - height * height > room * room * 1.00001f + slack2) return;
    triangle whole = triangle_of(bvh, t->face);
    nearest_on(&whole, q->point, best);
}

/* The balls around the discs meet that of the pocket: a few too many. */
static bool put_leaf(const qw_bvh *bvh, const node *leaf, float radius, qw_bvh_pocket *pocket)
{
    for (uint32_t i = leaf->first; i < leaf->first + leaf->count; i++) {
        float room = (radius + bvh->discs[i].radius) * 1.00001f;
        if (qw_length2(qw_sub(bvh->discs[i].centre, pocket->centre)) > room * room + bvh->tree.slack2) continue;
        if (pocket->count == QW_POCKET_SIZE) return false;
        pocket->place[pocket->count++] = i;
    }
    return true;
}

void qw_bvh_fill_pocket(const qw_bvh *bvh, qw_vec3 centre, float radius, qw_bvh_pocket *pocket)
{
    assert(radius >= 0);
    const tree *t = &bvh->tree;
    pocket->centre = centre, pocket->radius = 0, pocket->count = 0;
    uint32_t stack[STACK_SIZE], top = 0;
    float limit = reach(t, radius * radius);
    if (t->count > 0 && box_distance2(t->nodes, centre) <= limit) stack[top++] = 0;
    while (top > 0) {
        const node *n = &t->nodes[stack[--top]];
        if (n->count > 0) {
            if (!put_leaf(bvh, n, radius, pocket)) return;
            continue;
        }
        assert(top + 2 <= STACK_SIZE);
        for (uint32_t k = 2; k-- > 0;)
            if (box_distance2(&t->nodes[n->first + k], centre) <= limit) stack[top++] = n->first + k;
    }
    pocket->radius = radius;
}

/* Whether all that is as near as the best so far lies in the ball. */
static bool is_inside(const tree *t, const qw_bvh_pocket *pocket, qw_vec3 point, float distance2)
{
    float room = pocket->radius - sqrtf(reach(t, distance2));
    return room > 0 && qw_length2(qw_sub(point, pocket->centre)) * 1.00001f < room * room;
}

qw_hit qw_bvh_find(const qw_bvh *bvh, const qw_bvh_query *q, const qw_bvh_pocket *pocket)
{
    assert(q->max_distance >= 0);
    const tree *t = &bvh->tree;
    qw_hit best = {.face = QW_NONE, .distance2 = q->max_distance * q->max_distance};
    if (t->count == 0) return best;
    qw_vec3 point = q->point;
    bool test_normal = q->least_dot > -1 && (q->normal.x != 0 || q->normal.y != 0 || q->normal.z != 0);
    if (q->hint < t->count) try_disc(bvh, bvh->place[q->hint], q, test_normal, &best);
    if (pocket && pocket->radius > 0) {
        for (uint32_t i = 0; i < pocket->count; i++) try_disc(bvh, pocket->place[i], q, test_normal, &best);
        if (is_inside(t, pocket, point, best.distance2)) return best;
    }
    pending todo = {.count = 0};
    uint32_t at = box_distance2(t->nodes, point) <= reach(t, best.distance2) ? 0 : QW_NONE;
    while (at != QW_NONE) {
        const node *n = &t->nodes[at];
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++) try_disc(bvh, i, q, test_normal, &best);
            best.looked += n->count;
            at = pop(&todo, reach(t, best.distance2));
            continue;
        }
        const node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_distance2(pair, point), box_distance2(pair + 1, point),
                    reach(t, best.distance2));
        if (at == QW_NONE) at = pop(&todo, reach(t, best.distance2));
    }
    return best;
}

qw_hit qw_bvh_nearest(const qw_bvh *bvh, qw_vec3 point, qw_vec3 normal, float least_dot, float max_distance,
                      uint32_t hint)
{
    return qw_bvh_find(
        bvh,
        &(qw_bvh_query){
            .point = point, .normal = normal, .least_dot = least_dot, .max_distance = max_distance, .hint = hint},
        NULL);
}

qw_hit qw_bvh_nearest_on(const qw_bvh *bvh, uint32_t face, qw_vec3 point)
{
    assert(face < bvh->tree.count);
    qw_hit hit = {.face = QW_NONE, .distance2 = FLT_MAX};
    triangle whole = triangle_of(bvh, face);
    nearest_on(&whole, point, &hit);
    return hit;
}

/* ---- rays */

typedef struct ray {
    qw_vec3 origin, direction, inverse;
    uint32_t skip;
} ray;

/* Where the ray enters the box, 0 from inside; FLT_MAX: it does not. */
static inline float box_entry(const node *n, const ray *r)
{
    float x = (n->centre[0] - r->origin.x) * r->inverse.x, half_x = n->half[0] * fabsf(r->inverse.x);
    float y = (n->centre[1] - r->origin.y) * r->inverse.y, half_y = n->half[1] * fabsf(r->inverse.y);
    float z = (n->centre[2] - r->origin.z) * r->inverse.z, half_z = n->half[2] * fabsf(r->inverse.z);
    float in = max_of(max_of(x - half_x, y - half_y), z - half_z),
          out = min_of(min_of(x + half_x, y + half_y), z + half_z);
    in -= 1e-6f * fabsf(in);
    out += 1e-6f * fabsf(out);
    return out >= 0 && in <= out ? max_of(in, 0.0f) : FLT_MAX;
}

/* Moeller and Trumbore 1997. In double precision its rounding stays below the rim of 1e-12, so no ray slips between two
 * faces. */
static void try_ray(const qw_bvh *bvh, uint32_t face, const ray *r, double *best_t, qw_hit *best)
{
    const double rim = 1e-12;
    if (face == r->skip) return;
    triangle t = triangle_of(bvh, face);
    dvec ab = between(t.a, t.b), ac = between(t.a, t.c), ao = between(t.a, r->origin);
    dvec d = {r->direction.x, r->direction.y, r->direction.z}, p = dcross(d, ac), q = dcross(ao, ab);
    double det = ddot(ab, p);
    if (det == 0) return;
    double u = ddot(ao, p) / det, v = ddot(d, q) / det, s = ddot(ac, q) / det;
    if (!(u >= -rim && v >= -rim && u + v <= 1 + rim && s >= 0)) return;
    if (s > *best_t || (s == *best_t && face >= best->face)) return;
    *best_t = s;
    best->face = face;
    best->distance2 = (float)(s * s);
    best->point = qw_madd(r->origin, (float)s, r->direction);
    best->weight[0] = (float)(1 - u - v);
    best->weight[1] = (float)u;
    best->weight[2] = (float)v;
}

/* Large instead of infinite, so that 0 times it is 0 for an origin in the plane of a box's side. */
static float inverse_of(float x) { return fabsf(x) > 1e-20f ? 1 / x : x < 0 ? -1e20f : 1e20f; }

qw_hit qw_bvh_ray(const qw_bvh *bvh, qw_vec3 origin, qw_vec3 direction, float max_distance, uint32_t skip)
{
    assert(!(max_distance < 0));
    const tree *t = &bvh->tree;
    qw_hit best = {.face = QW_NONE, .distance2 = max_distance * max_distance};
    if (t->count == 0) return best;
    ray r = {.origin = origin, .direction = direction, .skip = skip};
    r.inverse = qw_v3(inverse_of(direction.x), inverse_of(direction.y), inverse_of(direction.z));
    double best_t = max_distance;
    pending todo = {.count = 0};
    uint32_t at = box_entry(t->nodes, &r) <= max_distance ? 0 : QW_NONE;
    while (at != QW_NONE) {
        const node *n = &t->nodes[at];
        float limit = min_of((float)best_t * 1.000001f, FLT_MAX / 2);
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++)
                try_ray(bvh, bvh->discs[i].face, &r, &best_t, &best);
            at = pop(&todo, min_of((float)best_t * 1.000001f, FLT_MAX / 2));
            continue;
        }
        const node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_entry(pair, &r), box_entry(pair + 1, &r), limit);
        if (at == QW_NONE) at = pop(&todo, limit);
    }
    return best;
}

/* ---- curves */

qw_curve_tree *qw_curve_tree_build(qw_env *env, const qw_vec3 *from, const qw_vec3 *to, uint32_t count)
{
    assert(count == 0 || (from && to));
    qw_curve_tree *c = QW_NEW_ZERO(env, qw_curve_tree, 1);
    c->segments = QW_NEW(env, segment, count);
    item *items = QW_NEW(env, item, count);
    uint32_t *order = QW_NEW(env, uint32_t, count);
    for (uint32_t i = 0; i < count; i++) {
        qw_vec3 ends[2] = {from[i], to[i]};
        items[i] = box_of(ends, 2);
    }
    c->tree = build_tree(env, items, count, order);
    for (uint32_t i = 0; i < count; i++) c->segments[i] = (segment){from[order[i]], to[order[i]], order[i]};
    qw_free(env, items), qw_free(env, order);
    return c;
}

qw_curve_tree *qw_curve_tree_of_quads(qw_env *env, const qw_quadmesh *quads)
{
    assert(quads->twin);
    size_t sides = 4 * (size_t)quads->face_count;
    qw_vec3 *from = QW_NEW(env, qw_vec3, sides), *to = QW_NEW(env, qw_vec3, sides);
    uint32_t count = 0;
    for (uint32_t h = 0; h < sides; h++) {
        if (quads->twin[h] != QW_NONE && quads->twin[h] < h) continue;
        from[count] = quads->position[quads->corner[h]];
        to[count++] = quads->position[quads->corner[qw_quad_next(h)]];
    }
    qw_curve_tree *built = qw_curve_tree_build(env, from, to, count);
    qw_free(env, from), qw_free(env, to);
    return built;
}

static inline void try_segment(const segment *s, qw_vec3 point, qw_curve_hit *best)
{
    dvec along = between(s->from, s->to), to = between(s->from, point);
    double t = nearest_on_segment(along, to);
    dvec d = {along.x * t - to.x, along.y * t - to.y, along.z * t - to.z};
    float d2 = (float)ddot(d, d);
    if (d2 > best->distance2 || (d2 == best->distance2 && s->index >= best->segment)) return;
    best->segment = s->index;
    best->distance2 = d2;
    best->t = (float)t;
    best->point = qw_v3((float)(s->from.x + along.x * t), (float)(s->from.y + along.y * t),
                        (float)(s->from.z + along.z * t));
}

qw_curve_hit qw_curve_nearest(const qw_curve_tree *curves, qw_vec3 point, float max_distance)
{
    const tree *t = &curves->tree;
    qw_curve_hit best = {.segment = QW_NONE, .distance2 = max_distance * max_distance};
    if (t->count == 0) return best;
    pending todo = {.count = 0};
    uint32_t at = box_distance2(t->nodes, point) <= reach(t, best.distance2) ? 0 : QW_NONE;
    while (at != QW_NONE) {
        const node *n = &t->nodes[at];
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++) try_segment(&curves->segments[i], point, &best);
            best.looked += n->count;
            at = pop(&todo, reach(t, best.distance2));
            continue;
        }
        const node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_distance2(pair, point), box_distance2(pair + 1, point),
                    reach(t, best.distance2));
        if (at == QW_NONE) at = pop(&todo, reach(t, best.distance2));
    }
    return best;
}
