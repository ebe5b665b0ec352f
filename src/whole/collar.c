#include "whole/collar.h"

#include "base/elementary.h"
#include "geometry/loops.h"
#include "geometry/step_search.h"
#include "whole/open_path.h"
#include "whole/strip.h"

#include <assert.h>
#include <string.h>

/* The numbers of edges of a strip's two sides differ by this factor at most, where there is room for enough strips. */
static const double MOST_CHANGE = 2.6;
enum { MOST_STRIPS = 12 };
/* The quads' rim moves inward by this share of the way to the next vertices; by the second where these lie on a rim
   themselves. */
static const float INWARD = 0.5f, INWARD_NARROW = 0.3f;
/* Vertices up to so many edges away from a strip are moved when the new quads are relaxed. */
enum { RINGS = 2 };
/* Samples of each loop of the quads by which the matching loop of the surface is found. */
enum { SAMPLES = 24 };

typedef struct collaring {
    qw_env *env;
    qw_quadmesh quads; /* with the rows that had to be added */
    const qw_trimesh *surface;
    qw_rims inner; /* of the quads */
    qw_outer_rims outer;
    uint32_t *outer_of;    /* uint32_t[inner.count]: the loop of the surface that each loop lies on */
    qw_vec3 *rim_position; /* qw_vec3[inner.begin[inner.count]]: where the quads' rims were */
    qw_quad_builder b;
    /* vertex of the builder that is the first of the surface's rims, which follow in the order of `outer` */
    uint32_t first;
    uint32_t *made; /* uint32_t[inner.count + 1]: the vertices that each loop has made are made[i] .. made[i + 1] */
} collaring;

/* ---- which loop is which */

static qw_vec3 outer_point(const collaring *c, uint32_t i) { return c->outer.position[i]; }

/* A tree of segments for each boundary loop of the surface. */
static const qw_curve_tree **trees_of_loops(const collaring *c)
{
    assert(c->outer.begin && c->inner.begin);
    const qw_curve_tree **tree = QW_NEW(c->env, const qw_curve_tree *, c->outer.count);
    uint32_t all = c->outer.begin[c->outer.count];
    qw_vec3 *from = QW_NEW(c->env, qw_vec3, all), *to = QW_NEW(c->env, qw_vec3, all);
    for (uint32_t l = 0; l < c->outer.count; l++) {
        uint32_t begin = c->outer.begin[l], n = c->outer.begin[l + 1] - begin;
        for (uint32_t i = 0; i < n; i++)
            from[i] = outer_point(c, begin + i), to[i] = outer_point(c, begin + (i + 1) % n);
        tree[l] = qw_curve_tree_build(c->env, from, to, n);
    }
    qw_free(c->env, from), qw_free(c->env, to);
    return tree;
}

/* How badly inner loop i matches outer loop l: the mean distance of its samples, each of which adds a quarter of its
   edge if that runs the other way. Stops once the sum is above `least`. */
static double misfit(const collaring *c, const qw_curve_tree *tree, uint32_t i, uint32_t l, double least)
{
    assert(i < c->inner.count && l < c->outer.count);
    uint32_t begin = c->inner.begin[i], n = c->inner.begin[i + 1] - begin,
             m = c->outer.begin[l + 1] - c->outer.begin[l];
    uint32_t samples = n < SAMPLES ? n : SAMPLES;
    double sum = 0;
    for (uint32_t k = 0; k < samples && sum < least; k++) {
        uint32_t j = (uint32_t)((uint64_t)k * n / samples);
        qw_vec3 p = c->rim_position[begin + j], next = c->rim_position[begin + (j + 1) % n];
        qw_curve_hit hit = qw_curve_nearest(tree, p, INFINITY);
        uint32_t at = c->outer.begin[l] + hit.segment, after = c->outer.begin[l] + (hit.segment + 1) % m;
        qw_vec3 along = qw_sub(outer_point(c, after), outer_point(c, at)), own = qw_sub(next, p);
        sum += sqrt((double)hit.distance2) / samples;
        if (qw_dot(along, own) < 0) sum += 0.25 * (double)qw_length(own) / samples;
    }
    return sum;
}

