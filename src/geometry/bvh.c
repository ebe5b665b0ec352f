/* Bounding volume trees over triangles and over segments (box_tree.h).
 *
 * Boxes and rejections work in single precision with a margin; the distance to a primitive itself is found in double
 * precision, where slivers are harmless, so that the answer does not depend on the order of the visits or on the hint.
 */
#include "geometry/bvh.h"

#include "base/simd.h"
#include "geometry/box_tree.h"

#include <assert.h>
#include <float.h>
#include <string.h>

/* A disc that contains the triangle: a cheap test that rejects most triangles. */
typedef struct disc {
    qw_vec3 centre, normal; /* of gravity; unit, or zero without an area */
    float radius;
    uint32_t face;
} disc;

_Static_assert(sizeof(disc) == 32, "half a cache line");

/* Bounds of normals, in steps of 1 / STEEPEST, rounded outward: what points another way is passed over with its node.
 */
typedef struct normal_box {
    int8_t at[6]; /* the least of x, y and z, and the largest */
} normal_box;
enum { STEEPEST = 127, SPLIT_LEVELS = 6 };

typedef struct triangle {
    qw_vec3 a, b, c;
    uint32_t face;
} triangle;

typedef struct segment {
    qw_vec3 from, to;
    uint32_t index;
} segment;

struct qw_bvh {
    qw_box_tree tree;
    const qw_vec3 *position; /* of the mesh */
    const uint32_t *corner, *component;
    disc *discs;         /* disc[tree.count], in leaf order */
    uint32_t *place;     /* uint32_t[tree.count]: where in discs a face is */
    normal_box *normals; /* normal_box[2 tree.count]: of the faces of each node */
    uint32_t *leaf;      /* uint32_t[tree.count]: the node that holds each place */
    uint32_t *parent;    /* uint32_t[tree.count]: of nodes 2 i and 2 i + 1 */
    uint32_t *part; /* uint32_t[2 tree.count]: the component of the faces of each node, QW_NONE for several; NULL: one
                       has all */
    uint32_t parts, *part_begin, *in_part; /* then uint32_t[parts + 2], uint32_t[tree.count]: places by component */
};

/* A component of no more faces is searched face by face: its boxes hold many others where thousands of small ones lie
   through one another. */
enum { FEW_FACES = 128 };

struct qw_curve_tree {
    qw_box_tree tree;
    segment *segments; /* segment[tree.count], in leaf order */
};

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

/* Takes the nearest point of a triangle if it is nearer than the best; of equal ones that of the lower number. */
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

/* x + |x| is 2 max(x, 0). Never more than the true distance. The fourth lane is of no use. */
static inline float box_distance2(const qw_box_node *n, qw_lanes point)
{
    const qw_lanes_mask size = {INT32_MAX, INT32_MAX, INT32_MAX, 0};
    qw_lanes centre, half;
    memcpy(&centre, n, sizeof centre), memcpy(&half, (const char *)n + sizeof centre, sizeof half);
    qw_lanes out = (qw_lanes)((qw_lanes_mask)(point - centre) & size) - half;
    out += (qw_lanes)((qw_lanes_mask)out & size);
    out *= out;
    return 0.25f * (out[0] + out[1] + out[2]);
}

static inline qw_lanes lanes_of(qw_vec3 p) { return (qw_lanes){p.x, p.y, p.z, 0}; }

/* Nodes still to be visited, nearest on top. */
typedef struct pending {
    uint32_t node[QW_BOX_STACK];
    float key[QW_BOX_STACK]; /* squared distance, or distance along the ray */
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
static inline float reach(const qw_box_tree *t, float distance2) { return distance2 * 1.000001f + t->slack2; }

/* ---- triangles */

static inline triangle triangle_of(const qw_bvh *bvh, uint32_t face)
{
    const uint32_t *c = bvh->corner + 3 * (size_t)face;
    return (triangle){bvh->position[c[0]], bvh->position[c[1]], bvh->position[c[2]], face};
}

typedef struct fill {
    qw_bvh *bvh;
    const qw_trimesh *mesh;
    qw_box *items;
    uint32_t *order; /* faces in leaf order */
} fill;

static void fill_boxes(void *user, uint32_t begin, uint32_t end)
{
    const fill *f = user;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t *c = f->mesh->corner + 3 * (size_t)i;
        qw_vec3 points[3] = {f->mesh->position[c[0]], f->mesh->position[c[1]], f->mesh->position[c[2]]};
        f->items[i] = qw_box_of(points, 3);
    }
}

