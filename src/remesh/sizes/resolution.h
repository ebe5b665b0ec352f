/* How fine the working mesh is beside the quads, and how smooth its normals: docs/dev/decisions/working-mesh.md. */
#pragma once

#include "geometry/trimesh.h"
#include "remesh/sizes/fast.h"

typedef struct qw_resolution_request {
    double faces;              /* quads of the result */
    double feature_density;    /* qw_find_feature_density */
    double follow, smoothness; /* the options */
    int64_t fast;              /* qw_fast_choice */
} qw_resolution_request;

/* Number of working edges along an edge of the quads. */
double qw_working_edges(const qw_resolution_request *request);
/* The option `smoothness`, reduced where there are few quads. */
double qw_smoothness(const qw_resolution_request *request);

/* (Length of the sharp edges + an allowance for each handle and hole) / area, in wanted edges of length rho. marked:
   the surface whose edges are marked; mesh, census, area: what is remeshed. */
double qw_find_feature_density(qw_env *env, const qw_trimesh *marked, const qw_trimesh *mesh, const qw_census *census,
                               double rho, double area);
