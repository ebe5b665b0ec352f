#include "run/retry.h"

#include "base/constants.h"
#include "base/promise.h"
#include "geometry/quadmesh.h"

#include <assert.h>
#include <math.h>
#include <string.h>

const qw_retry_row qw_retry_rows[QW_RETRIES] = {
#define QW_RETRY(name, after, back, most, sentence) {#name, QW_STAGE_##after, QW_STAGE_##back, most, sentence},
#include "run/retries.def"
};

static const qw_plan FIRST_PLAN = {.size_factor = 1};

void qw_history_begin(qw_history *h)
{
    memset(h, 0, sizeof *h);
    h->count = 1;
    h->attempt[0].plan = FIRST_PLAN;
    h->attempt[0].cause = QW_NO_RETRY;
}

void qw_history_go_back(qw_history *h, const qw_step *step)
{
    assert(step->cause < QW_RETRIES && h->count < QW_MAX_ATTEMPTS);
    if (qw_begins_anew(&qw_retry_rows[step->cause])) {
        uint32_t earlier = h->earlier + h->count;
        qw_request request = h->request;
        qw_history_begin(h);
        h->earlier = earlier, h->request = request, h->attempt[0].plan = step->plan;
        return;
    }
    h->current = h->count++;
    h->attempt[h->current].plan = step->plan;
    h->attempt[h->current].cause = step->cause;
}

int qw_history_asked_by(const qw_history *h)
{
    int last = h->earlier > 0 ? (int)QW_STAGE_COUNT - 1 : -1;
    for (uint32_t i = 1; i < h->count; i++) {
        int stage = (int)qw_retry_rows[h->attempt[i].cause].after;
        if (stage > last) last = stage;
    }
    return last;
}

qw_stage qw_history_went_to(const qw_history *h)
{
    const qw_plan *p = &h->attempt[0].plan;
    qw_stage first = p->keeps_teeth                ? QW_STAGE_CLEAN
                     : p->plane > 0 || p->ringless ? QW_STAGE_CORE
                     : p->room > 0                 ? QW_STAGE_WORKING
                                                   : QW_STAGE_COUNT;
    for (uint32_t i = 1; i < h->count; i++) {
        qw_stage stage = qw_retry_rows[h->attempt[i].cause].back;
        if (stage < first) first = stage;
    }
    return first;
}

/* ---- what the history says */

static const qw_attempt *current(const qw_history *h) { return &h->attempt[h->current]; }

/* The attempt that began the present round: the last one for which the working mesh was made. */
static uint32_t round_begin(const qw_history *h)
{
    uint32_t begin = h->count - 1;
    while (begin > 0 && qw_retry_rows[h->attempt[begin].cause].back > QW_STAGE_WORKING) begin--;
    return begin;
}

static uint32_t uses_since(const qw_history *h, qw_retry cause, uint32_t first)
{
    uint32_t count = 0;
    for (uint32_t i = first; i < h->count; i++) count += i > 0 && h->attempt[i].cause == cause;
    return count;
}

static bool has_use(const qw_history *h, qw_retry cause, uint32_t first)
{
    return uses_since(h, cause, first) < qw_retry_rows[cause].most;
}

static bool was_judged(const qw_attempt *a, qw_stage stage) { return a->judged > (uint32_t)stage; }

static qw_step go_on(uint32_t best) { return (qw_step){QW_NO_RETRY, best, FIRST_PLAN}; }

/* Where cones cut the surface into many times as many triangles as there are quads, or into more and the count is below
   the least, what repairs leave hardly depends on the size: one step, as long as two, shows all that another can do. */
static bool takes_one_step(const qw_history *h)
{
    const qw_verdict *v = &current(h)->verdict;
    return h->request.is_closed && v->lacks_room > (qw_is_too_few(&h->request) ? 0 : 1);
}

