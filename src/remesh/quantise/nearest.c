/* Lattice points near a point, after Fincke and Pohst 1985 and Schnorr and Euchner 1994: the moves are made orthogonal
 * one after the other; what the last ones add to the cost does not depend on those before, so that a sum is given up as
 * soon as its last terms cost too much. Moves are made short first, by taking multiples of one from another. */
#include "remesh/quantise/nearest.h"

#include "remesh/quantise/closed_moves.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The bound of the cost is raised by GROWTH so often at most. */
static const double GROWTH = 1.5;
enum { MOST_ROUNDS = 24, MOST_REDUCTIONS = 64, MOST_MOVES = 32 };
/* A move is shortened by another where its component along that is more than this, in lengths of that one. */
static const double SHORTENED = 0.51;

typedef struct enumeration {
    qw_complex *c;
    const qw_nearest_request *request;
    uint32_t moves, visited;
    qw_int2 *move;       /* qw_int2[moves][edges] */
    double *r, *aim;     /* double[moves][moves] above the diagonal and on it, double[moves] */
    double inner, outer; /* bounds of the cost */
    int32_t times[MOST_MOVES];
} enumeration;

static void add_move(qw_complex *c, qw_int2 *to, const qw_int2 *move, int32_t times)
{
    for (uint32_t e = 0; e < c->edge_count; e++) to[e].x += times * move[e].x, to[e].y += times * move[e].y;
}

static double product(const qw_complex *c, const qw_int2 *a, const qw_int2 *b)
{
    double sum = 0;
    for (uint32_t e = 0; e < c->edge_count; e++)
        sum += (double)c->weight[e] * ((double)a[e].x * b[e].x + (double)a[e].y * b[e].y);
    return sum;
}

/* Products of the moves with one another, NAN where they have changed since: double[moves][moves]. */
static void forget_products(uint32_t moves, double *known, uint32_t changed)
{
    for (uint32_t i = 0; i < moves; i++) known[changed * moves + i] = known[i * moves + changed] = NAN;
}

static double known_product(const enumeration *n, double *known, uint32_t i, uint32_t j)
{
    double *p = &known[i * n->moves + j];
    if (isnan(*p))
        *p = known[j * n->moves + i] = product(n->c, n->move + (size_t)i * n->c->edge_count,
                                               n->move + (size_t)j * n->c->edge_count);
    return *p;
}

/* Subtracts moves from one another as long as that makes them shorter: a reduced basis. */
static void shorten_moves(qw_env *env, enumeration *n)
{
    double *known = QW_NEW(env, double, (size_t)n->moves * n->moves);
    for (uint32_t i = 0; i < n->moves; i++) forget_products(n->moves, known, i);
    bool shorter = true;
    for (int round = 0; shorter && round < MOST_REDUCTIONS; round++) {
        shorter = false;
        for (uint32_t k = 0; k < n->moves * n->moves; k++) {
            uint32_t a = k / n->moves, b = k % n->moves;
            double share = a == b ? 0 : known_product(n, known, a, b) / known_product(n, known, b, b);
            if (fabs(share) < SHORTENED) continue;
            add_move(n->c, n->move + (size_t)a * n->c->edge_count, n->move + (size_t)b * n->c->edge_count,
                     -(int32_t)qw_round_away(share));
            forget_products(n->moves, known, a);
            shorter = true;
        }
    }
}

/* Fills r and aim by Gram and Schmidt's method. */
static void make_orthogonal(qw_env *env, enumeration *n)
{
    const qw_complex *c = n->c;
    uint32_t rows = 2 * c->edge_count;
    double *axis = QW_NEW(env, double, (size_t)n->moves *rows);
    for (uint32_t i = 0; i < n->moves; i++) {
        double *a = axis + (size_t)i * rows, length = 0;
        const qw_int2 *move = n->move + (size_t)i * c->edge_count;
        for (uint32_t k = 0; k < rows; k++)
            a[k] = sqrt((double)c->weight[k / 2]) * (k % 2 ? move[k / 2].y : move[k / 2].x);
        for (uint32_t j = 0; j < i; j++) {
            const double *b = axis + (size_t)j * rows;
            double sum = 0;
            for (uint32_t k = 0; k < rows; k++) sum += a[k] * b[k];
            for (uint32_t k = 0; k < rows; k++) a[k] -= sum * b[k];
            n->r[j * n->moves + i] = sum;
        }
        for (uint32_t k = 0; k < rows; k++) length += a[k] * a[k];
        length = n->r[i * n->moves + i] = sqrt(length);
        n->aim[i] = 0;
        for (uint32_t k = 0; k < rows; k++) {
            double off = k % 2 ? (double)c->real[k / 2].y - c->d[k / 2].y : (double)c->real[k / 2].x - c->d[k / 2].x;
            a[k] /= length;
            n->aim[i] += a[k] * sqrt((double)c->weight[k / 2]) * off;
        }
    }
}

/* Visits the sums of moves in which how often the moves from `index` on are taken is decided; these cost so much. */
static void visit_below(qw_env *env, enumeration *n, uint32_t index, double cost)
{
    assert(index <= n->moves);
    if (index == 0) {
        if (cost <= n->inner) return;
        n->visited++;
        for (uint32_t i = 0; i < n->moves; i++)
            if (n->times[i]) add_move(n->c, n->c->d, n->move + (size_t)i * n->c->edge_count, n->times[i]);
        n->request->visit(env, n->request->user);
        for (uint32_t i = 0; i < n->moves; i++)
            if (n->times[i]) add_move(n->c, n->c->d, n->move + (size_t)i * n->c->edge_count, -n->times[i]);
        return;
    }
    uint32_t k = index - 1;
    const double *r = n->r + (size_t)k * n->moves;
    double middle = n->aim[k];
    for (uint32_t j = index; j < n->moves; j++) middle -= r[j] * n->times[j];
    middle /= r[k];
    int32_t first = (int32_t)qw_round_away(middle), side = middle > first ? 1 : -1;
    for (int32_t i = 0; n->visited < n->request->most; i++) { /* from the middle outward, to both sides in turn */
        n->times[k] = first + (i % 2 ? side : -side) * ((i + 1) / 2);
        double off = (n->times[k] - middle) * r[k], sum = cost + off * off;
        if (sum > n->outer) return;
        visit_below(env, n, k, sum);
    }
}

uint32_t qw_visit_nearest(qw_env *env, qw_complex *c, const qw_nearest_request *request)
{
    assert(c->weight && request->visit);
    qw_scope_begin(env);
    enumeration n = {.c = c, .request = request, .inner = -1};
    n.moves = qw_find_moves(env, c, MOST_MOVES, &n.move);
    n.r = QW_NEW(env, double, (size_t)n.moves *n.moves), n.aim = QW_NEW(env, double, n.moves);
    shorten_moves(env, &n);
    make_orthogonal(env, &n);
    /* The bound begins where it may hold no offsets yet: those visited before `most` is reached are the cheapest. */
    for (uint32_t i = 0; i < n.moves; i++) {
        double half = n.r[i * n.moves + i] / 2;
        n.outer = i == 0 ? half * half : fmin(n.outer, half * half);
    }
    for (int round = 0; round < MOST_ROUNDS && n.moves > 0 && n.inner < request->farthest; round++) {
        n.outer = fmin(n.outer, request->farthest);
        visit_below(env, &n, n.moves, 0);
        n.inner = n.outer, n.outer *= GROWTH;
    }
    qw_scope_end(env);
    return n.visited;
}
