#include "remesh/quantise/touching.h"

#include "base/constants.h"
#include "base/sets.h"
#include "remesh/quantise/circuits.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Changes of one variable by 1 that are tried where curves touch, the cheapest. */
enum { STEPS = 8 };
/* Quads: a variable nearer to its real value than this is not changed, as no step would be towards it. */
static const float NEAR = 1e-3f;

/* Two lattice points that become one vertex of the quads: `face` is the triangle without an area in which they lie at
   one place, and `edge` is QW_NONE; or `edge` is the edge without a length between them, and `face` is QW_NONE. */
typedef struct arc {
    uint32_t a, b, face, edge;
} arc;

/* The lattice points that may become one with others: the vertices, then the points inside edges of triangles without
   an area. */
typedef struct points {
    const qw_component *component;
    const qw_complex *c; /* of the component, with the offsets that are looked at */
    uint32_t count;
    uint32_t *first;  /* [edges] the first of the edge's inner points, in the direction of its first half-edge; QW_NONE:
                         it has none */
    uint32_t *parent; /* [count] union-find of points that become one vertex */
    arc *arc;
    uint32_t arc_count;
    size_t arc_room;
} points;

static bool is_curve(const qw_complex *c, uint32_t e) { return c->fixed[e] || c->side[2 * e + 1] == QW_NONE; }

static int32_t divisor(int32_t a, int32_t b)
{
    a = abs(a), b = abs(b);
    while (b) {
        int32_t rest = a % b;
        a = b, b = rest;
    }
    return a;
}

static int32_t steps_of(qw_int2 d) { return divisor(d.x, d.y); }

static bool is_flat(const qw_complex *c, uint32_t f)
{
    return qw_int2_det(qw_steps_along(c, 3 * f), qw_steps_along(c, 3 * f + 1)) == 0;
}

/* The point that lies `step` lattice steps along half-edge h from its tail. */
static uint32_t point_at(const points *p, uint32_t h, int32_t step)
{
    const qw_complex *c = p->c;
    uint32_t e = c->edge[h];
    int32_t n = steps_of(c->d[e]);
    if (step == 0) return p->component->decimated.corner[h];
    if (step == n) return p->component->decimated.corner[qw_next(h)];
    return p->first[e] + (uint32_t)((c->side[2 * e] == h ? step : n - step) - 1);
}

static void join(qw_env *env, points *p, uint32_t a, uint32_t b, uint32_t face, uint32_t edge)
{
    p->arc = qw_grow(env, p->arc, &p->arc_room, p->arc_count + 1, sizeof *p->arc);
    p->arc[p->arc_count++] = (arc){a, b, face, edge};
    qw_join_sets(p->parent, a, b);
}

/* Folds a triangle without an area: the points of its longest side become one with those of the two others, which
   together have as many steps. */
static void fold(qw_env *env, points *p, uint32_t f)
{
    assert(f < p->c->face_count);
    const qw_complex *c = p->c;
    uint32_t longest = 3 * f;
    for (uint32_t h = 3 * f + 1; h < 3 * f + 3; h++)
        if (steps_of(c->d[c->edge[h]]) > steps_of(c->d[c->edge[longest]])) longest = h;
    int32_t n = steps_of(c->d[c->edge[longest]]), last = steps_of(c->d[c->edge[qw_prev(longest)]]);
    for (int32_t k = 1; k < n; k++) {
        uint32_t other = k <= last ? point_at(p, qw_prev(longest), last - k) : point_at(p, qw_next(longest), n - k);
        join(env, p, point_at(p, longest, k), other, f, QW_NONE);
    }
}

/* The lattice points on the edges of the complex, joined where edges without length or flat triangles make them
 * one. */