static bool is_large(const qw_history *h)
{
    return current(h)->verdict.working_vertices > QW_LARGE_VERTICES || h->request.faces_wanted > QW_LARGE_FACES;
}

/* Trees of leaves, heaps: thousands of components of a few quads each. Rounding decides how many quads they have. */
static bool has_many_parts(const qw_history *h)
{
    return h->request.faces_wanted > QW_LARGE_FACES &&
           (double)h->request.components * QW_LEAST_SHELL > QW_MANY_PARTS * h->request.faces_wanted;
}

static bool is_little_inverted(const qw_history *h)
{
    return qw_is_little_inverted(h->request.faces_wanted, current(h)->verdict.inverted);
}

/* ---- rounds: the run goes back to the working mesh */

static qw_step refine(const qw_history *h, qw_retry cause, uint32_t best)
{
    const qw_plan *p = &current(h)->plan;
    qw_step step = {cause, best, h->attempt[0].plan};
    step.plan.size_factor = p->size_factor, step.plan.reserve = p->reserve;
    step.plan.refinements = p->refinements + current(h)->verdict.places;
    if (step.plan.refinements > QW_MAX_REFINEMENTS) step.plan.refinements = QW_MAX_REFINEMENTS;
    return step;
}

/* ---- after REPAIR */

static qw_step after_repair(const qw_history *h)
{
    const qw_verdict *v = &current(h)->verdict;
    if (h->request.repairs && !qw_is_too_few(&h->request) && v->topology_lost && v->places > 0 && !v->lacks_room &&
        !is_little_inverted(h) && has_use(h, QW_RETRY_TOPOLOGY, 0))
        return refine(h, QW_RETRY_TOPOLOGY, QW_NO_ATTEMPT);
    return go_on(h->current);
}

/* ---- after SIMPLIFY */

static double count_error(const qw_history *h, uint32_t i)
{
    return qw_count_error(qw_faces_aimed_at(&h->request), h->attempt[i].verdict.faces);
}

/* The attempt, from `first` on, whose count is nearest to the wanted one; the first of equal ones. */
static uint32_t nearest_count(const qw_history *h, uint32_t first)
{
    uint32_t best = h->current;
    for (uint32_t i = h->count; i-- > first;)
        if (was_judged(&h->attempt[i], QW_STAGE_SIMPLIFY) && count_error(h, i) <= count_error(h, best)) best = i;
    return best;
}

static bool may_resize(const qw_history *h, uint32_t first)
{
    const qw_verdict *v = &current(h)->verdict;
    bool repairs_decide = h->request.is_closed && (v->topology_lost || v->lacks_room);
    uint32_t most = takes_one_step(h) || (repairs_decide && has_many_parts(h)) ? 1
                    : repairs_decide                                           ? QW_SIZE_RETRIES_REBUILT
                                     : qw_retry_rows[QW_RETRY_FACE_COUNT].most;
    return uses_since(h, QW_RETRY_FACE_COUNT, first) < most;
}

static qw_step with_other_size(const qw_history *h, uint32_t best)
{
    qw_step step = {QW_RETRY_FACE_COUNT, best, current(h)->plan};
    double ratio = sqrt(current(h)->verdict.faces / qw_faces_aimed_at(&h->request)),
           by = fmin(fmax(ratio, 1 / QW_MOST_SIZE_STEP), QW_MOST_SIZE_STEP);
    step.plan.size_factor *= takes_one_step(h) ? by * by : by;
    return step;
}

/* After SIMPLIFY: other sizes as long as the count converges, else on with the nearest count. */
static qw_step after_simplify(const qw_history *h)
{
    assert(h->current < h->count);
    const qw_verdict *v = &current(h)->verdict;
    uint32_t round = round_begin(h), best = nearest_count(h, round);
    if (qw_is_near_count(qw_faces_aimed_at(&h->request), v->faces, h->request.times_used) || v->faces < 1)
        return go_on(h->current);
    if (best != h->current || !may_resize(h, round)) return go_on(best);
    return with_other_size(h, best);
}