static disc disc_of(const triangle *t)
{
    disc d = {.centre = qw_scale(qw_add(qw_add(t->a, t->b), t->c), 1.0f / 3), .face = t->face};
    dvec n = dcross(between(t->a, t->b), between(t->a, t->c));
    double length = sqrt(ddot(n, n));
    if (length > 0) d.normal = qw_v3((float)(n.x / length), (float)(n.y / length), (float)(n.z / length));
    d.radius = 1.000001f * qw_max_of(qw_max_of(qw_distance(t->a, d.centre), qw_distance(t->b, d.centre)),
                                     qw_distance(t->c, d.centre));
    return d;
}

static void fill_discs(void *user, uint32_t begin, uint32_t end)
{
    const fill *f = user;
    for (uint32_t i = begin; i < end; i++) {
        triangle t = triangle_of(f->bvh, f->order[i]);
        f->bvh->discs[i] = disc_of(&t);
        f->bvh->place[f->order[i]] = i;
    }
}

/* The smallest box of small integers around a direction. */
static normal_box box_of_normal(qw_vec3 n)
{
    const float by[3] = {STEEPEST * n.x, STEEPEST * n.y, STEEPEST * n.z};
    normal_box b;
    for (int k = 0; k < 3; k++) {
        int whole = (int)by[k]; /* toward 0 */
        int low = whole - (by[k] < (float)whole), high = whole + (by[k] > (float)whole);
        b.at[k] = (int8_t)(low < -STEEPEST ? -STEEPEST : low),
        b.at[3 + k] = (int8_t)(high > STEEPEST ? STEEPEST : high);
    }
    return b;
}

static void widen(normal_box *b, const normal_box *by)
{
    for (int k = 0; k < 3; k++) {
        if (by->at[k] < b->at[k]) b->at[k] = by->at[k];
        if (by->at[3 + k] > b->at[3 + k]) b->at[3 + k] = by->at[3 + k];
    }
}

/* Of a node and all below it, which learn what is above them; no deeper than QW_BOX_STACK. done: so many levels below
 * the node is where it is known. */
static normal_box fill_normals(qw_bvh *bvh, uint32_t node, uint32_t done)
{
    const qw_box_node *n = &bvh->tree.nodes[node];
    normal_box b;
    if (done == 0) return bvh->normals[node];
    if (n->count == 0) {
        normal_box right = fill_normals(bvh, n->first + 1, done - 1);
        b = fill_normals(bvh, n->first, done - 1), widen(&b, &right);
        bvh->parent[n->first / 2] = node;
    } else {
        b = box_of_normal(bvh->discs[n->first].normal);
        for (uint32_t i = n->first; i < n->first + n->count; i++) bvh->leaf[i] = node;
        for (uint32_t i = n->first + 1; i < n->first + n->count; i++) {
            normal_box one = box_of_normal(bvh->discs[i].normal);
            widen(&b, &one);
        }
    }
    return bvh->normals[node] = b;
}

/* What lies below the first levels, on all threads. */
typedef struct subtrees {
    qw_bvh *bvh;
    uint32_t node[1 << SPLIT_LEVELS], count;
} subtrees;

static void list_subtrees(subtrees *s, uint32_t node, uint32_t levels)
{
    const qw_box_node *n = &s->bvh->tree.nodes[node];
    if (levels == 0) s->node[s->count++] = node;
    else if (n->count == 0) list_subtrees(s, n->first, levels - 1), list_subtrees(s, n->first + 1, levels - 1);
}

static void fill_subtrees(void *user, uint32_t begin, uint32_t end)
{
    subtrees *s = user;
    for (uint32_t i = begin; i < end; i++) fill_normals(s->bvh, s->node[i], QW_BOX_STACK);
}

static bool has_parts(const qw_trimesh *mesh)
{
    for (uint32_t f = 0; mesh->component && f < mesh->face_count; f++)
        if (mesh->component[f] != mesh->component[0]) return true;
    return false;
}

/* Of a node and all below it. */
static uint32_t fill_parts(qw_bvh *bvh, uint32_t node)
{
    const qw_box_node *n = &bvh->tree.nodes[node];
    uint32_t part;
    if (n->count == 0) {
        uint32_t right = fill_parts(bvh, n->first + 1);
        part = fill_parts(bvh, n->first);
        if (part != right) part = QW_NONE;
    } else {
        part = bvh->component[bvh->discs[n->first].face];
        for (uint32_t i = n->first + 1; i < n->first + n->count; i++)
            if (bvh->component[bvh->discs[i].face] != part) part = QW_NONE;
    }
    return bvh->part[node] = part;
}

