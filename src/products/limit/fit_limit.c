#include "products/limit/fit_limit.h"

#include "products/limit/stencils.h"
#include "geometry/go_back.h"
#include "solve/cg.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    PROJECTIONS = 5,
    MOST_ITERATIONS = 60 /* of conjugate gradients: then the error is a hundredth of a distance */
};
static const double TOLERANCE = 1e-3;
/* How much a distance along the shape counts, squared, beside one from it. */
static const double ALONG = 0.03;
/* How much it counts that vertices go other ways than their neighbours: without, the cage follows detail that it has no
   room for, and its corners are held back. */
static const double FAIR = 0.003;
/* In mean edges around: no vertex goes farther than that in all, and nothing that is farther is looked up. */
static const float MOST = 1, REACH = 1;

typedef struct fitting {
    qw_quadmesh *quads;
    const qw_limit_fit *fit;
    qw_quadmesh split;             /* once; its positions are on the limit surface */
    qw_stencils limit, transposed; /* rows: the vertices of `split`, the samples */
    const uint8_t *rule, *split_rule;
    uint32_t (*crease)[2];
    const float *edge;   /* float[samples]: mean edge around */
    double *area;        /* double[faces]: of the quads */
    double *weight;      /* double[samples]: areas */
    double (*matrix)[6]; /* double[samples][3 x 3, symmetric: xx xy xz yy yz zz]: how much which distance counts */
    double *pull;        /* double[samples][3]: the matrix times the way to where the sample belongs; scratch later */
    double *at, *first;  /* double[samples][3]: on the limit surface, now and at the beginning */
} fitting;

static uint32_t samples_of(const fitting *t) { return t->split.vertex_count; }

/* ---- the surface from the limit surface */

static void weigh_samples(qw_env *env, fitting *t)
{
    const qw_quadmesh *s = &t->split;
    t->weight = QW_NEW_ZERO(env, double, samples_of(t));
    for (uint32_t f = 0; f < s->face_count; f++) {
        double area = 0.5 * (double)qw_length(qw_quad_cross(s->position, s->corner + 4 * (size_t)f));
        for (uint32_t i = 0; i < 4; i++) t->weight[s->corner[4 * (size_t)f + i]] += area / 4;
    }
}

static void set_positions(const fitting *t)
{
    for (uint32_t i = 0; i < samples_of(t); i++) {
        const double *p = t->at + 3 * (size_t)i;
        t->split.position[i] = qw_v3_of_doubles(p);
    }
}

/* Adds what a distance `away` counts: `along` what goes along the unit vector n, `across` what goes across it. */
static void add_term(const fitting *t, uint32_t i, const double n[3], double along, double across, const double away[3])
{
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    double dot = n[0] * away[0] + n[1] * away[1] + n[2] * away[2];
    for (int k = 0; k < 6; k++)
        t->matrix[i][k] += (along - across) * n[row[k]] * n[column[k]] + (row[k] == column[k] ? across : 0);
    for (int k = 0; k < 3; k++) t->pull[3 * (size_t)i + (size_t)k] += across * away[k] + (along - across) * dot * n[k];
}

/* Towards the point that was found, where one was; and a little back to where the sample was at first: not along the
   normal of a surface, nor across a curve. */
static void pull_sample(const fitting *t, uint32_t i, const qw_shape_hit *hit)
{
    const double n[3] = {(double)hit->along.x, (double)hit->along.y, (double)hit->along.z},
                 to[3] = {(double)hit->point.x, (double)hit->point.y, (double)hit->point.z}, none[3] = {0, 0, 0};
    double w = t->weight[i], away[3], back[3];
    bool is_curve = t->split_rule[i] != QW_RULE_SMOOTH;
    for (int k = 0; k < 3; k++) {
        double at = t->at[3 * (size_t)i + (size_t)k];
        away[k] = to[k] - at, back[k] = t->first[3 * (size_t)i + (size_t)k] - at;
    }
    if (!hit->is_found) {
        add_term(t, i, none, 0, w * ALONG, back);
        return;
    }
    add_term(t, i, n, is_curve ? 0 : w, is_curve ? w : 0, away);
    add_term(t, i, n, is_curve ? w * ALONG : 0, is_curve ? 0 : w * ALONG, back);
}

typedef struct looking {
    const fitting *t;
    const qw_vec3 *normal;
} looking;

