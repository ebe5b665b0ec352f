/* New positions for the vertices of a window, in two ways:
 * - membrane: each vertex goes to the mean of its neighbours, over and over; then all go back onto the surface.
 * (Tutte's embedding has no flipped quad where the ring around it is convex.)
 * - search: each vertex tries eight steps around it and takes the one after which the quads around it cost least.
 */
#include "remesh/relax/quad_window.h"

#include "geometry/step_search.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    SPREADS = 40,  /* sweeps of the membrane: its windowes are at most a dozen quads wide */
    SETTLINGS = 4, /* onto the surface, with a sweep between */
    SWEEPS = 30,   /* of the search */
};

/* A corner costs the square of 1 less its sine, and PULL times the square of what its sine is below LEAST_SINE. */
static const float LEAST_SINE = 0.2f;
static const double PULL = 20;
/* Cost of a quad that faces against the surface: more than any one corner can cost. */
static const double AGAINST = 40;
/* A quad off the surface costs LIFT times its squared distance over its area. */
static const double LIFT = 10;
/* Steps of the search, in mean lengths of the edges around the vertex: the first, and the shortest. */
static const float FIRST_STEP = 0.4f, LEAST_STEP = 0.01f;
/* Farthest that the search moves a corner along a curve, in mean edges: corners are what makes a shape recognisable. */
static const float MOST_ALONG_CURVE = 0.3f;
/* A membrane is brought back to the sheet that it faces within this many mean edges, else to the nearest point
   anywhere. */
static const float MOST_DOWN = 4;
/* A window with fewer quad corners at fixed vertices, or with more than MOST_MOVING at moving vertices for each of
   them, is a protrusion or a whole component: its membrane would shrink to nothing. (Six rings of a plain lattice
   have six for each.) */
enum { LEAST_FIXED = 4, MOST_MOVING = 8 };

/* ---- the surface at each vertex and quad */

static qw_vec3 corner_cross(const qw_window *p, uint32_t h)
{
    qw_vec3 at = p->position[p->corner[h]];
    return qw_cross(qw_sub(p->position[p->corner[qw_quad_next(h)]], at),
                    qw_sub(p->position[p->corner[qw_quad_prev(h)]], at));
}

static float side_length2(const qw_window *p, uint32_t h)
{
    return qw_length2(qw_sub(p->position[p->corner[qw_quad_next(h)]], p->position[p->corner[h]]));
}

static qw_vec3 cross_of(const qw_window *p, uint32_t f) { return qw_quad_cross(p->position, p->corner + 4 * f); }

/* The surface below the middle of each quad, on the sheet that its neighbours face. */
static void look_up(const qw_repair_site *s, qw_window *p)
{
    uint32_t part = qw_window_component(s, p);
    for (uint32_t f = 0; f < p->quads.face_count; f++) {
        qw_vec3 middle = qw_quad_middle(p->position, p->corner + 4 * f), around = {0, 0, 0};
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++)
            if (p->twin[h] != QW_NONE) around = qw_add(around, cross_of(p, p->twin[h] / 4));
        qw_hit hit = qw_bvh_nearest_of(s->tree, part, middle, qw_normalize(around), QW_SAME_SHEET, INFINITY, QW_NONE);
        p->foot[f] = hit.face == QW_NONE ? middle : hit.point;
        p->up[f] = hit.face == QW_NONE ? qw_normalize(around) : qw_normalize(qw_face_cross(s->surface, hit.face));
    }
}

static qw_vec3 up_at(const qw_window *p, uint32_t v)
{
    qw_vec3 n = {0, 0, 0};
    for (uint32_t k = p->begin[v]; k < p->begin[v + 1]; k++) n = qw_add(n, p->up[p->around[k] / 4]);
    return qw_normalize(n);
}

static qw_vec3 normal_at(const qw_window *p, uint32_t v)
{
    qw_vec3 n = {0, 0, 0};
    for (uint32_t k = p->begin[v]; k < p->begin[v + 1]; k++) n = qw_add(n, qw_normalize(cross_of(p, p->around[k] / 4)));
    return qw_normalize(n);
}

static void put(const qw_repair_site *s, qw_window *p, uint32_t v, const qw_hit *hit)
{
    if (hit->face == QW_NONE) return;
    p->position[v] = hit->point, p->ground[v] = qw_normalize(qw_face_cross(s->surface, hit->face));
}

/* ---- the membrane */

/* Whether enough of the window's vertices are fixed for a membrane (LEAST_FIXED, MOST_MOVING). */
static bool is_hung(const qw_window *p)
{
    uint32_t moving = 0, fixed;
    for (uint32_t k = 0; k < p->moving_count; k++) moving += p->begin[p->moving[k] + 1] - p->begin[p->moving[k]];
    fixed = 4 * p->quads.face_count - moving;
    return fixed >= LEAST_FIXED && moving <= MOST_MOVING * fixed;
}

static bool is_curve(const qw_window *p, uint32_t h) { return p->twin[h] == QW_NONE || p->mark[h]; }

