#include "remesh/quads/rounds.h"

#include "geometry/bvh.h"
#include "remesh/quads/quad_components.h"
#include "remesh/quads/uncovered.h"
#include "geometry/flips.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ASKED: triangles of a component of the working mesh by which it is matched to one of the surface. PAIRS_OF: up to
   so many components, pairs of them are exchanged as well. SWEEPS: over all components and pairs. */
enum { ASKED = 9, PAIRS_OF = 64, SWEEPS = 20 };
/* Penalties of an irregular vertex and of a quad above or below the allowed count, in uncovered quads. */
static const double IRREGULAR_WEIGHT = 0.05, COUNT_WEIGHT = 100;

qw_rounds qw_rounds_begin(qw_env *env)
{
    qw_rounds r = {.flipped = QW_NEW(env, uint8_t, 0), .penalty = QW_NEW(env, double, 0)};
    qw_quadmesh *q = &r.quads;
    q->position = QW_NEW(env, qw_vec3, 0), q->kind = QW_NEW(env, uint8_t, 0), q->component = QW_NEW(env, uint32_t, 0);
    q->corner = QW_NEW(env, uint32_t, 0), q->twin = QW_NEW(env, uint32_t, 0), q->mark = QW_NEW(env, uint8_t, 0);
    return r;
}

void qw_rounds_drop(qw_rounds *r) { r->count = r->last = r->quads.vertex_count = r->quads.face_count = 0; }

/* ---- which component is which */

/* The component of the surface on which most of the first triangles of each component of the working mesh lie:
   uint32_t[components of working]. NULL where two of these have the same. */
static uint32_t *match_components(qw_env *env, const qw_round *round, const qw_census *working)
{
    assert(round->surface->face_count > 0);
    const qw_census surface = qw_trimesh_census(env, round->surface);
    if (working->components != surface.components) return NULL;
    uint32_t n = (uint32_t)surface.components, *of = QW_NEW(env, uint32_t, n),
             *answer = QW_NEW(env, uint32_t, (size_t)ASKED * n), *asked = QW_NEW_ZERO(env, uint32_t, n);
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, n);
    const qw_bvh *tree = qw_bvh_build(env, round->surface);
    for (uint32_t f = 0; f < round->working->face_count; f++) {
        uint32_t c = working->component[f];
        if (asked[c] == ASKED) continue;
        const uint32_t *corner = round->working->corner + 3 * (size_t)f;
        const qw_vec3 *p = round->working->position;
        qw_vec3 middle = qw_scale(qw_add(qw_add(p[corner[0]], p[corner[1]]), p[corner[2]]), 1.0f / 3),
                normal = qw_normalize(qw_face_cross(round->working, f));
        qw_hit hit = qw_bvh_nearest(tree, middle, normal, 0.5f, INFINITY, QW_NONE);
        if (hit.face != QW_NONE) answer[(size_t)ASKED * c + asked[c]++] = surface.component[hit.face];
    }
    for (uint32_t c = 0; c < n; c++) {
        uint32_t most = 0;
        for (uint32_t i = 0; i < asked[c]; i++) {
            uint32_t votes = 0;
            for (uint32_t j = 0; j < asked[c]; j++)
                votes += answer[(size_t)ASKED * c + j] == answer[(size_t)ASKED * c + i];
            if (votes > most) most = votes, of[c] = answer[(size_t)ASKED * c + i];
        }
        if (most == 0 || taken[of[c]]) return NULL;
        taken[of[c]] = 1;
    }
    return of;
}

/* ---- adding */

/* The penalty of each component in a round: uncovered area in quads, flipped quads, and a little for irregular
 * vertices. penalty: double[components], added to. */
static void judge(qw_env *env, const qw_round *round, const qw_census *census, const uint8_t *uncovered,
                  const uint32_t *of, double *penalty)
{
    const qw_trimesh *working = round->working;
    const qw_quadmesh *quads = round->quads;
    for (uint32_t h = 0; h < 3 * working->face_count; h++)
        if (uncovered[working->corner[h]])
            penalty[of[census->component[h / 3]]] += (double)qw_length(qw_face_cross(working, h / 3)) / 6 /
                                                     (round->rho * round->rho);
    for (uint32_t f = 0; f < quads->face_count; f++)
        penalty[of[quads->component[quads->corner[4 * f]]]] += round->flipped[f];
    uint32_t *out = qw_quadmesh_outgoing(env, quads);
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        bool on_boundary;
        if (out[v] != QW_NONE && qw_quad_valence(quads, out[v], &on_boundary) != 4 && !on_boundary)
            penalty[of[quads->component[v]]] += IRREGULAR_WEIGHT;
    }
}

