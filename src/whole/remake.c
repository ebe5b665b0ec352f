#include "whole/remake.h"

#include "base/promise.h"
#include "whole/kept_rims.h"
#include "base/elementary.h"
#include "geometry/flips.h"
#include "geometry/parts.h"
#include "remesh/quads/quad_components.h"
#include "remesh/quads/straight.h"

#include <assert.h>
#include <string.h>

/* Quads of a component that is made anew, at most. */
enum { MOST_QUADS = 64 };
/* Where there are more quads than asked for anyway, as so few cannot carry the components: this share more. */
static const double MOST_OVER = 0.2;
typedef struct remaking {
    qw_run_state *run;
    const qw_quadmesh *quads;
    qw_parts parts;
    double edge;               /* mean, of all quads of the result */
    uint32_t *count;           /* [parts.count]: quads of each component */
    uint32_t *faults;          /* [parts.count]: and how many of them are flipped */
    uint32_t *doubts;          /* [parts.count]: and how many are in doubt */
    uint8_t *left;             /* [parts.count] 1: stays as it is */
    int64_t spare, most_fewer; /* quads that may still be added, and taken away */
    qw_quadmesh *made;         /* [made_count] */
    uint32_t made_count;       /* components */
} remaking;

/* Counts quads of each component, and how many more or fewer the count still allows. */
static void count_quads(remaking *m)
{
    const qw_quadmesh *q = m->quads, *more = &m->run->core.small_quads;
    double sides = 4 * ((double)q->face_count + more->face_count);
    m->edge = (qw_sum_of_sides(q) + qw_sum_of_sides(more)) / sides;
    m->count = QW_NEW_ZERO(m->run->env, uint32_t, m->parts.count);
    m->faults = QW_NEW_ZERO(m->run->env, uint32_t, m->parts.count);
    m->doubts = QW_NEW_ZERO(m->run->env, uint32_t, m->parts.count);
    m->left = QW_NEW(m->run->env, uint8_t, m->parts.count);
    memset(m->left, 1, m->parts.count);
    for (uint32_t f = 0; f < q->face_count; f++) m->count[q->component[q->corner[4 * f]]]++;
    int64_t most = qw_most_faces(qw_faces_with_reserve(m->run), 1, qw_times_used(m->run));
    int64_t least = qw_least_faces(qw_faces_with_reserve(m->run), 1, qw_times_used(m->run));
    m->most_fewer = least < q->face_count ? q->face_count - least : 0;
    m->spare = most >= q->face_count ? most - q->face_count : (int64_t)(MOST_OVER * sides / 4);
}

/* By all triangles of the surface, as they are measured: another component may lie beside this one. */
static bool find_flipped(remaking *m)
{
    bool any = false;
    const qw_quadmesh *q = m->quads;
    const qw_trimesh *surface = &m->run->core.mesh;
    qw_flip_judge judge = {.surface = surface, .tree = NULL, .edge = (float)m->edge};
    for (uint32_t f = 0; f < q->face_count; f++) {
        uint32_t c = q->component[q->corner[4 * f]];
        if (m->count[c] > MOST_QUADS) continue;
        if (f % MOST_QUADS == 0) qw_heartbeat(m->run->env);
        if (!judge.tree) judge.tree = qw_bvh_build(m->run->env, surface);
        qw_flip flip = qw_flip_of_quad(&judge, q->position, q->corner + 4 * (size_t)f);
        m->faults[c] += flip == QW_FLIPPED, m->doubts[c] += flip == QW_DOUBTFUL;
        any |= flip != QW_NOT_FLIPPED;
    }
    return any;
}

static bool may_remake(const remaking *m, uint32_t c, bool has_rim)
{
    if (m->faults[c] + m->doubts[c] == 0) return false;
    if (!m->run->mirror.is_used && !qw_keeps_rims(m->run)) return true;
    return !has_rim; /* what is sewn to something else stays as it is */
}

/* Without a quad in doubt or, in place of flipped quads, with some. */
static void remake(remaking *m, uint32_t c)
{
    qw_env *env = m->run->env;
    bool has_faults = m->faults[c] > 0;
    qw_flip worst;
    qw_scope_begin(env);
    qw_trimesh part = qw_take_part(env, &m->parts, c);
    /* one that is in doubt gets no more quads for it */
    const qw_straight plan = {m->count[c], has_faults ? QW_MOST_TRIES : 1, m->edge, QW_NOT_FLIPPED, false};
    qw_quadmesh made = qw_make_straight(env, &part, &plan, &worst);
    int64_t more = (int64_t)made.face_count - m->count[c];
    bool is_taken = worst <= (has_faults ? QW_DOUBTFUL : QW_NOT_FLIPPED) && more <= (has_faults ? m->spare : 0) &&
                    -more <= m->most_fewer;
    if (is_taken) qw_keep_quads(env, &made);
    qw_scope_end(env);
    if (!is_taken) return;
    for (uint32_t v = 0; v < made.vertex_count; v++) made.component[v] = c;
    m->spare -= more, m->most_fewer += more, m->left[c] = 0, m->made[m->made_count++] = made;
}

/* Makes anew what may be, component by component. m->made[c] has no faces where nothing was. */
static void remake_all(remaking *m)
{
    assert(m->parts.count > 0 || m->quads->face_count == 0);
    qw_env *env = m->run->env;
    const qw_quadmesh *q = m->quads;
    m->made = QW_NEW_ZERO(env, qw_quadmesh, m->parts.count);
    uint8_t *has_rim = QW_NEW_ZERO(env, uint8_t, m->parts.count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (q->twin[h] == QW_NONE) has_rim[q->component[q->corner[h]]] = 1;
    for (uint32_t c = 0; c < m->parts.count; c++)
        if (may_remake(m, c, has_rim[c])) remake(m, c);
    qw_free(env, has_rim);
}

/* The quads that stay, then those that were made; one scope outward. */
static void join(remaking *m, qw_quadmesh *quads, uint8_t **flipped)
{
    qw_env *env = m->run->env;
    const qw_quadmesh made = qw_join_quads(env, m->made, m->made_count);
    uint8_t *now = QW_NEW_ZERO(env, uint8_t, quads->face_count + made.face_count);
    for (uint32_t f = 0, n = 0; f < quads->face_count; f++)
        if (m->left[quads->component[quads->corner[4 * f]]]) now[n++] = (*flipped)[f];
    *quads = qw_pick_components(env, quads, m->left, &made);
    qw_append_quads(quads, &made);
    *flipped = now;
    qw_keep(env, now), qw_keep_quads(env, quads);
}

uint32_t qw_remake_flipped(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped)
{
    assert(quads->twin && quads->component);
    qw_env *env = run->env;
    uint32_t repaired = 0;
    qw_scope_begin(env);
    remaking m = {.run = run, .quads = quads};
    m.parts = qw_sort_parts(env, &run->surface, run->surface_census.component,
                            (uint32_t)run->surface_census.components);
    count_quads(&m);
    if (find_flipped(&m)) remake_all(&m);
    if (m.made_count > 0) {
        join(&m, quads, flipped);
        for (uint32_t c = 0; c < m.parts.count; c++) repaired += m.left[c] ? 0 : m.faults[c];
        qw_log(env, QW_LOG_DEBUG, "%u components with %u flipped quads were made anew", m.made_count, repaired);
    }
    qw_scope_end(env);
    return repaired;
}
