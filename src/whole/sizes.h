/* How large the quads are to be: from the options and the surface. Lengths are in the centred frame. */
#ifndef QW_WHOLE_SIZES_H
#define QW_WHOLE_SIZES_H

#include "whole/asked.h"
#include "whole/shares.h"
#include "whole/state.h"

/* The mean edge length of so many quads on the components that are not small. */
double qw_edge_wanted(const qw_run_state *run, double faces);

/* An area in quads of the wanted size. */
double qw_in_quads(const qw_run_state *run, double area);
/* A point of the surface that is farther from every quad is uncovered. */
float qw_uncovered_distance(const qw_run_state *run);

/* The least number of quads in which all components keep their topology, and the sum of their lengths: the diagonals of
   their bounding boxes, or of their needles one behind the other. */
double qw_faces_needed(qw_env *env, const qw_trimesh *surface, const qw_census *census);
double *qw_extents(qw_env *env, const qw_trimesh *surface, const qw_census *census); /* of each: double[components] */
double qw_total_extent(qw_env *env, const qw_trimesh *surface, const qw_census *census);

/* Whether quads are to be of different sizes, by the option `adaptive` or a painted density. */
bool qw_has_density(const qw_run_state *run);

/* Wanted edge length of the quads at each vertex of run->surface: rho times the factors of remesh/sizes/density.h, less
   on small components (*base_target has only that), along small loops and in refinements. *tips, if not NULL: what
   sticks out, in the current scope. */
float *qw_wanted_size(const qw_run_state *run, double rho, float **base_target, qw_tip_list *tips);

/* How many of so many quads each component of a surface gets: double[census->components]. *part, if not NULL: what they
   need, qw_part[census->components]. Both in the current scope. */
double *qw_component_shares(qw_env *env, const qw_trimesh *surface, const qw_census *census, double quads,
                            qw_part **part);

/* Number of working edges along an edge of the quads. */
double qw_working_edges(const qw_run_state *run);
/* The option `smoothness`, reduced where there are few quads. */
double qw_smoothness(const qw_run_state *run);

/* Length of the edges that are marked. */
double qw_marked_length(const qw_trimesh *mesh);
/* run->feature_density, from the surface and rho. */
double qw_find_feature_density(const qw_run_state *run);

#endif