static void list_parts(qw_env *env, qw_bvh *bvh)
{
    for (uint32_t f = 0; f < bvh->tree.count; f++)
        if (bvh->component[f] >= bvh->parts) bvh->parts = bvh->component[f] + 1;
    bvh->part_begin = QW_NEW_ZERO(env, uint32_t, (size_t)bvh->parts + 2);
    bvh->in_part = QW_NEW(env, uint32_t, bvh->tree.count);
    for (uint32_t f = 0; f < bvh->tree.count; f++) bvh->part_begin[bvh->component[f] + 2]++;
    for (uint32_t i = 0; i < bvh->parts; i++) bvh->part_begin[i + 2] += bvh->part_begin[i + 1];
    for (uint32_t i = 0; i < bvh->tree.count; i++)
        bvh->in_part[bvh->part_begin[bvh->component[bvh->discs[i].face] + 1]++] = i;
}

qw_bvh *qw_bvh_build(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->face_count == 0 || (mesh->position && mesh->corner));
    qw_bvh *bvh = QW_NEW_ZERO(env, qw_bvh, 1);
    fill f = {.bvh = bvh,
              .mesh = mesh,
              .items = QW_NEW(env, qw_box, mesh->face_count),
              .order = QW_NEW(env, uint32_t, mesh->face_count)};
    qw_parallel(env, mesh->face_count, 4096, fill_boxes, &f);
    bvh->tree = qw_box_tree_build(env, f.items, mesh->face_count, f.order);
    qw_free(env, f.items); /* before the discs, which are as large */
    bvh->position = mesh->position, bvh->corner = mesh->corner, bvh->component = mesh->component;
    bvh->place = QW_NEW(env, uint32_t, mesh->face_count), bvh->discs = QW_NEW(env, disc, mesh->face_count);
    qw_parallel(env, mesh->face_count, 4096, fill_discs, &f);
    qw_free(env, f.order);
    bvh->normals = QW_NEW(env, normal_box, 2 * (size_t)mesh->face_count);
    bvh->leaf = QW_NEW(env, uint32_t, mesh->face_count), bvh->parent = QW_NEW(env, uint32_t, mesh->face_count);
    if (mesh->face_count > 0) {
        subtrees s = {.bvh = bvh};
        list_subtrees(&s, 0, SPLIT_LEVELS);
        qw_parallel(env, s.count, 4, fill_subtrees, &s);
        fill_normals(bvh, 0, SPLIT_LEVELS);
    }
    if (has_parts(mesh)) {
        bvh->part = QW_NEW(env, uint32_t, 2 * (size_t)mesh->face_count);
        fill_parts(bvh, 0);
        list_parts(env, bvh);
    }
    return bvh;
}

/* A query as the nodes and the discs are asked. */
typedef struct aim {
    qw_lanes point;
    bool has_normal, has_part; /* whether normals, or components, are asked for */
    uint8_t side[3];           /* the bounds of normals that lie farthest along the normal */
    float least;               /* along it, rounding allowed for */
    float slack;               /* by how much rounding puts centres of discs elsewhere, at most */
} aim;

static aim aim_of(const qw_bvh *bvh, const qw_bvh_query *q)
{
    aim a = {.point = lanes_of(q->point), .has_part = bvh->part && q->label == bvh->component};
    a.has_normal = q->least_dot > -1 && (q->normal.x != 0 || q->normal.y != 0 || q->normal.z != 0);
    a.side[0] = q->normal.x < 0 ? 0 : 3, a.side[1] = q->normal.y < 0 ? 1 : 4, a.side[2] = q->normal.z < 0 ? 2 : 5;
    a.least = STEEPEST * (q->least_dot - 1e-4f);
    a.slack = sqrtf(bvh->tree.slack2);
    return a;
}

/* Rejects cheaply what lies too far above its plane or, within the plane, too far from the disc around it. */
static inline void try_disc(const qw_bvh *bvh, uint32_t i, const qw_bvh_query *q, const aim *a, qw_hit *best)
{
    const disc *t = &bvh->discs[i];
    if (a->has_normal && qw_dot(t->normal, q->normal) < q->least_dot) return;
    if (q->label && q->label[t->face] != q->wanted) return;
    qw_vec3 d = qw_sub(q->point, t->centre);
    float height = qw_dot(d, t->normal), least = qw_max_of(fabsf(height) - a->slack, 0),
          room2 = best->distance2 * 1.00001f + bvh->tree.slack2 - least * least * 0.99999f;
    if (room2 < 0) return;
    float room = t->radius + sqrtf(room2) + a->slack;
    if (qw_length2(d) - height * height > room * room * 1.00001f + bvh->tree.slack2) return;
    triangle whole = triangle_of(bvh, t->face);
    nearest_on(&whole, q->point, best);
}

