#include "products/exact/rows.h"

#include "geometry/go_back.h"
#include "base/mechanisms.h"
#include "products/exact/ease.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* In edges: how far a vertex may move; MOST_AROUND on a circle or a line, as those around it move along. */
static const double MOST = 0.5, MOST_AROUND = 0.7;
/* In the frame: vertices of one circle differ by less in height and radius. */
static const double ONE_CIRCLE = 1e-6;
/* One less the cosine between axes that are parallel. */
static const double PARALLEL = 1e-9;
/* In edges: a row around an axis is one whose vertices differ by less in height. */
static const double ONE_ROW = 0.7;

enum { SWEEPS = 24 }; /* of spreading ways: vertices farther off stay */
/* The least sine of the corners of a quad that may still become worse. */
static const double GOOD = 0.3;

/* Vertices that follow one another on a circle. */
typedef struct circle {
    uint32_t begin, count; /* vertex[begin .. begin + count) */
    uint32_t item;         /* the cylinder or cone about whose axis it is */
    bool is_closed;
    double phase, step;    /* angle of vertex i: phase + i step */
    uint32_t root, joined; /* the first of those that lines join to it, their number */
} circle;

typedef struct evening {
    qw_env *env;
    const qw_quadmesh *quads;
    const qw_held *held;
    uint32_t (*next)[2]; /* uint32_t[vertices][2]: neighbours along curves, QW_NONE where there is none */
    uint8_t *curves;     /* uint8_t[vertices]: edges of curves there */
    uint32_t *outgoing;
    uint32_t *vertex;   /* of the circles */
    uint32_t *circle;   /* uint32_t[vertices]: the circle that a vertex is on, or QW_NONE */
    uint32_t *place_in; /* uint32_t[vertices]: its number there */
    circle *circles;
    uint32_t circle_count;
    uint32_t *line; /* vertices of a line */
    uint8_t *fixed; /* uint8_t[vertices]: 1: has its place */
} evening;

/* ---- coordinates about an axis */

typedef struct turned {
    double angle, height, radius;
} turned;

static void axes_of(const qw_primitive *p, double u[3], double v[3])
{
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(p->axis[k]) < fabs(p->axis[least])) least = k;
    for (int k = 0; k < 3; k++) u[k] = (k == least) - p->axis[least] * p->axis[k];
    double length = sqrt(qw_dot_doubles(u, u));
    for (int k = 0; k < 3; k++) u[k] /= length;
    qw_cross_doubles(p->axis, u, v);
}

static turned turned_of(const evening *e, uint32_t item, uint32_t vertex)
{
    assert(vertex < e->quads->vertex_count);
    const qw_primitive *p = &e->held->item[item];
    double q[3], u[3], v[3];
    axes_of(p, u, v);
    for (int k = 0; k < 3; k++) q[k] = e->held->place[3 * (size_t)vertex + (size_t)k] - p->point[k];
    double x = qw_dot_doubles(q, u), y = qw_dot_doubles(q, v);
    return (turned){qw_atan2(y, x), qw_dot_doubles(q, p->axis), sqrt(x * x + y * y)};
}

static void put_turned(const evening *e, uint32_t item, uint32_t vertex, turned t)
{
    const qw_primitive *p = &e->held->item[item];
    double u[3], v[3], c = t.radius * qw_cos(t.angle), s = t.radius * qw_sin(t.angle);
    axes_of(p, u, v);
    for (int k = 0; k < 3; k++)
        e->held->place[3 * (size_t)vertex + (size_t)k] = p->point[k] + c * u[k] + s * v[k] + t.height * p->axis[k];
}

static double turn_between(double from, double to) { return qw_remainder(to - from, 2 * QW_PI); }

static bool is_round(const evening *e, uint32_t item)
{
    return item != QW_NONE && e->held->item[item].kind != QW_PLANE && e->held->item[item].kind != QW_SPHERE;
}

static bool is_of(const evening *e, uint32_t v, uint32_t item)
{
    return e->held->of[v][0] == item || e->held->of[v][1] == item;
}

/* Whether an axis is that of another item, or the normal of a plane that it stands on. */
static bool is_upright(const evening *e, uint32_t item, uint32_t other)
{
    return fabs(qw_dot_doubles(e->held->item[item].axis, e->held->item[other].axis)) > 1 - PARALLEL;
}

