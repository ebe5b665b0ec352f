/* Components that get next to no quads are made straight away (quad/minimal.h), and the stages see the rest. */
#ifndef QW_APART_H
#define QW_APART_H

#include "run.h"

/* Sets run->apart for run->surface_faces. Needs what CLEAN leaves. */
void qw_set_apart(qw_run_state *run);
/* What is not made apart: the census of run->apart.rest and the sizes that go with it. For what a dump has read. */
void qw_measure_rest(qw_run_state *run);

/* Of so many quads in all, those for the rest. Where the whole has too few for its components, as many as its area is
   due: it is not to suffer from what lies about it. */
double qw_faces_of_rest(const qw_run_state *run, double faces);

/* The quads, and behind them those that were made apart. In the current scope. */
qw_quadmesh qw_join_apart(qw_run_state *run, const qw_quadmesh *quads);

#endif
