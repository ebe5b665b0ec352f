#include "remesh/sizes/around.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "geometry/corners.h"
#include "remesh/sizes/bends.h"
#include "remesh/sizes/cells.h"
#include "remesh/sizes/density.h"
#include "remesh/sizes/scale.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Sizes of what bends little grow at most so many times to make room. */
static const double MOST_GROWN = 2;
/* In radians: pieces of a curve that turn by less are one. */
static const float STRAIGHT = 2e-3f;
/* Single precision has no smaller circles in the frame. */
static const float LEAST_RADIUS = 1e-6f;
enum {
    PIECES = 512, /* of a curve are looked at for each circle, at most */
    LOOKS = 8,    /* rounds of averaging after which a bend counts as it is */
    HALVES = 12   /* of an interval, to where the count is met */
};

/* ---- circles of curves */

typedef struct curves {
    const qw_trimesh *mesh;
    const qw_curve_ends *ends;
    float corner, straight; /* cosines of the angles from which on a curve has a corner, and turns at all */
} curves;

/* A straight piece of a curve, on the way outward. */
typedef struct piece {
    uint32_t from, last, to; /* its first vertex, the one before its last, its last */
} piece;

static qw_vec3 way(const curves *c, uint32_t from, uint32_t to)
{
    return qw_sub(c->mesh->position[to], c->mesh->position[from]);
}

/* The whole piece that begins with an edge. */
static piece piece_from(const curves *c, uint32_t from, uint32_t to)
{
    piece p = {from, from, to};
    for (uint32_t k = 0; k < c->mesh->vertex_count && c->ends[p.to].count == 2; k++) {
        uint32_t next = qw_curve_beyond(c->ends, p.last, p.to);
        if (next == from ||
            qw_turns_sharply(c->mesh->position[from], c->mesh->position[p.to], c->mesh->position[next], c->straight))
            break;
        p.last = p.to, p.to = next;
    }
    return p;
}

/* The radius of the circle that a curve follows at an edge of it: between the middles of pieces on either side of it,
   between which it turns by that angle. INFINITY where it turns less up to its ends and corners. */
static double radius_at(const curves *c, uint32_t a, uint32_t b, double least)
{
    piece end[2] = {piece_from(c, b, a), piece_from(c, a, b)};
    end[0].from = end[1].to, end[1].from = end[0].to; /* one piece */
    double length = 0;
    bool grows = true;
    for (int k = 0; grows && k < PIECES; k++) {
        grows = false;
        for (int i = 0; i < 2; i++) {
            if (qw_is_curve_corner(c->mesh, c->ends, end[i].to, c->corner)) continue;
            piece next = piece_from(c, end[i].to, qw_curve_beyond(c->ends, end[i].last, end[i].to));
            length += 0.5 * (double)(qw_length(way(c, end[i].from, end[i].to)) + qw_length(way(c, next.from, next.to)));
            end[i] = next, grows = true;
        }
        qw_vec3 x = way(c, end[0].to, end[0].from), y = way(c, end[1].from, end[1].to);
        double turned = qw_atan2((double)qw_length(qw_cross(x, y)), (double)qw_dot(x, y));
        if (turned >= least) return length / turned;
    }
    return INFINITY;
}

/* The radius of each curve where it bends, as a bound for the size at its vertices. */
static void find_in_curves(qw_env *env, const qw_trimesh *m, double least, bool with_boundary, float *radius)
{
    curves c = {m, qw_find_curve_ends(env, m, with_boundary), (float)qw_cos(QW_CORNER_ANGLE),
                (float)qw_cos((double)STRAIGHT)};
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!qw_is_curve_edge(m, h, with_boundary) || !qw_stands_for_edge(m, h)) continue;
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        float r = (float)radius_at(&c, a, b, least);
        radius[a] = fminf(radius[a], r), radius[b] = fminf(radius[b], r);
    }
    qw_free(env, (void *)c.ends);
}

/* ---- circles of the surface */

/* A bend counts where the surface turns by half that angle over what was looked at: that of a vertex alone on facets,
   of more and more around it on fine triangles, so that what noise bends to and fro adds up to nothing. */
static void find_in_surface(qw_env *env, const qw_trimesh *m, double least, float *radius)
{
    uint32_t n = m->vertex_count;
    qw_scope_begin(env);
    qw_cells each = qw_cells_of_vertices(env, m);
    qw_bends *sums = qw_sum_bends(env, m, NULL, n);
    float *width = QW_NEW(env, float, n);
    for (uint32_t v = 0; v < n; v++) width[v] = sqrtf(sums[v].area);
    for (int look = 0; look <= LOOKS; look++) {
        double widened = 1 + sqrt((double)look);
        for (uint32_t v = 0; v < n; v++) {
            double k[2];
            if (radius[v] < INFINITY) continue;
            qw_principal_curvatures(&sums[v], k);
            double bend = fmax(fabs(k[0]), fabs(k[1]));
            if (look == LOOKS || bend * widened * (double)width[v] >= 0.5 * least)
                radius[v] = bend > 0 ? (float)(1 / bend) : INFINITY;
        }
        qw_cells_spread(env, &each, &sums->area, QW_BENDS, 1);
        qw_heartbeat(env);
    }
    qw_scope_end(env);
}

/* ---- long edges that are cut */

/* The half-edge from a vertex that goes on in a direction, as the pieces of an edge do; QW_NONE where none does:
   rounding bends the pieces of needles. */