static bool is_corner(const evening *e, uint32_t v) { return e->quads->kind && e->quads->kind[v] == QW_VERTEX_CORNER; }

/* ---- circles */

static void link_curves(evening *e)
{
    const qw_quadmesh *q = e->quads;
    for (uint32_t v = 0; v < q->vertex_count; v++) e->next[v][0] = e->next[v][1] = QW_NONE;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t twin = q->twin[h], end[2] = {q->corner[h], q->corner[qw_quad_next(h)]};
        if (twin != QW_NONE && (twin < h || !q->mark || !q->mark[h])) continue;
        for (int k = 0; k < 2; k++) {
            if (e->curves[end[k]] < 2) e->next[end[k]][e->curves[end[k]]] = end[1 - k];
            if (e->curves[end[k]] < 3) e->curves[end[k]]++;
        }
    }
}

/* Whether a circle about the item may go through a vertex, and go on. */
static bool goes_on(const evening *e, uint32_t v, uint32_t item)
{
    return e->curves[v] == 2 && !is_corner(e, v) && is_of(e, v, item);
}

static bool is_beside(const evening *e, uint32_t item, turned of, uint32_t v)
{
    turned t = turned_of(e, item, v);
    return fabs(t.height - of.height) < ONE_CIRCLE && fabs(t.radius - of.radius) < ONE_CIRCLE;
}

/* Vertices from v on towards `to`, as long as they are on one circle, an end included that lies on it but is of no
   other: their number; *is_closed where they come back. */
static uint32_t walk_circle(evening *e, uint32_t item, uint32_t v, uint32_t to, uint32_t *list, bool *is_closed)
{
    assert(v < e->quads->vertex_count);
    uint32_t count = 0, last = v;
    turned first = turned_of(e, item, v);
    *is_closed = false;
    while (to != QW_NONE && is_beside(e, item, first, to)) {
        if (to == v) {
            *is_closed = true;
            return count;
        }
        list[count++] = to;
        if (!goes_on(e, to, item) || count >= e->quads->vertex_count) return count;
        uint32_t after = e->next[to][0] == last ? e->next[to][1] : e->next[to][0];
        last = to, to = after;
    }
    return count;
}

/* Equal steps, of a closed circle from the mean of the phases, else between the ends. False where a vertex would go
   too far. */
static bool find_steps(const evening *e, circle *c)
{
    const uint32_t *v = e->vertex + c->begin;
    turned first = turned_of(e, c->item, v[0]);
    double total = 0, last = first.angle, mean = 0;
    for (uint32_t i = 1; i < c->count + c->is_closed; i++) {
        turned t = turned_of(e, c->item, v[i % c->count]);
        total += turn_between(last, t.angle), last = t.angle;
    }
    c->step = total / (c->count - !c->is_closed), c->phase = first.angle;
    if (c->is_closed && fabs(fabs(total) - 2 * QW_PI) > 0.1) return false;
    for (uint32_t i = 0; i < c->count; i++)
        mean += turn_between(first.angle + i * c->step, turned_of(e, c->item, v[i]).angle) / c->count;
    if (c->is_closed) c->phase += mean;
    for (uint32_t i = 0; i < c->count; i++) {
        double off = turn_between(c->phase + i * c->step, turned_of(e, c->item, v[i]).angle);
        if (fabs(off) > MOST_AROUND * fabs(c->step)) return false;
    }
    return true;
}

static void add_circle(evening *e, uint32_t v, uint32_t item, uint32_t *used, uint32_t *list)
{
    assert(v < e->quads->vertex_count);
    bool is_closed, is_again;
    circle c = {.begin = *used, .item = item, .root = e->circle_count, .joined = 1};
    uint32_t ahead = walk_circle(e, item, v, e->next[v][0], list, &is_closed), *to = e->vertex + *used;
    uint32_t n = 0;
    if (!is_closed) {
        uint32_t *back = list + ahead, behind = walk_circle(e, item, v, e->next[v][1], back, &is_again);
        for (uint32_t i = behind; i-- > 0;) to[n++] = back[i];
    }
    to[n++] = v;
    for (uint32_t i = 0; i < ahead; i++) to[n++] = list[i];
    c.is_closed = is_closed, c.count = n;
    bool ends_at_corner = is_corner(e, to[0]) || is_corner(e, to[n - 1]); /* what lies across keeps its spacing */
    if (n < 3 || ends_at_corner || !find_steps(e, &c)) return;
    for (uint32_t i = 0; i < n; i++)
        if (goes_on(e, to[i], item)) e->circle[to[i]] = e->circle_count, e->place_in[to[i]] = i;
    *used += n;
    e->circles[e->circle_count++] = c;
}

