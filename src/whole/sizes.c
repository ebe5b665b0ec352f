#include "whole/sizes.h"

#include "base/constants.h"
#include "remesh/sizes/painted.h"
#include "whole/kept_rims.h"
#include "whole/motion_on.h"
#include "whole/ring_guides.h"

#include <assert.h>
#include <string.h>

double qw_edge_wanted(const qw_run_state *run, double faces)
{
    return qw_edge_of(run->core.area, run->core.extent, faces);
}

double qw_in_quads(const qw_run_state *run, double area) { return area / (run->rho * run->rho); }

float qw_uncovered_distance(const qw_run_state *run) { return (float)QW_UNCOVERED_DISTANCE * (float)run->rho; }

double qw_turn_of_edge(const qw_run_state *run) { return 2 * QW_PI / ((double)run->options.around + 1); }

bool qw_has_density(const qw_run_state *run)
{
    return run->options.adaptive > 0 || run->options.around > 0 || run->input.density || qw_follows_motion(run);
}

float *qw_wanted_size(const qw_run_state *run, double rho, float **base_target, qw_tip_list *tips, qw_nests *nests)
{
    qw_env *env = run->env;
    assert(rho > 0);
    qw_size_request request = {.surface = &run->surface,
                               .census = &run->surface_census,
                               .tree = run->tree,
                               .rho = rho,
                               .adaptive = run->options.adaptive,
                               .circles = run->circles,
                               .turn = qw_turn_of_edge(run),
                               .painted = qw_painted_density(env, &run->input, &run->clean, &run->surface),
                               .with_boundary = run->options.align_boundary != 0,
                               .refinement = run->refinement,
                               .refinements = run->plan.refinements};
    float *size = qw_shared_sizes(env, &request, tips);
    if (qw_follows_motion(run)) qw_fit_motion(run, size);
    if (qw_keeps_rims(run)) qw_fit_rims(run, size);
    qw_nests fitted = qw_nests_of_guides(run, rho);
    qw_fit_nests(env, &run->surface, &fitted, size);
    if (nests) *nests = fitted;
    *base_target = QW_NEW(env, float, run->surface.vertex_count);
    memcpy(*base_target, size, run->surface.vertex_count * sizeof *size);
    qw_refine_sizes(env, &request, size);
    qw_free(env, (void *)request.painted);
    return size;
}

qw_resolution_request qw_resolution_of(const qw_run_state *run)
{
    return (qw_resolution_request){.faces = qw_times_used(run) * run->faces_wanted,
                                   .feature_density = run->feature_density,
                                   .follow = run->options.follow,
                                   .smoothness = run->options.smoothness,
                                   .fast = run->options.fast};
}

double qw_feature_density_of(const qw_run_state *run)
{
    return qw_find_feature_density(run->env, &run->surface, &run->core.mesh, &run->core.census, run->rho,
                                   run->core.area);
}