/* The mean of v's neighbours, or of those along curves; v itself where there are none. */
static qw_vec3 middle_of_neighbours(const qw_window *p, uint32_t v, bool on_curve)
{
    qw_vec3 sum = {0, 0, 0};
    float count = 0;
    for (uint32_t k = p->begin[v]; k < p->begin[v + 1]; k++) {
        uint32_t h = p->around[k], back = qw_quad_prev(h);
        if (!on_curve || is_curve(p, h)) sum = qw_add(sum, p->position[p->corner[qw_quad_next(h)]]), count += 1;
        if (p->twin[back] == QW_NONE) sum = qw_add(sum, p->position[p->corner[back]]), count += 1;
    }
    return count > 0 ? qw_scale(sum, 1 / count) : p->position[v];
}

/* Moves each vertex to the middle of its neighbours, those on curves along them. */
static void spread_once(const qw_repair_site *s, qw_window *p)
{
    for (uint32_t k = 0; k < p->moving_count; k++) {
        uint32_t v = p->moving[k];
        qw_vec3 to = middle_of_neighbours(p, v, p->role[v] != QW_ROLE_FREE);
        if (p->role[v] == QW_ROLE_BOUND) to = qw_slide_bound(&s->curves, &p->edge[v], to);
        if (p->role[v] == QW_ROLE_CORNER) to = qw_curve_nearest(s->all_curves, to, INFINITY).point;
        p->position[v] = to;
    }
}

/* Brings free vertices back to the surface. */
static void settle(const qw_repair_site *s, qw_window *p)
{
    assert(p->moving_count <= p->quads.vertex_count);
    uint32_t part = qw_window_component(s, p);
    for (uint32_t k = 0; k < p->moving_count; k++) {
        uint32_t v = p->moving[k];
        if (p->role[v] != QW_ROLE_FREE) continue;
        qw_vec3 at = p->position[v];
        float far = MOST_DOWN * s->edge;
        qw_hit hit = qw_bvh_nearest_of(s->tree, part, at, normal_at(p, v), QW_SAME_SHEET, far, QW_NONE);
        if (hit.face == QW_NONE) hit = qw_bvh_nearest_of(s->tree, part, at, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
        put(s, p, v, &hit);
    }
}

static void spread(const qw_repair_site *s, qw_window *p)
{
    for (int sweep = 0; sweep < SPREADS; sweep++) spread_once(s, p);
    settle(s, p);
}

/* Spreads the window out, then alternates between the surface and the membrane. The best that was found is kept. */
static void try_membrane(qw_repair_site *s, qw_window *p)
{
    if (!is_hung(p)) return;
    spread(s, p);
    for (int i = 0; i < SETTLINGS && s->budget > 0; i++) {
        if (qw_window_keep_better(s, p) && qw_is_faultless(p->faults)) return;
        spread_once(s, p);
        settle(s, p);
    }
    qw_window_restore(p);
}

/* ---- the search */

/* What quad f costs: facing against the surface, lying off it, and corners that are not square. */
static double cost_of(const qw_repair_site *s, const qw_window *p, uint32_t f)
{
    qw_vec3 area = cross_of(p, f), n = qw_normalize(area);
    double cost = qw_dot(n, p->up[f]) < 0 ? AGAINST : 0;
    double lifted = qw_dot(qw_sub(qw_quad_middle(p->position, p->corner + 4 * f), p->foot[f]), p->up[f]);
    cost += LIFT * lifted * lifted / fmax(0.5 * (double)qw_length(area), (double)s->least_area);
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
        float lengths = sqrtf(side_length2(p, h) * side_length2(p, qw_quad_prev(h)));
        float sine = lengths > 0 ? qw_dot(corner_cross(p, h), n) / lengths : 0; /* below 0 at an inverted corner */
        double poor = fmax((double)(LEAST_SINE - sine), 0), lacks = 1 - (double)sine;
        cost += PULL * poor * poor + lacks * lacks;
    }
    return cost;
}

static float edge_at(const qw_window *p, uint32_t v)
{
    float sum = 0;
    for (uint32_t k = p->begin[v]; k < p->begin[v + 1]; k++) sum += sqrtf(side_length2(p, p->around[k]));
    return sum / (float)(p->begin[v + 1] - p->begin[v]);
}

typedef struct place_search {
    qw_repair_site *site;
    qw_window *window;
    float step;      /* in mean lengths of the edges around a vertex */
    qw_vec3 normal;  /* at the vertex that is searched */
    uint32_t hint;   /* a triangle of the surface that may be near, or QW_NONE */
    uint64_t looked; /* triangles that it has looked at */
} place_search;

/* For qw_step_search: the plane in which v tries steps, and their length. */
static double frame_of(void *user, uint32_t v, qw_spot *here, qw_vec3 axis[2])
{
    place_search *s = user;
    const qw_window *p = s->window;
    qw_vec3 up = s->normal = up_at(p, v);
    s->hint = QW_NONE;
    here->up = p->ground[v], here->on = p->edge[v];
    axis[0] = qw_any_orthogonal(up), axis[1] = qw_cross(up, axis[0]);
    qw_spend(s->site, 1, s->looked), s->looked = 0;
    return (double)(s->step * edge_at(p, v));
}

