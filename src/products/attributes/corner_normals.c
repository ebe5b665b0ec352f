#include "products/attributes/corner_normals.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "base/groups.h"

#include <assert.h>
#include <math.h>

/* Edges are kept for other reasons, too (borders of materials, seams of a texture): they are sharp where the normals of
   their quads differ by more than this, 15 degrees, as a cosine. */
static const float SHARP_COSINE = 0.9659258f;

typedef struct fans {
    const qw_quadmesh *quads;
    bool split;
    float *normal; /* as of qw_shading_normals */
} fans;

/* What a corner that is bent inward weighs, in radians: the quad as a whole says more there. */
static const float BENT_INWARD = 1e-3f;

/* The normal of a quad at the corner of its half-edge h, as long as its angle there, in radians. */
static qw_vec3 corner_normal(const qw_quadmesh *q, uint32_t h)
{
    assert(h < 4 * q->face_count);
    qw_vec3 at = q->position[q->corner[h]], a = qw_sub(q->position[q->corner[qw_quad_next(h)]], at),
            b = qw_sub(q->position[q->corner[qw_quad_prev(h)]], at), across = qw_cross(a, b);
    qw_vec3 whole = qw_quad_normal(q, h / 4);
    if (qw_dot(across, whole) <= 0) return qw_scale(whole, BENT_INWARD);
    double angle = qw_atan2((double)qw_length(across), (double)qw_dot(a, b));
    return qw_scale(qw_normalize(across), (float)angle);
}

/* The edge between the quads of h and of its twin. */
static bool is_sharp(const qw_quadmesh *q, uint32_t h)
{
    uint32_t t = q->twin[h];
    return q->mark && (qw_is_hard(q->mark[h]) || qw_is_hard(q->mark[t])) &&
           qw_dot(qw_quad_normal(q, h / 4), qw_quad_normal(q, t / 4)) < SHARP_COSINE;
}

static void put(const fans *f, uint32_t h, qw_vec3 n)
{
    float *to = f->normal + 3 * (size_t)(f->split ? h : f->quads->corner[h]);
    to[0] = n.x, to[1] = n.y, to[2] = n.z;
}

/* The half-edge at which a sector of the fan of `first` begins: a sharp one where the fan has one. */
static uint32_t begin_of(const fans *f, uint32_t first)
{
    assert(first < 4 * f->quads->face_count);
    uint32_t h = first;
    if (!f->split || f->quads->twin[first] == QW_NONE) return first; /* fans at a boundary begin there */
    do {
        if (f->quads->twin[h] != QW_NONE && is_sharp(f->quads, h)) return h;
        h = qw_quad_around(f->quads, h);
    } while (h != QW_NONE && h != first);
    return first;
}

/* Normals of all corners around the vertex of half-edge `first`: one for each sector between sharp edges. */
static void shade_fan(const fans *f, uint32_t first)
{
    assert(first < 4 * f->quads->face_count);
    const qw_quadmesh *q = f->quads;
    uint32_t begin = begin_of(f, first), h = begin;
    while (h != QW_NONE) { /* a sector a turn */
        qw_vec3 sum = {0, 0, 0};
        uint32_t end = h;
        do {
            sum = qw_add(sum, corner_normal(q, end));
            end = qw_quad_around(q, end);
        } while (end != QW_NONE && end != begin && !(f->split && is_sharp(q, end)));
        qw_vec3 n = qw_normalize(sum);
        if (qw_length2(n) == 0) n = qw_quad_normal(q, h / 4);
        do {
            put(f, h, n);
            h = qw_quad_around(q, h);
        } while (h != end);
        if (end == begin) break;
    }
}

float *qw_shading_normals(qw_env *env, const qw_quadmesh *quads, bool split)
{
    assert(quads->twin && quads->position);
    size_t count = split ? 4 * (size_t)quads->face_count : quads->vertex_count;
    fans f = {quads, split, QW_NEW_ZERO(env, float, 3 * count)};
    uint32_t *first = qw_quadmesh_outgoing(env, quads);
    for (uint32_t v = 0; v < quads->vertex_count; v++)
        if (first[v] != QW_NONE) shade_fan(&f, first[v]);
    qw_free(env, first);
    return f.normal;
}

/* ---- quads together with other polygons */

typedef struct dvec {
    double c[3];
} dvec;

enum { MOST_AROUND = 1024 }; /* corners at a vertex */

/* The corners of one vertex after the other. */
typedef struct gathered {
    const qw_polygon_fans *p;
    uint32_t *next, *prev; /* uint32_t[corners]: within the polygon */
    dvec *face;            /* dvec[corners]: unit normal of the corner's polygon */
    dvec *weighted;        /* dvec[corners]: its normal there, as long as the angle */
    uint32_t *begin, *at;  /* uint32_t[vertices + 1], uint32_t[corners] */
    uint32_t *leader;      /* uint32_t[corners]: a corner that is shaded alike */
} gathered;