static void find_circles(evening *e)
{
    uint32_t n = e->quads->vertex_count, used = 0, *list = QW_NEW(e->env, uint32_t, 2 * (size_t)n + 2);
    memset(e->circle, 0xff, n * sizeof *e->circle);
    for (uint32_t v = 0; v < n; v++)
        for (int k = 0; k < 2 && e->circle[v] == QW_NONE; k++) {
            uint32_t item = e->held->of[v][k];
            if (is_round(e, item) && goes_on(e, v, item) && used + 2 < 2 * n) add_circle(e, v, item, &used, list);
        }
    qw_free(e->env, list);
}

static double wanted_angle(const evening *e, uint32_t v)
{
    const circle *c = &e->circles[e->circle[v]];
    return c->phase + e->place_in[v] * c->step;
}

static void put_circles(const evening *e)
{
    for (uint32_t v = 0; v < e->quads->vertex_count; v++)
        e->fixed[v] = e->curves[v] > 0 || is_corner(e, v) || e->held->on_tangent[v];
    for (uint32_t i = 0; i < e->circle_count; i++) {
        const circle *c = &e->circles[i];
        for (uint32_t k = 0; k < c->count; k++) {
            uint32_t v = e->vertex[c->begin + k];
            if (e->circle[v] != i) continue; /* an end that stays */
            turned t = turned_of(e, c->item, v);
            t.angle = c->phase + k * c->step;
            put_turned(e, c->item, v, t);
        }
    }
}

/* ---- lines */

/* Whether h runs along the axis of the item (or around it). */
static bool runs(const evening *e, uint32_t item, uint32_t h, bool around)
{
    assert(h < 4 * e->quads->face_count);
    uint32_t a = e->quads->corner[h], b = e->quads->corner[qw_quad_next(h)];
    turned s = turned_of(e, item, a), t = turned_of(e, item, b);
    double up = fabs(t.height - s.height), out = t.radius - s.radius,
           side = fabs(turn_between(s.angle, t.angle)) * 0.5 * (s.radius + t.radius);
    up = sqrt(up * up + out * out);
    return (around ? side : up) > QW_ALONG_AXIS * sqrt(up * up + side * side);
}

/* Vertices of the line that begins with h, straight on through regular ones on the item, along the axis of `about` or
   around it, into e->line: their number, with both ends. Closed where the last is the first. */
static uint32_t walk_line(const evening *e, uint32_t item, uint32_t about, uint32_t h, bool around)
{
    assert(h < 4 * e->quads->face_count);
    const qw_quadmesh *q = e->quads;
    uint32_t count = 0;
    e->line[count++] = q->corner[h];
    while (count <= q->vertex_count) {
        uint32_t to = q->corner[qw_quad_next(h)];
        bool on_boundary;
        if (!is_of(e, to, item) || !runs(e, about, h, around)) return 0;
        e->line[count++] = to;
        if (to == e->line[0] || e->curves[to] > 0 || is_corner(e, to)) return count;
        if (qw_quad_valence(q, e->outgoing[to], &on_boundary) != 4 || on_boundary) return 0;
        h = qw_quad_next(q->twin[qw_quad_next(h)]);
    }
    return 0;
}

/* The angle about the item's axis at which v will be on its circle. */
static double angle_about(const evening *e, uint32_t item, uint32_t v)
{
    assert(v < e->quads->vertex_count);
    double was[3], *place = e->held->place + 3 * (size_t)v;
    uint32_t about = e->circles[e->circle[v]].item;
    memcpy(was, place, sizeof was);
    turned t = turned_of(e, about, v);
    t.angle = wanted_angle(e, v);
    put_turned(e, about, v, t);
    double angle = turned_of(e, item, v).angle;
    memcpy(place, was, sizeof was);
    return angle;
}

