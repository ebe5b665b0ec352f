/* Closed curves of the surface are sampled, so densely that no edge of a full circle is missed; the edges of quads that
 * lie nearest to the samples are those around. */
#include "run/stages/stages.h"

#include "geometry/bvh.h"
#include "remesh/features/graph.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SAMPLES = 8 }; /* for each edge that is asked for */

typedef struct rims {
    const qw_trimesh *mesh;
    const qw_feature_graph *graph;
    const qw_curve_tree *tree; /* of the edges of quads */
    uint32_t *last_arc;        /* uint32_t[4 quads]: the last arc that each edge was nearest to */
    int64_t asked;
} rims;

/* Different edges of quads that are nearest to the samples of an arc. */
static int64_t count_edges(const rims *r, uint32_t a)
{
    const qw_feature_arc *arc = &r->graph->arc[a];
    double step = (double)arc->length / (double)(SAMPLES * r->asked);
    int64_t count = 0;
    for (uint32_t i = arc->begin; i < arc->begin + arc->count; i++) {
        uint32_t h = r->graph->half[i];
        qw_vec3 from = r->mesh->position[r->mesh->corner[h]], to = r->mesh->position[r->mesh->corner[qw_next(h)]];
        uint32_t samples = 1 + (uint32_t)((double)qw_distance(from, to) / step);
        for (uint32_t k = 0; k < samples; k++) {
            qw_vec3 p = qw_lerp(from, to, ((float)k + 0.5f) / (float)samples);
            uint32_t edge = qw_curve_nearest(r->tree, p, INFINITY).segment;
            if (edge == QW_NONE || r->last_arc[edge] == a) continue;
            r->last_arc[edge] = a, count++;
        }
    }
    return count;
}

static void warn(qw_run_state *run, int64_t few, int64_t all, int64_t least)
{
    char text[sizeof run->report->warnings[0]];
    snprintf(text, sizeof text,
             "%lld of %lld closed curves have fewer than %lld edges around, the least %lld: more quads are needed",
             (long long)few, (long long)all, (long long)run->options.around, (long long)least);
    qw_warn_once(run, text);
}

void qw_report_edges_around(qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_trimesh *mesh = &run->surface;
    if (run->options.around == 0 || quads->face_count == 0) return;
    qw_env *env = run->env;
    qw_scope_begin(env);
    const uint8_t *kept = qw_all_curves_kept(env, mesh, run->options.align_boundary != 0);
    qw_feature_graph graph = qw_feature_graph_build(env, mesh, kept, QW_VERDICT_BIT(QW_CURVE_KEPT));
    rims r = {mesh, &graph, qw_curve_tree_of_quads(env, quads), QW_NEW(env, uint32_t, 4 * (size_t)quads->face_count),
              run->options.around};
    memset(r.last_arc, 0xff, 4 * (size_t)quads->face_count * sizeof *r.last_arc);
    int64_t few = 0, all = 0, least = INT64_MAX;
    for (uint32_t a = 0; a < graph.arc_count; a++) {
        if (graph.arc[a].node[1] != QW_NONE) continue;
        int64_t count = count_edges(&r, a);
        all++, few += count < run->options.around;
        if (count < least) least = count;
        qw_heartbeat(env);
    }
    if (few > 0) warn(run, few, all, least);
    qw_scope_end(env);
}