static points make_points(qw_env *env, const qw_component *component, const qw_complex *c)
{
    points p = {.component = component, .c = c, .count = component->vertex_count};
    p.first = QW_NEW(env, uint32_t, c->edge_count);
    memset(p.first, 0xff, c->edge_count * sizeof *p.first);
    for (uint32_t h = 0; h < 3 * c->face_count; h++) {
        uint32_t e = c->edge[h];
        int32_t n = steps_of(c->d[e]);
        if (p.first[e] != QW_NONE || n < 2 || !is_flat(c, h / 3)) continue;
        p.first[e] = p.count, p.count += (uint32_t)n - 1;
    }
    p.parent = QW_NEW(env, uint32_t, p.count);
    qw_sets_begin(p.parent, p.count);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        uint32_t h = c->side[2 * e];
        if (qw_int2_is_zero(c->d[e]))
            join(env, &p, point_at(&p, h, 0), component->decimated.corner[qw_next(h)], QW_NONE, e);
    }
    for (uint32_t f = 0; f < c->face_count; f++)
        if (is_flat(c, f)) fold(env, &p, f);
    return p;
}

/* What meets at one vertex of the quads; stands at the root of its set of points. contacts: pieces of curves, where two
   points of one curve are one piece if an edge of that curve without a length joins them. */
typedef struct place {
    int32_t contacts, corners;
} place;

/* How many curves meet at each place, a set of points, beyond those that are joined there anyway; and its corners.
 * */
static place *find_places(qw_env *env, points *p)
{
    const qw_complex *c = p->c;
    const qw_component *component = p->component;
    place *at = QW_NEW_ZERO(env, place, p->count);
    uint8_t *on_curve = QW_NEW_ZERO(env, uint8_t, p->count);
    uint32_t *curve = QW_NEW(env, uint32_t, p->count);
    qw_sets_begin(curve, p->count);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!is_curve(c, e)) continue;
        uint32_t h = c->side[2 * e], a = component->decimated.corner[h], b = component->decimated.corner[qw_next(h)];
        on_curve[a] = on_curve[b] = 1;
        for (int32_t k = 1; p->first[e] != QW_NONE && k < steps_of(c->d[e]); k++) on_curve[point_at(p, h, k)] = 1;
        if (qw_int2_is_zero(c->d[e]) && qw_join_sets(curve, a, b)) at[qw_set_of(p->parent, a)].contacts--;
    }
    for (uint32_t i = 0; i < p->count; i++) {
        place *k = &at[qw_set_of(p->parent, i)];
        k->contacts += on_curve[i];
        k->corners += i < component->vertex_count && component->constraint && on_curve[i] &&
                      component->constraint[i] == QW_VERTEX_CORNER;
    }
    qw_free(env, on_curve), qw_free(env, curve);
    return at;
}

static uint32_t touching_at(const place *k)
{
    return (uint32_t)((k->contacts > 1 ? k->contacts - 1 : 0) + (k->corners > 1 ? k->corners - 1 : 0));
}

static uint32_t count_all(const points *p, const place *at)
{
    uint32_t sum = 0;
    for (uint32_t i = 0; i < p->count; i++) sum += touching_at(&at[i]);
    return sum;
}

static uint32_t count_touching(qw_env *env, const qw_component *component, const qw_complex *c)
{
    qw_scope_begin(env);
    points p = make_points(env, component, c);
    uint32_t count = count_all(&p, find_places(env, &p));
    qw_scope_end(env);
    return count;
}

uint32_t qw_count_touching(qw_env *env, const qw_component *component, const qw_int2 *d)
{
    assert(d && component->decimated.corner);
    qw_complex c = component->decimated.complex;
    c.d = (qw_int2 *)d;
    return count_touching(env, component, &c);
}

/* ---- signs */

/* Quads. Shorter distances and lengths get no sign: they are rounding errors of the closed solve, or lie where one
   curve ends on another. */
static const float LEAST_LENGTH = 0.1f;

static float free_length(const qw_complex *c, uint32_t e)
{
    return c->fixed[e] & QW_FIXED_X ? fabsf(c->real[e].y) : fabsf(c->real[e].x);
}

static void set_sign(qw_complex *c, uint32_t e, unsigned k)
{
    float x = k ? c->real[e].y : c->real[e].x;
    if (c->fixed[e] & (k ? QW_FIXED_Y : QW_FIXED_X) || fabsf(x) < LEAST_LENGTH) return;
    c->at_least[2 * e + k] = x > 0 ? 1 : -1;
}

/* Of each stretch of a feature curve between two corners, the longest edge gets a sign. degree: uint8_t[vertices],
   feature edges at each. */