/* The balls around the discs meet that of the cache: a few too many. */
static bool put_leaf(const qw_bvh *bvh, const qw_box_node *leaf, float radius, qw_bvh_cache *cache)
{
    for (uint32_t i = leaf->first; i < leaf->first + leaf->count; i++) {
        float room = (radius + bvh->discs[i].radius) * 1.00001f;
        if (qw_length2(qw_sub(bvh->discs[i].centre, cache->centre)) > room * room + bvh->tree.slack2) continue;
        if (cache->count == QW_CACHE_SIZE) return false;
        uint32_t k = cache->count++;
        cache->place[k] = i, cache->around[k] = bvh->discs[i].radius;
        cache->at[0][k] = bvh->discs[i].centre.x, cache->at[1][k] = bvh->discs[i].centre.y;
        cache->at[2][k] = bvh->discs[i].centre.z;
        triangle t = triangle_of(bvh, bvh->discs[i].face);
        cache->corner[k][0] = t.a, cache->corner[k][1] = t.b, cache->corner[k][2] = t.c;
    }
    return true;
}

void qw_bvh_fill_cache(const qw_bvh *bvh, qw_vec3 centre, float radius, qw_bvh_cache *cache)
{
    assert(radius >= 0);
    const qw_box_tree *t = &bvh->tree;
    cache->centre = centre, cache->radius = 0, cache->count = 0;
    uint32_t stack[QW_BOX_STACK], top = 0;
    float limit = reach(t, radius * radius);
    qw_lanes middle = lanes_of(centre);
    if (t->count > 0 && box_distance2(t->nodes, middle) <= limit) stack[top++] = 0;
    while (top > 0) {
        const qw_box_node *n = &t->nodes[stack[--top]];
        if (n->count > 0) {
            if (!put_leaf(bvh, n, radius, cache)) return;
            continue;
        }
        assert(top + 2 <= QW_BOX_STACK);
        for (uint32_t k = 2; k-- > 0;)
            if (box_distance2(&t->nodes[n->first + k], middle) <= limit) stack[top++] = n->first + k;
    }
    cache->radius = radius;
}

/* Whether all that is as near as the best so far lies in the ball. */
static bool is_inside(const qw_box_tree *t, const qw_bvh_cache *cache, qw_vec3 point, float distance2)
{
    float room = cache->radius - sqrtf(reach(t, distance2));
    return room > 0 && qw_length2(qw_sub(point, cache->centre)) * 1.00001f < room * room;
}

/* The squared distance to the box of a node, or beyond all where that is more than `limit`, no normal in it agrees, or
   no face is of the component that is wanted. */
static inline float key_of(const qw_bvh *bvh, uint32_t node, const qw_bvh_query *q, const aim *a, float limit)
{
    float distance2 = box_distance2(&bvh->tree.nodes[node], a->point);
    if (!(distance2 <= limit)) return INFINITY;
    if (a->has_part && bvh->part[node] != QW_NONE && bvh->part[node] != q->wanted) return INFINITY;
    if (!a->has_normal) return distance2;
    const int8_t *bound = bvh->normals[node].at;
    float most = (float)bound[a->side[0]] * q->normal.x + (float)bound[a->side[1]] * q->normal.y +
                 (float)bound[a->side[2]] * q->normal.z;
    return most >= a->least ? distance2 : INFINITY;
}

/* What is below a node. */
static void search(const qw_bvh *bvh, const qw_bvh_query *q, const aim *a, uint32_t at, qw_hit *best)
{
    const qw_box_tree *t = &bvh->tree;
    pending todo;
    todo.count = 0;
    while (at != QW_NONE) {
        const qw_box_node *n = &t->nodes[at];
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++) try_disc(bvh, i, q, a, best);
            best->looked += n->count;
            at = best->distance2 < q->enough2 ? QW_NONE : pop(&todo, reach(t, best->distance2));
            continue;
        }
        float limit = qw_min_of(reach(t, best->distance2), FLT_MAX);
        at = choose(&todo, n->first, key_of(bvh, n->first, q, a, limit), key_of(bvh, n->first + 1, q, a, limit), limit);
        if (at == QW_NONE) at = pop(&todo, limit);
    }
}

/* From a leaf upward: what is beside each node on the way. Half of what it takes from the root down, where the leaf has
   nearly the nearest face. */
