#include "whole/remake.h"

#include "base/lanes.h"
#include "base/promise.h"
#include "whole/kept_rims.h"
#include "whole/thin.h"
#include "base/elementary.h"
#include "geometry/flips.h"
#include "geometry/parts.h"
#include "remesh/quads/quad_components.h"

#include <assert.h>
#include <string.h>

/* Quads of a component that is made anew, at most. */
enum { MOST_QUADS = 64 };
/* Where there are more quads than asked for anyway, as so few cannot carry the components: this share more. */
static const double MOST_OVER = 0.2;
/* How many quads a component is tried with: so many for each that it has, and so many more. The first without a flipped
   one is taken. */
static const struct {
    double times, more;
} COUNTS[] = {{1, 0}, {1.5, 2}, {2, 6}, {4, 12}};
enum { TRIES = sizeof COUNTS / sizeof *COUNTS };
/* Bytes of a lane, and bytes that a component takes of it for each of its triangles. */
enum { LANE_BYTES = 1 << 24, BYTES_A_TRIANGLE = 1 << 11 };

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
        if (f % MOST_QUADS == 0) qw_break_silence(m->run->env);
        if (!judge.tree) judge.tree = qw_bvh_build(m->run->env, surface);
        qw_flip flip = qw_flip_of_quad(&judge, q->position, q->corner + 4 * (size_t)f);
        m->faults[c] += flip == QW_FLIPPED, m->doubts[c] += flip == QW_DOUBTFUL;
        any |= flip != QW_NOT_FLIPPED;
    }
    return any;
}

/* One component that is made anew, in a lane or, where `env` is the run's, without. */
typedef struct making {
    const remaking *all;
    qw_env *env;
    uint32_t component;
    qw_trimesh part;
    qw_quadmesh best[QW_FLIPPED]; /* in the scope of env where the making began */
    bool done;
} making;

/* Tries several counts, up to the first that is met, and sets the fewest quads none of which is worse than
   QW_NOT_FLIPPED, QW_DOUBTFUL; no faces where each try has one. */
static void make_best(void *user)
{
    making *t = user;
    qw_env *env = t->env;
    const remaking *m = t->all;
    uint32_t c = t->component;
    qw_quadmesh *best = t->best;
    bool is_met[QW_FLIPPED] = {false};
    qw_scope_begin(env);
    /* one that is in doubt gets no more quads for it */
    for (int i = 0; i < (m->faults[c] > 0 ? TRIES : 1); i++) {
        double wanted = qw_floor(COUNTS[i].times * m->count[c] + COUNTS[i].more);
        for (int k = 0; k < QW_FLIPPED; k++)
            is_met[k] = is_met[k] || (best[k].face_count > 0 && best[k].face_count <= wanted);
        if (is_met[QW_NOT_FLIPPED]) break;
        qw_quadmesh made[QW_FLIPPED];
        qw_break_silence(env);
        qw_scope_begin(env);
        qw_make_part(env, &t->part, wanted, m->edge, QW_NOT_FLIPPED, made);
        for (int k = 0; k < QW_FLIPPED; k++) {
            bool is_fewer = best[k].face_count == 0 || made[k].face_count < best[k].face_count;
            if (made[k].face_count == 0 || !is_fewer || is_met[k]) continue;
            best[k] = qw_quadmesh_copy(env, &made[k], 0, 0);
            qw_keep_quads(env, &best[k]);
        }
        qw_scope_end(env);
    }
    for (int k = 0; k < QW_FLIPPED; k++)
        if (best[k].face_count > 0) qw_keep_quads(env, &best[k]);
    qw_scope_end(env);
    t->done = true;
}

/* The best without a quad in doubt; else, for those that have flipped ones, with some. One scope outward. */
static void take_best(remaking *m, const making *t)
{
    uint32_t c = t->component;
    bool in_doubt = t->best[QW_NOT_FLIPPED].face_count == 0 && m->faults[c] > 0;
    const qw_quadmesh *best = &t->best[in_doubt ? QW_DOUBTFUL : QW_NOT_FLIPPED];
    int64_t more = (int64_t)best->face_count - m->count[c];
    if (best->face_count == 0 || more > (m->faults[c] > 0 ? m->spare : 0) || -more > m->most_fewer) return;
    qw_quadmesh taken = qw_quadmesh_copy(m->run->env, best, 0, 0);
    qw_keep_quads(m->run->env, &taken);
    for (uint32_t v = 0; v < taken.vertex_count; v++) taken.component[v] = c, taken.kind[v] = QW_VERTEX_FREE;
    m->spare -= more, m->most_fewer += more, m->left[c] = 0, m->made[m->made_count++] = taken;
}

static bool may_remake(const remaking *m, uint32_t c, bool has_rim)
{
    if (m->faults[c] + m->doubts[c] == 0) return false;
    if (!m->run->mirror.is_used && !qw_keeps_rims(m->run)) return true;
    return !has_rim; /* what is sewn to something else stays as it is */
}

