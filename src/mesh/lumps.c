#include "mesh/lumps.h"

#include "base/sort.h"
#include "math/elementary.h"
#include "mesh/surface.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    CELLS = 3,             /* in the radius of a ball */
    PIECES_A_SQUARE = 12,  /* of area, in the square of the radius */
    MOST_CUTS = 4096,      /* of one edge or triangle */
    MOST_PIECES = 1 << 24, /* in all, beyond one an edge and one a triangle */
    COORDINATE_BITS = 20,  /* of a cell */
    LUMPS_A_BUCKET = 4     /* on the average */
};
static const double FLAT = 1e-6; /* radians: an edge that bends less does not count */

/* Multiples of these, without their whole parts, fill a square evenly (Roberts 2018). */
static const double EVEN[2] = {0.75487766624669276, 0.56984029099805327};

/* Of an edge or a triangle, or the sum of those in a cell that face the same octant. */
typedef struct lump {
    qw_vec3 point;  /* their mean */
    qw_vec3 facing; /* sum */
    qw_vec3 normal; /* sum of area times unit normal */
    float area;
    float tensor[6]; /* sum of angle times length along the edge: xx, yy, zz, xy, yz, zx */
} lump;

struct qw_lumps {
    float radius;
    uint32_t mask;   /* buckets - 1; a power of two of them */
    uint32_t *begin; /* uint32_t[buckets + 1] */
    lump *lump;      /* lump[begin[buckets]], by bucket */
    uint64_t *cell;  /* of each lump: the cell, as wide as the radius, that it lies in */
};

typedef struct gathering {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_vec3 *facing;
    double width; /* of a cell */
    double piece_area;
    lump *piece;
    uint64_t *key;
    size_t count, room, key_room;
} gathering;

static uint64_t coordinate(float x, float width)
{
    double at = qw_floor((double)x / (double)width) + (1 << (COORDINATE_BITS - 1)), most = (1 << COORDINATE_BITS) - 2;
    return (uint64_t)fmin(fmax(at, 1), most);
}

static uint64_t cell_at(qw_vec3 p, float width)
{
    return coordinate(p.x, width) | coordinate(p.y, width) << COORDINATE_BITS |
           coordinate(p.z, width) << 2 * COORDINATE_BITS;
}

static void add_piece(gathering *g, const lump *piece)
{
    if (g->count == g->room) g->piece = qw_grow(g->env, g->piece, &g->room, g->count + 1, sizeof *g->piece);
    if (g->count == g->key_room) g->key = qw_grow(g->env, g->key, &g->key_room, g->count + 1, sizeof *g->key);
    uint64_t octant = (piece->facing.x < 0) | (uint64_t)(piece->facing.y < 0) << 1 |
                      (uint64_t)(piece->facing.z < 0) << 2;
    g->key[g->count] = cell_at(piece->point, (float)g->width) | octant << 3 * COORDINATE_BITS;
    g->piece[g->count++] = *piece;
}

static double cuts_of(const gathering *g, double cuts)
{
    return g->count > MOST_PIECES ? 1 : fmin(fmax(qw_ceil(cuts), 1), MOST_CUTS);
}

static void gather_edge(gathering *g, uint32_t h)
{
    assert(g->mesh->twin[h] != QW_NONE);
    const qw_trimesh *m = g->mesh;
    qw_vec3 a = m->position[m->corner[h]], b = m->position[m->corner[qw_next(h)]], u = qw_normalize(qw_sub(b, a)),
            n = g->facing[h / 3], o = g->facing[m->twin[h] / 3];
    double turn = qw_atan2(qw_dot(qw_cross(n, o), u), qw_dot(n, o));
    if (qw_length2(n) == 0 || qw_length2(o) == 0 || fabs(turn) <= FLAT) return;
    uint32_t cuts = (uint32_t)cuts_of(g, (double)qw_distance(a, b) / g->width);
    float w = (float)turn * qw_distance(a, b) / (float)cuts;
    lump p = {.facing = qw_add(n, o),
              .tensor = {w * u.x * u.x, w * u.y * u.y, w * u.z * u.z, w * u.x * u.y, w * u.y * u.z, w * u.z * u.x}};
    for (uint32_t i = 0; i < cuts; i++) {
        p.point = qw_lerp(a, b, ((float)i + 0.5f) / (float)cuts);
        add_piece(g, &p);
    }
}

static void gather_triangle(gathering *g, uint32_t f)
{
    assert(f < g->mesh->face_count && g->piece_area > 0);
    const qw_trimesh *m = g->mesh;
    const uint32_t *c = m->corner + 3 * (size_t)f;
    double area = 0.5 * (double)qw_length(qw_face_cross(m, f));
    if (qw_length2(g->facing[f]) == 0) return;
    uint32_t cuts = (uint32_t)cuts_of(g, area / g->piece_area);
    lump p = {.facing = g->facing[f], .area = (float)(area / cuts)};
    p.normal = qw_scale(p.facing, p.area);
    qw_vec3 a = m->position[c[0]], ab = qw_sub(m->position[c[1]], a), ac = qw_sub(m->position[c[2]], a);
    for (uint32_t i = 0; i < cuts; i++) {
        double x = (i + 0.5) * EVEN[0], y = (i + 0.5) * EVEN[1];
        float u = cuts > 1 ? (float)(x - qw_floor(x)) : 1.0f / 3, v = cuts > 1 ? (float)(y - qw_floor(y)) : 1.0f / 3;
        if (u + v > 1) u = 1 - u, v = 1 - v;
        p.point = qw_madd(qw_madd(a, u, ab), v, ac);
        add_piece(g, &p);
    }
}

