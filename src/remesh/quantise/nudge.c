#include "remesh/quantise/nudge.h"

#include "base/constants.h"
#include "remesh/quantise/circuits.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 12 }; /* most steps that are taken */

static double distance_from(double area, double least, double most) { return fmax(fmax(least - area, area - most), 0); }

/* One round: the offsets before it, their cost and by how many quads their area misses the bounds; and the offsets
   after the best step so far. The best step is the cheapest that leads into the bounds or, where none does, the one
   that costs least for each quad that it leads nearer. */
typedef struct nudging {
    double least_area, most_area;
    uint32_t inverted;
    qw_int2 *had, *best;
    double cost, off, best_price, best_off;
} nudging;

/* Changes variable v of c->d, keeps the result if it is the best so far, and restores c->d. */
static void try_step(qw_env *env, qw_complex *c, uint32_t v, int32_t by, nudging *r)
{
    if (qw_step_offsets(env, c, v, by, QW_LONGEST_WALK, QW_MOST_WALK_COST) && qw_complex_inverted(c) <= r->inverted &&
        !qw_complex_loses_length(c, r->had)) {
        double now = distance_from(qw_complex_area(c), r->least_area, r->most_area),
               cost = qw_complex_cost(c) - r->cost;
        double price = cost > 0 ? cost / fmax(r->off - now, 1e-9) : cost;
        bool is_in = now == 0, was_in = r->best_off == 0;
        if (now < r->off && is_in >= was_in && (is_in > was_in || price < r->best_price)) {
            r->best_price = price, r->best_off = now;
            memcpy(r->best, c->d, c->edge_count * sizeof *c->d);
        }
    }
    memcpy(c->d, r->had, c->edge_count * sizeof *c->d);
}

bool qw_nudge_area(qw_env *env, qw_complex *c, double least_area, double most_area, double *work)
{
    assert(c->d && c->fixed && least_area <= most_area && work);
    qw_scope_begin(env);
    size_t bytes = c->edge_count * sizeof *c->d;
    nudging r = {least_area, most_area, .inverted = qw_complex_inverted(c)};
    r.had = QW_NEW(env, qw_int2, c->edge_count), r.best = QW_NEW(env, qw_int2, c->edge_count);
    r.off = distance_from(qw_complex_area(c), least_area, most_area);
    for (int i = 0; i < ROUNDS && r.off > 0; i++) {
        bool longer = qw_complex_area(c) < least_area;
        memcpy(r.had, c->d, bytes);
        r.cost = qw_complex_cost(c), r.best_price = INFINITY, r.best_off = r.off;
        for (uint32_t e = 0; e < c->edge_count && work[0] > 0; e++) {
            if (c->fixed[e] != QW_FIXED_X && c->fixed[e] != QW_FIXED_Y) continue;
            bool is_y = c->fixed[e] == QW_FIXED_X;
            int32_t z = is_y ? c->d[e].y : c->d[e].x;
            if (z == 0 || (!longer && abs(z) == 1)) continue;
            *work -= c->face_count;
            qw_heartbeat(env);
            try_step(env, c, 2 * e + is_y, (z > 0) == longer ? 1 : -1, &r);
        }
        if (!(r.best_off < r.off)) break;
        r.off = r.best_off;
        memcpy(c->d, r.best, bytes);
    }
    qw_scope_end(env);
    return r.off <= 0;
}
