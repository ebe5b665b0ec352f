#include "remesh/quantise/bidirected.h"

#include "solve/hub.h"

#include <assert.h>
#include <string.h>

/* A path of this cost crosses a thousand edges. The few supplies that need longer paths take most of the time of an
   exact solution; they are left to the network with frozen variables. */
enum { FARTHEST = 4000 };

/* The two rows of a variable and the signs (with the rows' own) with which it appears there; node[1] is QW_NONE at the
 * ground. */
typedef struct ends {
    uint32_t node[2];
    int sign[2];
} ends;

/* The rows that a variable appears in, and its sign in each. */
static ends ends_of(const qw_network *net, const qw_complex *c, uint32_t variable)
{
    ends x = {{QW_NONE, QW_NONE}, {0, 0}};
    for (int i = 0; i < 2; i++) {
        uint32_t h = c->side[2 * (variable / 2) + (uint32_t)i];
        if (h == QW_NONE) continue;
        qw_row row = qw_row_of(c->rot[h], variable & 1u);
        x.node[i] = 2 * (h / 3) + row.row;
        x.sign[i] = row.sign * net->sign[x.node[i]];
    }
    return x;
}

/* The double cover: copy n of a row, copy n + rows of its negative, and one ground for both. Four arcs a variable: up,
   up mirrored, down, down mirrored. */
typedef struct cover {
    uint32_t rows, count;
    uint32_t *variable; /* [count] */
    uint32_t *tail, *head;
    int32_t *capacity, *cost, *flow, *supply;
} cover;

/* The copy of the end's row that gains when the variable rises: the row itself where it appears with +, else the
 * negative. */
static uint32_t gaining(const cover *k, const ends *x, int i)
{
    if (x->node[i] == QW_NONE) return 2 * k->rows;
    return x->sign[i] > 0 ? x->node[i] : x->node[i] + k->rows;
}
static uint32_t losing(const cover *k, const ends *x, int i)
{
    if (x->node[i] == QW_NONE) return 2 * k->rows;
    return x->sign[i] > 0 ? x->node[i] + k->rows : x->node[i];
}

static void set_arc(cover *k, uint32_t at, uint32_t tail, uint32_t head, int32_t cost)
{
    k->tail[at] = tail, k->head[at] = head, k->capacity[at] = 1, k->cost[at] = cost;
}

/* The flow problem on two copies of the rows, one that gains and one that loses: its half solves the bidirected
 * one. */
static cover build_cover(qw_env *env, const qw_network *net, const qw_complex *c, qw_step_cost step_cost,
                         const void *user)
{
    assert(net->node_count == 2 * c->face_count + 1);
    cover k = {.rows = net->node_count - 1};
    k.variable = QW_NEW(env, uint32_t, (size_t)2 * c->edge_count);
    for (uint32_t v = 0; v < 2 * c->edge_count; v++)
        if (!qw_is_fixed(c->fixed[v / 2], v)) k.variable[k.count++] = v;
    size_t arcs = (size_t)4 * k.count;
    k.tail = QW_NEW(env, uint32_t, arcs), k.head = QW_NEW(env, uint32_t, arcs);
    k.capacity = QW_NEW(env, int32_t, arcs), k.cost = QW_NEW(env, int32_t, arcs),
    k.flow = QW_NEW_ZERO(env, int32_t, arcs);
    k.supply = QW_NEW_ZERO(env, int32_t, (size_t)2 * k.rows + 1);
    for (uint32_t i = 0; i < k.count; i++) {
        ends x = ends_of(net, c, k.variable[i]);
        int32_t up = step_cost(user, k.variable[i], 1), down = step_cost(user, k.variable[i], -1);
        /* where the variable rises both ends gain; an arc leads from the copy of one end that loses to the copy of
           the other end that gains */
        set_arc(&k, 4 * i, losing(&k, &x, 0), gaining(&k, &x, 1), up);
        set_arc(&k, 4 * i + 1, losing(&k, &x, 1), gaining(&k, &x, 0), up);
        set_arc(&k, 4 * i + 2, gaining(&k, &x, 1), losing(&k, &x, 0), down);
        set_arc(&k, 4 * i + 3, gaining(&k, &x, 0), losing(&k, &x, 1), down);
    }
    for (uint32_t f = 0; f < c->face_count; f++) {
        qw_int2 r = qw_complex_residual(c, f);
        for (uint32_t row = 0; row < 2; row++) {
            uint32_t n = 2 * f + row;
            k.supply[n] = net->sign[n] * (row ? r.y : r.x);
            k.supply[n + k.rows] = -k.supply[n];
        }
    }
    return k;
}

