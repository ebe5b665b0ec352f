#include "remesh/meetings/meetings.h"

#include "base/constants.h"
#include "base/mechanisms.h"
#include "remesh/meetings/strip_search.h"
#include "remesh/meetings/tries.h"
#include "remesh/quantise/closed_moves.h"
#include "remesh/quantise/nearest.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Quads that lines must become shorter by for a unit of energy, at --loops 1 and for each unit of (1 - loops) / loops.
 */
static const double WORTH_LEAST = 0.1, WORTH = 0.5;
/* The longest that a line can count, in square roots of the area. */
static const double LONGEST = 20;
/* Quads: so far a search that takes the nearest first looks at the beginning, then twice as far. */
static const double FIRST_REACH = 4;
/* IN_VAIN: tries without success, one after the other, before the search ends: of 250 that were kept on ten meshes
   two came later. WORK: triangles of all layouts looked at; the search of candidates costs about as much as SEARCH
   tries. ROOM: triangles for each of the complex. NEAREST_WORK: triangles of the offsets looked at that keep what is
   held. AT_A_TIME: candidates picked. */
enum { IN_VAIN = 250, WORK = 600000, SEARCH = 20, ROOM = 4, NEAREST_WORK = 12500, AT_A_TIME = 64 };
/* Bytes of a lane: LANE_LEAST and so many a face that there is room for, which has been enough for 88 meshes. Where
   that is more than LANE_MOST there are no lanes. */
enum { LANE_LEAST = 1 << 20, LANE_A_FACE = 900, LANE_MOST = 1 << 24 };

typedef struct meeting_search {
    qw_meeting_terms terms;
    qw_measured_layout now;
    qw_tries *tries;
    double left;   /* work */
    qw_int2 *best; /* offsets of the best so far */
    double best_lines;
    qw_candidates found, failed;
} meeting_search;

static bool has_failed(const meeting_search *s, const qw_candidate *k)
{
    for (size_t i = 0; i < s->failed.count; i++)
        if (qw_is_same_candidate(&s->failed.found[i], k)) return true;
    return false;
}

/* What lines and energy cost together; a quad that the count is off by counts as one of a line. */
static double score_of(const qw_meeting_terms *t, const qw_measured_layout *m)
{
    return m->lines + t->worth * m->energy +
           qw_area_beyond(t->least_area, t->most_area, qw_complex_area(&m->layout.complex));
}

static bool is_promised(const meeting_search *s)
{
    const qw_meeting_terms *t = &s->terms;
    return qw_area_beyond(t->least_promised, t->most_promised, qw_complex_area(&s->now.layout.complex)) <= 0;
}

/* Keeps the layout's offsets if they are the best so far. */
static void consider(qw_env *env, meeting_search *s)
{
    const qw_meeting_terms *t = &s->terms;
    double score = score_of(t, &s->now);
    if (score >= t->best_score || !is_promised(s)) return;
    if (qw_count_touching(env, t->component, s->now.source.d) > t->touching) return;
    qw_layout_undo(&s->now.layout, s->best);
    s->terms.best_score = score, s->best_lines = s->now.lines;
}

/* Tries the candidates found whose keys are between these, until one is kept; returns false where none is. */
static bool keep_one_of(qw_env *env, meeting_search *s, double least, double most, uint32_t *tried, uint32_t most_tried)
{
    qw_candidate *some[AT_A_TIME];
    for (size_t i = 0; i < s->found.count && s->found.found[i].key >= least && *tried < most_tried;) {
        uint32_t n = 0;
        for (; i < s->found.count && n < AT_A_TIME && *tried + n < most_tried; i++) {
            qw_candidate *k = &s->found.found[i];
            if (k->key < least) break;
            bool is_known = k->key >= most || has_failed(s, k);
            for (uint32_t j = 0; j < n && !is_known; j++) is_known = qw_is_same_candidate(some[j], k);
            if (!is_known) some[n++] = k;
        }
        uint32_t kept = qw_tries_make(env, s->tries, some, n, &s->now);
        *tried += kept < n ? kept + 1 : n;
        for (uint32_t j = 0; j < kept; j++) {
            s->failed.found = qw_grow(env, s->failed.found, &s->failed.room, s->failed.count + 1, sizeof *some[j]);
            s->failed.found[s->failed.count++] = *some[j];
        }
        if (kept < n) return true;
    }
    return false;
}

