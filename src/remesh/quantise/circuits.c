#include "remesh/quantise/circuits.h"

#include "remesh/quantise/network.h"
#include "base/elementary.h"
#include "solve/queue.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Costs are integers, so that their sums are exact: this many units for a cost of 1. */
static const double UNIT = 4096;
/* Distances from the real value are cut at this, so that sums of costs do not overflow. */
static const double FARTHEST = 1e4;
/* NO_PRICE: the cost of a step has not been asked for. FAR: no walk has reached the state. */
static const int64_t NO_PRICE = INT64_MIN, FAR = INT64_MAX / 4;
/* MOST_OFF: steps by which rows may be off in all, for them to be set right one by one. */
enum { MOST_STEPS = 200, MOST_OFF = 24 };

/* One of the three variables of a row: its sign there, and where else it appears. */
typedef struct link {
    uint32_t variable; /* 2 edge + component, or QW_NONE where it is constrained */
    uint32_t far;      /* row, or QW_NONE at the boundary */
    int8_t sign, far_sign;
} link;

/* States: 2 row + (its sum is 1 too high); the last is the boundary, where nothing has to be set right. A step goes by
   a link from the state at its row to that at the far one: 2 link + (the variable rises). */
typedef struct walks {
    qw_complex *c;
    uint32_t rows, ground, longest;
    link *link;      /* [3 rows] */
    uint32_t *shore; /* links of variables at the boundary */
    uint32_t shore_count;
    int64_t *cost;       /* [2 variables] that it falls, that it rises; or NO_PRICE, until a step is looked at */
    int64_t *distance;   /* [states] */
    uint32_t *from, *by; /* [states] the state before, or QW_NONE, and the step from there */
    /* of circuits alone */
    int64_t *extra;  /* [6 rows] of a step: a circuit that meets a variable twice pays for that here */
    uint32_t *queue; /* [states] */
    uint8_t *queued; /* [states] */
    uint32_t first, waiting;
    int32_t *net; /* [variables] 0, but for those of the circuit looked at */
} walks;

static bool is_constrained(const qw_complex *c, uint32_t v)
{
    return (c->fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X)) != 0;
}

/* Cost of changing variable v by `by`. */
static int64_t cost_of(const qw_complex *c, uint32_t v, int32_t by)
{
    assert(v < 2 * c->edge_count);
    double off = v & 1u ? (double)c->d[v / 2].y - (double)c->real[v / 2].y
                        : (double)c->d[v / 2].x - (double)c->real[v / 2].x;
    off = fmin(fmax(off, -FARTHEST), FARTHEST);
    int32_t z = v & 1u ? c->d[v / 2].y : c->d[v / 2].x;
    int64_t missing = qw_complex_short(c, v, z + by) - qw_complex_short(c, v, z);
    return (int64_t)qw_floor(UNIT * (c->weight ? (double)c->weight[v / 2] : 1) * by * (by + 2 * off) + 0.5) +
           (int64_t)UNIT * QW_BOUND_COST * missing;
}

static uint32_t variable_of(const walks *w, uint32_t by) { return w->link[by / 2].variable; }

static int64_t price_of(walks *w, uint32_t by)
{
    uint32_t v = variable_of(w, by);
    int64_t *cost = &w->cost[2 * (size_t)v + (by & 1u)];
    if (*cost == NO_PRICE) *cost = cost_of(w->c, v, by & 1u ? 1 : -1);
    return *cost;
}

/* Adds to variable v, whose steps cost something else from then on. */
static void change(walks *w, uint32_t v, int32_t by)
{
    if (v & 1u) w->c->d[v / 2].y += by;
    else w->c->d[v / 2].x += by;
    w->cost[2 * (size_t)v] = w->cost[2 * (size_t)v + 1] = NO_PRICE;
}

/* For each row its three variables, with the row at the far end of each; those without one end on the shore. */
static void make_links(walks *w)
{
    const qw_complex *c = w->c;
    for (uint32_t h = 0; h < 3 * c->face_count; h++)
        for (unsigned k = 0; k < 2; k++) {
            uint32_t e = c->edge[h], other = c->side[2 * e] == h ? c->side[2 * e + 1] : c->side[2 * e];
            qw_row here = qw_row_of(c->rot[h], k);
            uint32_t at = 3 * (2 * (h / 3) + here.row) + h % 3;
            link *l = &w->link[at];
            *l = (link){.variable = 2 * e + k, .far = QW_NONE, .sign = here.sign};
            if (is_constrained(c, l->variable)) {
                l->variable = QW_NONE;
            } else if (other == QW_NONE) {
                w->shore[w->shore_count++] = at;
            } else {
                qw_row there = qw_row_of(c->rot[other], k);
                l->far = 2 * (other / 3) + there.row, l->far_sign = there.sign;
            }
        }
}

