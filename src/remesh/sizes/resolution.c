#include "remesh/sizes/resolution.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "remesh/sizes/needs.h"

#include <assert.h>
#include <math.h>

/* Edges of the working mesh an edge of the quads: see docs/dev/decisions/working-mesh.md. */
static const double WORKING_EDGES_FEW = 2.5, WORKING_EDGES_SHARP = 1.6;
static const double QUADS = 1000, MANY_QUADS = 10000;
/* The same at QUADS and at MANY_QUADS quads: on a surface without sharp edges, and on one with as many as a machined
   part. */
static const double WORKING_EDGES_SMOOTH[2] = {1.1, 0.8}, WORKING_EDGES_PART[2] = {1.2, 1.0};
/* From which feature density on a surface counts as a machined part, and as one with sharp edges everywhere. A
   way around a handle or a hole counts as LOOP edges of the quads of sharp length. */
static const double PART = 0.03, SHARP = 0.1, LOOP = 4;
/* Least working edges an edge of the quads where `follow` is at least FOLLOW_ALL, so that the mesh shows what to
 * follow. */
static const double WORKING_EDGES_FOLLOW = 1.2, FOLLOW_ALL = 0.5;
static const double PREVIEW_EDGES = 0.75;  /* share of the working edges that a preview has */
static const double SMOOTHNESS_FEW = 0.75; /* share of the smoothness that is used where there are few quads */

/* Interpolates on a logarithmic scale: 0 up to SMALL_FACES quads of the result, 1 from QUADS on. */
static double above_few(const qw_resolution_request *w)
{
    return fmin(fmax(qw_ln(w->faces / QW_SMALL_FACES) / qw_ln(QUADS / QW_SMALL_FACES), 0), 1);
}

/* The same from QUADS to MANY_QUADS. */
static double up_to_many(const qw_resolution_request *w)
{
    return fmin(fmax(qw_ln(w->faces / QUADS) / qw_ln(MANY_QUADS / QUADS), 0), 1);
}

static double between(double from, double to, double t) { return from + (to - from) * t; }

/* With few quads a protrusion is a few working edges around, so the working mesh is finer there; that costs little.
   Between sharp edges a narrow band is but a few edges wide at any count. On surfaces without sharp edges the relief
   gets smoother, in quads, the more quads there are, so the working mesh gets coarser. */
static double edges_by_count(const qw_resolution_request *w)
{
    double many = up_to_many(w);
    double smooth = between(WORKING_EDGES_SMOOTH[0], WORKING_EDGES_SMOOTH[1], many),
           part = between(WORKING_EDGES_PART[0], WORKING_EDGES_PART[1], many);
    double sharp = between(part, WORKING_EDGES_SHARP, fmin(w->feature_density / SHARP, 1));
    return between(WORKING_EDGES_FEW, between(smooth, sharp, fmin(w->feature_density / PART, 1)), above_few(w));
}

double qw_working_edges(const qw_resolution_request *w)
{
    double edges = edges_by_count(w), share = fmin(w->follow / FOLLOW_ALL, 1);
    if (w->fast == QW_FAST_DRAFT) return edges;
    if (w->fast == QW_FAST_PREVIEW) return PREVIEW_EDGES * edges;
    return between(edges, fmax(edges, WORKING_EDGES_FOLLOW), share);
}

/* With few quads, normals smoothed over as many edges as elsewhere would no longer show the protrusions. */
double qw_smoothness(const qw_resolution_request *w)
{
    return w->smoothness * (SMOOTHNESS_FEW + (1 - SMOOTHNESS_FEW) * above_few(w));
}

double qw_find_feature_density(qw_env *env, const qw_trimesh *marked, const qw_trimesh *mesh, const qw_census *census,
                               double rho, double area)
{
    assert(rho > 0 && area > 0);
    return (qw_marked_length(marked) + LOOP * qw_needed_loops(env, mesh, census) * rho) * rho / area;
}