/* Makes one meeting, of cones that lie near first where tries are accepted by an estimate. Returns whether there
 * was one. */
static bool keep_one(qw_env *env, meeting_search *s, uint32_t *tried, uint32_t most_tried)
{
    qw_outlook outlook = {&s->now.layout, s->now.length, QW_FARTHEST_CONE, s->terms.accepts_by_estimate};
    double nearer = INFINITY; /* keys above this have been tried */
    if (s->terms.accepts_by_estimate)
        for (outlook.reach = FIRST_REACH; outlook.reach < QW_FARTHEST_CONE; outlook.reach *= 2) {
            qw_tries_find(env, s->tries, &outlook, &s->found);
            if (keep_one_of(env, s, -outlook.reach, nearer, tried, most_tried)) return true;
            nearer = -outlook.reach;
        }
    outlook.reach = QW_FARTHEST_CONE;
    qw_tries_find(env, s->tries, &outlook, &s->found);
    return keep_one_of(env, s, -INFINITY, nearer, tried, most_tried);
}

/* Considers the layout with other integers. */
static void look_at_nearest(qw_env *env, void *user)
{
    meeting_search *s = user;
    double most = s->terms.best_score;
    if (is_promised(s) && qw_measure_energy(&s->terms, &s->now) &&
        qw_measure_lines(&s->terms, &s->now, most - s->terms.worth * s->now.energy))
        consider(env, s);
}

/* Considers all offsets that keep what is held and cost less than the best so far. */
static void look_around(qw_env *env, meeting_search *s)
{
    uint32_t faces = s->now.layout.complex.face_count;
    double energy = s->now.energy;
    qw_nearest_request request = {NEAREST_WORK / faces, s->terms.best_score / s->terms.worth, look_at_nearest, s};
    s->left -= (double)qw_visit_nearest(env, &s->now.layout.complex, &request) * faces;
    s->now.energy = energy;
}

/* What has only missed the count may be made once others have met. */
static void forget_misses(qw_candidates *failed)
{
    size_t kept = 0;
    for (size_t i = 0; i < failed->count; i++)
        if (!failed->found[i].misses_count) failed->found[kept++] = failed->found[i];
    failed->count = kept;
}

/* Makes meetings one by one until none more can be made. */
static void make_all(qw_env *env, meeting_search *s, qw_meeting_counts *counts, double share)
{
    s->left = WORK * share, s->failed.count = 0;
    uint32_t vain = 0; /* tries since the last one kept */
    for (uint32_t kept_before = QW_NONE; kept_before != counts->kept;) {
        kept_before = counts->kept;
        forget_misses(&s->failed);
        for (bool kept = true; kept;) {
            double faces = fmax(s->now.layout.complex.face_count, 1);
            if ((s->left -= SEARCH * faces) < faces) break;
            uint32_t tried = 0;
            kept = keep_one(env, s, &tried, (uint32_t)fmin(IN_VAIN - vain, s->left / faces));
            counts->tried += tried, counts->kept += kept;
            vain = kept ? 0 : vain + tried;
            s->left = vain == IN_VAIN ? 0 : s->left - tried * faces;
            if (!kept) continue;
            consider(env, s);
            if (s->terms.accepts_by_estimate) look_around(env, s);
            qw_measure_lines(&s->terms, &s->now, INFINITY);
        }
    }
}

static size_t lane_bytes(const meeting_search *s)
{
    size_t bytes = LANE_LEAST + (size_t)s->now.layout.face_room * LANE_A_FACE;
    return bytes <= LANE_MOST ? bytes : 0;
}

/* Makes lines meet until none more can be made to: where there are few cones, first by estimates, then by measures from
   where that ended. */