static void add_to(lump *sum, const lump *p)
{
    sum->point = qw_add(sum->point, p->point), sum->facing = qw_add(sum->facing, p->facing);
    sum->normal = qw_add(sum->normal, p->normal);
    sum->area += p->area;
    for (int i = 0; i < 6; i++) sum->tensor[i] += p->tensor[i];
}

/* Pieces of equal keys become one, in the first places of g->piece. Sorted by a hash of the key and then by index, so
   that sums have one order; where two keys have one hash, there may be more lumps than need be. */
static uint32_t unite(gathering *g, lump *lumps)
{
    assert(lumps || g->count == 0);
    uint64_t *order = QW_NEW(g->env, uint64_t, g->count);
    for (size_t i = 0; i < g->count; i++) order[i] = qw_mix(g->key[i]) >> 32 << 32 | i;
    qw_sort_u64(order, g->count);
    uint32_t count = 0, members = 0;
    uint64_t own = 0;
    for (size_t i = 0; i < g->count; i++) {
        uint32_t p = (uint32_t)order[i];
        if (i == 0 || g->key[p] != own) {
            if (members) lumps[count - 1].point = qw_scale(lumps[count - 1].point, 1 / (float)members);
            memset(&lumps[count++], 0, sizeof *lumps);
            own = g->key[p], members = 0;
        }
        add_to(&lumps[count - 1], &g->piece[p]);
        members++;
    }
    if (members) lumps[count - 1].point = qw_scale(lumps[count - 1].point, 1 / (float)members);
    qw_free(g->env, order);
    return count;
}

/* Into buckets by cells as wide as the radius; stable. */
static void group(qw_env *env, qw_lumps *l, const lump *lumps, uint32_t count)
{
    l->mask = 1;
    while (l->mask < count / LUMPS_A_BUCKET) l->mask = 2 * l->mask + 1;
    l->begin = QW_NEW_ZERO(env, uint32_t, (size_t)l->mask + 3);
    l->lump = QW_NEW(env, lump, count), l->cell = QW_NEW(env, uint64_t, count);
    for (uint32_t i = 0; i < count; i++) l->begin[(qw_mix(cell_at(lumps[i].point, l->radius)) & l->mask) + 2]++;
    for (uint32_t b = 0; b <= l->mask; b++) l->begin[b + 2] += l->begin[b + 1];
    for (uint32_t i = 0; i < count; i++) {
        uint64_t cell = cell_at(lumps[i].point, l->radius);
        uint32_t to = l->begin[(qw_mix(cell) & l->mask) + 1]++;
        l->lump[to] = lumps[i], l->cell[to] = cell;
    }
}

qw_lumps *qw_lumps_make(qw_env *env, const qw_trimesh *m, const qw_vec3 *facing, double radius)
{
    assert(radius > 0 && m->twin);
    qw_lumps *l = QW_NEW_ZERO(env, qw_lumps, 1);
    l->radius = (float)radius;
    gathering g = {.env = env, .mesh = m, .facing = facing, .width = radius / CELLS};
    g.piece_area = radius * radius / PIECES_A_SQUARE;
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (m->twin[h] != QW_NONE && h < m->twin[h] && !qw_is_curve_edge(m, h, false)) gather_edge(&g, h);
    for (uint32_t f = 0; f < m->face_count; f++) gather_triangle(&g, f);
    lump *lumps = QW_NEW(env, lump, g.count);
    group(env, l, lumps, unite(&g, lumps));
    qw_free(env, lumps), qw_free(env, g.piece), qw_free(env, g.key);
    return l;
}

static void visit_cell(const qw_lumps *l, uint64_t cell, qw_vec3 centre, qw_vec3 normal, lump *sum)
{
    uint32_t bucket = (uint32_t)(qw_mix(cell) & l->mask);
    float most = l->radius * l->radius;
    for (uint32_t i = l->begin[bucket]; i < l->begin[bucket + 1]; i++) {
        const lump *p = &l->lump[i];
        if (l->cell[i] == cell && qw_length2(qw_sub(p->point, centre)) <= most && qw_dot(p->facing, normal) > 0)
            add_to(sum, p);
    }
}

/* u M v */
static double product(const float m[6], qw_vec3 u, qw_vec3 v)
{
    return (double)(u.x * (m[0] * v.x + m[3] * v.y + m[5] * v.z) + u.y * (m[3] * v.x + m[1] * v.y + m[4] * v.z) +
                    u.z * (m[5] * v.x + m[4] * v.y + m[2] * v.z));
}

void qw_lumps_curvature(const qw_lumps *l, qw_vec3 point, qw_vec3 normal, double curvature[2])
{
    uint64_t x = coordinate(point.x, l->radius), y = coordinate(point.y, l->radius), z = coordinate(point.z, l->radius);
    lump sum = {.area = 0};
    for (uint64_t i = 0; i < 27; i++)
        visit_cell(l, (x + i % 3 - 1) | (y + i / 3 % 3 - 1) << COORDINATE_BITS | (z + i / 9 - 1) << 2 * COORDINATE_BITS,
                   point, normal, &sum);
    qw_vec3 n = qw_normalize(sum.normal);
    curvature[0] = curvature[1] = 0;
    if (!(sum.area > 0) || qw_length2(n) == 0) return;
    qw_vec3 u = qw_any_orthogonal(n), v = qw_cross(n, u);
    double uu = product(sum.tensor, u, u), uv = product(sum.tensor, u, v), vv = product(sum.tensor, v, v);
    double mean = 0.5 * (uu + vv), half = 0.5 * (uu - vv), spread = sqrt(half * half + uv * uv);
    curvature[0] = (mean + spread) / (double)sum.area, curvature[1] = (mean - spread) / (double)sum.area;
}