/* Keeps a round's quads, flips and penalties beside those of the rounds before. */
static void add_round(qw_env *env, qw_rounds *r, const qw_round *round, const uint32_t *of, const double *penalty)
{
    assert(r->component_count > 0 && round->quads->component);
    uint32_t n = r->component_count, vertices = r->quads.vertex_count;
    size_t all_vertices = (size_t)vertices + round->quads->vertex_count,
           all_faces = (size_t)r->quads.face_count + round->quads->face_count;
    qw_quadmesh *q = &r->quads;
    q->position = qw_resize(env, q->position, all_vertices, sizeof *q->position),
    q->kind = qw_resize(env, q->kind, all_vertices, sizeof *q->kind);
    q->component = qw_resize(env, q->component, all_vertices, sizeof *q->component);
    q->corner = qw_resize(env, q->corner, 4 * all_faces, sizeof *q->corner),
    q->twin = qw_resize(env, q->twin, 4 * all_faces, sizeof *q->twin);
    q->mark = qw_resize(env, q->mark, 4 * all_faces, sizeof *q->mark),
    r->flipped = qw_resize(env, r->flipped, all_faces, sizeof *r->flipped);
    r->penalty = qw_resize(env, r->penalty, (size_t)(r->count + 1) * n, sizeof *r->penalty);
    memcpy(r->flipped + q->face_count, round->flipped, round->quads->face_count);
    memcpy(r->penalty + (size_t)r->count * n, penalty, n * sizeof *penalty);
    r->last = q->face_count;
    qw_append_quads(q, round->quads);
    for (uint32_t v = vertices; v < q->vertex_count; v++) q->component[v] = r->count * n + of[q->component[v]];
    r->count++;
}

/* ---- choosing */

typedef struct choice {
    const qw_rounds *rounds;
    const qw_round *round;
    uint32_t *faces; /* uint32_t[rounds][components]: quads of each */
    uint32_t *taken; /* uint32_t[components]: the round that each is taken from */
    double penalty, count;
} choice;

static double cost_of(const choice *c, double penalty, double count)
{
    return penalty + COUNT_WEIGHT * fmax(fmax(c->round->least - count, count - c->round->most), 0);
}

static void take(choice *c, uint32_t component, uint32_t round)
{
    uint32_t n = c->rounds->component_count, from = c->taken[component] * n + component, to = round * n + component;
    c->penalty += c->rounds->penalty[to] - c->rounds->penalty[from],
        c->count += (double)c->faces[to] - (double)c->faces[from];
    c->taken[component] = round;
}

static void take_round(choice *c, uint32_t round)
{
    c->penalty = c->count = 0;
    for (uint32_t k = 0; k < c->rounds->component_count; k++) {
        c->taken[k] = round;
        c->penalty += c->rounds->penalty[round * c->rounds->component_count + k],
            c->count += c->faces[round * c->rounds->component_count + k];
    }
}

static const double GAIN = 1e-9; /* another choice must cost less by this: sums are rounded */

/* Takes component a, or a and b (if they differ), from the rounds that lower the cost most. Returns whether any
   does. */
static bool improve(choice *c, uint32_t a, uint32_t b)
{
    assert(a < c->rounds->component_count && b < c->rounds->component_count);
    double least = cost_of(c, c->penalty, c->count);
    uint32_t was_a = c->taken[a], was_b = c->taken[b], best_a = was_a, best_b = was_b;
    for (uint32_t i = 0; i < c->rounds->count; i++)
        for (uint32_t j = a == b ? i : 0; j < (a == b ? i + 1 : c->rounds->count); j++) {
            take(c, a, i), take(c, b, j);
            double cost = cost_of(c, c->penalty, c->count);
            if (cost < least - GAIN) least = cost, best_a = i, best_b = j;
        }
    take(c, a, best_a), take(c, b, best_b);
    return best_a != was_a || best_b != was_b;
}

/* Takes all components from the best round, then exchanges single ones and pairs as long as that lowers the cost. */
static void choose(qw_env *env, choice *c)
{
    uint32_t n = c->rounds->component_count, best = 0;
    double least = INFINITY;
    c->faces = QW_NEW_ZERO(env, uint32_t, (size_t)c->rounds->count * n), c->taken = QW_NEW_ZERO(env, uint32_t, n);
    for (uint32_t f = 0; f < c->rounds->quads.face_count; f++)
        c->faces[c->rounds->quads.component[c->rounds->quads.corner[4 * f]]]++;
    for (uint32_t i = 0; i < c->rounds->count; i++) {
        take_round(c, i);
        double cost = cost_of(c, c->penalty, c->count);
        if (cost < least) least = cost, best = i;
    }
    take_round(c, best);
    bool better = true;
    for (int sweep = 0; sweep < SWEEPS && better; sweep++) {
        better = false;
        for (uint32_t a = 0; a < n; a++) better |= improve(c, a, a);
        for (uint32_t a = 0; n <= PAIRS_OF && a < n; a++)
            for (uint32_t b = 0; b < a; b++) better |= improve(c, a, b);
    }
}