static void wait(walks *w, uint32_t state)
{
    if (w->queued[state]) return;
    uint32_t at = w->first + w->waiting++;
    w->queue[at <= w->ground ? at : at - w->ground - 1] = state;
    w->queued[state] = 1;
}

static uint32_t next(walks *w)
{
    uint32_t s = w->queue[w->first];
    w->first = w->first == w->ground ? 0 : w->first + 1;
    w->waiting--;
    w->queued[s] = 0;
    return s;
}

/* Room for walks over a complex; longest: in steps. */
static walks make_walks(qw_env *env, qw_complex *c, uint32_t longest)
{
    assert(c->edge && c->side && c->real && c->face_count < QW_NONE / 6);
    walks w = {.c = c, .rows = 2 * c->face_count, .ground = 4 * c->face_count, .longest = longest};
    uint32_t states = w.ground + 1, variables = 2 * c->edge_count;
    w.link = QW_NEW(env, link, (size_t)3 * w.rows), w.shore = QW_NEW(env, uint32_t, (size_t)3 * w.rows);
    w.cost = QW_NEW(env, int64_t, (size_t)2 * variables);
    w.distance = QW_NEW_ZERO(env, int64_t, states), w.from = QW_NEW(env, uint32_t, states),
    w.by = QW_NEW(env, uint32_t, states);
    make_links(&w);
    for (size_t i = 0; i < 2 * (size_t)variables; i++) w.cost[i] = NO_PRICE;
    return w;
}

/* ---- circuits: by a step from `from` to `to`, which is on the way to `from` */

typedef struct circuit {
    uint32_t from, to, by;
} circuit;

/* Steps of the walk that ends at `from`, back to `to`; 0 where that is not on it; more than the longest where it is too
 * long. */
static uint32_t length_back(const walks *w, uint32_t from, uint32_t to)
{
    uint32_t length = 1;
    for (; from != to && length <= w->longest; length++) {
        from = w->from[from];
        if (from == QW_NONE) return 0;
    }
    return length;
}

/* The step of the circuit before the one at *state; false after its first. */
static bool step_back(const walks *w, const circuit *k, uint32_t *state, uint32_t *by)
{
    if (*state == k->to) return false;
    *by = w->by[*state], *state = w->from[*state];
    return true;
}

/* Counts the changes of the circuit's variables and what they cost together. */
static int64_t add_up(walks *w, const circuit *k)
{
    assert(k->by < 6 * w->rows);
    int64_t cost = 0;
    uint32_t s = k->from, by = k->by;
    do {
        uint32_t v = variable_of(w, by);
        cost -= cost_of(w->c, v, w->net[v]);
        w->net[v] += by & 1u ? 1 : -1;
        cost += cost_of(w->c, v, w->net[v]);
    } while (step_back(w, k, &s, &by));
    return cost;
}

/* Changes the variables along a circuit by one, and puts in the queue all from which steps cost something else now.
 * */
static void take(walks *w, const circuit *k)
{
    assert(k->by < 6 * w->rows);
    uint32_t s = k->from, by = k->by;
    do {
        uint32_t v = variable_of(w, by);
        change(w, v, w->net[v]);
        w->net[v] = 0;
    } while (step_back(w, k, &s, &by));
    for (s = k->from;;) { /* steps from these, and from their opposites, have other costs now */
        uint32_t before = w->from[s];
        w->from[s] = QW_NONE;
        wait(w, s);
        if (s != w->ground) wait(w, s ^ 1u);
        if (s == k->to) break;
        s = before;
    }
}

/* The sum of the steps' costs is negative, but that of the circuit is not, as two steps of one variable cost more
   than twice one. The difference is added to the second of them. */
static void make_dearer(walks *w, const circuit *k)
{
    int64_t sum = 0;
    uint32_t s = k->from, by = k->by;
    do sum += price_of(w, by) + w->extra[by];
    while (step_back(w, k, &s, &by));
    s = k->from, by = k->by;
    do {
        uint32_t v = variable_of(w, by);
        if (abs(w->net[v]) == 2 && sum < 0) {
            int64_t more = cost_of(w->c, v, w->net[v]) - 2 * cost_of(w->c, v, w->net[v] / 2) - w->extra[by];
            if (more > -sum) more = -sum;
            if (more > 0) w->extra[by] += more, sum += more;
        }
        w->net[v] = 0;
    } while (step_back(w, k, &s, &by));
}

