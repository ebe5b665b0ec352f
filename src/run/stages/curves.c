#include "run/stages/stages.h"

#include "remesh/features/graph.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

/* In wanted edges, of those of its vertices. */
static double length_of(const qw_run_state *run, const qw_feature_graph *g, const qw_feature_arc *arc)
{
    const qw_trimesh *mesh = &run->working.mesh;
    double sum = 0;
    for (uint32_t i = arc->begin; i < arc->begin + arc->count; i++) {
        uint32_t h = g->half[i];
        double size = (double)(run->size[mesh->corner[h]] + run->size[mesh->corner[qw_next(h)]]) / 2;
        sum += (double)qw_edge_length(mesh, h) / size;
    }
    return sum;
}

/* The middle of the edge in the middle of its list, in the coordinates of the input. */
static void place_of(const qw_run_state *run, const qw_feature_graph *g, const qw_feature_arc *arc, double at[3])
{
    const qw_trimesh *mesh = &run->working.mesh;
    uint32_t h = g->half[arc->begin + arc->count / 2];
    qw_vec3 p = qw_lerp(mesh->position[mesh->corner[h]], mesh->position[mesh->corner[qw_next(h)]], 0.5f);
    const qw_frame *f = &run->clean.frame;
    at[0] = (double)p.x / f->scale + f->center[0], at[1] = (double)p.y / f->scale + f->center[1],
    at[2] = (double)p.z / f->scale + f->center[2];
}

/* Puts the note among the longest, before those that are shorter. */
static void add_note(qw_report *r, const qw_curve_note *note)
{
    uint32_t i = r->curve_count;
    if (i == sizeof r->curves / sizeof *r->curves && !(note->length > r->curves[i - 1].length)) return;
    if (i == sizeof r->curves / sizeof *r->curves) i--;
    else r->curve_count++;
    for (; i > 0 && note->length > r->curves[i - 1].length; i--) r->curves[i] = r->curves[i - 1];
    r->curves[i] = *note;
}

void qw_report_curves(qw_run_state *run)
{
    qw_report *r = run->report;
    int64_t *counts[QW_CURVE_VERDICTS] = {[QW_CURVE_MERGED] = &r->merged_arcs,
                                          [QW_CURVE_LET_GO] = &r->dropped_arcs,
                                          [QW_CURVE_SHORTENED] = &r->shortened_arcs,
                                          [QW_CURVE_UNBALANCED] = &r->bent_arcs};
    double all = 0, given_up = 0;
    qw_scope_begin(run->env);
    qw_feature_graph g = qw_feature_graph_build(run->env, &run->working.mesh, run->curve_outcome, QW_ALL_CURVES);
    for (uint32_t v = QW_CURVE_MERGED; v < QW_CURVE_VERDICTS; v++) *counts[v] = 0;
    r->feature_arcs = g.arc_count, r->curve_count = 0;
    memset(r->curves, 0, sizeof r->curves);
    for (uint32_t i = 0; i < g.arc_count; i++) {
        uint8_t verdict = run->curve_outcome[g.half[g.arc[i].begin]];
        assert(verdict < QW_CURVE_VERDICTS);
        qw_curve_note note = {.length = length_of(run, &g, &g.arc[i])};
        all += note.length;
        if (verdict == QW_CURVE_KEPT) continue;
        given_up += note.length;
        ++*counts[verdict];
        place_of(run, &g, &g.arc[i], note.at);
        snprintf(note.verdict, sizeof note.verdict, "%s", qw_curve_verdict_rows[verdict].word);
        add_note(r, &note);
        qw_log(run->env, QW_LOG_DEBUG, "a curve of %.1f edges at (%g, %g, %g) is %s: %s", note.length, note.at[0],
               note.at[1], note.at[2], note.verdict, qw_curve_verdict_rows[verdict].reason);
    }
    assert(given_up <= all);
    r->arcs_given_up = all > 0 ? given_up / all : 0;
    qw_scope_end(run->env);
}