/* Finds for each sample the surface or curve that pulls it, and by how much. */
static void look_block(void *user, uint32_t begin, uint32_t end)
{
    const looking *l = user;
    const fitting *t = l->t;
    const qw_vec3 *at = t->split.position;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        qw_shape_hit hit = {.is_found = false};
        float reach = 2 * REACH * t->edge[i]; /* edges of the split are half as long */
        if (t->split_rule[i] == QW_RULE_SMOOTH) {
            hit = qw_nearest_on_shape(t->fit->shape, t->split.component[i], at[i], l->normal[i], reach, &hint);
        } else if (t->split_rule[i] == QW_RULE_CREASE) {
            qw_vec3 tangent = qw_normalize(qw_sub(at[t->crease[i][1]], at[t->crease[i][0]]));
            hit = qw_nearest_on_curves(t->fit->shape, at[i], tangent, reach);
        }
        memset(t->matrix[i], 0, sizeof t->matrix[i]), memset(t->pull + 3 * (size_t)i, 0, 3 * sizeof *t->pull);
        pull_sample(t, i, &hit);
    }
}

/* ---- the limit surface from the surface */

/* The samples as triangles, two for each quad of the split. */
static qw_trimesh triangles_of(qw_env *env, const fitting *t)
{
    const qw_quadmesh *s = &t->split;
    qw_trimesh m = {.vertex_count = s->vertex_count, .face_count = 2 * s->face_count, .position = s->position};
    uint32_t *component = QW_NEW(env, uint32_t, m.face_count);
    m.corner = QW_NEW(env, uint32_t, 3 * (size_t)m.face_count);
    for (uint32_t f = 0; f < s->face_count; f++) {
        const uint32_t *c = s->corner + 4 * (size_t)f;
        const uint32_t of[6] = {c[0], c[1], c[2], c[0], c[2], c[3]};
        memcpy(m.corner + 6 * (size_t)f, of, sizeof of);
        component[2 * f] = component[2 * f + 1] = s->component[c[0]];
    }
    m.component = component;
    return m;
}

/* A point of the surface pulls the sample next to what is nearest to it on the limit surface, along the normal there.
 */
static void pull_from(const fitting *t, const qw_trimesh *limit, const qw_hit *hit, qw_vec3 point, double weight)
{
    const uint32_t *corner = limit->corner + 3 * (size_t)hit->face;
    int most = hit->weight[1] > hit->weight[0];
    if (hit->weight[2] > hit->weight[most]) most = 2;
    uint32_t i = corner[most];
    if (t->split_rule[i] != QW_RULE_SMOOTH) return;
    qw_vec3 normal = qw_normalize(qw_face_cross(limit, hit->face)), way = qw_sub(point, hit->point);
    const double n[3] = {(double)normal.x, (double)normal.y, (double)normal.z},
                 away[3] = {(double)way.x, (double)way.y, (double)way.z};
    add_term(t, i, n, weight, 0, away);
}

/* As many points of the surface as there are samples, evenly by area. */
static void pull_from_surface(qw_env *env, fitting *t)
{
    const qw_shape *shape = t->fit->shape;
    const qw_trimesh *m = shape->surface, limit = triangles_of(env, t);
    const qw_bvh *tree = qw_bvh_build(env, &limit);
    double area = qw_trimesh_area(m), step = area / samples_of(t), passed = 0, next = step / 2;
    float reach = (float)(REACH * sqrt(area / t->quads->face_count));
    uint32_t hint = QW_NONE, count = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        qw_vec3 cross = qw_face_cross(m, f);
        const uint32_t *corner = m->corner + 3 * (size_t)f;
        for (passed += 0.5 * (double)qw_length(cross); next <= passed; next += step) {
            double u, v;
            qw_spread_in_triangle(++count, &u, &v);
            qw_vec3 a = m->position[corner[0]], p = qw_madd(a, (float)u, qw_sub(m->position[corner[1]], a));
            p = qw_madd(p, (float)v, qw_sub(m->position[corner[2]], a));
            qw_hit hit = qw_bvh_nearest_of(tree, m->component ? m->component[f] : QW_NONE, p, qw_normalize(cross),
                                           QW_SAME_SHEET, reach, hint);
            if (hit.face == QW_NONE) continue;
            hint = hit.face;
            pull_from(t, &limit, &hit, p, step);
        }
        qw_heartbeat(env);
    }
}

/* ---- the system */

static bool is_fixed(const fitting *t, uint32_t v)
{
    return t->rule[v] == QW_RULE_CORNER || (t->fit->stays && t->fit->stays[v]);
}

static void clear_fixed(const fitting *t, double *x)
{
    for (uint32_t v = 0; v < t->quads->vertex_count; v++)
        if (is_fixed(t, v)) memset(x + 3 * (size_t)v, 0, 3 * sizeof *x);
}

static void multiply_block(void *user, uint32_t begin, uint32_t end)
{
    const fitting *t = user;
    for (uint32_t i = begin; i < end; i++) {
        const double *m = t->matrix[i];
        double *p = t->pull + 3 * (size_t)i, x = p[0], y = p[1], z = p[2];
        p[0] = m[0] * x + m[1] * y + m[2] * z;
        p[1] = m[1] * x + m[3] * y + m[4] * z;
        p[2] = m[2] * x + m[4] * y + m[5] * z;
    }
}

