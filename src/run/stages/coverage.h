/* Shared by the stages RELAX and FINISH: relaxation, the count, uncovered area, growth of protrusions. */
#pragma once

#include "remesh/quads/topology.h"
#include "whole/state.h"

/* The quads relaxed on the surface, in the current scope; *flipped as of qw_run_state; NULL: flipped quads
   are left, as the quads are to be changed and relaxed again. held: of qw_relax_target. */
qw_quadmesh qw_relax(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t *held, uint8_t **flipped);

/* The points of the surface that are farther from every quad than qw_uncovered_distance, and their area. */
qw_sites qw_find_uncovered(const qw_run_state *run, const qw_quadmesh *quads);

/* How many pieces of the surface are farther from every quad than qw_uncovered_distance. */
uint32_t qw_count_lost_parts(const qw_run_state *run, const qw_quadmesh *quads);

/* Number of flipped quads; one that is certainly flipped counts 2, one in doubt 1. */
double qw_count_flipped(const qw_quadmesh *quads, const uint8_t *flipped);

/* Adds or removes single quads until their count is within the promise. Where the components need more quads than
   were asked for, only quads are removed that cost no shape, down to what the components need. */
qw_quadmesh qw_fit_count(qw_run_state *run, const qw_quadmesh *quads);

/* Grows uncovered protrusions out of the relaxed quads and relaxes again, as long as the faults (uncovered area and
   flipped quads) get fewer; where the count would leave the promise, quads are removed elsewhere. marked: only
   protrusions with sharp edges, which the new quads do not follow; else only those without. Returns how many grew. */
uint32_t qw_grow_protrusions(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped, bool marked);

/* Where fewer grew than quads were kept for in the plan: others take their places. */
void qw_use_up_reserve(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped);