/* Whether both loops are of one component, or nothing is known of that. */
static bool is_of_one(const collaring *c, uint32_t i, uint32_t l)
{
    const uint32_t *of_quads = c->quads.component, *of_rims = c->outer.component;
    return !of_quads || !of_rims || of_quads[c->quads.corner[c->inner.half[c->inner.begin[i]]]] == of_rims[l];
}

/* Finds for each rim of the quads the loop of the surface that it lies along, each once. */
static void match_loops(collaring *c, const qw_curve_tree *const *tree)
{
    assert(c->outer.count > 0 || c->inner.count == 0);
    qw_env *env = c->env;
    static const char OTHERS[] = "the quads have %u rims, and the surface has %u, so none could be kept";
    if (c->inner.count != c->outer.count) qw_fail(env, QW_INTERNAL, -1, OTHERS, c->inner.count, c->outer.count);
    uint32_t count = c->inner.count;
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, count);
    for (uint32_t i = 0; i < count; i++) {
        double least = INFINITY;
        uint32_t best = QW_NONE;
        for (uint32_t l = 0; l < count; l++) {
            double d = taken[l] || !is_of_one(c, i, l) ? INFINITY : misfit(c, tree[l], i, l, least);
            if (d < least) least = d, best = l;
        }
        if (best == QW_NONE) qw_fail(env, QW_INTERNAL, i, OTHERS, c->inner.count, c->outer.count);
        taken[best] = 1, c->outer_of[i] = best;
    }
    qw_free(env, taken);
}

static void remember_rims(collaring *c)
{
    c->inner = qw_find_rims(c->env, 4, c->quads.twin, c->quads.face_count);
    uint32_t all = c->inner.begin[c->inner.count];
    c->rim_position = QW_NEW(c->env, qw_vec3, all);
    for (uint32_t i = 0; i < all; i++) c->rim_position[i] = c->quads.position[c->quads.corner[c->inner.half[i]]];
}

/* Adds rows where a loop has an odd number of edges and should have an even one, or the other way round. */
static void mend_parity(collaring *c)
{
    uint8_t *odd = QW_NEW(c->env, uint8_t, c->inner.count);
    uint32_t count = 0;
    for (uint32_t i = 0; i < c->inner.count; i++) {
        uint32_t l = c->outer_of[i], n = c->inner.begin[i + 1] - c->inner.begin[i],
                 m = c->outer.begin[l + 1] - c->outer.begin[l];
        odd[i] = (n + m) % 2, count += odd[i];
    }
    if (count > 0) {
        qw_add_rows_between(c->env, &c->quads, odd);
        remember_rims(c);
    }
    for (uint32_t i = 0; i < c->inner.count; i++) {
        const uint32_t *in = c->inner.begin + i, *out = c->outer.begin + c->outer_of[i];
        assert((in[1] - in[0] + out[1] - out[0]) % 2 == 0);
    }
    qw_free(c->env, odd);
}

/* ---- positions along a loop */

/* Parameters of the vertices of inner loop i along its outer loop, in edges of the outer loop: double[n], not
   decreasing. */
static double *places_on(const collaring *c, const qw_curve_tree *tree, uint32_t i)
{
    assert(i < c->inner.count && c->outer_of[i] < c->outer.count);
    uint32_t begin = c->inner.begin[i], n = c->inner.begin[i + 1] - begin, l = c->outer_of[i],
             m = c->outer.begin[l + 1] - c->outer.begin[l];
    double *at = QW_NEW(c->env, double, n);
    uint8_t *known = QW_NEW_ZERO(c->env, uint8_t, n);
    double first = 0, now = 0;
    for (uint32_t j = 0; j < n;
         j++) { /* a parameter that goes back, or around nearly all of the loop, is replaced by its neighbours' */
        qw_curve_hit hit = qw_curve_nearest(tree, c->rim_position[begin + j], INFINITY);
        double raw = hit.segment + (double)hit.t;
        if (j == 0) first = now = raw;
        double step = raw - now - m * qw_floor((raw - now) / m);
        known[j] = now + step - first <= m && step <= fmax(0.5 * m, 2);
        if (known[j]) at[j] = now = now + step;
    }
    for (uint32_t j = 0; j < n; j++) {
        if (known[j]) continue;
        uint32_t k = j + 1;
        while (k < n && !known[k]) k++;
        double to = k < n ? at[k] : first + m;
        at[j] = at[j - 1] + (to - at[j - 1]) / (double)(k - j + 1);
    }
    qw_free(c->env, known);
    return at;
}