/* y += FAIR times the Laplacian of x along the edges of the quads, weighted by their areas. */
static void add_fairness(const fitting *t, const double *x, double sign, double *y)
{
    const qw_quadmesh *q = t->quads;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        size_t a = 3 * (size_t)q->corner[h], b = 3 * (size_t)q->corner[qw_quad_next(h)];
        double w = sign * FAIR * t->area[h / 4];
        for (size_t k = 0; k < 3; k++) y[a + k] += w * (x[a + k] - x[b + k]), y[b + k] -= w * (x[a + k] - x[b + k]);
    }
}

/* y = A^T M A x; t->pull is scratch. */
static void apply(void *user, qw_env *env, const double *x, double *y)
{
    fitting *t = user;
    qw_stencils_apply(env, &t->limit, x, t->pull);
    qw_parallel(env, samples_of(t), QW_GRAIN_HEAVY, multiply_block, t);
    qw_stencils_apply(env, &t->transposed, t->pull, y);
    add_fairness(t, x, 1, y);
    clear_fixed(t, y);
}

/* The diagonal of the system of the fit: 3 numbers for each vertex, 0 for what is fixed. */
static double *diagonal_of(qw_env *env, const fitting *t)
{
    uint32_t n = t->quads->vertex_count;
    double *diagonal = QW_NEW_ZERO(env, double, 3 * (size_t)n);
    for (uint32_t v = 0; v < n; v++) {
        if (is_fixed(t, v)) continue;
        for (size_t e = t->transposed.first[v]; e < t->transposed.first[v + 1]; e++) {
            double a = t->transposed.value[e], *d = diagonal + 3 * (size_t)v;
            const double *m = t->matrix[t->transposed.column[e]];
            d[0] += a * a * m[0], d[1] += a * a * m[3], d[2] += a * a * m[5];
        }
    }
    for (uint32_t h = 0; h < 4 * t->quads->face_count; h++)
        for (size_t k = 0; k < 3; k++) {
            size_t a = 3 * (size_t)t->quads->corner[h] + k, b = 3 * (size_t)t->quads->corner[qw_quad_next(h)] + k;
            if (diagonal[a] > 0) diagonal[a] += FAIR * t->area[h / 4];
            if (diagonal[b] > 0) diagonal[b] += FAIR * t->area[h / 4];
        }
    return diagonal;
}

/* ---- one projection */

/* Adds the way d, and takes back what is farther than MOST from the first place x0. */
static void move(const fitting *t, const float *edge, double *x, const double *x0, const double *d)
{
    for (uint32_t v = 0; v < t->quads->vertex_count; v++) {
        size_t at = 3 * (size_t)v;
        double way2 = 0;
        for (size_t k = at; k < at + 3; k++) x[k] += d[k], way2 += (x[k] - x0[k]) * (x[k] - x0[k]);
        double most = (double)(MOST * edge[v]), way = sqrt(way2);
        for (size_t k = at; k < at + 3 && way > most; k++) x[k] = x0[k] + (x[k] - x0[k]) * most / way;
    }
}

/* Takes the quads to x, as far as that turns no corner over, and x back to where they are then. */
static void step_to(qw_env *env, fitting *t, double *x)
{
    qw_quadmesh *q = t->quads;
    qw_vec3 *before = QW_NEW(env, qw_vec3, q->vertex_count);
    memcpy(before, q->position, q->vertex_count * sizeof *before);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        const double *p = x + 3 * (size_t)v;
        if (!is_fixed(t, v)) q->position[v] = qw_v3_of_doubles(p);
    }
    qw_hold_back_flips(env, q, before);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        const double p[3] = {(double)q->position[v].x, (double)q->position[v].y, (double)q->position[v].z};
        memcpy(x + 3 * (size_t)v, p, sizeof p);
    }
}

/* A step of the fit: samples of the limit surface are pulled to the shape, and the x that lets them follow best is
   solved for. x0: where x began. */