/* ---- after RELAX */

static double faults(const qw_history *h, uint32_t i)
{
    return h->attempt[i].verdict.uncovered + h->attempt[i].verdict.flipped;
}

static double misshapen(const qw_history *h, uint32_t i) { return h->attempt[i].verdict.misshapen; }

/* Of the attempts from `begin` to `end` and `best`, if that is one, the one with the least uncovered area and fewest
   flipped and, `weight` times, misshapen quads; the first of equal ones. */
static uint32_t least_of(const qw_history *h, uint32_t begin, uint32_t end, double weight, uint32_t best)
{
    for (uint32_t i = end; i-- > begin;)
        if (was_judged(&h->attempt[i], QW_STAGE_RELAX) &&
            (best == QW_NO_ATTEMPT ||
             faults(h, i) + weight * misshapen(h, i) <= faults(h, best) + weight * misshapen(h, best)))
            best = i;
    return best;
}

/* The best of all rounds. Once protrusions have had room kept for them, misshapen quads count; of the attempts before,
   the one that was best without them is all that was kept. */
static uint32_t least_faults(const qw_history *h)
{
    uint32_t with_room = 1;
    while (with_room < h->count && h->attempt[with_room].cause != QW_RETRY_PROTRUSIONS) with_room++;
    if (with_room >= h->count) return least_of(h, 0, h->count, 0, h->current);
    uint32_t kept = least_of(h, 0, with_room, 0, QW_NO_ATTEMPT), best = least_of(h, with_room, h->count, 1, h->current);
    return kept == QW_NO_ATTEMPT ? best : least_of(h, kept, kept + 1, 1, best);
}

static uint32_t coverage_retries(const qw_history *h)
{
    if (h->request.faces_wanted < QW_SMALL_FACES) return qw_retry_rows[QW_RETRY_COVERAGE].most;
    return is_large(h) ? QW_COVERAGE_RETRIES_LARGE : QW_COVERAGE_RETRIES;
}

/* Where components are rebuilt from triangles, the size of the quads decides little of what is flipped: if less than a
   quad is uncovered, another round pays only where the last one did. Where cones cut the surface into more triangles
   than quads are wanted, it decides little of what is uncovered either. None pays where there are too few quads to make
   some of them smaller. */
static bool round_is_hopeless(const qw_history *h)
{
    double least = INFINITY; /* that earlier rounds leave */
    for (uint32_t i = 0; i < round_begin(h); i++)
        if (was_judged(&h->attempt[i], QW_STAGE_RELAX)) least = fmin(least, faults(h, i));
    double present = faults(h, h->current);
    const qw_verdict *v = &current(h)->verdict;
    return (v->topology_lost || v->lacks_room) &&
           (v->lacks_room > 1 || present > QW_HOPELESS_FAULTS * h->request.faces_wanted ||
            ((v->uncovered < 1 || v->lacks_room) && present > QW_ROUND_GAIN * least));
}

/* Whether the run may go back for what RELAX has seen. */
static bool may_go_back(const qw_history *h)
{
    return h->request.repairs && !h->request.hurries && !qw_is_too_few(&h->request);
}

/* Whether protrusions are to grow out of fewer quads: those are kept for them. */
static bool may_reserve(const qw_history *h)
{
    const qw_verdict *v = &current(h)->verdict;
    double faces = h->request.faces_wanted, reserve = fmin(v->lacking, QW_PROTRUSION_SHARE * faces);
    return v->lacking > 0 && v->misshapen > QW_MISSHAPEN * faces && v->misshapen < faces &&
           faces - reserve >= h->request.faces_needed && may_go_back(h) && has_use(h, QW_RETRY_PROTRUSIONS, 0);
}

