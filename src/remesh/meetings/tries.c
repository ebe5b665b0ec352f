#include "remesh/meetings/tries.h"

#include "base/constants.h"
#include "base/pool.h"
#include "remesh/quantise/circuits.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The most by which a search that accepts by estimates may miss the count, as a share of it. */
static const double TRUSTED_AREA = 0.05;
/* ---- what a layout is worth */

double qw_area_beyond(double least, double most, double area) { return fmax(fmax(least - area, area - most), 0); }

bool qw_measure_lines(const qw_meeting_terms *terms, qw_measured_layout *m, double most)
{
    if (most <= 0) return false;
    if (!m->is_numbered) qw_layout_number(&m->layout);
    m->is_numbered = true;
    double scale = sqrt(terms->first_area / fmax(qw_complex_area(&m->layout.complex), 1)) / 2, sums = most / scale;
    int64_t sum = qw_layout_measure(&m->layout, terms->longest,
                                    sums < (double)(INT64_MAX / 2) ? (int64_t)sums + 1 : INT64_MAX, m->length);
    m->lines = (double)sum * scale;
    return m->lines < most;
}

/* Whether cones, corners or curves that were in one place are so no more, or others are: a corner would lose its cone,
   two cones would be one, two curves touch. */
static bool joins_or_parts(const qw_complex *c, const qw_int2 *had)
{
    for (uint32_t e = 0; e < c->edge_count; e++)
        if (qw_int2_is_zero(c->d[e]) != qw_int2_is_zero(had[e])) return true;
    return false;
}

bool qw_measure_energy(const qw_meeting_terms *terms, qw_measured_layout *m)
{
    if (qw_complex_inverted(&m->layout.complex) > terms->inverted) return false;
    qw_layout_undo(&m->layout, m->source.d);
    if (qw_complex_inverted(&m->source) > terms->inverted || joins_or_parts(&m->source, terms->first)) return false;
    if (qw_count_odd_curves(&terms->curves, m->source.d) > terms->odd) return false;
    m->energy = qw_complex_energy(&m->source);
    return !terms->accepts_by_estimate || terms->worth * m->energy < terms->best_score;
}

qw_measured_layout qw_measured_layout_make(qw_env *env, const qw_component *component, const qw_real2 *real,
                                           uint32_t room)
{
    const qw_complex *c = &component->decimated.complex;
    assert(real && room >= c->face_count);
    qw_measured_layout m = {.layout = qw_layout_make(env, room), .source = *c};
    m.source.real = memcpy(QW_NEW(env, qw_real2, c->edge_count), real, c->edge_count * sizeof *real);
    m.source.d = QW_NEW(env, qw_int2, m.layout.edge_room);
    m.length = QW_NEW(env, int32_t, QW_MOST_LINES * (size_t)m.layout.vertex_room);
    return m;
}

void qw_measured_layout_fill(const qw_meeting_terms *terms, qw_measured_layout *m, const qw_int2 *d)
{
    qw_layout_fill(&m->layout, terms->component, m->source.real, d);
    memcpy(m->source.d, d, m->source.edge_count * sizeof *d);
    m->is_numbered = false;
    m->energy = qw_complex_energy(&m->source);
    qw_measure_lines(terms, m, INFINITY);
}

static void copy_measured(qw_env *env, const qw_measured_layout *from, qw_measured_layout *to)
{
    qw_layout_copy(env, &from->layout, &to->layout);
    memcpy(to->source.d, from->source.d, from->source.edge_count * sizeof *to->source.d);
    to->lines = from->lines, to->energy = from->energy, to->is_numbered = false;
}

/* ---- one try */

/* Closes the offsets again where constrained edges have got a part that they may not have. Returns false where that
   cannot be, or costs more than `most`. */
static bool close_layout(qw_env *env, qw_complex *c, double most)
{
    qw_complex_weigh(c);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (c->fixed[e] & QW_FIXED_X) c->d[e].x = 0;
        if (c->fixed[e] & QW_FIXED_Y) c->d[e].y = 0;
    }
    return qw_close_offsets(env, c, QW_LONGEST_WALK, most);
}