static dvec difference(const double *a, const double *b) { return (dvec){{a[0] - b[0], a[1] - b[1], a[2] - b[2]}}; }
static double dot(dvec a, dvec b) { return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2]; }
static dvec scaled(dvec a, double s) { return (dvec){{a.c[0] * s, a.c[1] * s, a.c[2] * s}}; }
static dvec sum_of(dvec a, dvec b) { return (dvec){{a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2]}}; }
static dvec cross(dvec a, dvec b)
{
    return (dvec){
        {a.c[1] * b.c[2] - a.c[2] * b.c[1], a.c[2] * b.c[0] - a.c[0] * b.c[2], a.c[0] * b.c[1] - a.c[1] * b.c[0]}};
}
static dvec unit(dvec a)
{
    double length = sqrt(dot(a, a));
    return length > 0 ? scaled(a, 1 / length) : (dvec){{0, 0, 0}};
}

static const double *place(const gathered *g, uint32_t c) { return g->p->position + 3 * (size_t)g->p->corner[c]; }

/* Next and previous corners of a polygon, its normal, and for each corner a normal weighted by the angle there. */
static void take_polygon(gathered *g, uint32_t first, uint32_t size)
{
    assert(first + size <= g->p->corner_count);
    dvec area = {{0, 0, 0}};
    for (uint32_t i = 0; i < size; i++) {
        uint32_t c = first + i;
        g->next[c] = first + (i + 1) % size, g->prev[c] = first + (i + size - 1) % size;
        if (i > 0)
            area = sum_of(area, cross(difference(place(g, c), place(g, first)),
                                      difference(place(g, first + (i + 1) % size), place(g, first))));
    }
    area = unit(area);
    for (uint32_t c = first; c < first + size; c++) {
        dvec a = difference(place(g, g->next[c]), place(g, c)), b = difference(place(g, g->prev[c]), place(g, c)),
             n = cross(a, b);
        double angle = qw_atan2(sqrt(dot(n, n)), dot(a, b));
        g->face[c] = area, g->weighted[c] = dot(n, area) > 0 ? scaled(unit(n), angle) : scaled(area, 1e-3);
    }
}

/* The edge from corner a to the next, which is that from corner b's previous one to b, seen from the other side. */
static bool turns_sharply(const gathered *g, uint32_t a, uint32_t b)
{
    const qw_polygon_fans *p = g->p;
    double cosine = dot(g->face[a], g->face[b]);
    uint32_t h = a, t = g->prev[b];
    if (h < p->marked && t < p->marked)
        return p->mark && (qw_is_hard(p->mark[h]) || qw_is_hard(p->mark[t])) && cosine < (double)SHARP_COSINE;
    return cosine < QW_SHARP_COSINE;
}

static uint32_t leader_of(const gathered *g, uint32_t c)
{
    while (g->leader[c] != c) c = g->leader[c];
    return c;
}

/* Corners of one vertex between sharp edges. Where there are too many to ask for each pair they are all one. */
static void join_corners(gathered *g, uint32_t v, bool split)
{
    uint32_t begin = g->begin[v], end = g->begin[v + 1];
    bool all = !split || end - begin > MOST_AROUND;
    for (uint32_t i = begin; i < end && all; i++) g->leader[g->at[i]] = g->at[begin];
    for (uint32_t i = begin; i < end && !all; i++)
        for (uint32_t k = begin; k < end; k++) {
            uint32_t a = g->at[i], b = g->at[k];
            bool share = g->p->corner[g->next[a]] == g->p->corner[g->prev[b]];
            if (share && !turns_sharply(g, a, b)) g->leader[leader_of(g, a)] = leader_of(g, b);
        }
}

static void gather(qw_env *env, gathered *g)
{
    const qw_polygon_fans *p = g->p;
    g->next = QW_NEW(env, uint32_t, p->corner_count), g->prev = QW_NEW(env, uint32_t, p->corner_count);
    g->face = QW_NEW(env, dvec, p->corner_count), g->weighted = QW_NEW(env, dvec, p->corner_count);
    g->at = qw_group(env, p->corner, p->corner_count, p->vertex_count, &g->begin);
    g->leader = QW_NEW(env, uint32_t, p->corner_count);
    for (uint32_t f = 0, first = 0; f < p->face_count; first += p->face_size[f++])
        take_polygon(g, first, p->face_size[f]);
    for (uint32_t c = 0; c < p->corner_count; c++) g->leader[c] = c;
}

float *qw_polygon_shading_normals(qw_env *env, const qw_polygon_fans *polygons, bool split)
{
    assert(polygons->position && polygons->corner);
    gathered g = {.p = polygons};
    float *normal = QW_NEW_ZERO(env, float, 3 * (size_t)(split ? polygons->corner_count : polygons->vertex_count));
    qw_scope_begin(env);
    gather(env, &g);
    dvec *sum = qw_alloc_zero(env, polygons->corner_count, sizeof *sum);
    for (uint32_t v = 0; v < polygons->vertex_count; v++) {
        join_corners(&g, v, split);
        for (uint32_t i = g.begin[v]; i < g.begin[v + 1]; i++) {
            uint32_t c = g.at[i], leader = leader_of(&g, c);
            sum[leader] = sum_of(sum[leader], g.weighted[c]);
        }
        for (uint32_t i = g.begin[v]; i < g.begin[v + 1]; i++) {
            uint32_t c = g.at[i];
            dvec n = unit(sum[leader_of(&g, c)]);
            if (dot(n, n) == 0) n = g.face[c];
            for (size_t k = 0; k < 3; k++) normal[3 * (size_t)(split ? c : v) + k] = (float)n.c[k];
        }
    }
    qw_scope_end(env);
    return normal;
}