/* Turns all circles that are joined to one. */
static void turn_joined(evening *e, uint32_t root, uint32_t item, double by)
{
    for (uint32_t i = 0; i < e->circle_count; i++) {
        circle *c = &e->circles[i];
        if (c->root != root) continue;
        c->phase += qw_dot_doubles(e->held->item[c->item].axis, e->held->item[item].axis) > 0 ? by : -by;
    }
}

/* The closed circles of v and w, if they have as many edges, are turned so that both have one angle about the item. */
static void join_circles(evening *e, uint32_t item, uint32_t v, uint32_t w)
{
    assert(v < e->quads->vertex_count && w < e->quads->vertex_count);
    circle *a = &e->circles[e->circle[v]], *b = &e->circles[e->circle[w]];
    if (a->root == b->root || a->count != b->count || !a->is_closed || !b->is_closed) return;
    double apart = turn_between(angle_about(e, item, v), angle_about(e, item, w)), share;
    if (fabs(apart) > MOST * fabs(a->step)) return;
    share = (double)b->joined / (a->joined + b->joined);
    turn_joined(e, a->root, item, share * apart), turn_joined(e, b->root, item, (share - 1) * apart);
    uint32_t from = b->root, joined = a->joined + b->joined;
    for (uint32_t i = 0; i < e->circle_count; i++) {
        circle *c = &e->circles[i];
        if (c->root == from) c->root = a->root;
        if (c->root == a->root) c->joined = joined;
    }
}

/* About which cylinder or cone lines on an item run from v on: itself, or, on a plane, that of the circle which v is
   on, if it stands upright on the plane. */
static uint32_t axis_of(const evening *e, uint32_t v, uint32_t item)
{
    if (item == QW_NONE || is_round(e, item)) return item;
    if (e->circle[v] == QW_NONE) return QW_NONE;
    uint32_t about = e->circles[e->circle[v]].item;
    return is_upright(e, about, item) ? about : QW_NONE;
}

/* Every line on cylinders and cones, or else on planes across them, that starts at a vertex of a curve. */
static void visit_lines(evening *e, bool rounds, void (*visit)(evening *, uint32_t about, uint32_t count))
{
    const qw_quadmesh *q = e->quads;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t v = q->corner[h], to = q->corner[qw_quad_next(h)];
        for (int k = 0; k < 2 && e->curves[v] > 0; k++) {
            uint32_t item = e->held->of[v][k], about = axis_of(e, v, item);
            if (about == QW_NONE || !is_of(e, to, item) || is_round(e, item) != rounds) continue;
            uint32_t count = walk_line(e, item, about, h, false);
            if (count > 1 && e->line[0] != e->line[count - 1]) visit(e, about, count);
        }
    }
}

static void join_ends(evening *e, uint32_t item, uint32_t count)
{
    uint32_t v = e->line[0], w = e->line[count - 1];
    if (v > w || e->circle[v] == QW_NONE || e->circle[w] == QW_NONE) return;
    if (is_upright(e, item, e->circles[e->circle[w]].item)) join_circles(e, item, v, w);
}

/* A line between two vertices at one angle gets it all along; ends of arcs are brought to the mean first. */
static void straighten(evening *e, uint32_t item, uint32_t count)
{
    uint32_t v = e->line[0], w = e->line[count - 1];
    if (v > w) return;
    turned a = turned_of(e, item, v), b = turned_of(e, item, w);
    double apart = turn_between(a.angle, b.angle), far = fabs(apart) * fmax(a.radius, b.radius);
    bool is_arc = e->circle[v] != QW_NONE && e->circle[w] != QW_NONE && !e->circles[e->circle[v]].is_closed &&
                  !e->circles[e->circle[w]].is_closed;
    if (far > ONE_CIRCLE && !is_arc) return;
    if (far > MOST * (double)fminf(e->held->edge[v], e->held->edge[w])) return;
    double angle = a.angle + apart / 2;
    for (uint32_t i = 0; i < count; i++) {
        turned t = turned_of(e, item, e->line[i]);
        if (fabs(turn_between(t.angle, angle)) * t.radius > MOST_AROUND * (double)e->held->edge[e->line[i]]) return;
    }
    for (uint32_t i = 0; i < count; i++) {
        e->fixed[e->line[i]] = 1;
        turned t = turned_of(e, item, e->line[i]);
        if (!is_arc && (i == 0 || i + 1 == count)) continue;
        t.angle = angle;
        put_turned(e, item, e->line[i], t);
    }
}

