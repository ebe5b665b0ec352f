#include "base/elementary.h"
#include "base/mechanisms.h"
#include "whole/written.h"

#include <assert.h>
#include <float.h>
#include <string.h>

/* A vertex is not rounded if an edge at it is shorter than so many units of rounding: that would change the shape. */
static const double ROOM = 256;
/* A coordinate of more units than this has no binary digits below the unit: there is nothing to round off. */
static const double MOST_WHOLE = 1e15;
/* A vertex is pushed by these shares of the longest side of a quad around it: the first, the last, and the factor
   between two. */
static const double FIRST_PUSH = 1.0 / (1ll << 40), LAST_PUSH = 1.0 / (1 << 10), PUSH_GROWTH = 8;

static double rounded(double x, double unit)
{
    return fabs(x) * unit < MOST_WHOLE ? qw_round_even(x * unit) / unit : x;
}

/* The power of two that brings coordinates to about 1, so that their products neither overflow nor vanish. */
static double safe_scale(const uint32_t *corner, const double *position)
{
    double most = 0;
    for (int i = 0; i < 12; i++) most = fmax(most, fabs(position[3 * (size_t)corner[i / 3] + (size_t)(i % 3)]));
    return most > 0 ? ldexp(1, -(int)fmax(ilogb(most), 2 - DBL_MAX_EXP)) : 1;
}

/* Flaws of a quad: pairs of corners at one position or, if there are none, 1 where all four lie on one line; else 0. */
static uint32_t flaws_of(const uint32_t *corner, const double *position)
{
    assert(corner && position);
    double p[4][3], longest2 = 0, most2 = 0, scale = safe_scale(corner, position);
    uint32_t pairs = 0;
    for (int i = 0; i < 4; i++)
        for (size_t k = 0; k < 3; k++) p[i][k] = scale * position[3 * (size_t)corner[i] + k];
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < i; j++) {
            pairs += p[i][0] == p[j][0] && p[i][1] == p[j][1] && p[i][2] == p[j][2];
            longest2 = fmax(longest2, qw_distance2_doubles(p[i], p[j]));
        }
    if (pairs > 0) return pairs;
    for (int i = 0; i < 4; i++) most2 = fmax(most2, qw_cross2_doubles(p[i], p[(i + 1) % 4], p[(i + 2) % 4]));
    return !(most2 > QW_CROSS_CERTAIN * QW_CROSS_CERTAIN * longest2 * longest2);
}

bool qw_is_degenerate(const uint32_t *corner, const double *position) { return flaws_of(corner, position) > 0; }

typedef struct settling {
    const qw_quadmesh *quads;
    double unit, *position;
    uint8_t *flag; /* uint8_t[face_count] */
} settling;

static void flag_short(void *user, uint32_t begin, uint32_t end)
{
    const settling *s = user;
    double least2 = ROOM / s->unit * (ROOM / s->unit);
    for (uint32_t f = begin; f < end; f++)
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++)
            s->flag[f] |= qw_distance2_doubles(s->position + 3 * (size_t)s->quads->corner[h],
                                               s->position + 3 * (size_t)s->quads->corner[qw_quad_next(h)]) < least2;
}

static void flag_degenerate(void *user, uint32_t begin, uint32_t end)
{
    const settling *s = user;
    for (uint32_t f = begin; f < end; f++) s->flag[f] = qw_is_degenerate(s->quads->corner + 4 * (size_t)f, s->position);
}

/* Vertices of flagged faces: uint8_t[vertex_count]. */
static void mark_corners(const settling *s, uint8_t *marked)
{
    for (uint32_t h = 0; h < 4 * s->quads->face_count; h++)
        if (s->flag[h / 4]) marked[s->quads->corner[h]] = 1;
}

static void round_positions(const settling *s, const uint8_t *kept)
{
    for (uint32_t v = 0; v < s->quads->vertex_count; v++)
        for (size_t k = 0; !kept[v] && k < 3; k++)
            s->position[3 * (size_t)v + k] = rounded(s->position[3 * (size_t)v + k], s->unit);
}

static uint32_t first_flagged(const settling *s)
{
    const uint8_t *at = memchr(s->flag, 1, s->quads->face_count);
    return at ? (uint32_t)(at - s->flag) : QW_NONE;
}

