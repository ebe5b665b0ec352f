/* The feature edges of the surface are sampled. Where no edge of a quad is near, the edge is lost there, as a rule
 * since a row of quads has no room between it and the next. So the count is found from the narrowest place at what is
 * lost: the distance to the nearest other curve, or the length of a curve between two corners. */
#include "run/stages/stages.h"

#include "base/constants.h"
#include "remesh/features/graph.h"
#include "base/elementary.h"
#include "geometry/bvh.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* In wanted edges: samples lie so far apart, and an edge farther off than the second from all edges of quads is lost.
 */
static const double STEP = 0.25, LOST = 0.2;
/* Samples for each quad, at most, besides one for each segment: the edges of needles are many times longer. */
static const double MOST_SAMPLES = 64;
/* A warning is given from so much on: wanted edges in length, and share of all sharp edges. */
static const double LEAST_LOST = 2, LEAST_SHARE = 0.003;
/* Wanted edges that are room enough for a row of quads, whatever lies around it. */
static const double ROOM = 0.5;
/* More than so many times the quads that were asked for are no advice. */
static const double MOST_ADVISED = 20;
/* No count is named where more pairs of samples and edges would have to be looked at. */
static const double MOST_PAIRS = 5e7;
enum { MOST_SEGMENTS = 1 << 22 };

typedef struct segments {
    qw_env *env;
    const qw_trimesh *mesh;
    uint32_t count;
    uint32_t *half;         /* uint32_t[count]: a half-edge of each */
    qw_feature_graph graph; /* of the surface; no boundaries */
    qw_vec3 *lost;          /* qw_vec3[lost_count]: samples */
    uint32_t *lost_of;      /* uint32_t[lost_count]: segment */
    uint32_t lost_count;
    size_t lost_room, lost_of_room;
    double all, gone; /* lengths */
} segments;

static qw_vec3 end_of(const segments *s, uint32_t i, bool far)
{
    uint32_t h = s->half[i];
    return s->mesh->position[s->mesh->corner[far ? qw_next(h) : h]];
}

/* ---- what is lost */

/* Samples the segments of sharp edges: where no edge of the quads is near, that piece is lost. */
static void find_lost(segments *s, const qw_quadmesh *quads, double edge)
{
    assert(edge > 0);
    const qw_curve_tree *tree = qw_curve_tree_of_quads(s->env, quads);
    for (uint32_t i = 0; i < s->count; i++) s->all += (double)qw_distance(end_of(s, i, false), end_of(s, i, true));
    double step = fmax(STEP * edge, s->all / (MOST_SAMPLES * quads->face_count));
    for (uint32_t i = 0; i < s->count; i++) {
        qw_vec3 a = end_of(s, i, false), b = end_of(s, i, true);
        double length = (double)qw_distance(a, b);
        uint32_t steps = 1 + (uint32_t)(length / step);
        for (uint32_t k = 0; k < steps; k++) {
            qw_vec3 p = qw_lerp(a, b, ((float)k + 0.5f) / (float)steps);
            if (qw_curve_nearest(tree, p, (float)(LOST * edge)).segment != QW_NONE) continue;
            s->gone += length / steps;
            s->lost = qw_grow(s->env, s->lost, &s->lost_room, s->lost_count + 1, sizeof *s->lost);
            s->lost_of = qw_grow(s->env, s->lost_of, &s->lost_of_room, s->lost_count + 1, sizeof *s->lost_of);
            s->lost[s->lost_count] = p, s->lost_of[s->lost_count++] = i;
        }
        if (i % 1024 == 0) qw_heartbeat(s->env);
    }
}

/* The narrowest place at what is lost; INFINITY where there is none, or too much to look at. */
static double narrowest(segments *s)
{
    double least = INFINITY;
    if ((double)s->lost_count * s->count > MOST_PAIRS) return least;
    const qw_feature_graph *g = &s->graph;
    for (uint32_t k = 0; k < s->lost_count; k++) {
        uint32_t own = g->arc_of[s->half[s->lost_of[k]]];
        if (g->arc[own].node[1] != QW_NONE) least = fmin(least, (double)g->arc[own].length);
        qw_heartbeat(s->env);
        for (uint32_t i = 0; i < s->count; i++) {
            uint32_t other = g->arc_of[s->half[i]];
            if (other == own || qw_arcs_share_node(g, own, other)) continue;
            float d2 = qw_distance2_to_segment(s->lost[k], end_of(s, i, false), end_of(s, i, true));
            if ((double)d2 < least * least) least = sqrt((double)d2);
        }
    }
    return least;
}

/* Up to two digits. */
static double rounded_up(double n)
{
    double unit = 1;
    while (n / unit >= 100) unit *= 10;
    return unit * qw_floor(n / unit + 0.9999);
}

/* Warns of lost sharp edges, with a count of quads that would have room for them. */
static void warn(qw_run_state *run, const segments *s, double enough)
{
    char text[sizeof run->report->warnings[0]], count[96] = "more quads are needed";
    bool is_far = enough > MOST_ADVISED * (double)run->report->faces_asked;
    if (is_far)
        snprintf(count, sizeof count, "they lie too close together for quads; a larger sharp angle leaves them out");
    else if (enough > 0) snprintf(count, sizeof count, "about %.0f quads would have room for them", enough);
    snprintf(text, sizeof text, "%.1f %% of the length of sharp edges is not in the result: %s", 100 * s->gone / s->all,
             count);
    qw_warn(run, text);
}

void qw_report_lost_edges(qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_trimesh *mesh = &run->surface;
    qw_report *r = run->report;
    r->lost_edges = -1, r->faces_for_edges = 0;
    if (!mesh->mark || quads->face_count == 0) return;
    qw_scope_begin(run->env);
    segments s = {.env = run->env, .mesh = mesh};
    s.half = QW_NEW(run->env, uint32_t, 3 * (size_t)mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count && s.count < MOST_SEGMENTS; h++)
        if (qw_is_curve_edge(mesh, h, false) && mesh->twin[h] > h) s.half[s.count++] = h;
    if (s.count > 0) {
        double edge = sqrt(run->core.area / quads->face_count);
        find_lost(&s, quads, edge);
        r->lost_edges = s.gone / s.all;
        if (s.gone > LEAST_LOST * edge && s.gone > LEAST_SHARE * s.all) {
            s.graph = qw_feature_graph_build(run->env, mesh, qw_all_curves_kept(run->env, mesh, false),
                                             QW_VERDICT_BIT(QW_CURVE_KEPT));
            double width = narrowest(&s), enough = run->core.area * ROOM * ROOM / (width * width) * qw_times_used(run);
            if (enough > (double)r->faces_asked && enough < 2e7) r->faces_for_edges = (int64_t)rounded_up(enough);
            warn(run, &s, (double)r->faces_for_edges);
        }
    }
    qw_scope_end(run->env);
}