/* Onto its curve if v is bound to one, else onto the surface. */
static bool land(void *user, uint32_t v, const double aimed[3], qw_spot *spot)
{
    place_search *t = user;
    qw_repair_site *s = t->site;
    const qw_window *p = t->window;
    qw_vec3 from = qw_v3_of_doubles(spot->at), to = qw_v3_of_doubles(aimed), point;
    float length = qw_distance(to, from);
    if (p->role[v] == QW_ROLE_BOUND) {
        point = qw_slide_bound(&s->curves, &spot->on, to);
    } else if (p->role[v] == QW_ROLE_CORNER) {
        qw_curve_hit hit = qw_curve_nearest(s->all_curves, to, length);
        point = hit.point;
        if (hit.segment == QW_NONE || qw_distance(point, p->home[v]) > MOST_ALONG_CURVE * s->edge) return false;
    } else {
        uint32_t part = qw_window_component(s, p);
        qw_hit hit = qw_bvh_nearest_of(s->tree, part, to, t->normal, QW_SAME_SHEET, length, t->hint);
        t->looked += hit.looked;
        if (hit.face == QW_NONE) return false;
        t->hint = hit.face, point = hit.point, spot->up = qw_normalize(qw_face_cross(s->surface, hit.face));
    }
    qw_to_doubles(point, spot->at);
    return true;
}

static void put_spot(void *user, uint32_t v, const qw_spot *spot)
{
    qw_window *p = ((const place_search *)user)->window;
    p->ground[v] = spot->up, p->edge[v] = spot->on;
}

static double cost_at(void *user, uint32_t v, uint32_t f)
{
    (void)v;
    const place_search *s = user;
    return cost_of(s->site, s->window, f);
}

/* Lets each vertex search for a better place, with smaller steps where no vertex finds one. */
static void try_search(qw_repair_site *s, qw_window *p)
{
    assert(p->quads.face_count <= QW_WINDOW_FACES);
    look_up(s, p);
    memset(p->awake, 1, sizeof p->awake);
    place_search t = {s, p, FIRST_STEP, {0, 0, 0}, QW_NONE, 0};
    const qw_step_search search = {p->corner, p->position, NULL,     p->begin, p->around, p->awake,
                                   1,         &t,          frame_of, land,     put_spot,  cost_at};
    for (int i = 0; i < SWEEPS && t.step > LEAST_STEP && s->budget >= p->moving_count; i++) {
        if (qw_search_all(&search, p->moving, p->moving_count)) continue;
        t.step *= 0.5f;
        memset(p->awake, 1, sizeof p->awake);
    }
    qw_window_keep_better(s, p);
    qw_window_restore(p);
}

void qw_window_place(qw_repair_site *s, qw_window *p, qw_placing placing)
{
    assert(p->quads.face_count > 0);
    if (qw_is_faultless(p->faults)) return;
    if (placing == QW_MEMBRANE) try_membrane(s, p);
    if (placing == QW_SEARCH) try_search(s, p);
    if (placing == QW_MEMBRANE_SEARCH) {
        spread(s, p);
        try_search(s, p);
    }
}

/* ---- back to the curves */

/* Of the quads around v. */
static qw_faults faults_around(qw_repair_site *s, const qw_window *p, uint32_t v)
{
    qw_faults sum = {0, 0, 0};
    for (uint32_t k = p->begin[v]; k < p->begin[v + 1]; k++)
        qw_add_faults(&sum, qw_window_faults_of(s, p, p->around[k] / 4), 1);
    return sum;
}

/* Moves v to `to` if that adds no faults; returns whether it did. */
static bool may_go(qw_repair_site *s, qw_window *p, uint32_t v, qw_vec3 to)
{
    qw_vec3 from = p->position[v], ground = p->ground[v];
    qw_faults now = p->faults;
    qw_add_faults(&now, faults_around(s, p, v), -1);
    p->position[v] = to, p->ground[v] = qw_v3(0, 0, 0);
    qw_add_faults(&now, faults_around(s, p, v), 1);
    if (!qw_fewer_faults(p->faults, now)) {
        p->faults = now;
        return true;
    }
    p->position[v] = from, p->ground[v] = ground;
    return false;
}

void qw_window_put_on_curves(qw_repair_site *s, qw_window *p)
{
    assert(p->moving_count <= p->quads.vertex_count);
    for (uint32_t k = 0; k < p->moving_count; k++) {
        uint32_t v = p->moving[k];
        if (p->role[v] != QW_ROLE_CORNER) continue;
        if (qw_distance(p->position[v], p->home[v]) == 0 || may_go(s, p, v, p->home[v])) continue;
        qw_vec3 half = qw_lerp(p->position[v], p->home[v], 0.5f);
        may_go(s, p, v, qw_curve_nearest(s->all_curves, half, INFINITY).point);
    }
    qw_window_save(p);
}
