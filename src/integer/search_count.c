#include "integer/search_count.h"

#include "base/promise.h"
#include "integer/moves.h"
#include "integer/nudge.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Each closed move (moves.h) of a small complex is tried so many times: by -2 to 2 steps. */
enum { MOVE_STEPS = 5, MOST_MOVES = 6 };

void qw_nudge_trial(qw_env *env, const qw_search *s, qw_trial *t, double others, double *work)
{
    assert(t->component < s->components->count && work);
    const qw_complex *real = qw_search_complex(s, t->component);
    double quads = s->wish.quads, bound = quads * QW_COUNT_MARGIN * qw_count_tolerance(quads, s->wish.times);
    if (t->open || !qw_trial_is_forced(s, t)) return;
    qw_scope_begin(env);
    qw_complex c = *real;
    c.d = t->d, c.real = QW_NEW(env, qw_real2, real->edge_count);
    qw_trial_aim(real, t, c.real);
    double rest = others + t->area - qw_complex_area(&c);
    qw_nudge_area(env, &c, quads - bound - rest, quads + bound - rest, work);
    qw_search_judge(s, t);
    qw_scope_end(env);
}

/* Whether a band of quads between curves is one quad wide. Another attempt, with cones beside the corners of feature
   curves, would have no room for them there and would lose the band; so the lengths must meet the count. */
static bool has_narrow_band(const qw_search *s, uint32_t p)
{
    const qw_int2 *d = s->kept[p].d;
    for (uint32_t e = 0; e < qw_search_complex(s, p)->edge_count; e++)
        if (abs(d[e].x) + abs(d[e].y) == 1) return true;
    return false;
}

/* The offsets kept, and each move as often as the digits of `number`, to the base MOVE_STEPS, say: from -2 to 2 times.
 */
static void move_by(const qw_int2 *kept, const qw_int2 *move, uint32_t moves, uint32_t edges, uint32_t number,
                    qw_int2 *d)
{
    memcpy(d, kept, edges * sizeof *d);
    for (uint32_t i = 0; i < moves; i++, number /= MOVE_STEPS) {
        int32_t times = (int32_t)(number % MOVE_STEPS) - MOVE_STEPS / 2;
        for (uint32_t e = 0; e < edges; e++)
            d[e].x += times * move[(size_t)i * edges + e].x, d[e].y += times * move[(size_t)i * edges + e].y;
    }
}

/* Tries all sums of moves and takes the cheapest for which the count is right and no edge loses its length. */
static void try_moves(qw_env *env, qw_search *s, uint32_t p)
{
    assert(p < s->components->count);
    qw_scope_begin(env);
    const qw_complex *real = qw_search_complex(s, p);
    qw_int2 *move;
    uint32_t moves = qw_find_moves(env, real, MOST_MOVES, &move), numbers = moves > 0;
    for (uint32_t i = 0; i < moves; i++) numbers *= MOVE_STEPS;
    qw_trial t = qw_search_copy_kept(env, s, p);
    qw_complex c = *real;
    c.d = QW_NEW(env, qw_int2, real->edge_count), c.real = QW_NEW(env, qw_real2, real->edge_count);
    qw_trial_aim(real, &t, c.real);
    memcpy(c.d, t.d, real->edge_count * sizeof *c.d);
    double least = INFINITY, area_kept = qw_complex_area(&c);
    for (uint32_t number = 0; number < numbers; number++) {
        move_by(s->kept[p].d, move, moves, real->edge_count, number, c.d);
        qw_search_total sum = s->sum;
        sum.area += qw_complex_area(&c) - area_kept;
        double cost = qw_complex_cost(&c);
        if (qw_search_miss(s, &sum) > 0 || cost >= least || qw_complex_inverted(&c) > 0 ||
            qw_complex_loses_length(&c, s->kept[p].d))
            continue;
        least = cost;
        memcpy(t.d, c.d, real->edge_count * sizeof *t.d);
    }
    if (least < INFINITY) {
        qw_search_judge(s, &t);
        qw_search_take_if_better(s, &t);
    }
    qw_scope_end(env);
}

void qw_search_moves(qw_env *env, qw_search *s)
{
    for (uint32_t p = 0; p < s->components->count && qw_search_miss(s, &s->sum) > 0; p++)
        if (!qw_trial_has_faults(&s->kept[p]) && has_narrow_band(s, p)) try_moves(env, s, p);
}
