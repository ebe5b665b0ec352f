/* Unknowns: y[2 c], y[2 c + 1], with P_c = X_c + y[2c] A_c + y[2c+1] B_c; A and B span what class c may do (a plane, a
 * line, nothing). Setting the derivatives of Eq. (9) to zero gives for every class  sum over links (P_c - P_n - T) .
 * (A_c, B_c) = 0, where T is the sum of the links' wanted vectors from n to c. A weak pull to X_c makes it definite
 * where a part could slide freely. */
#include "remesh/offsets/embedding.h"

#include "base/sets.h"
#include "solve/cg.h"

#include <assert.h>
#include <string.h>

enum { MAX_ITERATIONS = 400, FEW_EDGES = 64 };
static const float PULL = 0.002f;

typedef struct system {
    uint32_t count;                /* classes */
    qw_vec3 *origin, *axis, *side; /* [count] X, A, B */
    float *size;                   /* [count] */
    uint32_t *begin, *end;         /* [count] links of each class */
    uint32_t *neighbour;           /* [links] none twice at a class */
    float *weight;                 /* [links] */
    qw_vec3 *moved;                /* [count] scratch of the product */
    qw_vec3 *target;               /* [links] sum of weight * wanted vector from the neighbour to the class */
} system;

/* ---- contraction classes: union-find over zero edges */

uint32_t *qw_offset_classes(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->edge && m->d);
    uint32_t *parent = QW_NEW(env, uint32_t, m->vertex_count);
    qw_sets_begin(parent, m->vertex_count);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        if (!qw_int2_is_zero(m->d[e])) continue;
        uint32_t h = m->half[e];
        qw_join_sets(parent, m->corner[h], m->corner[qw_next(h)]);
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) parent[v] = qw_set_of(parent, v);
    return parent;
}

static uint32_t *number_classes(qw_env *env, const qw_offset_mesh *m, const uint32_t *class_of, uint32_t *count)
{
    assert(class_of && count);
    uint32_t *number = QW_NEW(env, uint32_t, m->vertex_count);
    *count = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) number[v] = class_of[v] == v ? (*count)++ : number[class_of[v]];
    return number;
}

/* ---- the least-squares system */

/* Mean position, normal and degrees of freedom of each class; members that are constrained to a curve or a corner
   decide for the class. */
static void class_frames(qw_env *env, const qw_offset_mesh *m, const uint32_t *number, system *s)
{
    assert(number && s->count <= m->vertex_count);
    uint32_t n = s->count;
    qw_vec3 *normal = QW_NEW_ZERO(env, qw_vec3, n), *direction = QW_NEW_ZERO(env, qw_vec3, n);
    uint8_t *constraint = QW_NEW_ZERO(env, uint8_t, n);
    uint32_t *members = QW_NEW_ZERO(env, uint32_t, n);
    s->origin = QW_NEW_ZERO(env, qw_vec3, n), s->axis = QW_NEW_ZERO(env, qw_vec3, n),
    s->side = QW_NEW_ZERO(env, qw_vec3, n);
    s->size = QW_NEW_ZERO(env, float, n);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        uint32_t c = number[v];
        uint8_t constrained = m->constraint[v];
        if (constrained < constraint[c]) continue;
        if (constrained > constraint[c]) {
            constraint[c] = constrained, members[c] = 0;
            s->origin[c] = normal[c] = direction[c] = qw_v3(0, 0, 0), s->size[c] = 0;
        }
        float turn = qw_dot(direction[c], m->direction[v]) < 0 ? -1.0f : 1.0f;
        s->origin[c] = qw_add(s->origin[c], m->position[v]);
        normal[c] = qw_add(normal[c], m->normal[v]);
        direction[c] = qw_madd(direction[c], turn, m->direction[v]);
        s->size[c] += m->size[v];
        members[c]++;
    }
    for (uint32_t c = 0; c < n; c++) {
        float share = 1.0f / (float)members[c];
        s->origin[c] = qw_scale(s->origin[c], share), s->size[c] *= share;
        qw_vec3 up = qw_normalize(normal[c]);
        if (constraint[c] == QW_VERTEX_CURVE) s->axis[c] = qw_normalize(direction[c]);
        if (constraint[c] != QW_VERTEX_FREE) continue;
        if (qw_length2(up) < 0.5f) up = qw_v3(0, 0, 1);
        s->axis[c] = qw_any_orthogonal(up);
        s->side[c] = qw_cross(up, s->axis[c]);
    }
    qw_free(env, normal), qw_free(env, direction), qw_free(env, constraint), qw_free(env, members);
}

/* The vector in space that the edge's offset stands for, from the tail of the edge's own half-edge to its head. */
static qw_vec3 wanted_vector(const qw_offset_mesh *m, uint32_t e)
{
    assert(e < m->edge_count);
    uint32_t h = m->half[e], u = m->corner[h], v = m->corner[qw_next(h)];
    float size = 0.5f * (m->size[u] + m->size[v]);
    return qw_madd(qw_scale(m->axis[e], size * (float)m->d[e].x), size * (float)m->d[e].y, m->side[e]);
}

