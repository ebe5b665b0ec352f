#include "whole/strip.h"

#include "base/elementary.h"

#include <assert.h>
#include <string.h>

uint32_t qw_builder_vertex(qw_quad_builder *b, qw_vec3 position)
{
    b->position = qw_grow(b->env, b->position, &b->position_capacity, (size_t)b->vertex_count + 1, sizeof *b->position);
    b->position[b->vertex_count] = position;
    return b->vertex_count++;
}

void qw_builder_quad(qw_quad_builder *b, uint32_t p, uint32_t q, uint32_t r, uint32_t s)
{
    assert(p < b->vertex_count && q < b->vertex_count && r < b->vertex_count && s < b->vertex_count);
    b->corner = qw_grow(b->env, b->corner, &b->corner_capacity, 4 * ((size_t)b->face_count + 1), sizeof *b->corner);
    uint32_t *c = b->corner + 4 * (size_t)b->face_count++;
    c[0] = p, c[1] = q, c[2] = r, c[3] = s;
}

/* ---- cells */

enum { MOST_EDGES = 15 }; /* of one loop that are joined to one edge of the other; odd */

/* A cell with `edges` edges from base[0] to base[edges], which has its inside to the left, and one from t0 above
   base[0] to t1. The base is overwritten. */
static void fill_cell(qw_quad_builder *b, uint32_t *base, uint32_t edges, uint32_t t0, uint32_t t1)
{
    assert(edges % 2 == 1 && edges <= MOST_EDGES);
    for (uint32_t m = edges; m > 1; m -= 2) {
        uint32_t inner[MOST_EDGES];
        float up = 1.0f / (float)((m + 1) / 2);
        for (uint32_t k = 1; k < m; k++) {
            qw_vec3 above = qw_lerp(b->position[t0], b->position[t1], (float)k / (float)m);
            inner[k - 1] = qw_builder_vertex(b, qw_lerp(b->position[base[k]], above, up));
        }
        qw_builder_quad(b, base[0], base[1], inner[0], t0);
        for (uint32_t k = 1; k + 1 < m; k++) qw_builder_quad(b, base[k], base[k + 1], inner[k], inner[k - 1]);
        qw_builder_quad(b, base[m - 1], base[m], t1, inner[m - 2]);
        memcpy(base, inner, (m - 1) * sizeof *base);
    }
    qw_builder_quad(b, base[0], base[1], t1, t0);
}

/* ---- which edges go together */

/* The loops cut open at a pair of vertices that are joined. */
typedef struct opened {
    uint32_t p, q;          /* edges of the outer and the inner loop */
    const double *a;        /* double[p + 1]: places of the outer vertices */
    const double *c;        /* double[q + 1]: of the inner ones */
    const uint8_t *station; /* uint8_t[q + 1] */
    double *spacing;        /* double[q + 1]: by which distances are measured */
    uint32_t width;         /* of the band of outer vertices that an inner one may be joined to */
    uint32_t *first;        /* uint32_t[q + 1]: the band's first */
    float *cost;            /* float[q + 1][width]: of the best way to here */
    int8_t *move;           /* int8_t[q + 1][width]: the last cell on it: n > 0: n outer edges; n < 0: -n inner edges */
} opened;

static const float STATION = 50;      /* a station counts as much as so many others */
static const float IRREGULAR = 0.35f; /* times the square of the pairs of edges that end in a cell */

static float cost_of_node(const opened *o, uint32_t k, uint32_t c)
{
    double d = (o->a[k] - o->c[c]) / o->spacing[c];
    return (float)(d * d) * (o->station[c] ? STATION : 1);
}

static void reach(opened *o, uint32_t k, uint32_t c, float cost, int move)
{
    if (k > o->p || c > o->q || k < o->first[c] || k >= o->first[c] + o->width) return;
    size_t i = (size_t)c * o->width + (k - o->first[c]);
    cost += cost_of_node(o, k, c);
    if (cost < o->cost[i]) o->cost[i] = cost, o->move[i] = (int8_t)move;
}

/* Goes on by one more quad, or by a fan of several that makes a pair of irregular vertices, each at its cost. */
static void go_on(opened *o, uint32_t k, uint32_t c, float cost)
{
    assert(cost >= 0);
    float skipped = 0;
    for (uint32_t n = 1; n <= MOST_EDGES; n += 2) {
        float pairs = (float)(n / 2), irregular = IRREGULAR * pairs * pairs;
        reach(o, k + n, c + 1, cost + irregular, (int)n);
        for (uint32_t i = n > 1 ? n - 2 : 1; n > 1 && i < n && c + i <= o->q; i++)
            skipped += o->station[c + i] ? STATION : 0;
        if (n > 1) reach(o, k + 1, c + n, cost + irregular + skipped, -(int)n);
    }
}

