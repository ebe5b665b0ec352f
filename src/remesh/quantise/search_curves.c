#include "remesh/quantise/search_curves.h"

#include "base/mechanisms.h"
#include "base/promise.h"
#include "remesh/quantise/closed_curves.h"
#include "remesh/quantise/search_count.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Triangles that may be looked at, of all components, to part curves. */
static const double PARTING_WORK = 4e5;
/* Sizes that are tried of each component, each smaller than the last by this share, as a row of quads between curves,
   or around one, adds quads; fewer where edges times sizes are more than PARTING_EDGES. */
static const double PARTING_STEP = 0.01;
enum { PARTING_SIZES = 16, PARTING_EDGES = 12000 };

/* Real offsets close where a triangle's sum is at most this share of the lengths of its sides. */
static const double GAP = 1e-3;

/* Chooses the integers of trial t at another size and improves them by circuits. Returns whether they are closed. */
static bool make_at(qw_env *env, const qw_search *s, qw_trial *t, uint32_t p, double scale)
{
    qw_search_prepare(s, t, p, 0);
    t->first = false, t->scale = scale;
    qw_run_trials(env, s->components, s->most_edges, &t, 1);
    t->known = true, t->done = false;
    qw_run_trials(env, s->components, s->most_edges, &t, 1);
    qw_search_judge(s, t);
    return !t->open;
}

/* Parts the curves of component p that touch: at its size, and at smaller ones as long as some still touch. */
static void part_curves(qw_env *env, qw_search *s, uint32_t p, double *work)
{
    assert(p < s->components->count && work);
    const qw_component *component = &s->components->component[p];
    const qw_complex *real = &component->decimated.complex;
    qw_trial *kept = &s->kept[p];
    uint32_t touching = qw_count_touching(env, component, kept->d);
    if (touching == 0 || !qw_uses(env, QW_MECH_CURVES_PARTED)) return;
    s->sum.touching += touching - kept->touching, kept->touching = touching;
    s->score = qw_search_score(s, &s->sum);
    qw_scope_begin(env);
    qw_real2 *aimed = QW_NEW(env, qw_real2, real->edge_count);
    qw_trial room = qw_search_copy_kept(env, s, p);
    double scale = kept->scale;
    int sizes = (int)fmax(1, fmin(PARTING_SIZES, PARTING_EDGES / fmax(s->edges, 1)));
    for (int i = 0; i < sizes && 0 < *work && (i == 0 || qw_uses(env, QW_MECH_PARTING_SIZES)); i++) {
        qw_trial t = *kept;
        t.d = room.d;
        if (i > 0 && !make_at(env, s, &t, p, scale * (1 - PARTING_STEP * i))) continue;
        qw_trial_aim(real, &t, aimed);
        t.touching = qw_part_curves(env, component, aimed, t.d, work);
        qw_search_judge(s, &t);
        double others = s->sum.area - kept->area;
        qw_search_total sum = {.area = others + t.area};
        if (qw_search_miss(s, &sum) > 0 && qw_uses(env, QW_MECH_PARTING_NUDGE))
            qw_nudge_trial(env, s, &t, others, work), qw_did(env, QW_MECH_PARTING_NUDGE, 1);
        t.touching = qw_count_touching(env, component, t.d);
        qw_mechanism m = i > 0 ? QW_MECH_PARTING_SIZES : QW_MECH_CURVES_PARTED;
        qw_acted(env, m, 1), qw_kept(env, m, qw_search_take_if_better(s, &t));
        if (kept->touching == 0 && qw_search_miss(s, &s->sum) <= 0) break;
    }
    qw_scope_end(env);
}

void qw_search_part_curves(qw_env *env, qw_search *s)
{
    double work = PARTING_WORK;
    for (uint32_t p = 0; p < s->components->count && s->request.apart; p++)
        if (!s->kept[p].open) part_curves(env, s, p, &work);
}

/* Makes the closed curves of component p an even number of quads long, within the bounds of the count: at its size and,
   as long as some are odd, at sizes beside it, where curves that touch are parted first. */