/* ---- rows around */

/* The radius of a cylinder or cone at a height above its point. */
static double radius_at(const qw_primitive *p, double height)
{
    return p->radius + height * p->sine / sqrt(1 - p->sine * p->sine);
}

static void level(evening *e, uint32_t item, uint32_t count)
{
    const qw_primitive *p = &e->held->item[item];
    double least = INFINITY, most = -INFINITY, mean = 0, radius = 0;
    for (uint32_t i = 0; i < count; i++) {
        turned t = turned_of(e, item, e->line[i]);
        least = fmin(least, t.height), most = fmax(most, t.height);
        mean += t.height / count, radius += t.radius / count;
    }
    if (p->kind != QW_TORUS) radius = radius_at(p, mean);
    if (most - least > ONE_ROW * (double)e->held->edge[e->line[0]]) return;
    for (uint32_t i = 0; i < count; i++) {
        turned t = turned_of(e, item, e->line[i]);
        e->fixed[e->line[i]] = 1;
        t.height = mean, t.radius = radius;
        put_turned(e, item, e->line[i], t);
    }
}

/* Closed rows of free vertices. */
static void level_rows(evening *e)
{
    const qw_quadmesh *q = e->quads;
    uint8_t *done = QW_NEW_ZERO(e->env, uint8_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t v = q->corner[h], item = e->held->of[v][0];
        if (done[v] || e->curves[v] || !is_round(e, item) || e->held->of[v][1] != QW_NONE) continue;
        uint32_t count = walk_line(e, item, item, h, true);
        if (count < 4 || e->line[0] != e->line[count - 1]) continue;
        for (uint32_t i = 0; i < count; i++) done[e->line[i]] = 1;
        level(e, item, count - 1);
    }
    qw_free(e->env, done);
}

/* ---- what lies between */

/* What is not fixed goes with its neighbours: their ways from `before` are spread over the mesh. */
static void spread(const evening *e, const double *before)
{
    const qw_quadmesh *q = e->quads;
    uint32_t n = q->vertex_count;
    double *way = QW_NEW_ZERO(e->env, double, 3 * (size_t)n), *sum = QW_NEW(e->env, double, 4 * (size_t)n);
    for (size_t v = 0; v < n; v++)
        for (size_t k = 0; k < 3 && e->fixed[v]; k++) way[3 * v + k] = e->held->place[3 * v + k] - before[3 * v + k];
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        memset(sum, 0, 4 * (size_t)n * sizeof *sum);
        for (uint32_t h = 0; h < 4 * q->face_count; h++) {
            size_t a = q->corner[h], b = q->corner[qw_quad_next(h)];
            for (size_t k = 0; k < 3; k++) sum[4 * a + k] += way[3 * b + k], sum[4 * b + k] += way[3 * a + k];
            sum[4 * a + 3]++, sum[4 * b + 3]++;
        }
        for (uint32_t v = 0; v < n; v++)
            for (size_t k = 0; k < 3 && !e->fixed[v] && sum[4 * (size_t)v + 3] > 0; k++)
                way[3 * (size_t)v + k] = sum[4 * (size_t)v + k] / sum[4 * (size_t)v + 3];
    }
    for (uint32_t v = 0; v < n; v++)
        for (size_t k = 0; k < 3 && !e->fixed[v]; k++)
            e->held->place[3 * (size_t)v + k] = before[3 * (size_t)v + k] + way[3 * (size_t)v + k];
    qw_free(e->env, sum), qw_free(e->env, way);
}

