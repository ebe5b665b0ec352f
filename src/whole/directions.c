#include "whole/directions.h"

#include "products/attributes/crosses.h"
#include "base/constants.h"
#include "remesh/field/alignment.h"
#include "whole/cut.h"
#include "whole/guides.h"
#include "whole/motion_on.h"

#include <math.h>

/* A movement that changes wholly within so many radii of a limb steers in full, one that takes twice as many not at
   all. A limb's radius is told by how far it bends within an edge. */
static const float MOTION_RADII = 1;

static bool is_asked(const qw_run_state *run)
{
    return run->steering.field != NULL || qw_follows_motion(run) || qw_has_guides(run, QW_GUIDE_DIRECTION);
}

/* Where nothing else is asked for: along and across the lines on which weights and targets are equal. */
static void add_motion(const qw_run_state *run, qw_vec3 *asked)
{
    const qw_trimesh *mesh = &run->working.mesh;
    qw_vec3 *change = qw_motion_on(run, mesh->position, run->normal, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        float bend = fmaxf(run->alignment ? qw_length(run->alignment[v]) : 0, QW_LEAST_BEND),
              share = MOTION_RADII * (float)run->rho * qw_length(change[v]) / bend;
        if (qw_length2(asked[v]) == 0)
            asked[v] = qw_scale(qw_normalize(change[v]),
                                fminf(fmaxf(2 * share - 1, 0), 1) * (float)run->options.follow_motion);
    }
    qw_free(run->env, change);
}

qw_vec3 *qw_directions_asked(const qw_run_state *run)
{
    qw_env *env = run->env;
    const qw_steering *s = &run->steering;
    const qw_trimesh *mesh = &run->working.mesh;
    if (!is_asked(run)) return NULL;
    qw_vec3 *asked = NULL;
    qw_scope_begin(env);
    if (s->field) {
        const qw_whole *w = &run->whole; /* whose frame has the same axes */
        qw_source source = qw_source_build(env, w->input, &w->clean, w->census.component);
        qw_vec3 *position = QW_NEW(env, qw_vec3, mesh->vertex_count);
        for (uint32_t v = 0; v < mesh->vertex_count; v++) position[v] = qw_in_whole(run, mesh->position[v]);
        asked = qw_crosses_at_points(env, &source, s->field_domain, s->field, position, run->normal, mesh->vertex_count,
                                     (float)(run->rho * qw_whole_scale(run)));
    }
    if (!asked) asked = QW_NEW_ZERO(env, qw_vec3, mesh->vertex_count);
    qw_keep(env, asked);
    qw_scope_end(env);
    qw_add_guide_directions(run, asked);
    if (qw_follows_motion(run)) add_motion(run, asked);
    return asked;
}

double qw_lines_followed(const qw_run_state *run)
{
    return is_asked(run) ? fmax(run->options.follow, QW_USUAL_FOLLOW) : run->options.follow;
}

void qw_report_field_angle(qw_run_state *run, const qw_quadmesh *quads)
{
    qw_env *env = run->env;
    const qw_steering *s = &run->steering;
    run->report->field_angle = -1;
    if (!s->field) return;
    qw_scope_begin(env);
    const qw_whole *w = &run->whole;
    qw_source source = qw_source_build(env, w->input, &w->clean, w->census.component);
    run->report->field_angle = qw_mean_field_angle(env, &source, s->field_domain, s->field, quads,
                                                   (float)(run->rho * qw_whole_scale(run)));
    qw_scope_end(env);
}
