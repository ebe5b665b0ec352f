#include "remesh/sizes/nests.h"

#include "base/elementary.h"
#include "geometry/bvh.h"
#include "geometry/harmonic.h"
#include "remesh/sizes/necks.h"
#include "remesh/sizes/scale.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A band is as wide as so many radii of the circle of its curve's length: beside what a person drew, and dents, one, so
   that the rings asked for are near, beside necks more, as a limb goes on. */
static const double WIDEST_FLAT = 1 / (2 * QW_PI), WIDEST_NECK = 3 / (2 * QW_PI);
/* Where a band of the wanted width is no annulus, narrower ones are tried, each by this share. */
enum { TRIES = 10 };
/* Near the far rim of a band, above this value, the harmonic function follows its jags. The band is found wider than
   the rings need by so many edges, and directions are set half an edge beyond
   them. From there to those of the middle so many edges at least are free. */
static const double SMOOTH = 0.9;
static const float SPARE = 2, BEYOND = 0.5f;
/* A band ends where its lines are this many times as long as the curve, or as short as this share of it: all have as
   many quads around, which are that much larger or smaller there. Sizes grow with the lines around; they do not shrink
   with them, as rows would be too thin. */
static const double MOST_RATIO = 2.5, LEAST_RATIO = 0.6;
/* No nest needs more than this many times what it may reach; what a curve encloses lies no farther. */
static const float FAR = 3;

/* A mesh with the curves of nests in it. */
typedef struct nesting {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_nests *nests;
    uint32_t count;   /* edges of all curves */
    uint32_t *half;   /* uint32_t[count]: their half-edges that run as the polyline does */
    uint32_t *number; /* uint32_t[count]: the nest of each */
    float *distance;  /* float[vertices]: to the nearest curve, up to where it can matter */
    uint32_t *owner;  /* uint32_t[vertices]: the nest of that curve; QW_NONE: too far from all */
    uint8_t *beside;  /* uint8_t[faces]: bits 1 << side: the curve runs along the face, which lies on that side of it */
    uint32_t *face_stamp, *vertex_stamp, stamp; /* [faces], [vertices]: the band that was grown last has `stamp` */
    uint32_t *face, face_count;                 /* its faces: uint32_t[faces] */
    int64_t euler;                              /* and its Euler number */
    bool ends;                                  /* it has a far rim */
} nesting;

static bool is_ring_edge(const qw_trimesh *m, uint32_t h) { return m->mark && (m->mark[h] & QW_MARK_RING); }

static bool is_closed(const qw_nest *n) { return qw_distance(n->point[0], n->point[n->point_count - 1]) == 0; }

/* The length of the whole ring, half of which an open curve is. */
static double ring_length(const qw_nest *n)
{
    double sum = 0;
    for (uint32_t i = 0; i + 1 < n->point_count; i++) sum += (double)qw_distance(n->point[i], n->point[i + 1]);
    return is_closed(n) ? sum : 2 * sum;
}

/* ---- curves in the mesh */

/* Which edges are whose: those that are marked as rings, by the polyline that is nearest. */
static void find_curves(nesting *g)
{
    qw_env *env = g->env;
    const qw_trimesh *m = g->mesh;
    uint32_t segments = 0, edges = 0;
    for (uint32_t i = 0; i < g->nests->count; i++) segments += g->nests->nest[i].point_count - 1;
    qw_vec3 *from = QW_NEW(env, qw_vec3, segments), *to = QW_NEW(env, qw_vec3, segments);
    uint32_t *nest = QW_NEW(env, uint32_t, segments);
    segments = 0;
    for (uint32_t i = 0; i < g->nests->count; i++)
        for (uint32_t k = 0; k + 1 < g->nests->nest[i].point_count; k++) {
            const qw_vec3 *p = g->nests->nest[i].point + k;
            if (qw_distance(p[0], p[1]) == 0) continue; /* drawn twice: it runs neither way */
            from[segments] = p[0], to[segments] = p[1], nest[segments++] = i;
        }
    const qw_curve_tree *tree = qw_curve_tree_build(env, from, to, segments);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) edges += is_ring_edge(m, h) && qw_stands_for_edge(m, h);
    g->half = QW_NEW(env, uint32_t, edges), g->number = QW_NEW(env, uint32_t, edges);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!is_ring_edge(m, h) || !qw_stands_for_edge(m, h)) continue;
        qw_vec3 way = qw_edge_way(m, h), middle = qw_madd(m->position[m->corner[h]], 0.5f, way);
        uint32_t s = qw_curve_nearest(tree, middle, INFINITY).segment;
        bool is_rim = m->twin[h] == QW_NONE; /* an opening, which has one side */
        uint32_t along = is_rim || qw_dot(way, qw_sub(to[s], from[s])) >= 0 ? h : m->twin[h];
        g->half[g->count] = along, g->number[g->count++] = nest[s];
        g->beside[along / 3] |= 1 << QW_LEFT;
        if (!is_rim) g->beside[m->twin[along] / 3] |= 1 << QW_RIGHT;
    }
}