static uint32_t straight_on(const qw_trimesh *m, const uint32_t *outgoing, uint32_t v, qw_vec3 d)
{
    uint32_t best = QW_NONE, h = outgoing[v];
    float most = (float)QW_PARALLEL_COSINE;
    do {
        float cosine = qw_dot(qw_normalize(qw_edge_way(m, h)), d);
        if (cosine > most) most = cosine, best = h;
        h = m->twin[qw_prev(h)];
    } while (h != QW_NONE && h != outgoing[v]);
    return best;
}

/* On facets: their widths over the angle between them. INFINITY where they are one plane, or the edge is a curve. */
static float radius_across(const qw_trimesh *m, uint32_t h, bool with_boundary)
{
    uint32_t t = m->twin[h];
    if (t == QW_NONE || qw_is_curve_edge(m, h, with_boundary)) return INFINITY;
    qw_vec3 n = qw_face_cross(m, h / 3), o = qw_face_cross(m, t / 3);
    float width = 0.5f * (qw_length(n) + qw_length(o)) / qw_length(qw_edge_way(m, h)),
          turn = (float)qw_atan2((double)qw_length(qw_cross(n, o)), (double)qw_dot(n, o));
    return turn >= STRAIGHT ? width / turn : INFINITY;
}

/* Cylinders and cones of long facets have no vertices but at their ends. */
static void find_along_edges(qw_env *env, const qw_trimesh *m, const qw_trimesh *cut, bool with_boundary, float *radius)
{
    uint32_t *outgoing = qw_trimesh_outgoing(env, cut);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!qw_stands_for_edge(m, h)) continue;
        float r = radius_across(m, h, with_boundary);
        uint32_t v = m->corner[h];
        qw_vec3 d = qw_normalize(qw_edge_way(m, h));
        for (uint32_t k = 0; r < INFINITY && k < cut->vertex_count; k++) {
            uint32_t next = straight_on(cut, outgoing, v, d);
            if (next == QW_NONE) break;
            v = cut->corner[qw_next(next)];
            if (v < m->vertex_count) break;
            radius[v] = fminf(radius[v], r);
        }
    }
    qw_free(env, outgoing);
}

float *qw_find_circles(qw_env *env, const qw_trimesh *mesh, const qw_trimesh *cut, double least, bool with_boundary)
{
    assert(mesh->twin && least > 0 && cut->vertex_count >= mesh->vertex_count);
    uint32_t n = cut->vertex_count;
    float *radius = QW_NEW(env, float, n);
    for (uint32_t v = 0; v < n; v++) radius[v] = INFINITY;
    find_in_surface(env, mesh, least, radius);
    find_in_curves(env, mesh, least, with_boundary, radius);
    if (n > mesh->vertex_count) find_along_edges(env, mesh, cut, with_boundary, radius);
    for (uint32_t v = 0; v < n; v++) radius[v] = 1 / fmaxf(radius[v], LEAST_RADIUS);
    return radius;
}

/* ---- within the count */

enum { GIVEN, CIRCLES, YIELDING }; /* what gives way, in this order */

typedef struct fitting {
    qw_env *env;
    const qw_trimesh *mesh;
    const float *bend, *given;
    double turn;
    double factor[YIELDING]; /* by which each is larger than asked for */
    float *size;
} fitting;

/* Sets the sizes. As many edges around farther out: they grow by an edge's turn. Returns how many quads they make. */
static double set_sizes(const fitting *t)
{
    const qw_trimesh *m = t->mesh;
    float given = (float)t->factor[GIVEN], turn = (float)(t->factor[CIRCLES] * t->turn);
    for (uint32_t v = 0; v < m->vertex_count; v++)
        t->size[v] = t->bend[v] > 0 ? fminf(given * t->given[v], turn / t->bend[v]) : given * t->given[v];
    qw_limit_gradation(t->env, m, t->size, (float)t->turn);
    return qw_quads_of_size(m, t->size);
}

/* Finds the factor, from 1 to the most, with which no more quads are made than there are to be; its logarithm is
   halved. False where there is none. */
static bool find_room(fitting *t, double quads, int yielding, double most)
{
    double low = 0, high = qw_ln(most);
    t->factor[yielding] = most;
    if (set_sizes(t) > quads) return false;
    for (int i = 0; i < HALVES; i++) {
        double middle = 0.5 * (low + high);
        t->factor[yielding] = qw_exp(middle);
        if (set_sizes(t) > quads) low = middle;
        else high = middle;
        qw_heartbeat(t->env);
    }
    t->factor[yielding] = qw_exp(high);
    return true;
}

void qw_fit_around(qw_env *env, const qw_trimesh *mesh, const float *bend, double turn, float *size)
{
    const double most[YIELDING] = {MOST_GROWN, 1e3};
    assert(turn > 0 && mesh->twin && size);
    uint32_t n = mesh->vertex_count;
    float *given = QW_NEW(env, float, n);
    memcpy(given, size, n * sizeof *given);
    fitting t = {env, mesh, bend, given, turn, {1, 1}, size};
    double quads = qw_quads_of_size(mesh, given);
    bool fits = set_sizes(&t) <= quads;
    for (int k = 0; k < YIELDING && !fits; k++) fits = find_room(&t, quads, k, most[k]);
    set_sizes(&t);
    qw_log(env, QW_LOG_DEBUG, "for full circles sizes grow by %.3g, and edges on circles by %.3g", t.factor[GIVEN],
           t.factor[CIRCLES]);
    qw_free(env, given);
}