static void change(qw_complex *c, uint32_t variable, int32_t by)
{
    if (variable & 1u) c->d[variable / 2].y += by;
    else c->d[variable / 2].x += by;
}

/* ---- rounding of the half variables */

typedef struct rounding {
    const qw_network *net;
    qw_complex *c;
    const uint32_t *variable; /* [count] half variables */
    int8_t *half;             /* [count] twice the value that was solved: odd; 0 once rounded */
    uint32_t *first;          /* [rows] head of the list of ends at each row, 2 i + side, or QW_NONE */
    uint32_t *next;           /* [2 count] */
} rounding;

static bool take_end(rounding *r, uint32_t node, uint32_t *end)
{
    assert(node < r->net->node_count);
    for (uint32_t e = r->first[node]; e != QW_NONE; e = r->next[e])
        if (r->half[e / 2]) {
            *end = e;
            return true;
        }
    return false;
}

/* Rounds variable i so that it moves by `toward` half steps (+1 or -1) from its half value. */
static void round_variable(rounding *r, uint32_t i, int toward)
{
    change(r->c, r->variable[i], (r->half[i] + toward) / 2);
    r->half[i] = 0;
}

/* Follows the half variables from one end: each next one undoes at their common row what the last did. Returns whether
 * it closed. */
static bool round_path(rounding *r, uint32_t start)
{
    uint32_t i = start / 2, side = start & 1u;
    ends x = ends_of(r->net, r->c, r->variable[i]);
    uint32_t home = x.node[side];
    int toward = 1, home_effect = x.node[side] == QW_NONE ? 0 : toward * x.sign[side];
    for (;;) {
        round_variable(r, i, toward);
        uint32_t at = x.node[1 - side], end;
        if (at == QW_NONE) return home == QW_NONE;
        int effect = toward * x.sign[1 - side];
        if (at == home && effect + home_effect == 0) return true;
        if (!take_end(r, at, &end)) return at == home && effect + home_effect == 0;
        i = end / 2, side = end & 1u;
        x = ends_of(r->net, r->c, r->variable[i]);
        toward = -effect * x.sign[side];
    }
}

/* Rounds the paths of half units, those that end at the ground first. Returns how many could not be. */
static int64_t round_halves(rounding *r, uint32_t count)
{
    assert(count <= 2 * r->c->edge_count);
    int64_t odd = 0;
    for (uint32_t pass = 0; pass < 2; pass++) /* paths from the ground first */
        for (uint32_t i = 0; i < count; i++) {
            if (!r->half[i]) continue;
            bool grounded = r->c->side[2 * (r->variable[i] / 2) + 1] == QW_NONE;
            if (pass == 0 && !grounded) continue;
            odd += !round_path(r, 2 * i + (grounded ? 1u : 0u));
        }
    return odd;
}

qw_bidirected_counts qw_solve_bidirected(qw_env *env, const qw_network *net, qw_complex *c, qw_step_cost step_cost,
                                         const void *user, int64_t *potential)
{
    qw_bidirected_counts counts = {0};
    qw_scope_begin(env);
    cover k = build_cover(env, net, c, step_cost, user);
    qw_flow_problem problem = {2 * k.rows + 1, 4 * k.count, k.tail, k.head, k.capacity, k.cost, k.supply};
    assert(problem.node_count == QW_POTENTIALS(c->face_count));
    if (!potential) potential = QW_NEW_ZERO(env, int64_t, problem.node_count);
    qw_flow_min_cost_hub(env, &problem, 2 * k.rows, FARTHEST, k.flow, potential);
    rounding r = {.net = net, .c = c, .variable = k.variable};
    r.half = QW_NEW_ZERO(env, int8_t, k.count);
    r.next = QW_NEW(env, uint32_t, (size_t)2 * k.count);
    r.first = QW_NEW(env, uint32_t, k.rows);
    memset(r.first, 0xff, k.rows * sizeof *r.first);
    for (uint32_t i = 0; i < k.count; i++) {
        const int32_t *f = k.flow + 4 * (size_t)i;
        int32_t twice = f[0] + f[1] - f[2] - f[3];
        if (twice % 2 == 0) {
            change(c, k.variable[i], twice / 2);
            continue;
        }
        r.half[i] = (int8_t)twice;
        counts.half_variables++;
        ends x = ends_of(net, c, k.variable[i]);
        for (uint32_t s = 0; s < 2; s++)
            if (x.node[s] != QW_NONE) r.next[2 * i + s] = r.first[x.node[s]], r.first[x.node[s]] = 2 * i + s;
    }
    counts.odd_cycles = round_halves(&r, k.count);
    qw_scope_end(env);
    return counts;
}