/* What is nearer to each nest's curve than to the others, and no farther than the nest may reach with what it needs
   beside. */
static void share_out(nesting *g)
{
    qw_env *env = g->env;
    const qw_trimesh *m = g->mesh;
    uint8_t *is_from = QW_NEW(env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) g->distance[v] = INFINITY, g->owner[v] = QW_NONE;
    for (uint32_t i = 0; i < g->nests->count; i++) {
        const qw_nest *n = &g->nests->nest[i];
        float reach = FAR * fmaxf(n->reach[QW_LEFT], n->reach[QW_RIGHT]);
        memset(is_from, 0, m->vertex_count);
        for (uint32_t k = 0; k < g->count; k++)
            if (g->number[k] == i) is_from[m->corner[g->half[k]]] = is_from[m->corner[qw_next(g->half[k])]] = 1;
        float *distance = qw_distances(env, m, is_from, reach);
        for (uint32_t v = 0; v < m->vertex_count; v++)
            if (distance[v] < reach && distance[v] < g->distance[v]) g->distance[v] = distance[v], g->owner[v] = i;
        qw_free(env, distance);
    }
}

static nesting begin(qw_env *env, const qw_trimesh *mesh, const qw_nests *nests)
{
    nesting g = {.env = env, .mesh = mesh, .nests = nests};
    g.distance = QW_NEW(env, float, mesh->vertex_count), g.owner = QW_NEW(env, uint32_t, mesh->vertex_count);
    g.beside = QW_NEW_ZERO(env, uint8_t, mesh->face_count);
    g.face_stamp = QW_NEW_ZERO(env, uint32_t, mesh->face_count),
    g.vertex_stamp = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count), g.face = QW_NEW(env, uint32_t, mesh->face_count);
    find_curves(&g);
    share_out(&g);
    return g;
}

/* ---- a band */

static bool is_within(const nesting *g, uint32_t nest, uint32_t f, float reach)
{
    const uint32_t *c = g->mesh->corner + 3 * (size_t)f;
    for (int i = 0; i < 3; i++)
        if (g->owner[c[i]] != nest || g->distance[c[i]] > reach) return false;
    return true;
}

/* Whether the edge of h, which is one of the band's faces, bounds it. */
static bool is_rim(const nesting *g, uint32_t h)
{
    uint32_t t = g->mesh->twin[h];
    return t == QW_NONE || g->face_stamp[t / 3] != g->stamp || is_ring_edge(g->mesh, h);
}

/* The same, but for the curve and, beside half of one, the cut. */
static bool is_far_rim(const nesting *g, uint32_t nest, uint32_t h)
{
    bool is_cut = g->nests->is_half && g->mesh->twin[h] == QW_NONE && !is_closed(&g->nests->nest[nest]);
    return is_rim(g, h) && !is_ring_edge(g->mesh, h) && !is_cut;
}

/* Adds a face with its vertices to the band; returns how many of these are new in it. */
static uint32_t take_face(nesting *g, uint32_t f)
{
    uint32_t fresh = 0;
    g->face_stamp[f] = g->stamp, g->face[g->face_count++] = f;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t v = g->mesh->corner[3 * f + i];
        fresh += g->vertex_stamp[v] != g->stamp, g->vertex_stamp[v] = g->stamp;
    }
    return fresh;
}