static void search_around(const qw_bvh *bvh, const qw_bvh_query *q, const aim *a, uint32_t leaf, qw_hit *best)
{
    search(bvh, q, a, leaf, best);
    for (uint32_t at = leaf; at != 0 && !(best->distance2 < q->enough2); at = bvh->parent[at / 2]) {
        float limit = qw_min_of(reach(&bvh->tree, best->distance2), FLT_MAX);
        if (key_of(bvh, at ^ 1, q, a, limit) <= limit) search(bvh, q, a, at ^ 1, best);
    }
}

/* Tries the faces of the wanted component: all of them where they are few; else eight, until one is found, whose
   distance bounds the search of the tree. Returns whether the search is done. */
static bool search_part(const qw_bvh *bvh, const qw_bvh_query *q, const aim *a, qw_hit *best)
{
    if (q->wanted >= bvh->parts) return true;
    uint32_t begin = bvh->part_begin[q->wanted], end = bvh->part_begin[q->wanted + 1], step = 1;
    bool is_small = end - begin <= FEW_FACES;
    if (!is_small) step = (end - begin) / 8;
    for (uint32_t i = begin; i < end && (is_small || best->face == QW_NONE); i += step)
        try_disc(bvh, bvh->in_part[i], q, a, best), best->looked++;
    return is_small;
}

qw_hit qw_bvh_find(const qw_bvh *bvh, const qw_bvh_query *q, const qw_bvh_cache *cache)
{
    assert(q->max_distance >= 0);
    const qw_box_tree *t = &bvh->tree;
    qw_hit best = {.face = QW_NONE, .distance2 = q->max_distance * q->max_distance};
    if (t->count == 0) return best;
    const aim a = aim_of(bvh, q);
    uint32_t hint = q->hint < t->count ? bvh->place[q->hint] : QW_NONE;
    if (hint != QW_NONE) try_disc(bvh, hint, q, &a, &best);
    if (best.distance2 < q->enough2) return best;
    if (cache && cache->radius > 0) {
        for (uint32_t i = 0; i < cache->count; i++) try_disc(bvh, cache->place[i], q, &a, &best);
        if (is_inside(t, cache, q->point, best.distance2)) return best;
    }
    if (a.has_part && search_part(bvh, q, &a, &best)) return best;
    bool is_near = hint != QW_NONE && best.distance2 <= bvh->discs[hint].radius * bvh->discs[hint].radius;
    if (is_near) search_around(bvh, q, &a, bvh->leaf[hint], &best);
    else if (box_distance2(t->nodes, a.point) <= reach(t, best.distance2)) search(bvh, q, &a, 0, &best);
    return best;
}

qw_hit qw_bvh_nearest_of(const qw_bvh *bvh, uint32_t component, qw_vec3 point, qw_vec3 normal, float least_dot,
                         float max_distance, uint32_t hint)
{
    return qw_bvh_find(bvh,
                       &(qw_bvh_query){.point = point,
                                       .normal = normal,
                                       .least_dot = least_dot,
                                       .max_distance = max_distance,
                                       .hint = hint,
                                       .label = component == QW_NONE ? NULL : bvh->component,
                                       .wanted = component},
                       NULL);
}

uint32_t qw_bvh_face_at(const qw_bvh *bvh, uint32_t place)
{
    assert(place < bvh->tree.count);
    return bvh->discs[place].face;
}

uint32_t qw_bvh_place_of(const qw_bvh *bvh, uint32_t face) { return bvh->place[face]; }

float qw_bvh_rounding2(const qw_bvh *bvh) { return bvh->tree.slack2; }

qw_vec3 qw_bvh_normal(const qw_bvh *bvh, uint32_t face) { return bvh->discs[bvh->place[face]].normal; }