/* ---- the quads' rim moves inward */

/* Whether a sharp edge of the inside ends at the vertex that `out` leaves. */
static bool meets_feature(const qw_quadmesh *q, uint32_t out)
{
    assert(out < 4 * q->face_count);
    for (uint32_t h = out;;) {
        if (q->twin[h] != QW_NONE && q->mark && q->mark[h]) return true;
        h = qw_quad_around(q, h);
        if (h == QW_NONE || h == out) return false;
    }
}

/* Where a vertex of the rim goes to make room for the collar: towards its inner neighbours. */
static qw_vec3 moved_inward(const qw_quadmesh *q, uint32_t out, const uint8_t *on_rim)
{
    assert(out < 4 * q->face_count && on_rim);
    qw_vec3 p = q->position[q->corner[out]], sum = qw_v3(0, 0, 0);
    uint32_t count = 0;
    float share = INWARD;
    for (uint32_t h = qw_quad_around(q, out); h != QW_NONE; h = qw_quad_around(q, h)) {
        uint32_t u = q->corner[qw_quad_next(h)];
        if (on_rim[u]) share = INWARD_NARROW;
        sum = qw_add(sum, q->position[u]), count++;
    }
    if (count == 0) { /* the only quad there */
        uint32_t u = q->corner[qw_quad_next(qw_quad_next(out))];
        if (on_rim[u]) share = INWARD_NARROW;
        sum = q->position[u], count = 1;
    }
    return qw_lerp(p, qw_scale(sum, 1.0f / (float)count), share);
}

/* station: uint8_t[rim vertices], set where a sharp edge or a corner of the rim is. */
static void move_rims_inward(collaring *c, uint8_t *station)
{
    qw_quadmesh *q = &c->quads;
    uint32_t all = c->inner.begin[c->inner.count];
    uint8_t *on_rim = QW_NEW_ZERO(c->env, uint8_t, q->vertex_count);
    qw_vec3 *to = QW_NEW(c->env, qw_vec3, all);
    uint32_t *out = qw_quadmesh_outgoing(c->env, q);
    for (uint32_t i = 0; i < all; i++) on_rim[q->corner[c->inner.half[i]]] = 1;
    for (uint32_t i = 0; i < all; i++) {
        uint32_t v = q->corner[c->inner.half[i]];
        assert(out[v] != QW_NONE);
        bool feature = meets_feature(q, out[v]);
        to[i] = moved_inward(q, out[v], on_rim);
        station[i] = feature || q->kind[v] == QW_VERTEX_CORNER;
        q->kind[v] = feature ? QW_VERTEX_CORNER : QW_VERTEX_FREE;
    }
    for (uint32_t i = 0; i < all; i++) q->position[q->corner[c->inner.half[i]]] = to[i];
    qw_free(c->env, on_rim), qw_free(c->env, to), qw_free(c->env, out);
}

/* ---- loops between */

static const double SHORTEST_STEP = 1e-6; /* of an edge: parameters that coincide are set so far apart */

/* Parameters of n vertices of a loop between. Their spacing goes from that of the outer loop (share 0) to that of the
   inner one (1). at: double[n], along the outer loop, in its edges; on_inner: the same along the inner loop. */
