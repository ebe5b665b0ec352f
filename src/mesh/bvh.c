/* Bounding volume trees over triangles and over segments.
 *
 * One builder serves both: primitives are boxes, split top-down at the cheapest of 16 bins along the longest side of their centres
 * (the surface area heuristic); HALVED or fewer lie so evenly on a surface that halving the side does as well. Ranges of more than SUBTREE
 * primitives and one of PARTS of all are split level by level, the subtrees of the rest each by one thread.
 *
 *     node 0 is the root; the two children of a node lie side by side at an even index, in one cache line of 64 bytes
 *     a split of the range begin..end at m in the upper levels puts them at 2m, 2m + 1; a subtree fills 2 begin + 2 onwards
 *
 * so 2 * count nodes always suffice and the layout depends on the input alone. Past BALANCED_DEPTH ranges are halved, which bounds
 * the depth and with it the stack of the traversals.
 *
 * Boxes and rejections work in single precision with a margin; the distance to a primitive itself is found in double precision,
 * where slivers are harmless, so that the answer does not depend on the order of the visits or on the hint.
 */
#include "mesh/bvh.h"

#include <assert.h>
#include <float.h>

enum { LEAF_SIZE = 4, BINS = 16, BALANCED_DEPTH = 30, STACK_SIZE = 64, PARTS = 16, SUBTREE = 2048, HALVED = 1024 };

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
    uint32_t index;
    float hi[3];
    uint32_t unused;
} item;

typedef struct tree {
    node *nodes;
    uint32_t count; /* primitives */
    float slack2;   /* squared distance below which two points are one, for the rounding of the boxes */
} tree;

typedef struct range {
    uint32_t node, begin, end, depth;
} range;

/* What most triangles that are asked are rejected by: a disc that holds the triangle. */
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

/* ---------------------------------------------------------------------------------------------------------------- build */

typedef struct box {
    float lo[3], hi[3];
} box;

static const box empty_box = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

static inline float min_of(float a, float b) { return a < b ? a : b; }
static inline float max_of(float a, float b) { return a > b ? a : b; }

static inline void include(box *b, const float lo[3], const float hi[3])
{
    for (int k = 0; k < 3; k++) {
        b->lo[k] = min_of(b->lo[k], lo[k]);
        b->hi[k] = max_of(b->hi[k], hi[k]);
    }
}

static float half_area(const box *b)
{
    float x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
    return x * y + y * z + z * x;
}

/* How the centres of a range fall into bins along one axis. */
typedef struct binning {
    int axis;
    float origin, factor;
} binning;

static inline int bin_of(const binning *b, const item *it)
{
    int bin = (int)((it->lo[b->axis] + it->hi[b->axis] - b->origin) * b->factor);
    return bin < BINS - 1 ? bin : BINS - 1;
}

/* The bin that begins the right half, by least (area times count) on both sides together. */
static int cheapest_bin(const item *items, range r, const binning *b)
{
    box boxes[BINS];
    uint32_t counts[BINS] = {0};
    for (int i = 0; i < BINS; i++) boxes[i] = empty_box;
    for (uint32_t i = r.begin; i < r.end; i++) {
        int bin = bin_of(b, &items[i]);
        counts[bin]++;
        include(&boxes[bin], items[i].lo, items[i].hi);
    }
    float right_cost[BINS];
    box side = empty_box;
    uint32_t count = 0;
    for (int i = BINS - 1; i > 0; i--) {
        count += counts[i];
        include(&side, boxes[i].lo, boxes[i].hi);
        right_cost[i] = count ? half_area(&side) * (float)count : FLT_MAX;
    }
    side = empty_box;
    count = 0;
    int best = 1;
    float best_cost = FLT_MAX;
    for (int i = 1; i < BINS; i++) {
        count += counts[i - 1];
        include(&side, boxes[i - 1].lo, boxes[i - 1].hi);
        if (count == 0 || right_cost[i] == FLT_MAX) continue;
        float cost = half_area(&side) * (float)count + right_cost[i];
        if (cost < best_cost) best_cost = cost, best = i;
    }
    return best;
}

static uint32_t partition(item *items, range r, const binning *b, int first_right_bin)
{
    uint32_t i = r.begin, j = r.end;
    while (i < j) {
        if (bin_of(b, &items[i]) < first_right_bin) {
            i++;
        } else {
            item t = items[i];
            items[i] = items[--j];
            items[j] = t;
        }
    }
    return i;
}

