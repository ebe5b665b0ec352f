#include "integer/nudge.h"

#include "integer/circuits.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ROUNDS: steps that are taken; LONGEST_WALK: steps of a walk that closes the offsets again. */
enum { ROUNDS = 12, LONGEST_WALK = 48 };
/* Cost of rounding that a walk may have. */
static const double MOST_COST = 200;

static double distance_from(double area, double least, double most) { return fmax(fmax(least - area, area - most), 0); }

static bool loses_length(const qw_complex *c, const qw_int2 *had)
{
    for (uint32_t e = 0; e < c->edge_count; e++)
        if ((had[e].x && !c->d[e].x) || (had[e].y && !c->d[e].y)) return true;
    return false;
}

/* The best step of a round: into the bounds for the least cost, or else nearer to them for the least cost a quad. */
typedef struct best {
    double price, off;
    qw_int2 *d;
} best;

static void try_step(qw_env *env, qw_complex *c, uint32_t v, int32_t by, const double bound[2], uint32_t inverted,
                     const qw_int2 *had, best *b)
{
    double before = qw_complex_cost(c), off = distance_from(qw_complex_area(c), bound[0], bound[1]);
    if (qw_step_offsets(env, c, v, by, LONGEST_WALK, MOST_COST) && qw_complex_inverted(c) <= inverted &&
        !loses_length(c, had)) {
        double now = distance_from(qw_complex_area(c), bound[0], bound[1]), cost = qw_complex_cost(c) - before;
        double price = cost > 0 ? cost / fmax(off - now, 1e-9) : cost;
        if (now < off && (now == 0) >= (b->off == 0) && ((now == 0) > (b->off == 0) || price < b->price)) {
            b->price = price, b->off = now;
            memcpy(b->d, c->d, c->edge_count * sizeof *c->d);
        }
    }
    memcpy(c->d, had, c->edge_count * sizeof *c->d);
}

bool qw_nudge_area(qw_env *env, qw_complex *c, double least_area, double most_area, double *work)
{
    assert(c->d && c->fixed && least_area <= most_area && work);
    const double bound[2] = {least_area, most_area};
    qw_scope_begin(env);
    size_t bytes = c->edge_count * sizeof *c->d;
    qw_int2 *had = QW_NEW(env, qw_int2, c->edge_count);
    best b = {.d = QW_NEW(env, qw_int2, c->edge_count)};
    uint32_t inverted = qw_complex_inverted(c);
    double off = distance_from(qw_complex_area(c), least_area, most_area);
    for (int round = 0; round < ROUNDS && off > 0; round++) {
        bool longer = qw_complex_area(c) < least_area;
        memcpy(had, c->d, bytes);
        b.price = INFINITY, b.off = off;
        for (uint32_t e = 0; e<c->edge_count && * work> 0; e++) {
            if (c->fixed[e] != QW_FIXED_X && c->fixed[e] != QW_FIXED_Y) continue;
            bool is_y = c->fixed[e] == QW_FIXED_X;
            int32_t z = is_y ? c->d[e].y : c->d[e].x;
            if (z == 0 || (!longer && abs(z) == 1)) continue;
            *work -= c->face_count;
            qw_break_silence(env);
            try_step(env, c, 2 * e + is_y, (z > 0) == longer ? 1 : -1, bound, inverted, had, &b);
        }
        if (!(b.off < off)) break;
        off = b.off;
        memcpy(c->d, b.d, bytes);
    }
    qw_scope_end(env);
    return off <= 0;
}