static void places_between(const qw_ring *inner, double period, double share, uint32_t n, double *at, double *on_inner)
{
    double sum = 0, done = 0;
    for (uint32_t j = 0; j < inner->count; j++) {
        double to = j + 1 < inner->count ? inner->at[j + 1] : inner->at[0] + period;
        sum += qw_pow(fmax(to - inner->at[j], SHORTEST_STEP), 1 - share);
    }
    uint32_t k = 0;
    for (uint32_t j = 0; j < inner->count; j++) {
        double from = inner->at[j], to = j + 1 < inner->count ? inner->at[j + 1] : inner->at[0] + period;
        double part = qw_pow(fmax(to - from, SHORTEST_STEP), 1 - share) / sum * n;
        for (; k < n && (k <= done + part || j + 1 == inner->count); k++) {
            double t = part > 0 ? fmin(fmax((k - done) / part, 0), 1) : 0;
            at[k] = from + (to - from) * t, on_inner[k] = j + t;
        }
        done += part;
    }
    assert(k == n); /* all have a place */
}

static qw_vec3 point_on(const qw_quad_builder *b, const qw_ring *r, double index)
{
    assert(r->count > 0 && b->position);
    double whole = qw_floor(index);
    uint32_t i = (uint32_t)(whole - r->count * qw_floor(whole / r->count)) % r->count;
    return qw_lerp(b->position[r->vertex[i]], b->position[r->vertex[(i + 1) % r->count]], (float)(index - whole));
}

/* A station of the inner ring becomes one of the nearest vertex of the ring. */
static void take_stations(qw_ring *r, const qw_ring *inner, double period)
{
    for (uint32_t j = 0; j < inner->count; j++) {
        uint32_t best = 0;
        double least = INFINITY;
        for (uint32_t k = 0; inner->station[j] && k < r->count; k++) {
            double d = fabs(qw_remainder(r->at[k] - inner->at[j], period));
            if (d < least) least = d, best = k;
        }
        if (inner->station[j]) r->station[best] = 1;
    }
}

/* Ring s of `strips` + 1, of which the outer is ring 0. */
static qw_ring ring_between(collaring *c, const qw_ring *outer, const qw_ring *inner, uint32_t s, uint32_t strips)
{
    assert(outer->count > 0 && inner->count > 0 && s < strips);
    double share = (double)s / strips, ratio = (double)inner->count / outer->count, step = qw_pow(ratio, -1.0 / strips);
    uint32_t n = (uint32_t)fmax(qw_floor(outer->count * qw_pow(ratio, share) + 0.5), 3);
    n += (n + outer->count) % 2;
    qw_ring r = {n, QW_NEW(c->env, uint32_t, n), QW_NEW(c->env, double, n), QW_NEW_ZERO(c->env, uint8_t, n)};
    double *on_inner = QW_NEW(c->env, double, n), depth = 0, whole = 0, size = 1;
    for (uint32_t k = 0; k < strips; k++, size *= step) { /* strips are as thick as their edges are long */
        whole += size;
        if (k < s) depth += size;
    }
    places_between(inner, outer->count, share, n, r.at, on_inner);
    for (uint32_t k = 0; k < n; k++) {
        qw_vec3 from = point_on(&c->b, outer, r.at[k] - outer->at[0]), to = point_on(&c->b, inner, on_inner[k]);
        r.vertex[k] = qw_builder_vertex(&c->b, qw_lerp(from, to, (float)(depth / whole)));
    }
    take_stations(&r, inner, outer->count);
    qw_free(c->env, on_inner);
    return r;
}

static uint32_t strips_between(double outer, double inner)
{
    double change = fabs(qw_ln(outer / inner));
    return (uint32_t)fmin(fmax(qw_ceil(change / qw_ln(MOST_CHANGE)), 1), MOST_STRIPS);
}

static void free_ring(qw_env *env, const qw_ring *r)
{
    qw_free(env, r->vertex), qw_free(env, r->at), qw_free(env, r->station);
}