static double least_sine(const qw_quadmesh *q, uint32_t f, const double *place)
{
    assert(f < q->face_count);
    double least = 1;
    double n[3] = {0}, c[4][3], length[4];
    for (uint32_t i = 0; i < 4; i++) {
        const double *p = place + 3 * (size_t)q->corner[4 * (size_t)f + i],
                     *next = place + 3 * (size_t)q->corner[4 * (size_t)f + (i + 1) % 4],
                     *last = place + 3 * (size_t)q->corner[4 * (size_t)f + (i + 3) % 4];
        double a[3], b[3];
        for (int k = 0; k < 3; k++) a[k] = next[k] - p[k], b[k] = last[k] - p[k];
        qw_cross_doubles(a, b, c[i]);
        length[i] = sqrt(qw_dot_doubles(a, a) * qw_dot_doubles(b, b));
        for (int k = 0; k < 3; k++) n[k] += c[i][k];
    }
    double size = sqrt(qw_dot_doubles(n, n));
    for (int i = 0; i < 4; i++)
        least = fmin(least, size * length[i] > 0 ? qw_dot_doubles(c[i], n) / (size * length[i]) : -1);
    return least;
}

typedef struct undoing {
    const qw_quadmesh *quads;
    double *place;
    const double *before;
    double slack;
} undoing;

static void find_worse(qw_env *env, void *user, uint8_t *is_worse)
{
    (void)env;
    const undoing *u = user;
    for (uint32_t f = 0; f < u->quads->face_count; f++) {
        double is = least_sine(u->quads, f, u->place);
        is_worse[f] = is < GOOD && is < least_sine(u->quads, f, u->before) - u->slack;
    }
}

static void undo(void *user, uint32_t v, float share)
{
    (void)share;
    const undoing *u = user;
    memcpy(u->place + 3 * (size_t)v, u->before + 3 * (size_t)v, 3 * sizeof *u->place);
}

void qw_undo_bad(qw_env *env, const qw_quadmesh *q, double *place, const double *before, double slack, uint8_t *back)
{
    undoing u = {q, place, before, slack};
    qw_go_back(env, &(qw_going_back){q, true, &u, find_worse, undo}, back);
}

/* Right angles again around what was moved: circles, lines and rows have their places. */
static void ease(const evening *e)
{
    uint32_t n = e->quads->vertex_count;
    if (!qw_uses(e->env, QW_MECH_EASED)) return;
    qw_did(e->env, QW_MECH_EASED, 1);
    uint8_t *stays = QW_NEW(e->env, uint8_t, n);
    for (uint32_t v = 0; v < n; v++)
        stays[v] = e->circle[v] != QW_NONE || (e->fixed[v] && e->curves[v] == 0) || e->held->on_tangent[v];
    qw_ease_angles(e->env, e->quads, e->held, stays);
    qw_free(e->env, stays);
}

void qw_even_rows(qw_env *env, const qw_quadmesh *quads, const qw_held *held)
{
    assert(quads->twin && held->place);
    uint32_t n = quads->vertex_count;
    qw_scope_begin(env);
    evening e = {.env = env, .quads = quads, .held = held, .outgoing = qw_quadmesh_outgoing(env, quads)};
    e.next = qw_alloc(env, n, sizeof *e.next), e.curves = QW_NEW_ZERO(env, uint8_t, n);
    e.vertex = QW_NEW(env, uint32_t, 2 * (size_t)n + 2), e.circles = qw_alloc(env, n, sizeof *e.circles);
    e.circle = QW_NEW(env, uint32_t, n), e.place_in = QW_NEW_ZERO(env, uint32_t, n);
    e.line = QW_NEW(env, uint32_t, (size_t)n + 2);
    link_curves(&e);
    find_circles(&e);
    e.fixed = QW_NEW_ZERO(env, uint8_t, n);
    double *before = QW_NEW(env, double, 3 * (size_t)n), *between = QW_NEW(env, double, 3 * (size_t)n);
    memcpy(before, held->place, 3 * (size_t)n * sizeof *before);
    held->find_tangents(held->user);
    visit_lines(&e, true, join_ends), visit_lines(&e, false, join_ends);
    put_circles(&e);
    spread(&e, before);
    held->settle(held->user);
    memcpy(between, held->place, 3 * (size_t)n * sizeof *between);
    level_rows(&e);
    visit_lines(&e, true, straighten), visit_lines(&e, false, straighten);
    spread(&e, between);
    held->settle(held->user);
    ease(&e);
    uint8_t *back = QW_NEW(env, uint8_t, n);
    qw_undo_bad(env, quads, held->place, before, 1e-12, back);
    for (uint32_t v = 0; v < n; v++)
        if (back[v] && held->on_tangent[v]) held->leave_tangent(held->user, v);
    ease(&e);
    qw_scope_end(env);
}
