#include "products/limit/patch_faces.h"

#include "base/sets.h"
#include "base/vec.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* How far the points of a block may be from the surface of the part that their middles are next to: of the radius
   there, or of a plane's block. */
static const double OFF_DESIGNED = 0.02;
enum { ROUNDS = 24 /* of putting borders onto both of their surfaces */ };

typedef struct flattening {
    qw_env *env;
    const qw_patches *patches;
    const qw_patch_blocks *blocks;
    qw_primitive *surface; /* qw_primitive[blocks]: plane, cylinder or cone; QW_PRIMITIVE_KINDS: none */
    uint32_t *designed;    /* uint32_t[blocks]: which surface of the part, or QW_NONE */
    uint32_t *set;         /* uint32_t[blocks], sets */
    uint32_t *owner;       /* uint32_t[2 edges]: the block that goes against edge e, and the one along it */
    uint32_t *leaving;     /* uint32_t[vertices]: the side of the set at hand that begins there, or QW_NONE */
    qw_patch_faces *out;
} flattening;

static double *point_at(const flattening *t, uint32_t p) { return t->patches->point + 3 * (size_t)p; }

static double height(const flattening *t, uint32_t b, uint32_t p)
{
    double gradient[3];
    return fabs(qw_primitive_distance(&t->surface[b], point_at(t, p), gradient));
}

/* Adds the cross product of b - a and d - c to sum. */
static void add_cross(double sum[3], const double *a, const double *b, const double *c, const double *d)
{
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        sum[k] += (b[i] - a[i]) * (d[j] - c[j]) - (b[j] - a[j]) * (d[i] - c[i]);
    }
}

/* The plane of a block all of whose points lie on it, by its diagonals. */
static void find_plane(const flattening *t, uint32_t b)
{
    const uint32_t *p = t->blocks->point + t->blocks->first[b];
    size_t count = t->blocks->first[b + 1] - t->blocks->first[b];
    uint32_t columns = 2 * t->blocks->span[b][1] + 2;
    assert(count >= columns && count % columns == 0);
    qw_primitive *s = &t->surface[b];
    *s = (qw_primitive){.kind = QW_PLANE};
    memcpy(s->point, point_at(t, p[0]), sizeof s->point);
    add_cross(s->axis, point_at(t, p[0]), point_at(t, p[count - 1]), point_at(t, p[count - columns]),
              point_at(t, p[columns - 1]));
    double length = sqrt(qw_dot_doubles(s->axis, s->axis));
    if (!(length > 0)) s->kind = QW_PRIMITIVE_KINDS;
    for (int k = 0; k < 3; k++) s->axis[k] /= length > 0 ? length : 1;
    for (size_t i = 0; i < count; i++)
        if (!(height(t, b, p[i]) <= t->patches->tolerance)) s->kind = QW_PRIMITIVE_KINDS;
}

/* The weights of four points, from the one that is returned on, of a chain of `count` cubics that meet with one
 * tangent. */
static uint32_t weigh(double at, uint32_t count, double weight[4])
{
    uint32_t k = at < count ? (uint32_t)at : count - 1;
    double t = at - k, s = 1 - t;
    weight[0] = s * s * s, weight[1] = 3 * s * s * t, weight[2] = 3 * s * t * t, weight[3] = t * t * t;
    if (k > 0) weight[1] += weight[0] /= 2; /* ends inside are the middles of their neighbours */
    if (k + 1 < count) weight[2] += weight[3] /= 2;
    return 2 * k;
}

static void block_point(const flattening *t, uint32_t b, double x, double y, double at[3])
{
    double u[4], v[4];
    uint32_t row = weigh(x, t->blocks->span[b][0], u), column = weigh(y, t->blocks->span[b][1], v);
    const uint32_t *p = t->blocks->point + t->blocks->first[b], columns = 2 * t->blocks->span[b][1] + 2;
    memset(at, 0, 3 * sizeof *at);
    for (uint32_t i = 0; i < 16; i++)
        for (int k = 0; k < 3; k++)
            at[k] += u[i / 4] * v[i % 4] * point_at(t, p[(row + i / 4) * columns + column + i % 4])[k];
}

void qw_patch_middles(const qw_patches *patches, const qw_patch_blocks *blocks, double (*middle)[3])
{
    const flattening t = {.patches = patches, .blocks = blocks};
    for (uint32_t b = 0, i = 0; b < blocks->count; b++)
        for (uint32_t x = 0; x < blocks->span[b][0]; x++)
            for (uint32_t y = 0; y < blocks->span[b][1]; y++) block_point(&t, b, x + 0.5, y + 0.5, middle[i++]);
}