qw_hit qw_bvh_nearest(const qw_bvh *bvh, qw_vec3 point, qw_vec3 normal, float least_dot, float max_distance,
                      uint32_t hint)
{
    return qw_bvh_nearest_of(bvh, QW_NONE, point, normal, least_dot, max_distance, hint);
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
static inline float box_entry(const qw_box_node *n, const ray *r)
{
    float x = (n->centre[0] - r->origin.x) * r->inverse.x, half_x = n->half[0] * fabsf(r->inverse.x);
    float y = (n->centre[1] - r->origin.y) * r->inverse.y, half_y = n->half[1] * fabsf(r->inverse.y);
    float z = (n->centre[2] - r->origin.z) * r->inverse.z, half_z = n->half[2] * fabsf(r->inverse.z);
    float in = qw_max_of(qw_max_of(x - half_x, y - half_y), z - half_z),
          out = qw_min_of(qw_min_of(x + half_x, y + half_y), z + half_z);
    in -= 1e-6f * fabsf(in);
    out += 1e-6f * fabsf(out);
    return out >= 0 && in <= out ? qw_max_of(in, 0.0f) : FLT_MAX;
}

/* Moeller and Trumbore 1997. In double precision its rounding stays below the rim of 1e-12, so no ray slips between two
 * faces. */
static void try_ray(const triangle *t, const ray *r, double *best_t, qw_hit *best)
{
    const double rim = 1e-12, wide = 1e-9;
    if (t->face == r->skip) return;
    dvec ab = between(t->a, t->b), ac = between(t->a, t->c), ao = between(t->a, r->origin);
    dvec d = {r->direction.x, r->direction.y, r->direction.z}, p = dcross(d, ac);
    double det = ddot(ab, p), size = fabs(det), sign = det < 0 ? -1 : 1, u = sign * ddot(ao, p);
    if (det == 0 || u < -wide * size || u > (1 + wide) * size) return; /* most end here, before a division */
    dvec q = dcross(ao, ab);
    double v = sign * ddot(d, q);
    if (v < -wide * size || u + v > (1 + wide) * size) return;
    u /= size, v /= size;
    double s = ddot(ac, q) / det;
    if (!(u >= -rim && v >= -rim && u + v <= 1 + rim && s >= 0)) return;
    if (s > *best_t || (s == *best_t && t->face >= best->face)) return;
    *best_t = s;
    best->face = t->face;
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
    const qw_box_tree *t = &bvh->tree;
    qw_hit best = {.face = QW_NONE, .distance2 = max_distance * max_distance};
    if (t->count == 0) return best;
    ray r = {.origin = origin, .direction = direction, .skip = skip};
    r.inverse = qw_v3(inverse_of(direction.x), inverse_of(direction.y), inverse_of(direction.z));
    double best_t = max_distance;
    pending todo;
    todo.count = 0;
    uint32_t at = box_entry(t->nodes, &r) <= max_distance ? 0 : QW_NONE;
    while (at != QW_NONE) {
        const qw_box_node *n = &t->nodes[at];
        float limit = qw_min_of((float)best_t * 1.000001f, FLT_MAX / 2);
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++) {
                triangle whole = triangle_of(bvh, bvh->discs[i].face);
                try_ray(&whole, &r, &best_t, &best);
            }
            at = pop(&todo, qw_min_of((float)best_t * 1.000001f, FLT_MAX / 2));
            continue;
        }
        const qw_box_node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_entry(pair, &r), box_entry(pair + 1, &r), limit);
        if (at == QW_NONE) at = pop(&todo, limit);
    }
    return best;
}

/* Lists the balls in a cache that come as near to the ray's line as this: four at a time, as compilers lay the first
   loop out. */
static uint32_t list_met(const qw_bvh_cache *p, const ray *r, float near, float slack2, uint32_t list[QW_CACHE_SIZE])
{
    uint32_t is_met[QW_CACHE_SIZE], count = 0;
    for (uint32_t i = 0; i < p->count; i++) {
        float x = p->at[0][i] - r->origin.x, y = p->at[1][i] - r->origin.y, z = p->at[2][i] - r->origin.z;
        float along = x * r->direction.x + y * r->direction.y + z * r->direction.z;
        float room = (p->around[i] + near) * 1.0001f;
        float aside2 = (x * x + y * y + z * z) * 0.9999f - along * along * 1.0001f;
        is_met[i] = aside2 <= room * room + slack2;
    }
    for (uint32_t i = 0; i < p->count; i++) list[count] = i, count += is_met[i];
    return count;
}

static triangle in_cache(const qw_bvh *bvh, const qw_bvh_cache *p, uint32_t i)
{
    return (triangle){p->corner[i][0], p->corner[i][1], p->corner[i][2], bvh->discs[p->place[i]].face};
}

static bool can_use(const qw_box_tree *t, const qw_bvh_cache *cache, qw_vec3 origin, qw_vec3 end)
{
    return cache && cache->radius > 0 && is_inside(t, cache, origin, 0) && is_inside(t, cache, end, 0);
}