/* Fills the node's box. Returns where to split the range, or its end for a leaf. */
static uint32_t open_range(node *n, item *items, range r)
{
    box all = empty_box, centres = empty_box;
    for (uint32_t i = r.begin; i < r.end; i++) {
        float c[3];
        for (int k = 0; k < 3; k++) c[k] = items[i].lo[k] + items[i].hi[k];
        include(&all, items[i].lo, items[i].hi);
        include(&centres, c, c);
    }
    for (int k = 0; k < 3; k++) {
        float c = 0.5f * all.lo[k] + 0.5f * all.hi[k];
        n->centre[k] = c;
        n->half[k] = max_of(all.hi[k] - c, c - all.lo[k]) * 1.000001f;
    }
    n->first = r.begin;
    n->count = r.end - r.begin;
    if (n->count <= LEAF_SIZE) return r.end;
    uint32_t middle = r.begin + n->count / 2;
    binning b = {0};
    for (int k = 1; k < 3; k++)
        if (centres.hi[k] - centres.lo[k] > centres.hi[b.axis] - centres.lo[b.axis]) b.axis = k;
    float extent = centres.hi[b.axis] - centres.lo[b.axis];
    b.origin = centres.lo[b.axis];
    b.factor = BINS / extent;
    if (!(extent > 0) || !(b.factor < FLT_MAX) || r.depth >= BALANCED_DEPTH) return middle;
    uint32_t split = partition(items, r, &b, n->count <= HALVED ? BINS / 2 : cheapest_bin(items, r, &b));
    return split > r.begin && split < r.end ? split : middle;
}

typedef struct build {
    tree *tree;
    item *items;
    range *ranges;   /* of this round; in the end those whose subtrees are left */
    uint32_t *split; /* uint32_t[ranges]: where each is to be split, or its end */
    uint32_t largest;
} build;

static inline void push_children(range *stack, uint32_t *top, node *n, range r, uint32_t split, uint32_t pair)
{
    n->first = pair;
    n->count = 0;
    stack[(*top)++] = (range){pair + 1, split, r.end, r.depth + 1};
    stack[(*top)++] = (range){pair, r.begin, split, r.depth + 1};
    assert(*top <= STACK_SIZE);
}

static void split_ranges(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const build *b = user;
    for (uint32_t i = begin; i < end; i++) {
        range r = b->ranges[i];
        b->split[i] = r.end - r.begin > b->largest ? open_range(&b->tree->nodes[r.node], b->items, r) : r.end;
    }
}

static void build_subtrees(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const build *b = user;
    for (uint32_t s = begin; s < end; s++) {
        range stack[STACK_SIZE];
        uint32_t top = 0, next = 2 * b->ranges[s].begin + 2;
        stack[top++] = b->ranges[s];
        while (top > 0) {
            range r = stack[--top];
            node *n = &b->tree->nodes[r.node];
            uint32_t split = open_range(n, b->items, r);
            if (split == r.end) continue;
            push_children(stack, &top, n, r, split, next);
            next += 2;
        }
    }
}

/* Splits all that are too large once, side by side. Returns how many ranges there are now. */
static uint32_t split_once(qw_env *env, build *b, uint32_t count)
{
    b->split = QW_NEW(env, uint32_t, count);
    qw_parallel(env, count, 1, split_ranges, b);
    range *ranges = QW_NEW(env, range, 2 * (size_t)count);
    uint32_t top = 0;
    for (uint32_t i = 0; i < count; i++) {
        range r = b->ranges[i];
        if (b->split[i] == r.end) {
            ranges[top++] = r;
            continue;
        }
        node *n = &b->tree->nodes[r.node];
        n->first = 2 * b->split[i];
        n->count = 0;
        ranges[top++] = (range){n->first, r.begin, b->split[i], r.depth + 1};
        ranges[top++] = (range){n->first + 1, b->split[i], r.end, r.depth + 1};
    }
    b->ranges = ranges;
    return top;
}

/* Reorders items into leaf order. The nodes stay in the caller's scope. A range of more than one of PARTS of all is split by itself, so that threads have subtrees of
   like size. */