static qw_step with_reserve(const qw_history *h, uint32_t best)
{
    const qw_attempt *a = current(h);
    qw_step step = {QW_RETRY_PROTRUSIONS, best, h->attempt[0].plan};
    step.plan.refinements = a->plan.refinements;
    step.plan.reserve = fmin(a->verdict.lacking, QW_PROTRUSION_SHARE * h->request.faces_wanted);
    return step;
}

static qw_step after_relax(const qw_history *h)
{
    const qw_verdict *v = &current(h)->verdict;
    uint32_t best = least_faults(h), used = uses_since(h, QW_RETRY_COVERAGE, 0);
    if (may_reserve(h)) return with_reserve(h, best);
    bool accepted = v->places == 0 || (v->protrusions > 0 && faults(h, h->current) < QW_ACCEPTED_TIP) ||
                    (is_large(h) && used > 0 && faults(h, h->current) < QW_ACCEPTED_LARGE) ||
                    (has_many_parts(h) && v->uncovered < QW_ACCEPTED_LARGE) || round_is_hopeless(h);
    if (accepted || used >= coverage_retries(h) || !may_go_back(h)) return go_on(best);
    return refine(h, QW_RETRY_COVERAGE, best);
}

/* ---- after ASSEMBLE */

/* If there is no room for both sides, this share more quads is asked for; each further attempt doubles the share. */
static const double MORE_ROOM = 0.02;

/* After ASSEMBLE: a region without teeth; more room for one side of a plane, then the next plane or none; else on. */
static qw_step after_assemble(const qw_history *h)
{
    assert(h->count > 0);
    const qw_plan *p = &h->attempt[0].plan;
    const qw_verdict *v = &current(h)->verdict;
    qw_step step = {QW_RETRY_NO_ROOM, QW_NO_ATTEMPT, FIRST_PLAN};
    step.plan.plane = p->plane, step.plan.keeps_teeth = p->keeps_teeth;
    if (v->rims_flipped > 0 && !p->keeps_teeth && h->request.repairs) {
        step.cause = QW_RETRY_TEETH, step.plan.keeps_teeth = 1;
        return step;
    }
    bool is_free = h->request.symmetry_is_free != 0;
    /* a plane that was asked for may lose what the whole would lose as well */
    uint32_t unlike = v->sides_unlike == QW_PARTS_LOST && !is_free ? QW_SIDES_ALIKE : v->sides_unlike;
    if (!v->sides_apart && unlike == QW_SIDES_ALIKE && !v->count_off) return go_on(h->current);
    if (v->sides_apart && unlike == QW_SIDES_ALIKE && !is_free && p->room < qw_retry_rows[QW_RETRY_NO_ROOM].most) {
        double asked = fmax(h->request.faces_wanted, v->faces); /* there may be more already than were asked for */
        step.plan.room = (uint16_t)(p->room + 1);
        step.plan.core_faces = asked + ceil(MORE_ROOM * asked) * (1u << p->room);
        return step;
    }
    bool is_hopeless = !v->has_across && ((is_free && v->sides_apart) || unlike == QW_PARTS_LOST ||
                                          (unlike == QW_OTHER_SIDE_FARTHER && p->plane > 0));
    step.cause = QW_RETRY_PLANE;
    bool may = h->request.planes && p->plane < qw_retry_rows[QW_RETRY_PLANE].most;
    if (may && v->has_rings && !p->ringless) { /* a ring may be around what one side has in another place */
        step.plan.ringless = 1;
        return step;
    }
    step.plan.plane = is_hopeless ? qw_retry_rows[QW_RETRY_PLANE].most : p->plane + 1;
    return may ? step : go_on(h->current);
}

qw_step qw_next_step(const qw_history *h, qw_stage judged)
{
    assert(h->current < h->count && was_judged(current(h), judged));
    if (judged == QW_STAGE_ASSEMBLE) return after_assemble(h);
    if (h->count == QW_MAX_ATTEMPTS) return go_on(h->current);
    switch (judged) {
    case QW_STAGE_REPAIR: return after_repair(h);
    case QW_STAGE_SIMPLIFY: return after_simplify(h);
    case QW_STAGE_RELAX: return after_relax(h);
    default: return go_on(h->current);
    }
}