/* Whether block b lies about a surface of the part. */
static bool is_about(const flattening *t, uint32_t b, const qw_primitive *p)
{
    double corner[3], at[3], q[3], gradient[3];
    block_point(t, b, 0, 0, corner), block_point(t, b, t->blocks->span[b][0], t->blocks->span[b][1], at);
    for (int k = 0; k < 3; k++) q[k] = at[k] - corner[k];
    double wide2 = qw_dot_doubles(q, q);
    for (uint32_t x = 0; x <= 2 * t->blocks->span[b][0]; x++)
        for (uint32_t y = 0; y <= 2 * t->blocks->span[b][1]; y++) {
            block_point(t, b, 0.5 * x, 0.5 * y, at);
            for (int k = 0; k < 3; k++) q[k] = at[k] - p->point[k];
            double z = qw_dot_doubles(q, p->axis), away2 = p->kind == QW_PLANE ? wide2 : qw_dot_doubles(q, q) - z * z;
            double off = qw_primitive_distance(p, at, gradient);
            if (!(off * off <= OFF_DESIGNED * OFF_DESIGNED * away2)) return false;
        }
    return true;
}

/* Whether block b is seen from the side that the gradient of its surface's distance points away from. */
static bool is_against(const flattening *t, uint32_t b)
{
    double corner[3], ahead[3], up[3], normal[3] = {0}, gradient[3];
    block_point(t, b, 0, 0, corner), block_point(t, b, 0.5, 0, ahead), block_point(t, b, 0, 0.5, up);
    add_cross(normal, corner, ahead, corner, up);
    qw_primitive_distance(&t->surface[b], corner, gradient);
    return qw_dot_doubles(normal, gradient) < 0;
}

/* The surface of each block; of_cell: as qw_find_patch_faces has it. */
static void find_surfaces(const flattening *t, const qw_primitive *designed, const uint32_t *of_cell)
{
    for (uint32_t b = 0; b < t->blocks->count; b++) {
        uint32_t cells = t->blocks->span[b][0] * t->blocks->span[b][1], which = of_cell[0];
        for (uint32_t i = 0; i < cells; i++)
            if (of_cell[i] != which) which = QW_NONE;
        of_cell += cells;
        t->designed[b] = which != QW_NONE && is_about(t, b, &designed[which]) ? which : QW_NONE;
        if (t->designed[b] == QW_NONE) find_plane(t, b);
        else t->surface[b] = designed[which];
        if (t->surface[b].kind == QW_PLANE && is_against(t, b))
            for (int k = 0; k < 3; k++) t->surface[b].axis[k] = -t->surface[b].axis[k];
    }
}

/* Whether block b lies on the surface of block a: on the same one of the part, or on its plane and faces the same way.
 */
static bool is_on(const flattening *t, uint32_t a, uint32_t b)
{
    if (t->designed[a] != QW_NONE && t->designed[a] == t->designed[b]) return true;
    if (t->surface[a].kind != QW_PLANE || t->surface[b].kind != QW_PLANE) return false;
    for (size_t i = t->blocks->first[b]; i < t->blocks->first[b + 1]; i++)
        if (!(height(t, a, t->blocks->point[i]) <= t->patches->tolerance)) return false;
    return qw_dot_doubles(t->surface[a].axis, t->surface[b].axis) > 0;
}

/* Joins blocks that lie on one primitive across edges, as far as all of each lies on that of the other. */
static void join_blocks(const flattening *t)
{
    const qw_patch_blocks *o = t->blocks;
    memset(t->owner, 0xff, 2 * (size_t)o->edge_count * sizeof *t->owner);
    for (uint32_t b = 0; b < o->count; b++)
        for (int k = 0; k < 4; k++) t->owner[2 * o->side[b][k] + o->is_along[b][k]] = b;
    qw_sets_begin(t->set, o->count);
    for (uint32_t e = 0; e < o->edge_count; e++) {
        uint32_t a = t->owner[2 * e], b = t->owner[2 * e + 1];
        if (a == QW_NONE || b == QW_NONE) continue;
        if (is_on(t, qw_set_of(t->set, a), b) && is_on(t, qw_set_of(t->set, b), a)) qw_join_sets(t->set, a, b);
    }
}

/* Side 2 e + 1 goes along edge e, 2 e against it. */
static uint32_t end_of(const flattening *t, uint32_t side, bool is_start)
{
    const qw_patch_blocks *o = t->blocks;
    uint32_t e = side / 2;
    return o->edge_point[(side % 2 == 1) == is_start ? o->edge_first[e] : o->edge_first[e + 1] - 1];
}

static bool is_border(const flattening *t, uint32_t side)
{
    uint32_t other = t->owner[side ^ 1];
    return other == QW_NONE || qw_set_of(t->set, other) != qw_set_of(t->set, t->owner[side]);
}