static tree build_tree(qw_env *env, item *items, uint32_t count)
{
    tree t = {.nodes = qw_alloc(env, 2 * (size_t)count + 2, sizeof(node)), .count = count};
    if (count == 0) return t;
    if (count > UINT32_MAX / 2 - 2) qw_fail(env, QW_TOO_LARGE, -1, "%u primitives are too many for a bounding volume tree", count);
    qw_scope_begin(env);
    range whole = {0, 0, count, 0};
    build b = {.tree = &t, .items = items, .ranges = &whole, .largest = count / PARTS > SUBTREE ? count / PARTS : SUBTREE};
    uint32_t ranges = 0;
    for (uint32_t now = 1; now > ranges;) {
        ranges = now;
        now = split_once(env, &b, ranges);
    }
    qw_parallel(env, ranges, 1, build_subtrees, &b);
    qw_scope_end(env);
    float reach2 = 0;
    for (int k = 0; k < 3; k++) {
        float most = fabsf(t.nodes->centre[k]) + t.nodes->half[k];
        reach2 += most * most;
    }
    t.slack2 = 1e-13f * reach2;
    return t;
}

static void put_box(item *it, uint32_t index, const qw_vec3 *points, int count)
{
    qw_vec3 lo = points[0], hi = points[0];
    for (int i = 1; i < count; i++) {
        lo = qw_v3(min_of(lo.x, points[i].x), min_of(lo.y, points[i].y), min_of(lo.z, points[i].z));
        hi = qw_v3(max_of(hi.x, points[i].x), max_of(hi.y, points[i].y), max_of(hi.z, points[i].z));
    }
    *it = (item){.lo = {lo.x, lo.y, lo.z}, .index = index, .hi = {hi.x, hi.y, hi.z}};
}

/* ------------------------------------------------------------------------------------------------------------ distances */

typedef struct dvec {
    double x, y, z;
} dvec;

static inline dvec between(qw_vec3 from, qw_vec3 to)
{
    return (dvec){(double)to.x - from.x, (double)to.y - from.y, (double)to.z - from.z};
}
static inline double ddot(dvec a, dvec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline dvec dcross(dvec a, dvec b) { return (dvec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

/* Parameter in 0..1 of the point of a segment along `along` that is nearest to the end of `to`, both from the same start. */
static inline double nearest_on_segment(dvec along, dvec to)
{
    double l2 = ddot(along, along), t = ddot(along, to);
    return t <= 0 || l2 <= 0 ? 0 : t >= l2 ? 1 : t / l2;
}

/* Barycentric weights v, w of b and c of the nearest point: the regions of Ericson, Real-Time Collision Detection, 5.1.5. */
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

/* What may still hold something as near as the best, rounding allowed for. */
static inline float reach(const tree *t, float distance2) { return distance2 * 1.000001f + t->slack2; }

/* ------------------------------------------------------------------------------------------------------------ triangles */

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
        put_box(&f->items[i], i, points, 3);
    }
}

static void fill_order(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const fill *f = user;
    for (uint32_t i = begin; i < end; i++) f->order[i] = f->items[i].index;
}

static disc disc_of(const triangle *t)
{
    disc d = {.centre = qw_scale(qw_add(qw_add(t->a, t->b), t->c), 1.0f / 3), .face = t->face};
    dvec n = dcross(between(t->a, t->b), between(t->a, t->c));
    double length = sqrt(ddot(n, n));
    if (length > 0) d.normal = qw_v3((float)(n.x / length), (float)(n.y / length), (float)(n.z / length));
    d.radius = 1.000001f * max_of(max_of(qw_distance(t->a, d.centre), qw_distance(t->b, d.centre)), qw_distance(t->c, d.centre));
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
    qw_bvh *bvh = QW_NEW_ZERO(env, qw_bvh, 1);
    fill f = {.bvh = bvh, .mesh = mesh, .items = QW_NEW(env, item, mesh->face_count), .order = QW_NEW(env, uint32_t, mesh->face_count)};
    qw_parallel(env, mesh->face_count, 4096, fill_boxes, &f);
    bvh->tree = build_tree(env, f.items, mesh->face_count);
    qw_parallel(env, mesh->face_count, 4096, fill_order, &f);
    qw_free(env, f.items); /* before the discs, which are as large */
    bvh->position = mesh->position, bvh->corner = mesh->corner;
    bvh->place = QW_NEW(env, uint32_t, mesh->face_count), bvh->discs = QW_NEW(env, disc, mesh->face_count);
    qw_parallel(env, mesh->face_count, 4096, fill_discs, &f);
    qw_free(env, f.order);
    return bvh;
}

typedef struct nearest_query {
    qw_vec3 point, normal;
    float least_dot;
    bool test_normal;
    float slack2;
} nearest_query;

/* Rejects cheaply what lies too far above its plane or, within the plane, too far from the disc around it. */
static inline void try_disc(const qw_bvh *bvh, uint32_t i, const nearest_query *q, qw_hit *best)
{
    const disc *t = &bvh->discs[i];
    if (q->test_normal && qw_dot(t->normal, q->normal) < q->least_dot) return;
    qw_vec3 d = qw_sub(q->point, t->centre);
    float height = qw_dot(d, t->normal), room2 = best->distance2 * 1.00001f + q->slack2 - height * height * 0.99999f;
    if (room2 < 0) return;
    float room = t->radius + sqrtf(room2);
    if (qw_length2(d) - height * height > room * room * 1.00001f + q->slack2) return;
    triangle whole = triangle_of(bvh, t->face);
    nearest_on(&whole, q->point, best);
}

qw_hit qw_bvh_nearest(const qw_bvh *bvh, qw_vec3 point, qw_vec3 normal, float least_dot, float max_distance, uint32_t hint)
{
    const tree *t = &bvh->tree;
    qw_hit best = {.face = QW_NONE, .distance2 = max_distance * max_distance};
    if (t->count == 0) return best;
    nearest_query q = {.point = point, .normal = normal, .least_dot = least_dot, .slack2 = t->slack2};
    q.test_normal = least_dot > -1 && (normal.x != 0 || normal.y != 0 || normal.z != 0);
    if (hint < t->count) try_disc(bvh, bvh->place[hint], &q, &best);
    pending todo = {.count = 0};
    uint32_t at = box_distance2(t->nodes, point) <= reach(t, best.distance2) ? 0 : QW_NONE;
    while (at != QW_NONE) {
        const node *n = &t->nodes[at];
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++) try_disc(bvh, i, &q, &best);
            at = pop(&todo, reach(t, best.distance2));
            continue;
        }
        const node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_distance2(pair, point), box_distance2(pair + 1, point), reach(t, best.distance2));
        if (at == QW_NONE) at = pop(&todo, reach(t, best.distance2));
    }
    return best;
}