/* rim: the first vertex of the outer loop in the builder. */
static void fill_loop(collaring *c, const qw_curve_tree *tree, uint32_t i, const uint8_t *station, uint32_t rim)
{
    assert(i < c->inner.count && tree && station);
    uint32_t l = c->outer_of[i], m = c->outer.begin[l + 1] - c->outer.begin[l], begin = c->inner.begin[i],
             n = c->inner.begin[i + 1] - begin;
    qw_env *env = c->env;
    qw_ring outer = {m, QW_NEW(env, uint32_t, m), QW_NEW(env, double, m), NULL};
    qw_ring inner = {n, QW_NEW(env, uint32_t, n), places_on(c, tree, i), QW_NEW(env, uint8_t, n)};
    for (uint32_t k = 0; k < m; k++) outer.vertex[k] = rim + k, outer.at[k] = k;
    for (uint32_t k = 0; k < n; k++) inner.vertex[k] = c->quads.corner[c->inner.half[begin + k]];
    memcpy(inner.station, station + begin, n);
    uint32_t strips = strips_between(m, n);
    qw_ring from = outer;
    for (uint32_t s = 1; s <= strips; s++) {
        qw_ring to = s < strips ? ring_between(c, &outer, &inner, s, strips) : inner;
        qw_fill_strip(&c->b, &from, &to, m);
        if (s > 1) free_ring(env, &from);
        from = to;
    }
    free_ring(env, &outer), free_ring(env, &inner);
}

/* A strip has a quad for each edge of its shorter side, and three more for each two that the other side has more. */
double qw_collar_faces(double outer, double inner)
{
    assert(outer > 0 && inner > 0);
    uint32_t strips = strips_between(outer, inner);
    double step = qw_pow(inner / outer, 1.0 / strips), sum = 0, from = outer;
    for (uint32_t s = 0; s < strips; s++) {
        double to = from * step;
        sum += fmin(from, to) + 1.5 * fabs(from - to);
        from = to;
    }
    return sum;
}

/* ---- the whole */

/* The quads with their collars, as the builder has them. */
static qw_quadmesh close_builder(collaring *c)
{
    qw_env *env = c->env;
    const qw_quadmesh *was = &c->quads;
    qw_quadmesh q = {.vertex_count = c->b.vertex_count,
                     .face_count = c->b.face_count,
                     .position = c->b.position,
                     .corner = c->b.corner};
    assert(q.vertex_count >= was->vertex_count && q.face_count >= was->face_count);
    q.kind = QW_NEW_ZERO(env, uint8_t, q.vertex_count);
    q.mark = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)q.face_count);
    q.component = QW_NEW_ZERO(env, uint32_t, q.vertex_count);
    memcpy(q.kind, was->kind, was->vertex_count);
    memcpy(q.component, was->component, was->vertex_count * sizeof *q.component);
    memcpy(q.mark, was->mark, 4 * (size_t)was->face_count);
    qw_quadmesh_link(env, &q);
    for (uint32_t i = 0; i < c->inner.count; i++) {
        uint32_t component = q.component[q.corner[4 * (c->inner.half[c->inner.begin[i]] / 4)]], l = c->outer_of[i];
        for (uint32_t v = c->made[i]; v < c->made[i + 1]; v++) q.component[v] = component;
        for (uint32_t k = c->outer.begin[l]; k < c->outer.begin[l + 1]; k++)
            q.component[c->first + k] = component, q.kind[c->first + k] = QW_VERTEX_CORNER;
    }
    return q;
}

/* Marks the vertices that relaxation moves: new ones, those of the former rim, and RINGS rings around; none on a rim
   or a sharp edge. */
static uint8_t *find_moving(qw_env *env, const qw_quadmesh *q, const uint32_t *rim, uint32_t strip_begin)
{
    assert(q->kind && rim && strip_begin <= q->face_count);
    uint8_t *moves = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    for (uint32_t h = 4 * strip_begin; h < 4 * q->face_count; h++) moves[q->corner[h]] = 1;
    qw_grow_marks(q, RINGS, moves);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        bool stays = rim[v] != QW_NONE || q->kind[v] != QW_VERTEX_FREE;
        moves[v] = (uint8_t)(stays ? QW_STAYS : moves[v] ? QW_MOVES : QW_MAY_MOVE);
    }
    return moves;
}