/* uint32_t[parts.count]: the components to be made anew; returns how many. */
static uint32_t list_components(const remaking *m, uint32_t *list)
{
    const qw_quadmesh *q = m->quads;
    uint32_t count = 0;
    uint8_t *has_rim = QW_NEW_ZERO(m->run->env, uint8_t, m->parts.count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (q->twin[h] == QW_NONE) has_rim[q->component[q->corner[h]]] = 1;
    for (uint32_t c = 0; c < m->parts.count; c++)
        if (may_remake(m, c, has_rim[c])) list[count++] = c;
    qw_free(m->run->env, has_rim);
    return count;
}

static void make_in_lane(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    making *all = user;
    for (uint32_t i = begin; i < end; i++)
        if (all[i].env) (void)qw_protect(all[i].env, make_best, &all[i]); /* what failed is not `done` */
}

/* Components side by side, each in a lane; one that a lane has no room for is made without. */
static void make_side_by_side(remaking *m, const uint32_t *list, uint32_t count, qw_lane *lanes, uint32_t lane_count)
{
    qw_env *env = m->run->env;
    making all[QW_MOST_LANES];
    qw_scope_begin(env);
    for (uint32_t i = 0; i < count; i++) {
        qw_env *own = i < lane_count ? lanes[i].env : NULL;
        all[i] = (making){.all = m, .env = own, .component = list[i], .part = qw_take_part(env, &m->parts, list[i])};
        if (own) qw_scope_begin(own);
    }
    qw_parallel(env, count, 1, make_in_lane, all);
    for (uint32_t i = 0; i < count; i++) {
        if (!all[i].done) {
            memset(all[i].best, 0, sizeof all[i].best);
            all[i].env = env;
            make_best(&all[i]);
        }
        take_best(m, &all[i]);
        if (i < lane_count && lanes[i].env) qw_scope_end(lanes[i].env);
    }
    qw_scope_end(env);
}

static uint32_t largest_part(const remaking *m, const uint32_t *list, uint32_t count)
{
    uint32_t most = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t faces = m->parts.begin[list[i] + 1] - m->parts.begin[list[i]];
        most = faces > most ? faces : most;
    }
    return most;
}

static void remake_all(remaking *m)
{
    qw_env *env = m->run->env;
    m->made = QW_NEW_ZERO(env, qw_quadmesh, m->parts.count);
    uint32_t *list = QW_NEW(env, uint32_t, m->parts.count), count = list_components(m, list),
             threads = qw_env_threads(env), lane_count = threads < QW_MOST_LANES ? threads : QW_MOST_LANES;
    if (threads == 1 || count < 2 || largest_part(m, list, count) > LANE_BYTES / BYTES_A_TRIANGLE) lane_count = 0;
    qw_lane *lanes = qw_lanes_begin(env, lane_count, LANE_BYTES);
    uint32_t step = lane_count > 0 ? lane_count : 1;
    for (uint32_t i = 0; i < count; i += step)
        make_side_by_side(m, list + i, count - i < step ? count - i : step, lanes, lane_count);
    qw_lanes_end(lanes, lane_count);
    qw_free(env, list);
}

/* The quads that stay, then those that were made. */
static qw_quadmesh join(remaking *m, uint8_t *flipped, const uint8_t *before)
{
    const qw_quadmesh *q = m->quads;
    qw_quadmesh room = {0};
    for (uint32_t i = 0; i < m->made_count; i++)
        room.vertex_count += m->made[i].vertex_count, room.face_count += m->made[i].face_count;
    qw_quadmesh joined = qw_pick_components(m->run->env, q, m->left, &room);
    for (uint32_t f = 0, n = 0; f < q->face_count; f++)
        if (m->left[q->component[q->corner[4 * f]]]) flipped[n++] = before[f];
    for (uint32_t i = 0; i < m->made_count; i++) qw_append_quads(&joined, &m->made[i]);
    return joined;
}

uint32_t qw_remake_flipped(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped)
{
    assert(quads->twin && quads->component);
    qw_env *env = run->env;
    uint32_t repaired = 0, most = quads->face_count;
    qw_scope_begin(env);
    remaking m = {.run = run, .quads = quads};
    m.parts = qw_sort_parts(env, &run->surface, run->surface_census.component,
                            (uint32_t)run->surface_census.components);
    count_quads(&m);
    if (find_flipped(&m)) remake_all(&m);
    if (m.made_count > 0) {
        uint8_t *now = QW_NEW_ZERO(env, uint8_t, most + (size_t)m.made_count * MOST_QUADS * 16);
        *quads = join(&m, now, *flipped);
        *flipped = now;
        qw_keep(env, now), qw_keep_quads(env, quads);
        for (uint32_t c = 0; c < m.parts.count; c++) repaired += m.left[c] ? 0 : m.faults[c];
        qw_log(env, QW_LOG_DEBUG, "%u components with %u flipped quads were made anew", m.made_count, repaired);
    }
    qw_scope_end(env);
    return repaired;
}