static void project(qw_env *env, fitting *t, double *x, const double *x0)
{
    uint32_t n = t->quads->vertex_count;
    qw_scope_begin(env);
    qw_stencils_apply(env, &t->limit, x, t->at);
    set_positions(t);
    weigh_samples(env, t);
    t->edge = qw_edges_around(env, &t->split);
    t->area = QW_NEW(env, double, t->quads->face_count);
    for (uint32_t f = 0; f < t->quads->face_count; f++)
        t->area[f] = 0.5 * (double)qw_length(qw_quad_cross(t->quads->position, t->quads->corner + 4 * (size_t)f));
    looking l = {t, qw_quadmesh_vertex_normals(env, &t->split)};
    qw_parallel(env, samples_of(t), QW_GRAIN_HEAVY, look_block, &l);
    pull_from_surface(env, t);
    double *b = QW_NEW(env, double, 3 * (size_t)n), *d = QW_NEW_ZERO(env, double, 3 * (size_t)n);
    qw_stencils_apply(env, &t->transposed, t->pull, b);
    double *gone = QW_NEW(env, double, 3 * (size_t)n);
    for (size_t k = 0; k < 3 * (size_t)n; k++) gone[k] = x[k] - x0[k];
    add_fairness(t, gone, -1, b);
    clear_fixed(t, b);
    qw_cg_solve(env, 3 * n, apply, t, diagonal_of(env, t), b, d, TOLERANCE, MOST_ITERATIONS);
    move(t, qw_edges_around(env, t->quads), x, x0, d);
    step_to(env, t, x);
    qw_scope_end(env);
}

/* ---- no limit surface that turns over */

typedef struct holding {
    fitting *t;
    const qw_vec3 *before, *wanted; /* qw_vec3[vertices] */
    const qw_vec3 *was;             /* qw_vec3[samples]: the limit surface of `before` */
} holding;

static void find_turned(qw_env *env, void *user, uint8_t *is_worse)
{
    const holding *h = user;
    const qw_quadmesh *split = &h->t->split;
    qw_stencils_place(env, &h->t->limit, h->t->quads->position, split->position);
    for (uint32_t c = 0; c < split->face_count; c++) {
        const uint32_t *corner = split->corner + 4 * (size_t)c;
        qw_vec3 is = qw_quad_cross(split->position, corner), old = qw_quad_cross(h->was, corner);
        if (qw_dot(is, old) <= 0 && qw_length2(old) > 0) is_worse[c / 4] = 1;
    }
}

static void put_back(void *user, uint32_t v, float share)
{
    const holding *h = user;
    h->t->quads->position[v] = qw_lerp(h->before[v], h->wanted[v], share);
}

/* Takes back the vertices of quads of which a part of the limit surface flipped against that of `before`. */
static void hold_back_limit_flips(qw_env *env, fitting *t, const qw_vec3 *before)
{
    uint32_t n = t->quads->vertex_count;
    qw_vec3 *was = QW_NEW(env, qw_vec3, samples_of(t)), *wanted = QW_NEW(env, qw_vec3, n);
    qw_stencils_place(env, &t->limit, before, was);
    memcpy(wanted, t->quads->position, n * sizeof *wanted);
    holding h = {t, before, wanted, was};
    qw_go_back(env, &(qw_going_back){t->quads, false, &h, find_turned, put_back}, NULL);
}

/* The stencils of the limit surface after one split, and room for its samples. */
static void begin(qw_env *env, fitting *t)
{
    const qw_quadmesh *q = t->quads;
    qw_stencils once = qw_split_stencils(env, q), last;
    t->split = qw_split_quads(env, q);
    last = qw_limit_stencils(env, &t->split);
    t->limit = qw_stencils_product(env, &last, &once);
    t->transposed = qw_stencils_transpose(env, &t->limit);
    size_t samples = samples_of(t);
    assert(t->split.vertex_count == once.row_count && last.column_count == once.row_count);
    t->rule = qw_find_rules(env, q, NULL);
    t->crease = qw_alloc(env, samples, sizeof *t->crease);
    t->split_rule = qw_find_rules(env, &t->split, t->crease);
    t->matrix = qw_alloc(env, samples, sizeof *t->matrix);
    t->at = QW_NEW(env, double, 3 * samples), t->first = QW_NEW(env, double, 3 * samples);
    t->pull = QW_NEW(env, double, 3 * samples);
}

void qw_fit_limit(qw_env *env, qw_quadmesh *q, const qw_limit_fit *fit)
{
    assert(q->twin && q->component && fit->shape->tree);
    uint32_t n = q->vertex_count;
    if (n == 0) return;
    qw_vec3 *before = q->position;
    q->position = QW_NEW(env, qw_vec3, n);
    qw_scope_begin(env);
    fitting t = {.quads = q, .fit = fit};
    begin(env, &t);
    double *x = QW_NEW(env, double, 3 * (size_t)n), *x0 = QW_NEW(env, double, 3 * (size_t)n);
    for (uint32_t v = 0; v < n; v++) {
        const double p[3] = {(double)before[v].x, (double)before[v].y, (double)before[v].z};
        memcpy(x + 3 * (size_t)v, p, sizeof p), q->position[v] = before[v];
    }
    memcpy(x0, x, 3 * (size_t)n * sizeof *x);
    qw_stencils_apply(env, &t.limit, x, t.first);
    for (int round = 0; round < PROJECTIONS; round++) {
        qw_heartbeat(env);
        project(env, &t, x, x0);
    }
    hold_back_limit_flips(env, &t, before);
    qw_scope_end(env);
}