static void begin_builder(collaring *c)
{
    const qw_quadmesh *q = &c->quads;
    c->b = (qw_quad_builder){.env = c->env};
    for (uint32_t v = 0; v < q->vertex_count; v++) qw_builder_vertex(&c->b, q->position[v]);
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *k = q->corner + 4 * (size_t)f;
        qw_builder_quad(&c->b, k[0], k[1], k[2], k[3]);
    }
}

/* Fills the gap between each rim and its loop with quads. */
static void fill_loops(collaring *c, const qw_curve_tree *const *tree)
{
    assert(c->inner.count == c->outer.count);
    uint8_t *station = QW_NEW_ZERO(c->env, uint8_t, c->inner.begin[c->inner.count]);
    move_rims_inward(c, station);
    begin_builder(c);
    c->first = c->b.vertex_count;
    c->made = QW_NEW(c->env, uint32_t, (size_t)c->inner.count + 1);
    for (uint32_t i = 0; i < c->outer.begin[c->outer.count]; i++) qw_builder_vertex(&c->b, outer_point(c, i));
    c->made[0] = c->b.vertex_count;
    for (uint32_t i = 0; i < c->inner.count; i++) {
        fill_loop(c, tree[c->outer_of[i]], i, station, c->first + c->outer.begin[c->outer_of[i]]);
        c->made[i + 1] = c->b.vertex_count;
    }
    qw_free(c->env, station);
}

qw_outer_rims qw_rims_of_surface(qw_env *env, const qw_trimesh *surface)
{
    qw_rims rims = qw_find_rims(env, 3, surface->twin, surface->face_count);
    uint32_t all = rims.begin[rims.count];
    qw_outer_rims outer = {rims.count, rims.begin, QW_NEW(env, qw_vec3, all), QW_NEW(env, uint32_t, all), NULL};
    if (surface->component) outer.component = QW_NEW(env, uint32_t, rims.count);
    for (uint32_t i = 0; i < all; i++) {
        outer.id[i] = surface->corner[rims.half[i]];
        outer.position[i] = surface->position[outer.id[i]];
    }
    for (uint32_t l = 0; l < rims.count && outer.component; l++)
        outer.component[l] = surface->component[rims.half[rims.begin[l]] / 3];
    return outer;
}

qw_collar qw_add_collar(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const qw_outer_rims *outer)
{
    assert(quads->twin && surface->twin);
    qw_scope_begin(env);
    collaring c = {.env = env, .quads = qw_quadmesh_copy(env, quads, 0, 0), .surface = surface};
    c.outer = *outer;
    remember_rims(&c);
    c.outer_of = QW_NEW(env, uint32_t, c.inner.count);
    const qw_curve_tree **tree = trees_of_loops(&c);
    match_loops(&c, tree);
    mend_parity(&c);
    fill_loops(&c, tree);
    uint32_t strip_begin = c.quads.face_count;
    qw_collar r = {.quads = close_builder(&c), .added = c.b.face_count - quads->face_count};
    r.rim = QW_NEW(env, uint32_t, r.quads.vertex_count);
    memset(r.rim, 0xff, r.quads.vertex_count * sizeof *r.rim);
    for (uint32_t i = 0; i < c.outer.begin[c.outer.count]; i++) r.rim[c.first + i] = c.outer.id[i];
    qw_square_corners(env, &r.quads, find_moving(env, &r.quads, r.rim, strip_begin), surface,
                      qw_bvh_build(env, surface));
    qw_keep(env, r.quads.position), qw_keep(env, r.quads.corner), qw_keep(env, r.quads.twin);
    qw_keep(env, r.quads.kind), qw_keep(env, r.quads.mark), qw_keep(env, r.quads.component), qw_keep(env, r.rim);
    qw_scope_end(env);
    return r;
}