/* Chains the border sides of one set, uint32_t[count], into loops; false where two begin at one vertex. */
static bool chain(const flattening *t, const uint32_t *side, uint32_t count)
{
    qw_patch_faces *o = t->out;
    bool is_simple = true;
    uint32_t loops = o->loop_count, sides = o->side_first[loops];
    for (uint32_t i = 0; i < count; i++) {
        uint32_t *at = &t->leaving[end_of(t, side[i], true)];
        is_simple &= *at == QW_NONE;
        *at = side[i];
    }
    for (uint32_t i = 0; i < count && is_simple; i++) {
        for (uint32_t s = side[i]; t->leaving[end_of(t, s, true)] != QW_NONE; s = t->leaving[end_of(t, s, false)]) {
            o->side[sides++] = s;
            t->leaving[end_of(t, s, true)] = QW_NONE;
            if (t->leaving[end_of(t, s, false)] == QW_NONE) break;
        }
        if (sides > o->side_first[loops]) o->side_first[++loops] = sides;
    }
    for (uint32_t i = 0; i < count; i++) t->leaving[end_of(t, side[i], true)] = QW_NONE;
    if (is_simple) o->loop_count = loops;
    return is_simple;
}

/* Twice the area inside a loop, seen from where n points to. */
static double area_of(const flattening *t, uint32_t loop, const double n[3])
{
    const qw_patch_faces *o = t->out;
    double sum[3] = {0};
    const double *origin = point_at(t, end_of(t, o->side[o->side_first[loop]], true));
    for (uint32_t i = o->side_first[loop]; i < o->side_first[loop + 1]; i++)
        add_cross(sum, origin, point_at(t, end_of(t, o->side[i], true)), origin,
                  point_at(t, end_of(t, o->side[i], false)));
    return sum[0] * n[0] + sum[1] * n[1] + sum[2] * n[2];
}

/* Adds the set of block b as a face; side: its border sides. */
static void add_face(const flattening *t, uint32_t b, const uint32_t *side, uint32_t count)
{
    qw_patch_faces *o = t->out;
    const qw_primitive *p = &t->surface[b];
    uint32_t first = o->loop_count, largest = first;
    if (!chain(t, side, count)) return;
    for (uint32_t l = first; l < o->loop_count; l++)
        if (area_of(t, l, p->axis) > area_of(t, largest, p->axis)) largest = l;
    double sign = p->sine < 0 ? -1 : 1;
    o->surface[o->count] = (qw_patch_surface){.radius = p->radius,
                                              .angle = qw_atan2(fabs(p->sine), sqrt(fmax(0, 1 - p->sine * p->sine))),
                                              .is_hollow = is_against(t, b)};
    for (int k = 0; k < 3; k++)
        o->surface[o->count].point[k] = p->point[k], o->surface[o->count].axis[k] = sign * p->axis[k];
    o->outer[o->count] = p->kind == QW_PLANE ? largest : QW_NONE, o->block[o->count] = b;
    o->of_block[b] = o->count;
    o->loop_first[++o->count] = o->loop_count;
}

/* Border sides of each set: side[first[b] .. first[b + 1]) of that whose first block is b. */
static void list_borders(const flattening *t, uint32_t *first, uint32_t *side)
{
    uint32_t n = t->blocks->count, sides = 2 * t->blocks->edge_count;
    for (int fill = 0; fill < 2; fill++) {
        for (uint32_t s = sides; s-- > 0;) {
            if (t->owner[s] == QW_NONE || !is_border(t, s)) continue;
            uint32_t *at = &first[qw_set_of(t->set, t->owner[s])];
            if (fill) side[--*at] = s;
            else ++*at;
        }
        for (uint32_t b = 0; b < n && !fill; b++) first[b + 1] += first[b];
    }
}

/* ---- borders */

/* The surface of the face on one side of edge e, or NULL. */
static const qw_primitive *beside(const flattening *t, uint32_t e, uint32_t side)
{
    uint32_t b = t->owner[2 * e + side], f = b == QW_NONE ? QW_NONE : t->out->of_block[b];
    return f == QW_NONE ? NULL : &t->surface[t->out->block[f]];
}

static bool is_round(const qw_primitive *p) { return p && p->kind != QW_PLANE; }

static bool is_between(const flattening *t, uint32_t e) { return beside(t, e, 0) != beside(t, e, 1); }

static void put_beside(const flattening *t, uint32_t e, double at[3])
{
    for (uint32_t side = 0; side < 2; side++) {
        double gradient[3], off;
        if (!beside(t, e, side)) continue;
        off = qw_primitive_distance(beside(t, e, side), at, gradient);
        for (int k = 0; k < 3; k++) at[k] -= off * gradient[k];
    }
}