/* Grows the band from the curve; false where it is no annulus (beside an open curve, no strip), or not all of the curve
   runs along it. */
static bool grow(nesting *g, uint32_t nest, int side, float reach)
{
    const qw_trimesh *m = g->mesh;
    int64_t vertices = 0, rim = 0;
    g->stamp++, g->face_count = 0, g->euler = 0, g->ends = false;
    for (uint32_t k = 0; k < g->count; k++) {
        if (g->number[k] != nest) continue;
        uint32_t h = side == QW_LEFT ? g->half[k] : m->twin[g->half[k]], f = h / 3;
        if (h == QW_NONE || !is_within(g, nest, f, reach)) return false;
        if (g->face_stamp[f] != g->stamp) vertices += take_face(g, f);
    }
    for (uint32_t i = 0; i < g->face_count; i++) {
        if (g->beside[g->face[i]] & ~(1 << side)) return false; /* it comes around to the other side */
        for (uint32_t h = 3 * g->face[i]; h < 3 * g->face[i] + 3; h++) {
            uint32_t t = m->twin[h];
            if (t == QW_NONE || is_ring_edge(m, h) || g->face_stamp[t / 3] == g->stamp) continue;
            if (is_within(g, nest, t / 3, reach)) vertices += take_face(g, t / 3);
        }
    }
    for (uint32_t i = 0; i < g->face_count; i++)
        for (uint32_t h = 3 * g->face[i]; h < 3 * g->face[i] + 3; h++)
            rim += is_rim(g, h), g->ends |= is_far_rim(g, nest, h);
    g->euler = vertices - (3 * (int64_t)g->face_count + rim) / 2 + g->face_count;
    return g->ends && g->euler == (is_closed(&g->nests->nest[nest]) ? 0 : 1);
}

/* The widest band up to this reach that can be had; 0: there is none. */
static float grow_widest(nesting *g, uint32_t nest, int side, float reach)
{
    for (int i = TRIES; i > 0; i--)
        if (grow(g, nest, side, reach * (float)i / TRIES)) return reach * (float)i / TRIES;
    return 0;
}

/* All that a curve encloses on one side, of which a cut leaves half; false where that is no disc, or reaches far beyond
   the nest. */
static bool grow_inside(nesting *g, uint32_t nest, int side)
{
    (void)grow(g, nest, side, FAR * g->nests->nest[nest].reach[side]);
    return g->euler == 1 && !g->ends;
}

/* The vertex at corner i of the faces that were grown last. */
static uint32_t corner_of(const nesting *g, uint32_t i) { return g->mesh->corner[3 * (size_t)g->face[i / 3] + i % 3]; }

/* ---- sizes */

/* By how much of its length a line at a small distance from the curve is longer, for each unit of that: out of the area
   of the band, whose far rim is at about the mean distance of its vertices. */
static double growth(const nesting *g, uint32_t nest, double length)
{
    const qw_trimesh *m = g->mesh;
    double area = 0, sum = 0, count = 0;
    for (uint32_t i = 0; i < g->face_count; i++) {
        area += 0.5 * (double)qw_length(qw_face_cross(m, g->face[i]));
        for (uint32_t h = 3 * g->face[i]; h < 3 * g->face[i] + 3; h++)
            if (is_far_rim(g, nest, h)) sum += (double)g->distance[m->corner[h]], count++;
    }
    double width = count > 0 ? sum / count : 0;
    return width > 0 ? 2 * (area / (width * length) - 1) / width : 0;
}

/* Of rows from the curve out that get longer in proportion to the lines along them, up to `ratio` times: the width of
   as many of the first one's width as one is wide in all. */
static double mean_row(double ratio) { return ratio < 1 + 1e-3 ? 1 : (ratio - 1) / qw_ln(ratio); }

/* What a band of a nest is like on one side. */
typedef struct side_fit {
    float width;  /* 0: none was found */
    double ratio; /* length of its far rim over that of the curve */
    double even;  /* the edge of as many quads of one size as are wanted on it */
} side_fit;