/* The quads of each component from the round that was chosen for it. */
static void compose(qw_env *env, const choice *c, const uint32_t *of, qw_quadmesh *best, uint8_t **flipped)
{
    assert(c->taken && best && flipped);
    const qw_rounds *r = c->rounds;
    uint32_t n = r->component_count, faces = 0;
    uint32_t *here = QW_NEW(env, uint32_t, n); /* the number in this round's working mesh */
    uint8_t *wanted = QW_NEW_ZERO(env, uint8_t, (size_t)r->count * n);
    for (uint32_t k = 0; k < n; k++) here[of[k]] = k, wanted[c->taken[k] * n + k] = 1;
    *flipped = QW_NEW(env, uint8_t, r->quads.face_count);
    for (uint32_t f = 0; f < r->quads.face_count; f++)
        if (wanted[r->quads.component[r->quads.corner[4 * f]]]) (*flipped)[faces++] = r->flipped[f];
    *best = qw_pick_components(env, &r->quads, wanted, NULL);
    for (uint32_t v = 0; v < best->vertex_count; v++) best->component[v] = here[best->component[v] % n];
}

/* Adds a round, chooses again for each component, and makes the mesh of all choices. */
static void add_and_choose(qw_env *env, qw_rounds *rounds, const qw_round *round, const qw_census *working,
                           const uint8_t *uncovered, const uint32_t *of, qw_quadmesh *best, uint8_t **flipped)
{
    rounds->component_count = (uint32_t)working->components;
    double *penalty = QW_NEW_ZERO(env, double, rounds->component_count);
    judge(env, round, working, uncovered, of, penalty);
    add_round(env, rounds, round, of, penalty);
    choice c = {.rounds = rounds, .round = round};
    choose(env, &c);
    compose(env, &c, of, best, flipped);
    qw_keep_quads(env, best), qw_keep(env, *flipped);
}

bool qw_rounds_add(qw_env *env, qw_rounds *rounds, const qw_round *round, qw_quadmesh *best, uint8_t **flipped)
{
    assert(round->quads->component && round->flipped && round->rho > 0 && round->far > 0 &&
           round->least <= round->most);
    qw_scope_begin(env);
    const uint32_t *of = NULL;
    qw_census working = qw_trimesh_census(env, round->working);
    if (working.components > 1 && round->quads->face_count > 0) {
        qw_halves halves = qw_halve_quads(env, round->quads);
        const uint8_t *uncovered = qw_mark_uncovered(env, round->working, &halves, round->far);
        bool has_faults = memchr(uncovered, 1, round->working->vertex_count) ||
                          memchr(round->flipped, QW_FLIPPED, round->quads->face_count);
        if (rounds->count > 0 || has_faults) of = match_components(env, round, &working);
        if (of) add_and_choose(env, rounds, round, &working, uncovered, of, best, flipped);
    }
    if (!of) qw_rounds_drop(rounds);
    qw_scope_end(env);
    return of != NULL;
}

qw_sites qw_rounds_uncovered(qw_env *env, const qw_rounds *r, const qw_trimesh *working, const float *size,
                             const qw_quadmesh *best, float far)
{
    assert(r->count > 0 && r->last <= r->quads.face_count && size && far > 0);
    const qw_quadmesh last = {.vertex_count = r->quads.vertex_count,
                              .face_count = r->quads.face_count - r->last,
                              .position = r->quads.position,
                              .corner = r->quads.corner + 4 * (size_t)r->last};
    qw_halves halves[2] = {qw_halve_quads(env, best), qw_halve_quads(env, &last)};
    uint8_t *uncovered = qw_mark_uncovered(env, working, &halves[0], far),
            *by_last = qw_mark_uncovered(env, working, &halves[1], far);
    qw_census census = qw_trimesh_census(env, working);
    uint8_t *lacks = QW_NEW_ZERO(env, uint8_t, (size_t)census.components);
    for (uint32_t h = 0; h < 3 * working->face_count; h++)
        lacks[census.component[h / 3]] |= uncovered[working->corner[h]];
    for (uint32_t h = 0; h < 3 * working->face_count; h++)
        if (lacks[census.component[h / 3]] && by_last[working->corner[h]]) uncovered[working->corner[h]] = 1;
    return qw_list_uncovered(env, working, size, uncovered);
}