/* The flaws of the quads around v, out[v] first; *longest: the longest side of any of them. */
static uint32_t count_flaws(const settling *s, uint32_t first, double *longest)
{
    assert(first < 4 * s->quads->face_count);
    const qw_quadmesh *m = s->quads;
    uint32_t count = 0;
    double longest2 = 0;
    for (uint32_t h = first; h != QW_NONE;) {
        const uint32_t *c = m->corner + 4 * (size_t)(h / 4);
        count += flaws_of(c, s->position);
        for (int i = 0; i < 4; i++)
            longest2 = fmax(longest2, qw_distance2_doubles(s->position + 3 * (size_t)c[i],
                                                           s->position + 3 * (size_t)c[(i + 1) % 4]));
        h = m->twin[qw_quad_prev(h)];
        if (h == first) break;
    }
    *longest = sqrt(longest2);
    return count;
}

/* Moves v along the axis that leaves fewest flaws around it, by that share of the longest side or, where all is at one
   point, of its distance from the origin. Flaws, not quads, are counted: a quad of which two pairs of corners have
   fallen together, as on a tube that has become a line, is repaired one corner after another. */
static void push_vertex(settling *s, uint32_t v, uint32_t first, double share)
{
    assert(v < s->quads->vertex_count && first < 4 * s->quads->face_count);
    double longest, *p = s->position + 3 * (size_t)v, unused, distance = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    uint32_t least = count_flaws(s, first, &longest);
    double best[3] = {p[0], p[1], p[2]}, step = share * (longest > 0 ? longest : distance);
    for (int side = 0; side < 6 && least > 0; side++) {
        double old = p[side / 2];
        p[side / 2] += side % 2 ? -step : step;
        uint32_t count = count_flaws(s, first, &unused);
        if (count < least) least = count, memcpy(best, p, sizeof best);
        p[side / 2] = old;
    }
    memcpy(p, best, sizeof best);
}

/* Pushes the corners of degenerate quads one after another, by steps too small to be seen, and longer ones as long as
   there are such quads. Returns how often. */
static uint32_t push_apart(settling *s, const uint32_t *out)
{
    const qw_quadmesh *m = s->quads;
    uint32_t count = 0;
    for (double share = FIRST_PUSH; share <= LAST_PUSH && first_flagged(s) != QW_NONE; share *= PUSH_GROWTH)
        for (uint32_t f = 0; f < m->face_count; f++) {
            const uint32_t *c = m->corner + 4 * (size_t)f;
            if (!s->flag[f]) continue;
            for (int i = 0; i < 4 && qw_is_degenerate(c, s->position); i++)
                if (out[c[i]] != QW_NONE) push_vertex(s, c[i], out[c[i]], share), count++;
            s->flag[f] = qw_is_degenerate(c, s->position);
        }
    return count;
}

/* Rounds all positions but for those where that would make a quad degenerate. */
static void round_all(qw_env *env, settling *s)
{
    uint32_t n = s->quads->vertex_count;
    uint8_t *kept = QW_NEW_ZERO(env, uint8_t, n);
    double *exact = QW_NEW(env, double, 3 * (size_t)n);
    memcpy(exact, s->position, 3 * (size_t)n * sizeof *exact);
    qw_parallel(env, s->quads->face_count, QW_GRAIN_LIGHT, flag_short, s);
    mark_corners(s, kept);
    round_positions(s, kept);
    qw_parallel(env, s->quads->face_count, QW_GRAIN_LIGHT, flag_degenerate, s);
    if (first_flagged(s) == QW_NONE) return;
    mark_corners(s, kept);
    for (uint32_t v = 0; v < n; v++)
        if (kept[v]) memcpy(s->position + 3 * (size_t)v, exact + 3 * (size_t)v, 3 * sizeof *exact);
}

uint32_t qw_settle_written(qw_env *env, const qw_quadmesh *quads, double unit, double *position, uint32_t *moved)
{
    assert(quads->twin && unit >= 0);
    qw_scope_begin(env);
    settling s = {quads, unit, position, QW_NEW_ZERO(env, uint8_t, quads->face_count)};
    *moved = 0;
    if (unit > 0) round_all(env, &s);
    qw_parallel(env, quads->face_count, QW_GRAIN_LIGHT, flag_degenerate, &s);
    if (first_flagged(&s) != QW_NONE && qw_uses(env, QW_MECH_PUSHED_APART))
        *moved = push_apart(&s, qw_quadmesh_outgoing(env, quads)), qw_did(env, QW_MECH_PUSHED_APART, *moved);
    uint32_t left = first_flagged(&s);
    qw_scope_end(env);
    return left;
}