/* Moves the inner points of edge e so that its curve comes to lie on the surfaces on both sides. */
static void put_curve(const flattening *t, uint32_t e)
{
    const uint32_t *p = t->blocks->edge_point + t->blocks->edge_first[e];
    uint32_t n = t->blocks->edge_first[e + 1] - t->blocks->edge_first[e], count = n / 2 - 1;
    assert(n % 2 == 0 && count > 0);
    for (int round = 0; round < ROUNDS; round++)
        for (uint32_t i = 1; i + 1 < n; i++) {
            double w[4], at[3] = {0}, to[3];
            uint32_t first = weigh((i + (i - 1) / 2) / 3.0, count, w);
            for (uint32_t j = 0; j < 4; j++)
                for (int k = 0; k < 3; k++) at[k] += w[j] * point_at(t, p[first + j])[k];
            memcpy(to, at, sizeof to);
            for (int again = 0; again < 4; again++) put_beside(t, e, to);
            for (int k = 0; k < 3; k++) point_at(t, p[i])[k] += to[k] - at[k];
        }
}

/* Whether an edge is an arc about the axis of a: between it and a plane across the axis, or another with the same axis.
 */
static bool is_arc(const flattening *t, const qw_primitive *a, const qw_primitive *b)
{
    double q[3], side[3];
    if (!is_round(a) || !b || !(fabs(qw_dot_doubles(a->axis, b->axis)) > 1 - 1e-9)) return false;
    for (int k = 0; k < 3; k++) q[k] = b->point[k] - a->point[k];
    qw_cross_doubles(q, a->axis, side);
    return !is_round(b) || sqrt(qw_dot_doubles(side, side)) <= t->patches->tolerance;
}

/* Puts the points of edges between two primitives on both, and finds which of these edges are arcs. */
static void settle_borders(const flattening *t)
{
    const qw_patch_blocks *o = t->blocks;
    for (int round = 0; round < ROUNDS; round++)
        for (uint32_t e = 0; e < o->edge_count; e++) {
            if (!is_between(t, e)) continue;
            put_beside(t, e, point_at(t, o->edge_point[o->edge_first[e]]));
            put_beside(t, e, point_at(t, o->edge_point[o->edge_first[e + 1] - 1]));
        }
    for (uint32_t e = 0; e < o->edge_count; e++) {
        const qw_primitive *a = beside(t, e, 0), *b = beside(t, e, 1);
        t->out->arc[e] = QW_NONE;
        if (!is_between(t, e)) continue;
        put_curve(t, e);
        for (uint32_t side = 0; side < 2; side++)
            if (side ? is_arc(t, b, a) : is_arc(t, a, b)) t->out->arc[e] = t->out->of_block[t->owner[2 * e + side]];
    }
}

qw_patch_faces *qw_find_patch_faces(qw_env *env, const qw_patches *patches, const qw_patch_blocks *blocks,
                                    const qw_primitive *designed, const uint32_t *of_cell)
{
    assert(patches->point && blocks->count > 0);
    uint32_t n = blocks->count, *side = QW_NEW(env, uint32_t, 2 * (size_t)blocks->edge_count),
             *first = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    qw_patch_faces *o = QW_NEW_ZERO(env, qw_patch_faces, 1);
    flattening t = {.env = env, .patches = patches, .blocks = blocks, .out = o};
    t.surface = qw_alloc_zero(env, n, sizeof *t.surface), t.set = QW_NEW(env, uint32_t, n),
    t.designed = QW_NEW(env, uint32_t, n);
    t.owner = QW_NEW(env, uint32_t, 2 * (size_t)blocks->edge_count);
    t.leaving = QW_NEW(env, uint32_t, patches->vertex_count);
    memset(t.leaving, 0xff, patches->vertex_count * sizeof *t.leaving);
    o->of_block = QW_NEW(env, uint32_t, n), o->block = QW_NEW(env, uint32_t, n), o->outer = QW_NEW(env, uint32_t, n);
    o->surface = qw_alloc(env, n, sizeof *o->surface), o->arc = QW_NEW(env, uint32_t, blocks->edge_count);
    o->loop_first = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    o->side_first = QW_NEW_ZERO(env, uint32_t, 4 * (size_t)n + 1), o->side = QW_NEW(env, uint32_t, 4 * (size_t)n);
    memset(o->of_block, 0xff, n * sizeof *o->of_block);
    find_surfaces(&t, designed, of_cell);
    join_blocks(&t);
    list_borders(&t, first, side);
    for (uint32_t b = 0; b < n; b++) {
        uint32_t whole = qw_set_of(t.set, b);
        if (whole != b) o->of_block[b] = o->of_block[whole];
        else if (t.surface[b].kind != QW_PRIMITIVE_KINDS) add_face(&t, b, side + first[b], first[b + 1] - first[b]);
    }
    settle_borders(&t);
    return o;
}