qw_hit qw_bvh_ray_near(const qw_bvh *bvh, const qw_bvh_cache *cache, qw_vec3 origin, qw_vec3 direction,
                       float max_distance, uint32_t skip)
{
    const qw_box_tree *t = &bvh->tree;
    if (!can_use(t, cache, origin, qw_madd(origin, max_distance, direction)))
        return qw_bvh_ray(bvh, origin, direction, max_distance, skip);
    qw_hit best = {.face = QW_NONE, .distance2 = max_distance * max_distance};
    ray r = {.origin = origin, .direction = direction, .skip = skip};
    double best_t = max_distance;
    uint32_t list[QW_CACHE_SIZE], count = list_met(cache, &r, 0, t->slack2, list);
    for (uint32_t k = 0; k < count; k++) {
        triangle whole = in_cache(bvh, cache, list[k]);
        try_ray(&whole, &r, &best_t, &best);
    }
    return best;
}

/* Which of four rays may meet a face: try_ray's tests in single precision, with room for what that rounds. reach: no
   corner is farther from an origin. */
static qw_lanes_mask may_meet(const triangle *t, const qw_vec3_lanes *origin, const qw_vec3_lanes *direction,
                              float size, float reach)
{
    const qw_lanes none = qw_lanes_of(0), room = qw_lanes_of(1e-5f * size * (reach + size));
    qw_vec3 b = qw_sub(t->b, t->a), c = qw_sub(t->c, t->a);
    qw_vec3_lanes ab = qw_four(b, b, b, b), ac = qw_four(c, c, c, c);
    qw_vec3_lanes ao = qw_sub4(*origin, qw_four(t->a, t->a, t->a, t->a));
    qw_vec3_lanes p = qw_cross4(*direction, ac), q = qw_cross4(ao, ab);
    qw_lanes det = qw_dot4(ab, p), u = qw_dot4(ao, p), v = qw_dot4(*direction, q);
    qw_lanes_mask is_back = det < none;
    det = qw_choose(is_back, -det, det), u = qw_choose(is_back, -u, u), v = qw_choose(is_back, -v, v);
    return (det <= room) | ((u >= -room) & (v >= -room) & (u + v <= det + 3 * room));
}

void qw_bvh_rays_near(const qw_bvh *bvh, const qw_bvh_cache *cache, const qw_vec3 *origin, const qw_vec3 *direction,
                      const float *max_distance, uint32_t count, qw_hit *hit)
{
    const qw_box_tree *t = &bvh->tree;
    uint32_t list[QW_CACHE_SIZE];
    double best_t[QW_MOST_RAYS];
    ray r[QW_MOST_RAYS];
    qw_vec3 end[QW_MOST_RAYS];
    qw_vec3_lanes from = qw_four(origin[0], origin[0], origin[0], origin[0]);
    qw_vec3_lanes along = qw_four(direction[0], direction[0], direction[0], direction[0]);
    float near = 0; /* all lie as near to the first: both of their ends do */
    bool good = true;
    assert(count <= QW_MOST_RAYS);
    for (uint32_t i = 0; i < count; i++) {
        r[i] = (ray){.origin = origin[i], .direction = direction[i], .skip = QW_NONE};
        hit[i] = (qw_hit){.face = QW_NONE, .distance2 = max_distance[i] * max_distance[i]};
        best_t[i] = max_distance[i], end[i] = qw_madd(origin[i], max_distance[i], direction[i]);
        good = good && can_use(t, cache, origin[i], end[i]);
        near = fmaxf(near, fmaxf(qw_distance(origin[i], origin[0]), qw_distance(end[i], end[0])));
        qw_put_lane(&from, (int)i, origin[i]), qw_put_lane(&along, (int)i, direction[i]);
    }
    for (uint32_t i = 0; i < count && !good; i++)
        hit[i] = qw_bvh_ray_near(bvh, cache, origin[i], direction[i], max_distance[i], QW_NONE);
    if (!good || count == 0) return;
    uint32_t met = list_met(cache, &r[0], near, t->slack2, list);
    for (uint32_t k = 0; k < met; k++) {
        triangle whole = in_cache(bvh, cache, list[k]);
        float size = 2 * cache->around[list[k]];
        qw_lanes_mask may = may_meet(&whole, &from, &along, size, 2 * cache->radius + size);
        for (uint32_t i = 0; i < count; i++)
            if (may[i]) try_ray(&whole, &r[i], &best_t[i], &hit[i]);
    }
}

/* Which of four rays from one origin enter a box within reach. */
static inline qw_lanes_mask enter_box(const qw_box_node *n, qw_vec3 origin, const qw_vec3_lanes *inverse, float reach)
{
    const float from[3] = {n->centre[0] - origin.x, n->centre[1] - origin.y, n->centre[2] - origin.z};
    const qw_lanes by[3] = {inverse->x, inverse->y, inverse->z}, none = qw_lanes_of(0);
    qw_lanes in = none, out = qw_lanes_of(reach);
    for (int k = 0; k < 3; k++) {
        qw_lanes middle = from[k] * by[k], half = n->half[k] * by[k];
        half = qw_choose(half < none, -half, half);
        qw_lanes begin = middle - half, end = middle + half;
        in = qw_choose(begin > in, begin, in), out = qw_choose(end < out, end, out);
    }
    return in * (1 - 1e-6f) <= out * (1 + 1e-6f);
}