/* Makes the two lines of k meet in m, which is as `now` first. It is kept where what is saved is worth the energy that
   it costs: the length that all lines together have lost or, where the search accepts_by_estimate, what these two may
   save. */
static bool try(qw_env *env, const qw_meeting_terms *terms, qw_candidate *k, const qw_measured_layout *now,
                qw_measured_layout *m)
{
    copy_measured(env, now, m);
    qw_complex *c = &m->layout.complex;
    if (!qw_make_segment(env, &m->layout, k->segment)) return false;
    if (!close_layout(env, c, k->gain / terms->worth)) return false;
    double had = qw_complex_area(&now->layout.complex),
           room = terms->accepts_by_estimate ? TRUSTED_AREA * terms->first_area
                                             : qw_area_beyond(terms->least_area, terms->most_area, had);
    k->misses_count = qw_area_beyond(terms->least_area, terms->most_area, qw_complex_area(c)) > room;
    if (k->misses_count || !qw_measure_energy(terms, m)) return false;
    double cost = terms->worth * (m->energy - now->energy);
    bool pays = terms->accepts_by_estimate ? k->gain > cost : qw_measure_lines(terms, m, now->lines - cost);
    if (!pays || qw_count_touching(env, terms->component, m->source.d) > terms->touching) return false;
    if (terms->accepts_by_estimate) qw_measure_lines(terms, m, INFINITY);
    return true;
}

/* ---- side by side */

/* A place to make tries in. */
typedef struct worker {
    qw_env *env; /* NULL once its memory has run out */
    qw_tries *all;
    qw_measured_layout measured;
    qw_candidates found;
    uint32_t part; /* of the work at hand that is done here */
    uint32_t kept; /* index of the candidate that `measured` shows, or the count of all */
} worker;

struct qw_tries {
    const qw_meeting_terms *terms;
    const qw_real2 *real;
    uint32_t room, lane_count;
    qw_lane *lane;
    worker own, *worker; /* own: in the memory of the run; worker[lane_count] */
    /* the work at hand */
    const qw_outlook *outlook;
    qw_candidate *const *candidate;
    uint32_t count;
    qw_shared next;       /* index of the first candidate that no lane has begun with */
    qw_shared first_kept; /* index of the first known that can be kept, or the count */
    const qw_measured_layout *now;
};

static void set_up(void *user)
{
    worker *b = user;
    b->measured = qw_measured_layout_make(b->env, b->all->terms->component, b->all->real, b->all->room);
}

qw_tries *qw_tries_begin(qw_env *env, const qw_meeting_terms *terms, const qw_real2 *real, uint32_t room,
                         size_t lane_bytes)
{
    qw_tries *a = QW_NEW_ZERO(env, qw_tries, 1);
    uint32_t threads = qw_env_threads(env);
    a->lane_count = threads == 1 || lane_bytes == 0 ? 0 : threads < QW_MOST_LANES ? threads : QW_MOST_LANES;
    a->terms = terms, a->real = real, a->room = room;
    a->own = (worker){.env = env, .all = a};
    set_up(&a->own);
    a->lane = qw_lanes_begin(env, a->lane_count, lane_bytes), a->worker = QW_NEW_ZERO(env, worker, a->lane_count);
    for (uint32_t i = 0; i < a->lane_count; i++) {
        worker *b = &a->worker[i];
        *b = (worker){.env = a->lane[i].env, .all = a, .part = i};
        if (b->env && qw_protect(b->env, set_up, b) != QW_OK) b->env = NULL;
    }
    return a;
}

void qw_tries_end(qw_tries *a) { qw_lanes_end(a->lane, a->lane_count); }

/* Whether there are lanes, none of which has had too little memory. */
static bool has_lanes(const qw_tries *a)
{
    bool all = a->lane_count > 0;
    for (uint32_t i = 0; i < a->lane_count; i++) all &= a->worker[i].env != NULL;
    return all;
}