static void sign_lengths(qw_env *env, qw_component *component, const uint8_t *degree)
{
    qw_complex *c = &component->decimated.complex;
    const uint32_t *corner = component->decimated.corner;
    uint32_t n = component->vertex_count, *chain = QW_NEW(env, uint32_t, c->edge_count),
             *last = QW_NEW(env, uint32_t, n), *longest = QW_NEW(env, uint32_t, c->edge_count);
    qw_sets_begin(chain, c->edge_count);
    memset(last, 0xff, n * sizeof *last), memset(longest, 0xff, c->edge_count * sizeof *longest);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        uint32_t h = c->side[2 * e], ends[2] = {corner[h], corner[qw_next(h)]};
        for (int i = 0; i < 2 && c->fixed[e]; i++) {
            uint32_t v = ends[i];
            if (degree[v] != 2 || (component->constraint && component->constraint[v] == QW_VERTEX_CORNER)) continue;
            if (last[v] != QW_NONE) qw_join_sets(chain, last[v], e);
            last[v] = e;
        }
    }
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!c->fixed[e]) continue;
        uint32_t *most = &longest[qw_set_of(chain, e)];
        if (*most == QW_NONE || free_length(c, e) > free_length(c, *most)) *most = e;
    }
    for (uint32_t e = 0; e < c->edge_count; e++)
        if (longest[e] != QW_NONE) set_sign(c, longest[e], c->fixed[longest[e]] & QW_FIXED_X ? 1 : 0);
}

void qw_set_signs(qw_env *env, qw_component *component)
{
    qw_complex *c = &component->decimated.complex;
    const uint32_t *corner = component->decimated.corner;
    c->at_least = QW_NEW_ZERO(env, int8_t, 2 * (size_t)c->edge_count);
    qw_scope_begin(env);
    uint8_t *degree = QW_NEW_ZERO(env, uint8_t, component->vertex_count);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!c->fixed[e]) continue;
        uint32_t h = c->side[2 * e], a = corner[h], b = corner[qw_next(h)];
        degree[a] += degree[a] < UINT8_MAX, degree[b] += degree[b] < UINT8_MAX;
    }
    sign_lengths(env, component, degree);
    for (uint32_t h = 0; h < 3 * c->face_count; h++) {
        uint32_t e = c->edge[h], sides[2] = {qw_next(h), qw_prev(h)};
        if ((c->fixed[e] != QW_FIXED_X && c->fixed[e] != QW_FIXED_Y) || !degree[corner[sides[1]]]) continue;
        for (int i = 0; i < 2; i++)
            set_sign(c, c->edge[sides[i]], (c->fixed[e] == QW_FIXED_Y) ^ ((c->rot[h] + c->rot[sides[i]]) & 1u));
    }
    qw_scope_end(env);
}

/* ---- parting */

/* A change of a variable, 2 edge + (it is y), by 1 or -1 towards its real value; cost: of rounding, before the offsets
   are closed again. */
typedef struct step {
    uint32_t variable;
    int32_t by;
    double cost;
} step;

typedef struct parting {
    const qw_component *component;
    qw_complex c; /* own offsets and constraints */
    uint32_t touching, inverted;
    uint8_t *failed; /* uint8_t[faces + edges] places at which no step helps, named by the face or the edge (+ faces) of
                        their first arc */
    qw_int2 *had, *best;
    step step[STEPS];
    uint32_t step_count;
} parting;

/* Adds the step of a variable to the list of the STEPS cheapest, which is sorted by cost. */
static void add_step(parting *q, uint32_t variable)
{
    const qw_complex *c = &q->c;
    uint32_t e = variable / 2;
    bool is_y = variable & 1u;
    if (c->fixed[e] & (is_y ? QW_FIXED_Y : QW_FIXED_X)) return;
    float off = is_y ? c->real[e].y - (float)c->d[e].y : c->real[e].x - (float)c->d[e].x;
    if (!(fabsf(off) > NEAR)) return;
    step s = {variable, off > 0 ? 1 : -1, (double)(c->weight ? c->weight[e] : 1) * (1 - 2 * fabs((double)off))};
    uint32_t at = q->step_count;
    for (uint32_t i = 0; i < q->step_count; i++)
        if (q->step[i].variable == variable) return;
    while (at > 0 && q->step[at - 1].cost > s.cost) at--;
    if (at == STEPS) return;
    if (q->step_count < STEPS) q->step_count++;
    for (uint32_t i = q->step_count - 1; i > at; i--) q->step[i] = q->step[i - 1];
    q->step[at] = s;
}