static void make_even(qw_env *env, qw_search *s, uint32_t p, double *work)
{
    const qw_component *component = &s->components->component[p];
    double quads = s->request.quads, bound = quads * QW_COUNT_MARGIN * qw_count_tolerance(quads, s->request.times);
    double scale = s->kept[p].scale;
    uint32_t least = QW_NONE, touching = 0;
    for (uint32_t i = 0; i < PARTING_SIZES && i * s->edges < PARTING_EDGES && least > 0 && (i == 0 || *work > 0); i++) {
        qw_scope_begin(env);
        qw_trial t = qw_search_copy_kept(env, s, p);
        double by = PARTING_STEP * (double)((i + 1) / 2) * (i % 2 ? -1 : 1);
        if (i == 0 || make_at(env, s, &t, p, scale * (1 + by))) {
            qw_complex c = component->decimated.complex;
            c.d = t.d, c.real = QW_NEW(env, qw_real2, c.edge_count);
            qw_trial_aim(&component->decimated.complex, &t, c.real);
            double rest = s->sum.area - s->kept[p].area + t.area - qw_complex_area(&c);
            if (i > 0) qw_part_curves(env, component, c.real, t.d, work);
            uint32_t odd = qw_make_curves_even(env, component, &c, quads - bound - rest, quads + bound - rest, work);
            qw_search_judge(s, &t);
            qw_search_total sum = qw_search_exchange(s->sum, &s->kept[p], &t);
            uint32_t touches = qw_count_touching(env, component, t.d);
            bool is_no_worse = t.inverted <= s->kept[p].inverted && t.collapsed <= s->kept[p].collapsed &&
                               touches <= touching && qw_search_miss(s, &sum) <= 0;
            if (i == 0 || (odd < least && is_no_worse)) {
                least = odd, touching = touches, s->sum = sum;
                qw_search_copy(s, &s->kept[p], &t);
            }
        }
        qw_scope_end(env);
    }
}

void qw_search_make_even(qw_env *env, qw_search *s)
{
    double work = PARTING_WORK;
    for (uint32_t p = 0; p < s->components->count; p++)
        if (!s->kept[p].open) make_even(env, s, p, &work);
}

/* Whether real offsets close but for a share of their lengths, as those that the complex came with do. */
static bool closes(const qw_complex *c, const qw_real2 *real)
{
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) {
        double x = 0, y = 0, length = 0;
        for (uint32_t i = h; i < h + 3; i++) {
            qw_real2 d = qw_turn_real(c->rot[i], real[c->edge[i]]);
            x += (double)d.x, y += (double)d.y, length += fabs((double)d.x) + fabs((double)d.y);
        }
        if (fabs(x) + fabs(y) > GAP * length) return false;
    }
    return true;
}

/* The real offsets that lines are looked for on: those that the trial aimed at or, where it stretched some so that they
   close no more, and what is where depends on the way there, all longer or shorter by one factor. */
static qw_real2 *closed_aim(qw_env *env, const qw_complex *real, const qw_trial *t)
{
    qw_real2 *aimed = QW_NEW(env, qw_real2, real->edge_count);
    qw_trial_aim(real, t, aimed);
    if (closes(real, aimed)) return aimed;
    qw_trial plain = *t;
    plain.stretch = 1;
    qw_trial_aim(real, &plain, aimed);
    return aimed;
}

/* Makes lines of component p meet, within the bounds of the count. */
static qw_meeting_counts meet(qw_env *env, qw_search *s, uint32_t p, double share, double strips_share)
{
    assert(p < s->components->count && share >= 0 && strips_share >= 0);
    qw_scope_begin(env);
    const qw_component *component = &s->components->component[p];
    const qw_complex *real = &component->decimated.complex;
    double quads = s->request.quads, bound = quads * QW_SEARCH_COUNT_FREE;
    qw_trial t = qw_search_copy_kept(env, s, p);
    double rest = s->sum.area - t.area +
                  t.scale * t.scale * s->request.cut[p]; /* other components, and what is cut off */
    /* of a side of a plane not all: rows beside the plane, and parts without a twin, move the count of both as well */
    double margin = QW_COUNT_MARGIN / s->request.times,
           promised = fmax(quads * margin * qw_count_tolerance(quads, s->request.times), bound);
    qw_meeting_request request = {.real = closed_aim(env, real, &t),
                                  .loops = s->request.loops,
                                  .least_area = fmin(quads - bound, s->sum.area) - rest,
                                  .most_area = fmax(quads + bound, s->sum.area) - rest,
                                  .least_promised = fmin(quads - promised, s->sum.area) - rest,
                                  .most_promised = fmax(quads + promised, s->sum.area) - rest,
                                  .share = share,
                                  .strips_share = strips_share};
    qw_meeting_counts counts = qw_make_meetings(env, component, &request, t.d);
    qw_search_judge(s, &t);
    assert(!t.open && t.inverted <= s->kept[p].inverted);
    s->sum = qw_search_exchange(s->sum, &s->kept[p], &t);
    qw_search_copy(s, &s->kept[p], &t);
    qw_scope_end(env);
    return counts;
}

qw_meeting_counts qw_search_meet(qw_env *env, qw_search *s, double share, double strips_share)
{
    qw_meeting_counts sum = {0};
    uint32_t faces = 1;
    for (uint32_t p = 0; p < s->components->count; p++) faces += qw_search_complex(s, p)->face_count;
    for (uint32_t p = 0; p < s->components->count && s->request.loops > 0; p++) {
        if (s->kept[p].open) continue;
        double part = s->request.effort * qw_search_complex(s, p)->face_count / faces;
        qw_meeting_counts c = meet(env, s, p, share * part, strips_share * part);
        sum.tried += c.tried, sum.kept += c.kept;
        sum.length_before += c.length_before, sum.length_after += c.length_after;
    }
    return sum;
}
