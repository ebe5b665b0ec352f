/* What RELAX and FINISH share: relaxing, and what the quads of an attempt lack: the wanted count, and protrusions that
 * the integers left out.
 */
#ifndef QW_COVERAGE_H
#define QW_COVERAGE_H

#include "quad/topology.h"
#include "run.h"

/* The quads relaxed on the surface, in the current scope; *flipped as of qw_run_state. */
qw_quadmesh qw_relax(const qw_run_state *run, const qw_quadmesh *quads, uint8_t **flipped);

/* What the quads leave uncovered: points and area. */
qw_sites qw_find_uncovered(const qw_run_state *run, const qw_quadmesh *quads);

/* Quads that are certainly flipped count as two, those that may be as one. */
double qw_count_flipped(const qw_quadmesh *quads, const uint8_t *flipped);

/* Quads whose count is within the promise: what no size could do is done by single quads, which go or are added. Where
   fewer are wanted than the components need, only quads go that cost no shape, down to what they need. */
qw_quadmesh qw_fit_count(qw_run_state *run, const qw_quadmesh *quads);

/* Relaxed quads with the protrusions that could grow, relaxed again, as long as that leaves less uncovered and flipped;
   where the count would be missed then, quads go elsewhere. marked: those that have sharp edges, which their quads do
   not follow; else those that have none. Returns how many grew. */
uint32_t qw_grow_protrusions(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped, bool marked);

#endif