/* Of what was grown last. */
static double even_edge(const nesting *g, const float *size)
{
    double area = 0, quads = 0;
    for (uint32_t i = 0; i < g->face_count; i++) {
        double a = 0.5 * (double)qw_length(qw_face_cross(g->mesh, g->face[i]));
        area += a;
        for (uint32_t k = 0; k < 3; k++) {
            double edge = (double)size[corner_of(g, 3 * i + k)];
            quads += a / (3 * edge * edge);
        }
    }
    return sqrt(area / quads);
}

/* How wide one side of a nest may get, how much wider each row than the one before, and the edge there if all are
   even. */
static side_fit measure(nesting *g, uint32_t nest, int side, const float *size)
{
    const qw_nest *n = &g->nests->nest[nest];
    double length = ring_length(n) / (is_closed(n) ? 1 : 2);
    side_fit fit = {grow_widest(g, nest, side, n->reach[side]), 1, INFINITY};
    if (fit.width == 0) return fit;
    fit.even = even_edge(g, size);
    double by = growth(g, nest, length);
    double ratio = 1 + (double)fit.width * by;
    fit.ratio = fmin(fmax(ratio, LEAST_RATIO), MOST_RATIO);
    if (fit.ratio != ratio) fit.width = (float)((fit.ratio - 1) / by);
    return fit;
}

static double mean_on_curve(const nesting *g, uint32_t nest, const float *size)
{
    double sum = 0, count = 0;
    for (uint32_t k = 0; k < g->count; k++)
        if (g->number[k] == nest) sum += (double)size[g->mesh->corner[g->half[k]]], count++;
    return count > 0 ? sum / count : 0;
}

/* The area of what was grown last that lies farther from the curve. */
static double area_beyond(const nesting *g, float reach)
{
    double area = 0;
    for (uint32_t i = 0; i < g->face_count; i++) {
        double outer = 0;
        for (uint32_t k = 0; k < 3; k++) outer += g->distance[corner_of(g, 3 * i + k)] > reach ? 1.0 / 3 : 0;
        area += outer * 0.5 * (double)qw_length(qw_face_cross(g->mesh, g->face[i]));
    }
    return area;
}

static bool is_opening(const nesting *g, uint32_t nest)
{
    for (uint32_t k = 0; k < g->count; k++)
        if (g->number[k] == nest) return g->mesh->twin[g->half[k]] == QW_NONE;
    return false;
}

/* Writes the sizes in the band on one side: each is as long as the line there is for the quads around. What is smaller
   stays beside an opening, and on the side of a limb where lines get longer, as an eye may lie there beside an ear.
   What the rings enclose has as many quads around as the curve: a square of a quarter as many on each side. */
static void write_sizes(nesting *g, uint32_t nest, int side, const side_fit *fit, float *size)
{
    const qw_nest *n = &g->nests->nest[nest];
    if (fit->width == 0) return;
    bool all = grow_inside(g, nest, side), widens = n->kind == QW_LIMB && fit->ratio > 1,
         stays = widens || is_opening(g, nest);
    double halves = is_closed(n) ? 1 : 2;
    double middle = 2 * sqrt(QW_PI * halves * area_beyond(g, n->reach[side])) / ring_length(n);
    if (!all && grow_widest(g, nest, side, n->reach[side] + SPARE * n->edge) == 0) return;
    for (uint32_t i = 0; i < 3 * g->face_count; i++) {
        uint32_t v = corner_of(g, i);
        double longer = fmax(1 + (fit->ratio - 1) * (double)(g->distance[v] / fit->width), 1);
        bool is_band = !all || g->distance[v] <= n->reach[side];
        float most = n->edge * (float)(is_band ? longer : middle);
        size[v] = is_band && !stays ? most : fminf(size[v], most);
    }
}