static void meet_all(qw_env *env, meeting_search *s, qw_meeting_counts *counts, double share)
{
    size_t edges = s->now.source.edge_count;
    s->tries = qw_tries_begin(env, &s->terms, s->now.source.real, s->now.layout.face_room, lane_bytes(s));
    if (edges <= QW_MOST_MOVED_EDGES) {
        s->terms.accepts_by_estimate = true;
        make_all(env, s, counts, share);
        s->terms.accepts_by_estimate = false;
        qw_measured_layout_fill(&s->terms, &s->now,
                                memcpy(QW_NEW(env, qw_int2, edges), s->best, edges * sizeof *s->best));
    }
    make_all(env, s, counts, share);
    qw_tries_end(s->tries);
}

/* Searches on for strips that do not cross themselves, from the best offsets so far. Of what the searches find the
   best is taken; nothing of it where all lines together become longer by more quads than there are fewer in such
   strips. */
static void straighten_strips(qw_env *env, meeting_search *s, double share)
{
    qw_complex *c = &s->now.source;
    size_t bytes = c->edge_count * sizeof *c->d;
    memcpy(c->d, s->best, bytes);
    qw_strip_find found[QW_STRIP_SEARCHES];
    uint32_t count = qw_search_strips(env, &s->terms, c, share, lane_bytes(s), found);
    double least = INFINITY, had = s->best_lines;
    for (uint32_t i = 0; i < count; i++) {
        qw_acted(env, QW_MECH_STRIPS, found[i].tried);
        qw_measured_layout_fill(&s->terms, &s->now, found[i].d);
        double lines = s->now.lines;
        if (lines >= had + found[i].freed || found[i].score >= least) continue;
        least = found[i].score, s->best_lines = lines;
        memcpy(s->best, found[i].d, bytes);
        qw_kept(env, QW_MECH_STRIPS, found[i].kept);
    }
}

/* The layout as it comes, with all that does not change during the search. In the current scope. */
static meeting_search begin_search(qw_env *env, const qw_component *component, const qw_meeting_request *request,
                                   const qw_int2 *d)
{
    assert(component->vertex_count > 0 && request->real && d);
    const qw_complex *c = &component->decimated.complex;
    uint32_t room = ROOM * c->face_count + component->vertex_count;
    meeting_search s = {.now = qw_measured_layout_make(env, component, request->real, room)};
    qw_complex first = s.now.source;
    first.d = memcpy(s.now.source.d, d, c->edge_count * sizeof *d);
    s.terms = (qw_meeting_terms){
        .component = component,
        .first = d,
        .first_area = qw_complex_area(&first),
        .inverted = qw_complex_inverted(&first),
        .touching = qw_count_touching(env, component, d),
        .curves = qw_find_closed_curves(env, component),
        .worth = WORTH_LEAST + WORTH * (1 - request->loops) / request->loops,
        .least_area = request->least_area,
        .most_area = request->most_area,
        .least_promised = request->least_promised,
        .most_promised = request->most_promised,
        .longest = (int32_t)(LONGEST * sqrt(request->most_area)),
    };
    s.terms.odd = qw_count_odd_curves(&s.terms.curves, d);
    qw_measured_layout_fill(&s.terms, &s.now, d);
    s.best = memcpy(QW_NEW(env, qw_int2, s.now.layout.edge_room), d, c->edge_count * sizeof *d);
    s.terms.best_score = score_of(&s.terms, &s.now), s.best_lines = s.now.lines;
    return s;
}

qw_meeting_counts qw_make_meetings(qw_env *env, const qw_component *component, const qw_meeting_request *request,
                                   qw_int2 *d)
{
    assert(request->loops > 0 && request->loops <= 1 && request->least_area <= request->most_area);
    if (!(request->most_area > 0)) return (qw_meeting_counts){0}; /* it is inverted as a whole: no line has a length */
    qw_scope_begin(env);
    meeting_search s = begin_search(env, component, request, d);
    if (!(s.terms.first_area > 0)) { /* likewise, by its integers */
        qw_scope_end(env);
        return (qw_meeting_counts){0};
    }
    qw_meeting_counts counts = {.length_before = (int64_t)s.now.lines};
    if (request->share > 0) meet_all(env, &s, &counts, request->share);
    if (request->strips_share > 0 && qw_uses(env, QW_MECH_STRIPS)) straighten_strips(env, &s, request->strips_share);
    memcpy(d, s.best, s.now.source.edge_count * sizeof *d);
    counts.length_after = (int64_t)s.best_lines;
    qw_scope_end(env);
    return counts;
}