/* Whether there is a way in bands of this width. */
static bool find_way(opened *o, qw_env *env, uint32_t width)
{
    o->width = width < o->p + 1 ? width : o->p + 1;
    size_t nodes = ((size_t)o->q + 1) * o->width;
    o->cost = QW_NEW(env, float, nodes), o->move = QW_NEW_ZERO(env, int8_t, nodes);
    uint32_t k = 0;
    for (uint32_t c = 0; c <= o->q; c++) {
        while (k < o->p && o->a[k] < o->c[c]) k++;
        uint32_t low = k > o->width / 2 ? k - o->width / 2 : 0, most = o->p + 1 - o->width;
        o->first[c] = c == 0 ? 0 : c == o->q || low > most ? most : low;
        assert(o->first[c] + o->width <= o->p + 1);
    }
    for (size_t i = 0; i < nodes; i++) o->cost[i] = INFINITY;
    o->cost[0] = 0;
    for (uint32_t c = 0; c < o->q; c++)
        for (uint32_t j = 0; j < o->width; j++) {
            float cost = o->cost[(size_t)c * o->width + j];
            if (cost < INFINITY) go_on(o, o->first[c] + j, c, cost);
        }
    return o->cost[(size_t)o->q * o->width + (o->p - o->first[o->q])] < INFINITY;
}

/* Fills the cells, from the last to the first. outer: uint32_t[p + 1], inner: uint32_t[q + 1], vertices. */
static void fill_cells(qw_quad_builder *b, const opened *o, const uint32_t *outer, const uint32_t *inner)
{
    uint32_t k = o->p, c = o->q, base[MOST_EDGES + 1];
    while (k > 0 || c > 0) {
        int move = o->move[(size_t)c * o->width + (k - o->first[c])];
        assert(move != 0);
        if (move > 0) {
            uint32_t n = (uint32_t)move;
            k -= n, c--;
            memcpy(base, outer + k, (n + 1) * sizeof *base);
            fill_cell(b, base, n, inner[c], inner[c + 1]);
        } else {
            uint32_t n = (uint32_t)-move;
            k--, c -= n;
            for (uint32_t i = 0; i <= n; i++) base[i] = inner[c + n - i];
            fill_cell(b, base, n, outer[k + 1], outer[k]);
        }
    }
}

/* The outer vertex that lies nearest to the first inner one. */
static uint32_t find_start(const qw_ring *outer, double at, double period)
{
    assert(outer->count > 0 && period > 0);
    uint32_t best = 0;
    double least = INFINITY;
    for (uint32_t i = 0; i < outer->count; i++) {
        double d = fabs(qw_remainder(outer->at[i] - at, period));
        if (d < least) least = d, best = i;
    }
    return best;
}

/* The ring from vertex `start` on, once around: uint32_t[count + 1]; places shifted so that the first is nearest to
   `near`. */
static uint32_t *unroll(qw_env *env, const qw_ring *r, uint32_t start, double period, double near, double *at)
{
    assert(r->count > 0 && start < r->count);
    uint32_t *vertex = QW_NEW(env, uint32_t, (size_t)r->count + 1);
    double shift = period * qw_floor((near - r->at[start]) / period + 0.5);
    for (uint32_t i = 0; i <= r->count; i++) {
        uint32_t k = (start + i) % r->count;
        vertex[i] = r->vertex[k];
        at[i] = r->at[k] + shift + (start + i >= r->count ? period : 0);
    }
    return vertex;
}

void qw_fill_strip(qw_quad_builder *b, const qw_ring *outer, const qw_ring *inner, double period)
{
    assert(outer->count > 0 && inner->count > 0 && (outer->count - inner->count) % 2 == 0);
    qw_env *env = b->env;
    uint32_t p = outer->count, q = inner->count;
    double *a = QW_NEW(env, double, (size_t)p + 1), *c = QW_NEW(env, double, (size_t)q + 1);
    uint32_t *in = unroll(env, inner, 0, period, inner->at[0], c),
             *out = unroll(env, outer, find_start(outer, inner->at[0], period), period, inner->at[0], a);
    opened o = {p, q, a, c, NULL, QW_NEW(env, double, (size_t)q + 1), 0, QW_NEW(env, uint32_t, (size_t)q + 1), 0, 0};
    uint8_t *station = QW_NEW_ZERO(env, uint8_t, (size_t)q + 1);
    for (uint32_t i = 0; i <= q; i++) {
        double around = (i < q ? c[i + 1] - c[i] : c[1] - c[0]) + (i > 0 ? c[i] - c[i - 1] : c[q] - c[q - 1]);
        o.spacing[i] = fmax(fmax(around / 2, period / p), 1e-9 * period);
        station[i] = inner->station && inner->station[i % q];
    }
    o.station = station;
    uint32_t width = 64;
    while (!find_way(&o, env, width)) {
        if (o.width > p)
            qw_fail(env, QW_INTERNAL, -1, "a rim of %u edges cannot be joined to quads with %u edges there", p, q);
        qw_free(env, o.cost), qw_free(env, o.move);
        width *= 4;
    }
    fill_cells(b, &o, out, in);
    qw_free(env, a), qw_free(env, c), qw_free(env, in), qw_free(env, out), qw_free(env, station);
    qw_free(env, o.spacing), qw_free(env, o.first), qw_free(env, o.cost), qw_free(env, o.move);
}