/* ---- what was read */

/* The last stage after which a retry may go back to this one. */
static qw_stage loop_end(qw_stage back)
{
    qw_stage end = back;
    for (int i = 0; i < QW_RETRIES; i++)
        if (qw_retry_rows[i].back == back && qw_retry_rows[i].after > end && !qw_begins_anew(&qw_retry_rows[i]))
            end = qw_retry_rows[i].after;
    return end;
}

static bool is_number(double x) { return x >= 0 && isfinite(x); }

/* What of attempt i none can have, for dumps; NULL: nothing. */
static const char *attempt_fault(const qw_history *h, uint32_t i, double largest_factor)
{
    assert(i < h->count && largest_factor >= 1);
    const qw_attempt *a = &h->attempt[i];
    const qw_plan *p = &a->plan;
    const qw_verdict *v = &a->verdict;
    if (i == 0 && a->cause != QW_NO_RETRY) return "the first attempt was begun for a cause";
    if (!(p->size_factor >= 1 / largest_factor && p->size_factor <= largest_factor) ||
        p->refinements > QW_MAX_REFINEMENTS || p->plane > qw_retry_rows[QW_RETRY_PLANE].most || p->keeps_teeth > 1 ||
        p->ringless > 1 || p->room > qw_retry_rows[QW_RETRY_NO_ROOM].most || !is_number(p->core_faces) ||
        !is_number(p->reserve) || (i > 0 && p->refinements < a[-1].plan.refinements))
        return "an attempt has a plan that none can have";
    if (a->judged > QW_STAGE_COUNT || !is_number(v->faces) || !is_number(v->uncovered) || !is_number(v->flipped) ||
        !is_number(v->lacking) || !is_number(v->misshapen) || v->inverted < 0)
        return "an attempt was judged as none can be";
    return NULL;
}

/* Of products of size factors. */
static const double ROUNDING = 1e-9;

const char *qw_history_fault(const qw_history *h, uint32_t finished)
{
    if (h->count == 0 || h->count > QW_MAX_ATTEMPTS || h->current >= h->count) return "the run has no attempt";
    for (uint32_t i = 1; i < h->count; i++)
        if (h->attempt[i].cause >= QW_RETRIES) return "an attempt was begun for no cause";
    uint32_t round = round_begin(h);
    double largest_factor = 1 + ROUNDING;
    uint32_t uses[QW_RETRIES] = {0}; /* since the last retry that goes back further */
    for (uint32_t i = 0; i < h->count; i++) {
        const qw_attempt *a = &h->attempt[i];
        if (a->cause == QW_RETRY_FACE_COUNT) largest_factor *= QW_MOST_SIZE_STEP * QW_MOST_SIZE_STEP;
        const char *fault = attempt_fault(h, i, largest_factor);
        if (fault) return fault;
        /* A round that lost the topology was judged no further than REPAIR; its later rows are not asked again. */
        uint32_t most = i < round && finished <= QW_STAGE_REPAIR ? QW_STAGE_REPAIR + 1 : finished;
        if (a->judged > most) return "an attempt has got further than the run";
        if (i == 0) continue;
        const qw_retry_row *row = &qw_retry_rows[a->cause];
        for (int k = 0; k < QW_RETRIES; k++)
            if (qw_retry_rows[k].back > row->back) uses[k] = 0;
        if (++uses[a->cause] > row->most) return "a cause has led to more attempts than it may";
        bool is_open = row->back == QW_STAGE_WORKING ? a->cause != QW_RETRY_TOPOLOGY : i > round;
        if (is_open && finished <= (uint32_t)loop_end(row->back))
            return "an attempt may still be chosen that a dump does not hold";
    }
    return NULL;
}