/* Runs a part of the work in each lane; false where it is to be done without them. */
static bool run_lanes(qw_env *env, qw_tries *a, qw_task task)
{
    if (!has_lanes(a)) return false;
    qw_parallel(env, a->lane_count, 1, task, a);
    return has_lanes(a);
}

static void find_part(void *user)
{
    worker *b = user;
    const qw_tries *a = b->all;
    uint64_t halves = 3 * (uint64_t)a->outlook->layout->complex.face_count;
    b->found.count = 0;
    qw_add_candidates(b->env, a->outlook, (uint32_t)(halves * b->part / a->lane_count),
                      (uint32_t)(halves * (b->part + 1) / a->lane_count), &b->found);
}

static void find_in_lane(void *user, uint32_t begin, uint32_t end)
{
    (void)end;
    worker *b = &((qw_tries *)user)->worker[begin];
    if (b->env && qw_protect(b->env, find_part, b) != QW_OK) b->env = NULL;
}

void qw_tries_find(qw_env *env, qw_tries *a, const qw_outlook *outlook, qw_candidates *found)
{
    a->outlook = outlook;
    found->count = 0;
    if (run_lanes(env, a, find_in_lane)) {
        size_t count = 0;
        for (uint32_t i = 0; i < a->lane_count; i++) count += a->worker[i].found.count;
        found->found = qw_grow(env, found->found, &found->room, count, sizeof *found->found);
        for (uint32_t i = 0; i < a->lane_count; i++) {
            const qw_candidates *part = &a->worker[i].found;
            if (part->count > 0) memcpy(found->found + found->count, part->found, part->count * sizeof *part->found);
            found->count += part->count;
        }
    } else {
        qw_add_candidates(env, outlook, 0, 3 * outlook->layout->complex.face_count, found);
    }
    qw_sort_candidates(found);
}

/* Tries one candidate after the other, of those that no other lane has begun with, until one is kept or one before
   has been. */
static void try_some(void *user)
{
    worker *b = user;
    qw_tries *a = b->all;
    for (uint32_t i; (i = qw_shared_next(&a->next)) < qw_shared_get(&a->first_kept);) {
        qw_heartbeat(b->env);
        if (!try(b->env, a->terms, a->candidate[i], a->now, &b->measured)) continue;
        b->kept = i;
        qw_shared_lower(&a->first_kept, i);
        return;
    }
}

static void try_in_lane(void *user, uint32_t begin, uint32_t end)
{
    (void)end;
    worker *b = &((qw_tries *)user)->worker[begin];
    if (b->env && qw_protect(b->env, try_some, b) != QW_OK) b->env = NULL;
}

/* All before the first that can be kept are tried, and some behind it in vain; false where it is to be done
   otherwise. */
static bool try_in_lanes(qw_env *env, qw_tries *a)
{
    for (worker *b = a->worker; b < a->worker + a->lane_count; b++) b->kept = a->count;
    qw_shared_set(&a->next, 0);
    return run_lanes(env, a, try_in_lane);
}

static void try_one_by_one(qw_env *env, qw_tries *a)
{
    worker *b = &a->own;
    for (b->kept = 0; b->kept < a->count; b->kept++) {
        qw_heartbeat(env);
        if (try(env, a->terms, a->candidate[b->kept], a->now, &b->measured)) break;
    }
    qw_shared_set(&a->first_kept, b->kept);
}

uint32_t qw_tries_make(qw_env *env, qw_tries *a, qw_candidate *const *candidate, uint32_t count,
                       qw_measured_layout *now)
{
    assert(candidate || count == 0);
    a->candidate = candidate, a->count = count, a->now = now;
    qw_shared_set(&a->first_kept, count);
    if (!try_in_lanes(env, a)) try_one_by_one(env, a);
    uint32_t kept = qw_shared_get(&a->first_kept);
    if (kept < count) {
        const worker *b = &a->own;
        for (uint32_t i = 0; i < a->lane_count; i++)
            if (a->worker[i].kept == kept) b = &a->worker[i];
        copy_measured(env, &b->measured, now);
    }
    return kept;
}