/* Finds a place at which curves touch and which has not failed, lists its steps in q->step and returns its name (see
   `failed`); QW_NONE: there is none. */
static uint32_t next_place(qw_env *env, parting *q)
{
    qw_scope_begin(env);
    points p = make_points(env, q->component, &q->c);
    const place *at = find_places(env, &p);
    uint32_t root = QW_NONE, name = QW_NONE;
    q->step_count = 0;
    for (uint32_t i = 0; i < p.arc_count; i++) {
        const arc *a = &p.arc[i];
        uint32_t r = qw_set_of(p.parent, a->a), key = a->face != QW_NONE ? a->face : q->c.face_count + a->edge;
        if (root == QW_NONE && touching_at(&at[r]) && !q->failed[key]) root = r, name = key;
        if (r != root) continue;
        if (a->face == QW_NONE) add_step(q, 2 * a->edge), add_step(q, 2 * a->edge + 1);
        for (uint32_t h = 3 * a->face; a->face != QW_NONE && h < 3 * a->face + 3; h++)
            add_step(q, 2 * q->c.edge[h]), add_step(q, 2 * q->c.edge[h] + 1);
    }
    qw_scope_end(env);
    return name;
}

/* Changes the variable and closes the offsets by others. Returns whether fewer curves touch then and no more triangles
   are inverted. */
static bool attempt(qw_env *env, parting *q, const step *s, uint32_t *touching)
{
    qw_complex *c = &q->c;
    bool closed = qw_step_offsets(env, c, s->variable, s->by, QW_LONGEST_WALK, QW_MOST_WALK_COST);
    if (!closed || qw_complex_inverted(c) > q->inverted) return false;
    *touching = count_touching(env, q->component, c);
    return *touching < q->touching;
}

/* Tries the steps of a place, each from the same offsets, and takes the one after which the cost of rounding is least.
   Returns whether there is one that helps. */
static bool part_place(qw_env *env, parting *q)
{
    size_t bytes = q->c.edge_count * sizeof *q->c.d;
    double least = INFINITY;
    uint32_t touching, left = q->touching;
    memcpy(q->had, q->c.d, bytes);
    for (uint32_t i = 0; i < q->step_count; i++) {
        if (attempt(env, q, &q->step[i], &touching)) {
            double cost = qw_complex_cost(&q->c);
            if (cost < least) least = cost, left = touching, memcpy(q->best, q->c.d, bytes);
        }
        memcpy(q->c.d, q->had, bytes);
    }
    if (left == q->touching) return false;
    memcpy(q->c.d, q->best, bytes);
    q->touching = left;
    return true;
}

uint32_t qw_part_curves(qw_env *env, const qw_component *component, const qw_real2 *real, qw_int2 *d, double *work)
{
    assert(real && d && work);
    const qw_complex *c = &component->decimated.complex;
    qw_scope_begin(env);
    parting q = {.component = component, .c = *c};
    q.c.d = d, q.c.real = (qw_real2 *)real;
    q.c.fixed = QW_NEW(env, uint8_t, c->edge_count);
    memcpy(q.c.fixed, c->fixed, c->edge_count);
    q.failed = QW_NEW_ZERO(env, uint8_t, (size_t)c->face_count + c->edge_count);
    q.had = QW_NEW(env, qw_int2, c->edge_count), q.best = QW_NEW(env, qw_int2, c->edge_count);
    q.touching = count_touching(env, component, &q.c), q.inverted = qw_complex_inverted(&q.c);
    while (q.touching > 0 && *work > 0) {
        uint32_t name = next_place(env, &q);
        if (name == QW_NONE) break;
        qw_heartbeat(env);
        *work -= (double)(q.step_count + 1) * c->face_count;
        q.failed[name] = !part_place(env, &q);
    }
    qw_scope_end(env);
    return q.touching;
}