/* ----------------------------------------------------------------------------------------------------------------- rays */

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
    float in = max_of(max_of(x - half_x, y - half_y), z - half_z), out = min_of(min_of(x + half_x, y + half_y), z + half_z);
    in -= 1e-6f * fabsf(in);
    out += 1e-6f * fabsf(out);
    return out >= 0 && in <= out ? max_of(in, 0.0f) : FLT_MAX;
}

/* Moeller and Trumbore 1997. In double precision its rounding stays below the rim of 1e-12, so no ray slips between two faces. */
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
            for (uint32_t i = n->first; i < n->first + n->count; i++) try_ray(bvh, bvh->discs[i].face, &r, &best_t, &best);
            at = pop(&todo, min_of((float)best_t * 1.000001f, FLT_MAX / 2));
            continue;
        }
        const node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_entry(pair, &r), box_entry(pair + 1, &r), limit);
        if (at == QW_NONE) at = pop(&todo, limit);
    }
    return best;
}

/* --------------------------------------------------------------------------------------------------------------- curves */

qw_curve_tree *qw_curve_tree_build(qw_env *env, const qw_vec3 *from, const qw_vec3 *to, uint32_t count)
{
    qw_curve_tree *c = QW_NEW_ZERO(env, qw_curve_tree, 1);
    c->segments = QW_NEW(env, segment, count);
    item *items = QW_NEW(env, item, count);
    for (uint32_t i = 0; i < count; i++) {
        qw_vec3 ends[2] = {from[i], to[i]};
        put_box(&items[i], i, ends, 2);
    }
    c->tree = build_tree(env, items, count);
    for (uint32_t i = 0; i < count; i++) c->segments[i] = (segment){from[items[i].index], to[items[i].index], items[i].index};
    qw_free(env, items);
    return c;
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
    best->point = qw_v3((float)(s->from.x + along.x * t), (float)(s->from.y + along.y * t), (float)(s->from.z + along.z * t));
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
            at = pop(&todo, reach(t, best.distance2));
            continue;
        }
        const node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_distance2(pair, point), box_distance2(pair + 1, point), reach(t, best.distance2));
        if (at == QW_NONE) at = pop(&todo, reach(t, best.distance2));
    }
    return best;
}
