/* Protrusions that the integers left out grow out of the quads below them. */
#ifndef QW_COVERAGE_H
#define QW_COVERAGE_H

#include "quad/topology.h"
#include "run.h"

/* What the quads leave uncovered: points and area. */
qw_losses qw_find_uncovered(const qw_run_state *run, const qw_quadmesh *quads);

/* Quads that are certainly flipped count as two, those that may be as one. */
double qw_count_flipped(const qw_quadmesh *quads, const uint8_t *flipped);

/* Fewer quads, from `least` to `most`, as long as there are chords and moves for that. */
qw_quadmesh qw_fewer_quads(qw_run_state *run, const qw_quadmesh *quads, int64_t least, int64_t most);

/* Relaxed quads with the protrusions that could grow, relaxed again, as long as that leaves less uncovered and flipped;
   where the count would be missed then, quads go elsewhere. with_marks: also those that have sharp edges, which their
   quads do not follow. Returns how many grew. */
uint32_t qw_grow_protrusions(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped, bool with_marks);

#endif