/* The classes that an edge joins; both QW_NONE where it joins a class to itself. */
static void ends_of(const qw_offset_mesh *m, const uint32_t *number, uint32_t e, uint32_t *from, uint32_t *to)
{
    assert(e < m->edge_count);
    uint32_t h = m->half[e];
    *from = number[m->corner[h]];
    *to = number[m->corner[qw_next(h)]];
    if (*from == *to) *from = *to = QW_NONE;
}

/* The edges at each class, in their order: edge[first[c]..first[c + 1] - 1]. One that joins a class to itself is at
 * none. */
typedef struct incidence {
    const qw_offset_mesh *m;
    const uint32_t *number;
    uint32_t *first, *edge; /* [count + 2], the last for counting only; [first[count]] */
    system *s;
} incidence;

/* Lists the edges at each class of vertices. */
static void collect_edges(qw_env *env, incidence *in)
{
    const qw_offset_mesh *m = in->m;
    uint32_t n = in->s->count, a, b;
    uint32_t *first = in->first = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        ends_of(m, in->number, e, &a, &b);
        if (a != QW_NONE) first[a + 2]++, first[b + 2]++;
    }
    for (uint32_t c = 0; c < n; c++) first[c + 2] += first[c + 1];
    in->edge = QW_NEW(env, uint32_t, first[n + 1]);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        ends_of(m, in->number, e, &a, &b);
        if (a != QW_NONE) in->edge[first[a + 1]++] = e, in->edge[first[b + 1]++] = e;
    }
}

/* One link for all edges between c and a neighbour. place: uint32_t[count], the last link made to each class, QW_NONE
   at first; or NULL: links are few enough to be searched. */
static void merge_links(const incidence *in, uint32_t c, uint32_t *place)
{
    system *s = in->s;
    uint32_t begin = in->first[c], end = begin, a, b;
    for (uint32_t i = begin; i < in->first[c + 1]; i++) {
        ends_of(in->m, in->number, in->edge[i], &a, &b);
        uint32_t other = a == c ? b : a, at = place ? place[other] : begin;
        qw_vec3 t = qw_scale(wanted_vector(in->m, in->edge[i]), a == c ? -1.0f : 1.0f);
        while (!place && at < end && s->neighbour[at] != other) at++;
        if (at < begin || at >= end) {
            if (place) place[other] = end;
            s->neighbour[end] = other, s->weight[end] = 1, s->target[end++] = t;
        } else {
            s->weight[at] += 1;
            s->target[at] = qw_add(s->target[at], t);
        }
    }
    s->begin[c] = begin, s->end[c] = end;
}

static bool has_few_edges(const incidence *in, uint32_t c) { return in->first[c + 1] - in->first[c] <= FEW_EDGES; }

static void merge_block(void *user, uint32_t begin, uint32_t end)
{
    const incidence *in = user;
    for (uint32_t c = begin; c < end; c++)
        if (has_few_edges(in, c)) merge_links(in, c, NULL);
}

/* The neighbours of each class of vertices, with weights and wanted vectors to them: edges between the same two
 * classes become one link. */
static void collect_links(qw_env *env, const qw_offset_mesh *m, const uint32_t *number, system *s)
{
    assert(number && s->size);
    incidence in = {.m = m, .number = number, .s = s};
    collect_edges(env, &in);
    uint32_t total = in.first[s->count];
    s->begin = QW_NEW(env, uint32_t, s->count), s->end = QW_NEW(env, uint32_t, s->count);
    s->neighbour = QW_NEW(env, uint32_t, total);
    s->weight = QW_NEW(env, float, total);
    s->target = QW_NEW(env, qw_vec3, total);
    qw_parallel(env, s->count, QW_GRAIN_HEAVY, merge_block, &in);
    uint32_t *place = NULL;
    for (uint32_t c = 0; c < s->count; c++) {
        if (has_few_edges(&in, c)) continue;
        if (!place) place = memset(QW_NEW(env, uint32_t, s->count), 0xff, s->count * sizeof *place);
        merge_links(&in, c, place);
    }
    qw_free(env, in.first), qw_free(env, in.edge), qw_free(env, place);
}

typedef struct product {
    const system *s;
    const double *x;
    double *y;
    qw_vec3 *moved; /* [count] displacement of each class by x */
} product;

static qw_vec3 displacement(const system *s, const double *x, uint32_t c)
{
    return qw_madd(qw_scale(s->axis[c], (float)x[2 * c]), (float)x[2 * c + 1], s->side[c]);
}

static void move_block(void *user, uint32_t begin, uint32_t end)
{
    const product *p = user;
    for (uint32_t c = begin; c < end; c++) p->moved[c] = displacement(p->s, p->x, c);
}

