/* How large the quads of a run are to be: its state as the values that src/remesh/sizes takes. */
#pragma once

#include "remesh/sizes/nests.h"
#include "remesh/sizes/resolution.h"
#include "whole/asked.h"

/* The mean edge length of so many quads on the components that are not small. */
double qw_edge_wanted(const qw_run_state *run, double faces);

/* An area in quads of the wanted size. */
double qw_in_quads(const qw_run_state *run, double area);
/* A point of the surface that is farther from every quad is uncovered. */
float qw_uncovered_distance(const qw_run_state *run);

/* Whether quads are to be of different sizes, by the option `adaptive` or a painted density. */
bool qw_has_density(const qw_run_state *run);

/* Of an edge on a circle, at most: with one edge more than asked for, as the integers round up or down. */
double qw_turn_of_edge(const qw_run_state *run);

/* Wanted edge length of the quads at each vertex of run->surface; those of *base_target are not yet refined. *tips, if
   not NULL: what sticks out, in the current scope. *nests, if not NULL: those of guides, fitted, in the current scope.
 */
float *qw_wanted_size(const qw_run_state *run, double rho, float **base_target, qw_tip_list *tips, qw_nests *nests);

/* How fine the working mesh of the run is to be. */
qw_resolution_request qw_resolution_of(const qw_run_state *run);

/* run->feature_density, from the surface and rho. */
double qw_feature_density_of(const qw_run_state *run);