/* ---- the search */

/* Returns whether the step closed a circuit that was taken. */
static bool step(walks *w, uint32_t from, uint32_t to, uint32_t by)
{
    int64_t d = w->distance[from] + price_of(w, by) + w->extra[by];
    if (d >= w->distance[to]) return false;
    uint32_t length = length_back(w, from, to);
    if (length > w->longest) return false;
    if (length == 0) {
        w->distance[to] = d, w->from[to] = from, w->by[to] = by;
        wait(w, to);
        return false;
    }
    circuit k = {from, to, by};
    bool pays = add_up(w, &k) < 0;
    if (pays) take(w, &k);
    else make_dearer(w, &k);
    return pays;
}

/* Tries the steps from a state until one closes a circuit. */
static bool step_on(walks *w, uint32_t from)
{
    if (from == w->ground) {
        for (uint32_t i = 0; i < w->shore_count; i++)
            for (uint32_t rises = 0; rises < 2; rises++) {
                uint32_t at = w->shore[i];
                bool high = (w->link[at].sign > 0) == (rises == 1);
                if (step(w, from, 2 * (at / 3) + high, 2 * at + rises)) return true;
            }
        return false;
    }
    bool high = from & 1u;
    for (uint32_t at = 3 * (from / 2); at < 3 * (from / 2) + 3; at++) {
        const link *l = &w->link[at];
        if (l->variable == QW_NONE) continue;
        uint32_t rises = (l->sign > 0) != high;
        uint32_t to = l->far == QW_NONE ? w->ground : 2 * l->far + ((l->far_sign > 0) == (rises == 1));
        if (step(w, from, to, 2 * at + rises)) return true;
    }
    return false;
}

uint32_t qw_improve_offsets(qw_env *env, qw_complex *c, uint32_t longest)
{
    assert(c->d);
    qw_scope_begin(env);
    walks w = make_walks(env, c, longest);
    uint32_t circuits = 0, states = w.ground + 1;
    w.extra = QW_NEW_ZERO(env, int64_t, (size_t)6 * w.rows), w.net = QW_NEW_ZERO(env, int32_t, 2 * c->edge_count);
    w.queue = QW_NEW(env, uint32_t, states), w.queued = QW_NEW_ZERO(env, uint8_t, states);
    for (uint32_t s = 0; s < states; s++) w.from[s] = QW_NONE, wait(&w, s);
    for (uint64_t steps = 0; w.waiting > 0 && steps < (uint64_t)MOST_STEPS * w.rows; steps++)
        circuits += step_on(&w, next(&w));
    qw_scope_end(env);
    return circuits;
}

/* ---- rows that are off */

/* What is off in each row: int32_t[rows]. Returns the sum of its magnitudes. */
static int64_t find_off(const walks *w, int32_t *off)
{
    int64_t sum = 0;
    for (uint32_t f = 0; f < w->rows / 2; f++) {
        qw_int2 r = qw_complex_residual(w->c, f);
        off[2 * f] = r.x, off[2 * f + 1] = r.y;
        sum += (int64_t)abs(r.x) + abs(r.y);
    }
    return sum;
}

/* Whether a walk from `start` that arrives at `state` sets a row right there: the row that it began with must be off by
   one more. */
static bool sets_right(const walks *w, const int32_t *off, uint32_t start, uint32_t state)
{
    if (state == w->ground) return true;
    int32_t needed = state / 2 == start / 2 ? 2 : 1;
    return (state & 1u ? -off[state / 2] : off[state / 2]) >= needed;
}

/* A search for the cheapest walk from one row that is off to another, by Dijkstra's algorithm: no step is free. */
typedef struct walk_search {
    walks *w;
    int32_t *off;      /* int32_t[rows], what is off in each */
    int64_t left;      /* the sum of its magnitudes */
    qw_queue queue;    /* of states; distances go on from the last one of the search before */
    uint32_t *hops;    /* [states] steps of the walk to there */
    uint32_t *reached; /* [states] those that have a distance; the others have FAR */
    uint32_t reached_count;
    uint32_t start; /* state */
    int64_t most;   /* distance */
    uint32_t end;   /* the cheapest state so far that sets a row right, or QW_NONE */
} walk_search;