/* The size of quads on the curve of a nest and, from that, beside it: so that all rings have room on both sides. */
static void fit_nest(nesting *g, uint32_t nest, float *size)
{
    qw_nest *n = &g->nests->nest[nest];
    if (n->kind == QW_DENT && is_opening(g, nest)) n->rings *= 2, n->most_rings *= 2; /* both sides' on one */
    side_fit fit[QW_SIDES];
    double radius = ring_length(n) / (2 * QW_PI);
    double edge = fmin(mean_on_curve(g, nest, size), ring_length(n) / QW_LEAST_AROUND);
    for (int side = 0; side < QW_SIDES; side++) fit[side] = measure(g, nest, side, size);
    /* around a limb the sizes on the curve are those of the band */
    if (n->kind == QW_DENT) edge = fmin(edge, fmin(fit[QW_LEFT].even, fit[QW_RIGHT].even));
    for (int side = 0; side < QW_SIDES; side++) /* a side with half the room that the inside of a circle has counts */
        if ((double)fit[side].width > 0.5 * (1 - LEAST_RATIO) * radius)
            edge = fmin(edge, (double)fit[side].width / (n->rings * mean_row(fit[side].ratio)));
    n->edge = (float)edge;
    for (int side = 0; side < QW_SIDES; side++) {
        float needed = n->edge * (float)(n->most_rings * mean_row(fit[side].ratio));
        n->reach[side] = fminf(needed, fit[side].width > 0 ? fit[side].width : n->reach[side]);
        write_sizes(g, nest, side, &fit[side], size);
    }
    for (uint32_t k = 0; k < g->count; k++)
        if (g->number[k] == nest)
            size[g->mesh->corner[g->half[k]]] = size[g->mesh->corner[qw_next(g->half[k])]] = n->edge;
}

void qw_fit_nests(qw_env *env, const qw_trimesh *surface, const qw_nests *nests, float *size)
{
    assert(surface->twin && size);
    if (nests->count == 0) return;
    qw_scope_begin(env);
    for (uint32_t i = 0; i < nests->count; i++) {
        qw_nest *n = &nests->nest[i];
        double widest = n->most_rings > 0 ? n->kind == QW_DENT ? WIDEST_FLAT : WIDEST_NECK : 0;
        n->reach[QW_LEFT] = n->reach[QW_RIGHT] = (float)(widest * ring_length(n));
    }
    nesting g = begin(env, surface, nests);
    for (uint32_t i = 0; i < nests->count; i++)
        if (nests->nest[i].most_rings > 0) fit_nest(&g, i, size);
    qw_scope_end(env);
}

void qw_unmark_nests(qw_env *env, qw_trimesh *m, const qw_nests *nests)
{
    bool all = true;
    for (uint32_t i = 0; i < nests->count; i++) all &= nests->nest[i].most_rings > 0;
    if (all) return;
    qw_scope_begin(env);
    nesting g = {.env = env, .mesh = m, .nests = nests, .beside = QW_NEW_ZERO(env, uint8_t, m->face_count)};
    find_curves(&g);
    for (uint32_t k = 0; k < g.count; k++)
        if (nests->nest[g.number[k]].most_rings == 0) {
            uint32_t twin = m->twin[g.half[k]];
            m->mark[g.half[k]] = 0;
            if (twin != QW_NONE) m->mark[twin] = 0;
        }
    qw_scope_end(env);
}

/* ---- directions */

/* The harmonic function on the band that was grown last: 0 on the curve, 1 on the far rim. Where an open curve ends in
   a cut nothing is fixed along that. In the current scope. */
static qw_harmonic solve(const nesting *g, bool at_boundary)
{
    const qw_trimesh *m = g->mesh;
    qw_harmonic p = qw_harmonic_begin(g->env, m, g->face, g->face_count, g->face_stamp, g->stamp);
    for (uint32_t i = 0; i < g->face_count; i++)
        for (uint32_t h = 3 * g->face[i]; h < 3 * g->face[i] + 3; h++) {
            if (!is_rim(g, h) || (m->twin[h] == QW_NONE && !at_boundary)) continue;
            uint32_t ends[2] = {p.place[m->corner[h]], p.place[m->corner[qw_next(h)]]};
            for (int k = 0; k < 2; k++) p.is_fixed[ends[k]] = 1, p.value[ends[k]] = 1;
        }
    for (uint32_t i = 0; i < p.count; i++)
        if (g->distance[p.vertex[i]] == 0) p.is_fixed[i] = 1, p.value[i] = 0;
    qw_harmonic_solve(g->env, &p);
    return p;
}