uint32_t qw_bvh_blocked(const qw_bvh *bvh, qw_vec3 origin, const qw_vec3 direction[4], float reach, uint32_t skip)
{
    const qw_box_tree *t = &bvh->tree;
    if (t->count == 0) return 0;
    qw_hit hit = {.face = QW_NONE};
    qw_vec3 inverse[4];
    for (int i = 0; i < 4; i++)
        inverse[i] = qw_v3(inverse_of(direction[i].x), inverse_of(direction[i].y), inverse_of(direction[i].z));
    const qw_vec3_lanes from = qw_four(origin, origin, origin, origin),
                        along = qw_four(direction[0], direction[1], direction[2], direction[3]),
                        by = qw_four(inverse[0], inverse[1], inverse[2], inverse[3]);
    const qw_box_node *root = t->nodes;
    float far = 0; /* no corner is farther from the origin */
    const float at[3] = {origin.x, origin.y, origin.z};
    for (int k = 0; k < 3; k++) far += fabsf(root->centre[k] - at[k]) + root->half[k];
    reach = qw_min_of(reach, 2 * far);
    uint32_t stack[QW_BOX_STACK], count = 1, blocked = 0;
    qw_lanes_mask open = qw_lanes_of(0) == qw_lanes_of(0);
    for (stack[0] = 0; count > 0 && qw_any(open);) {
        const qw_box_node *n = &t->nodes[stack[--count]];
        if (!qw_any(enter_box(n, origin, &by, reach) & open)) continue;
        if (n->count == 0) stack[count++] = n->first, stack[count++] = n->first + 1;
        for (uint32_t i = n->first; i < n->first + n->count; i++) {
            triangle whole = triangle_of(bvh, bvh->discs[i].face);
            qw_lanes_mask may = open & may_meet(&whole, &from, &along, 2 * bvh->discs[i].radius, far);
            for (int k = 0; k < 4 && qw_any(may); k++) {
                ray r = {.origin = origin, .direction = direction[k], .skip = skip};
                double best_t = reach;
                if (may[k]) try_ray(&whole, &r, &best_t, &hit);
                if (hit.face != QW_NONE) blocked |= 1u << k, open[k] = 0, hit.face = QW_NONE;
            }
        }
    }
    return blocked;
}

/* ---- curves */

qw_curve_tree *qw_curve_tree_build(qw_env *env, const qw_vec3 *from, const qw_vec3 *to, uint32_t count)
{
    assert(count == 0 || (from && to));
    qw_curve_tree *c = QW_NEW_ZERO(env, qw_curve_tree, 1);
    c->segments = QW_NEW(env, segment, count);
    qw_box *items = QW_NEW(env, qw_box, count);
    uint32_t *order = QW_NEW(env, uint32_t, count);
    for (uint32_t i = 0; i < count; i++) {
        qw_vec3 ends[2] = {from[i], to[i]};
        items[i] = qw_box_of(ends, 2);
    }
    c->tree = qw_box_tree_build(env, items, count, order);
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

/* Takes the nearest point of a segment if it is nearer than the best; of equal ones that of the lower number. */
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
    const qw_box_tree *t = &curves->tree;
    qw_curve_hit best = {.segment = QW_NONE, .distance2 = max_distance * max_distance};
    if (t->count == 0) return best;
    pending todo;
    todo.count = 0;
    qw_lanes middle = lanes_of(point);
    uint32_t at = box_distance2(t->nodes, middle) <= reach(t, best.distance2) ? 0 : QW_NONE;
    while (at != QW_NONE) {
        const qw_box_node *n = &t->nodes[at];
        if (n->count > 0) {
            for (uint32_t i = n->first; i < n->first + n->count; i++) try_segment(&curves->segments[i], point, &best);
            best.looked += n->count;
            at = pop(&todo, reach(t, best.distance2));
            continue;
        }
        const qw_box_node *pair = &t->nodes[n->first];
        at = choose(&todo, n->first, box_distance2(pair, middle), box_distance2(pair + 1, middle),
                    reach(t, best.distance2));
        if (at == QW_NONE) at = pop(&todo, reach(t, best.distance2));
    }
    return best;
}