/* Reaches state `to` from `from`, if that is cheaper than so far and not too long. */
static void extend(walk_search *s, uint32_t from, uint32_t to, uint32_t by)
{
    walks *w = s->w;
    int64_t cost = price_of(w, by);
    int64_t d = w->distance[from] + (cost > 0 ? cost : 1);
    if (d >= w->distance[to] || d > s->most || s->hops[from] >= w->longest) return;
    if (w->distance[to] == FAR) s->reached[s->reached_count++] = to;
    w->distance[to] = d, w->from[to] = from, w->by[to] = by, s->hops[to] = s->hops[from] + 1;
    if (sets_right(w, s->off, s->start, to)) s->end = to, s->most = d - 1;
    else qw_queue_put(&s->queue, to, d);
}

/* Takes all steps from a state: both ways of its row's three variables. */
static void extend_from(walk_search *s, uint32_t from)
{
    walks *w = s->w;
    for (uint32_t at = 3 * (from / 2); at < 3 * (from / 2) + 3; at++) {
        const link *l = &w->link[at];
        if (l->variable == QW_NONE) continue;
        uint32_t rises = (l->sign > 0) != (from & 1u);
        uint32_t to = l->far == QW_NONE ? w->ground : 2 * l->far + ((l->far_sign > 0) == (rises == 1));
        extend(s, from, to, 2 * at + rises);
    }
}

/* Finds the cheapest walk from `start`, of at most this cost, to a row that it sets right: s->end. Returns its cost. */
static int64_t find_walk(walk_search *s, uint32_t start, int64_t most)
{
    assert(start < s->w->ground && s->w->waiting == 0);
    walks *w = s->w;
    for (uint32_t i = 0; i < s->reached_count; i++) {
        w->distance[s->reached[i]] = FAR;
        qw_queue_remove(&s->queue, s->reached[i]);
    }
    int64_t begin = s->queue.last;
    s->start = start, s->end = QW_NONE, s->most = begin + most;
    w->distance[start] = begin, w->from[start] = QW_NONE, s->hops[start] = 0;
    s->reached[0] = start, s->reached_count = 1;
    qw_queue_put(&s->queue, start, begin);
    for (uint32_t from; (from = qw_queue_take(&s->queue)) != QW_NONE && w->distance[from] <= s->most;)
        extend_from(s, from);
    return s->end == QW_NONE ? most : w->distance[s->end] - begin;
}

static void add_off(walk_search *s, uint32_t row, int32_t by)
{
    s->left -= abs(s->off[row]);
    s->off[row] += by;
    s->left += abs(s->off[row]);
}

/* Changes the variables along the walk that was found, and what is off in the rows on it. */
static void take_walk(walk_search *s)
{
    walks *w = s->w;
    for (uint32_t k = s->end; k != s->start; k = w->from[k]) {
        assert(w->from[k] != QW_NONE);
        uint32_t by = w->by[k];
        const link *l = &w->link[by / 2];
        int32_t rise = by & 1u ? 1 : -1;
        change(w, l->variable, rise);
        add_off(s, by / 6, l->sign * rise);
        if (l->far != QW_NONE) add_off(s, l->far, l->far_sign * rise);
    }
}

bool qw_close_offsets(qw_env *env, qw_complex *c, uint32_t longest, double most)
{
    assert(c->d);
    qw_scope_begin(env);
    walks w = make_walks(env, c, longest);
    uint32_t states = w.ground + 1;
    walk_search s = {.w = &w, .off = QW_NEW(env, int32_t, w.rows), .hops = QW_NEW(env, uint32_t, states)};
    s.queue = qw_queue_create(env, states), s.reached = QW_NEW(env, uint32_t, states);
    s.left = find_off(&w, s.off);
    for (uint32_t k = 0; k < states; k++) w.distance[k] = FAR;
    int64_t budget = (int64_t)(UNIT * fmin(most, FARTHEST));
    for (uint32_t row = 0; s.left > 0 && s.left <= MOST_OFF && row < w.rows;) {
        if (s.off[row] == 0) {
            row++;
            continue;
        }
        int64_t before = s.left;
        budget -= find_walk(&s, 2 * row + (s.off[row] > 0), budget);
        if (s.end == QW_NONE) break;
        take_walk(&s);
        if (s.left >= before) break;
    }
    qw_scope_end(env);
    return s.left == 0;
}

bool qw_step_offsets(qw_env *env, qw_complex *c, uint32_t v, int32_t by, uint32_t longest, double most)
{
    assert(!is_constrained(c, v));
    uint32_t e = v / 2;
    uint8_t fixed = c->fixed[e];
    if (v & 1u) c->d[e].y += by, c->fixed[e] |= QW_FIXED_Y;
    else c->d[e].x += by, c->fixed[e] |= QW_FIXED_X;
    bool closed = qw_close_offsets(env, c, longest, most);
    c->fixed[e] = fixed;
    return closed;
}