/* Directions along the lines of equal value. way: 1 or -1, so that both sides of a curve run the same way around. */
static int64_t write_directions(const nesting *g, const qw_harmonic *p, float way, float reach,
                                const uint8_t *constraint, qw_vec3 *direction)
{
    qw_vec3 *along = qw_harmonic_lines(g->env, p);
    int64_t count = 0;
    for (uint32_t i = 0; i < p->count; i++) {
        uint32_t v = p->vertex[i];
        if (constraint[v] != QW_VERTEX_FREE || p->value[i] > SMOOTH || g->distance[v] > reach ||
            qw_length2(along[i]) == 0)
            continue;
        direction[v] = qw_scale(qw_normalize(along[i]), way);
        count++;
    }
    return count;
}

/* The longer axis of a curve; of half of one the line in the plane of symmetry, which is an axis too. */
static qw_vec3 axis_of(const qw_nest *n)
{
    uint32_t steps = n->point_count - 1;
    if (!is_closed(n)) return qw_normalize(qw_sub(n->point[steps], n->point[0]));
    qw_vec3 sum = qw_v3(0, 0, 0), axis = sum;
    for (uint32_t i = 0; i < steps; i++) sum = qw_add(sum, n->point[i]);
    for (uint32_t i = 0; i < steps; i++) {
        qw_vec3 out = qw_madd(n->point[i], -1 / (float)steps, sum);
        if (qw_length2(out) > qw_length2(axis)) axis = out;
    }
    return qw_normalize(axis);
}

/* In the middle of what a curve encloses the field runs one way, along the curve's longer axis: so the four cones of a
   long oval come to lie beside one another at its ends, not one behind the other, where the first would be near the
   curve. Not in what was found: limbs end in other ways. The whole of the inside was grown last. */
static void direct_middle(const nesting *g, const qw_nest *n, float reach, const uint8_t *constraint,
                          qw_vec3 *direction)
{
    float deepest = 0;
    for (uint32_t i = 0; i < 3 * g->face_count; i++) deepest = fmaxf(deepest, g->distance[corner_of(g, i)]);
    float least = fmaxf((reach + deepest) / 2, reach + SPARE * n->edge);
    qw_vec3 axis = axis_of(n);
    for (uint32_t i = 0; i < 3 * g->face_count; i++) {
        uint32_t v = corner_of(g, i);
        if (constraint[v] == QW_VERTEX_FREE && g->distance[v] > least) direction[v] = axis;
    }
}

/* The directions of a nest's curve at its vertices. */
static void direct_curve(const nesting *g, uint32_t nest, qw_vec3 *direction)
{
    const qw_trimesh *m = g->mesh;
    for (int round = 0; round < 2; round++) /* sums of the unit edges, then their directions */
        for (uint32_t k = 0; k < g->count; k++) {
            if (g->number[k] != nest) continue;
            uint32_t ends[2] = {m->corner[g->half[k]], m->corner[qw_next(g->half[k])]};
            for (int i = 0; i < 2; i++)
                direction[ends[i]] = round ? qw_normalize(direction[ends[i]])
                                           : qw_add(direction[ends[i]], qw_normalize(qw_edge_way(m, g->half[k])));
        }
}

int64_t qw_direct_nests(qw_env *env, const qw_trimesh *mesh, const qw_nests *nests, const uint8_t *constraint,
                        qw_vec3 *direction)
{
    assert(mesh->twin && constraint && direction);
    if (nests->count == 0) return 0;
    int64_t count = 0;
    qw_scope_begin(env);
    nesting g = begin(env, mesh, nests);
    for (uint32_t i = 0; i < nests->count; i++) {
        if (nests->nest[i].most_rings == 0) continue;
        direct_curve(&g, i, direction);
        for (int side = 0; side < QW_SIDES; side++) {
            const qw_nest *n = &nests->nest[i];
            if (grow_widest(&g, i, side, n->reach[side] + SPARE * n->edge) == 0) continue;
            qw_scope_begin(env);
            qw_harmonic p = solve(&g, is_closed(n));
            count += write_directions(&g, &p, side == QW_LEFT ? 1 : -1, n->reach[side] + BEYOND * n->edge, constraint,
                                      direction);
            qw_scope_end(env);
            if (n->kind == QW_DENT && grow_inside(&g, i, side))
                direct_middle(&g, n, n->reach[side], constraint, direction);
        }
    }
    qw_scope_end(env);
    return count;
}