/* y = A x: the residuals of all links at each class, along its two axes. */
static void apply_block(void *user, uint32_t begin, uint32_t end)
{
    const product *p = user;
    const system *s = p->s;
    for (uint32_t c = begin; c < end; c++) {
        qw_vec3 mine = p->moved[c], sum = {0, 0, 0};
        float total = 0;
        for (uint32_t i = s->begin[c]; i < s->end[c]; i++) {
            sum = qw_madd(sum, s->weight[i], p->moved[s->neighbour[i]]);
            total += s->weight[i];
        }
        qw_vec3 r = qw_sub(qw_scale(mine, total * (1.0f + PULL)), sum);
        p->y[2 * c] = qw_dot(r, s->axis[c]);
        p->y[2 * c + 1] = qw_dot(r, s->side[c]);
    }
}

static void apply_system(void *user, qw_env *env, const double *x, double *y)
{
    const system *s = user;
    product p = {s, x, y, s->moved};
    qw_parallel(env, s->count, QW_GRAIN_HEAVY, move_block, &p);
    qw_parallel(env, s->count, QW_GRAIN_HEAVY, apply_block, &p);
}

typedef struct right_side {
    const system *s;
    double *diagonal, *b;
} right_side;

/* Right side and diagonal of the same system. */
static void fill_right(void *user, uint32_t begin, uint32_t end)
{
    const right_side *r = user;
    const system *s = r->s;
    for (uint32_t c = begin; c < end; c++) {
        qw_vec3 sum = {0, 0, 0};
        float total = 0;
        for (uint32_t i = s->begin[c]; i < s->end[c]; i++) {
            qw_vec3 apart = qw_sub(s->origin[s->neighbour[i]], s->origin[c]);
            sum = qw_add(sum, qw_add(qw_scale(apart, s->weight[i]), s->target[i]));
            total += s->weight[i];
        }
        r->b[2 * c] = qw_dot(sum, s->axis[c]), r->b[2 * c + 1] = qw_dot(sum, s->side[c]);
        r->diagonal[2 * c] = total * (1.0f + PULL) * qw_length2(s->axis[c]);
        r->diagonal[2 * c + 1] = total * (1.0f + PULL) * qw_length2(s->side[c]);
    }
}

typedef struct energies {
    const system *s;
    const double *x;
    double *energy, *count; /* of each block */
} energies;

/* Energy and count of the links of a block, in squares of their sizes. */
static void add_energies(void *user, uint32_t begin, uint32_t end)
{
    const energies *e = user;
    const system *s = e->s;
    double energy = 0, count = 0;
    for (uint32_t c = begin; c < end; c++)
        for (uint32_t i = s->begin[c]; i < s->end[c]; i++) {
            uint32_t n = s->neighbour[i];
            qw_vec3 a = qw_add(s->origin[c], displacement(s, e->x, c)),
                    b = qw_add(s->origin[n], displacement(s, e->x, n));
            qw_vec3 r = qw_sub(qw_sub(a, b), qw_scale(s->target[i], 1.0f / s->weight[i]));
            energy += s->weight[i] * qw_length2(r) / (s->size[c] * s->size[c]);
            count += s->weight[i];
        }
    e->energy[begin / QW_GRAIN_HEAVY] = energy, e->count[begin / QW_GRAIN_HEAVY] = count;
}

static double energy_of(qw_env *env, const system *s, const double *x)
{
    uint32_t blocks = qw_block_count(s->count, QW_GRAIN_HEAVY);
    energies e = {s, x, QW_NEW(env, double, blocks), QW_NEW(env, double, blocks)};
    double energy = 0, count = 0;
    qw_parallel(env, s->count, QW_GRAIN_HEAVY, add_energies, &e);
    for (uint32_t b = 0; b < blocks; b++) energy += e.energy[b], count += e.count[b];
    qw_free(env, e.energy), qw_free(env, e.count);
    return count > 0 ? energy / count : 0;
}

qw_vec3 *qw_solve_embedding(qw_env *env, const qw_offset_mesh *m, const uint32_t *class_of, double tolerance,
                            qw_embedding_counts *counts)
{
    assert(class_of && tolerance > 0 && counts);
    qw_vec3 *place = QW_NEW(env, qw_vec3, m->vertex_count);
    qw_scope_begin(env);
    system s = {0};
    uint32_t *number = number_classes(env, m, class_of, &s.count);
    class_frames(env, m, number, &s);
    collect_links(env, m, number, &s);
    s.moved = QW_NEW(env, qw_vec3, s.count);
    size_t unknowns = (size_t)2 * s.count;
    double *diagonal = QW_NEW(env, double, unknowns), *b = QW_NEW(env, double, unknowns),
           *y = QW_NEW_ZERO(env, double, unknowns);
    right_side right = {&s, diagonal, b};
    qw_parallel(env, s.count, QW_GRAIN_HEAVY, fill_right, &right);
    counts->energy_before = energy_of(env, &s, y);
    qw_cg_result r = qw_cg_solve(env, (uint32_t)unknowns, apply_system, &s, diagonal, b, y, tolerance, MAX_ITERATIONS);
    counts->energy_after = energy_of(env, &s, y);
    counts->iterations = r.iterations;
    counts->residual = r.residual;
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (class_of[v] == v) place[v] = qw_add(s.origin[number[v]], displacement(&s, y, number[v]));
    qw_scope_end(env);
    return place;
}
