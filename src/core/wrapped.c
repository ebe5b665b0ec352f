#include "core/wrapped.h"

#include "demand/asked.h"
#include "wrap/wrap.h"

/* The distance below which gaps are closed, in edges of the quads: docs/dev/decisions/wrap.md. */
static const double EDGES = 0.75;

bool qw_wraps_by_count(const qw_options *options) { return options->wrap && !(options->wrap_distance > 0); }

static double distance_of(const qw_run_state *run)
{
    const qw_options *o = &run->options;
    if (o->wrap_distance > 0) return o->wrap_distance * qw_wrap_diagonal(run->whole.input);
    if (o->edge_length > 0) return EDGES * o->edge_length;
    return qw_wrap_distance_for(run->env, run->whole.input, qw_faces_wanted(run, o), EDGES);
}

void qw_wrap_whole(qw_run_state *run)
{
    const qw_clean_input *input = run->whole.input;
    qw_clean *clean = &run->whole.clean;
    int64_t triangles = 0;
    if (run->whole.steering->region || run->options.fix_boundary)
        qw_fail(run->env, QW_OPTION, -1, "option wrap makes a surface without a boundary: it cannot be with %s",
                run->whole.steering->region ? "a region" : "fix_boundary");
    run->whole.left_out = NULL;
    for (uint32_t f = 0; f < input->face_count; f++) {
        uint32_t corners = input->face_begin[f + 1] - input->face_begin[f];
        if (corners > 2) triangles += corners - 2;
    }
    clean->counts.triangles = triangles; /* which the count of quads may go by */
    qw_wrapped w = qw_wrap(run->env, input, distance_of(run));
    *clean = qw_clean_surface(run->env, &w.skin, 0, false);
    clean->counts.triangles = triangles;
    clean->wrapped = (float)(w.distance * clean->frame.scale);
    for (uint32_t f = 0; f < clean->mesh.face_count; f++) clean->source_face[f] = w.source[clean->source_face[f]];
    run->whole.census = qw_trimesh_census_of(run->env, &clean->mesh, clean->component, clean->components);
}
