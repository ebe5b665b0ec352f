#include "products/limit/patch_planes.h"

#include "base/sets.h"

#include <assert.h>
#include <math.h>
#include <string.h>

typedef struct flattening {
    qw_env *env;
    const qw_patches *patches;
    const qw_patch_blocks *blocks;
    double (*normal)[3]; /* double[blocks][3]: unit, or 0: bent */
    uint32_t *set;       /* uint32_t[blocks], sets */
    uint32_t *owner;     /* uint32_t[2 edges]: the block that goes against edge e, and the one along it */
    uint32_t *leaving;   /* uint32_t[vertices]: the side of the set at hand that begins there, or QW_NONE */
    qw_patch_planes *out;
} flattening;

static const double *point_at(const flattening *t, uint32_t p) { return t->patches->point + 3 * (size_t)p; }

static double height(const flattening *t, uint32_t b, uint32_t p)
{
    const double *n = t->normal[b], *x = point_at(t, p), *o = point_at(t, t->blocks->point[t->blocks->first[b]]);
    return fabs(n[0] * (x[0] - o[0]) + n[1] * (x[1] - o[1]) + n[2] * (x[2] - o[2]));
}

/* Adds the cross product of b - a and d - c to sum. */
static void add_cross(double sum[3], const double *a, const double *b, const double *c, const double *d)
{
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        sum[k] += (b[i] - a[i]) * (d[j] - c[j]) - (b[j] - a[j]) * (d[i] - c[i]);
    }
}

/* The normal of a block all of whose points lie on one plane, by its diagonals. */
static void find_normal(const flattening *t, uint32_t b)
{
    const uint32_t *p = t->blocks->point + t->blocks->first[b];
    size_t count = t->blocks->first[b + 1] - t->blocks->first[b];
    uint32_t columns = 2 * t->blocks->span[b][1] + 2;
    double *n = t->normal[b];
    add_cross(n, point_at(t, p[0]), point_at(t, p[count - 1]), point_at(t, p[count - columns]),
              point_at(t, p[columns - 1]));
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++) n[k] = length > 0 ? n[k] / length : 0;
    for (size_t i = 0; i < count; i++)
        if (!(height(t, b, p[i]) <= t->patches->tolerance)) memset(n, 0, sizeof t->normal[b]);
}

static bool is_flat(const flattening *t, uint32_t b)
{
    return t->normal[b][0] != 0 || t->normal[b][1] != 0 || t->normal[b][2] != 0;
}

/* Whether block b lies on the plane of block a and faces the same way. */
static bool is_on(const flattening *t, uint32_t a, uint32_t b)
{
    double cosine = 0;
    for (int k = 0; k < 3; k++) cosine += t->normal[a][k] * t->normal[b][k];
    for (size_t i = t->blocks->first[b]; i < t->blocks->first[b + 1]; i++)
        if (!(height(t, a, t->blocks->point[i]) <= t->patches->tolerance)) return false;
    return cosine > 0;
}

static void join_blocks(const flattening *t)
{
    const qw_patch_blocks *o = t->blocks;
    memset(t->owner, 0xff, 2 * (size_t)o->edge_count * sizeof *t->owner);
    for (uint32_t b = 0; b < o->count; b++)
        for (int k = 0; k < 4; k++) t->owner[2 * o->side[b][k] + o->is_along[b][k]] = b;
    qw_sets_begin(t->set, o->count);
    for (uint32_t e = 0; e < o->edge_count; e++) {
        uint32_t a = t->owner[2 * e], b = t->owner[2 * e + 1];
        if (a == QW_NONE || b == QW_NONE || !is_flat(t, a) || !is_flat(t, b)) continue;
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
    qw_patch_planes *o = t->out;
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
    const qw_patch_planes *o = t->out;
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
    qw_patch_planes *o = t->out;
    uint32_t first = o->loop_count, largest = first;
    if (!chain(t, side, count)) return;
    for (uint32_t l = first; l < o->loop_count; l++)
        if (area_of(t, l, t->normal[b]) > area_of(t, largest, t->normal[b])) largest = l;
    o->outer[o->count] = largest, o->block[o->count] = b;
    memcpy(o->normal[o->count], t->normal[b], sizeof t->normal[b]);
    o->loop_first[++o->count] = o->loop_count;
    for (uint32_t i = 0; i < t->blocks->count; i++)
        if (qw_set_of(t->set, i) == b) o->of_block[i] = o->count - 1;
}

qw_patch_planes *qw_find_patch_planes(qw_env *env, const qw_patches *patches, const qw_patch_blocks *blocks)
{
    assert(patches->point && blocks->count > 0);
    uint32_t n = blocks->count, *side = QW_NEW(env, uint32_t, 2 * (size_t)blocks->edge_count);
    qw_patch_planes *o = QW_NEW_ZERO(env, qw_patch_planes, 1);
    flattening t = {.env = env, .patches = patches, .blocks = blocks, .out = o};
    t.normal = qw_alloc_zero(env, n, sizeof *t.normal), t.set = QW_NEW(env, uint32_t, n);
    t.owner = QW_NEW(env, uint32_t, 2 * (size_t)blocks->edge_count);
    t.leaving = QW_NEW(env, uint32_t, patches->vertex_count);
    memset(t.leaving, 0xff, patches->vertex_count * sizeof *t.leaving);
    o->of_block = QW_NEW(env, uint32_t, n), o->block = QW_NEW(env, uint32_t, n), o->outer = QW_NEW(env, uint32_t, n);
    o->normal = qw_alloc(env, n, sizeof *o->normal), o->loop_first = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    o->side_first = QW_NEW_ZERO(env, uint32_t, 4 * (size_t)n + 1), o->side = QW_NEW(env, uint32_t, 4 * (size_t)n);
    memset(o->of_block, 0xff, n * sizeof *o->of_block);
    for (uint32_t b = 0; b < n; b++) find_normal(&t, b);
    join_blocks(&t);
    for (uint32_t b = 0; b < n; b++) {
        if (!is_flat(&t, b) || qw_set_of(t.set, b) != b) continue;
        uint32_t count = 0;
        for (uint32_t s = 0; s < 2 * blocks->edge_count; s++)
            if (t.owner[s] != QW_NONE && qw_set_of(t.set, t.owner[s]) == b && is_border(&t, s)) side[count++] = s;
        add_face(&t, b, side, count);
    }
    return o;
}
