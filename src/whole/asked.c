#include "whole/asked.h"

#include "base/elementary.h"

#include <math.h>

/* The most faces that can be asked for, as in options.def. */
static const double MOST_FACES = 2e7;

/* The faces that one of the options asks for; a quarter of the triangles, 100 to 20,000, by default. */
static double faces_asked(const qw_run_state *run, const qw_options *o)
{
    double triangles = (double)run->whole.clean.counts.triangles;
    if (o->faces > 0) return (double)o->faces;
    if (o->vertices > 0) return (double)o->vertices; /* on a closed quad mesh V = F + 2 - 2 genus */
    if (o->edge_length > 0)
        return run->whole.area /
               (o->edge_length * run->whole.clean.frame.scale * o->edge_length * run->whole.clean.frame.scale);
    if (o->ratio > 0) return o->ratio * triangles;
    return fmin(fmax(triangles / 4, 100), 20000);
}

void qw_require_few_faces(const qw_run_state *run)
{
    const qw_options *o = &run->options;
    double faces = faces_asked(run, o);
    if (faces <= MOST_FACES) return;
    const char *name = o->edge_length > 0 ? "edge_length" : "ratio";
    qw_fail(run->env, QW_OPTION, -1, "option %s, %g, asks for %.3g quads of this surface; the most is %.0f", name,
            o->edge_length > 0 ? o->edge_length : o->ratio, faces, MOST_FACES);
}

double qw_faces_wanted(const qw_run_state *run, const qw_options *options)
{
    return fmin(fmax(qw_floor(faces_asked(run, options) + 0.5), 1), MOST_FACES);
}
