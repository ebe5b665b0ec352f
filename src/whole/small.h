/* Which components are small, or thin, is decided here (small.c: find_least among LEAST_APART and more, find_thin among
   fewer): those that would get next to no quads are made straight from their triangles (remesh/quads/straight.h). The
   stages from SURFACE on see the others only. */
#pragma once

#include "whole/state.h"

/* Sets run->core for run->surface_faces. Needs what CLEAN leaves. */
void qw_set_core(qw_run_state *run);
/* Whether some of the parts may be too thin for the quads that they get: there are several, but not very many. */
bool qw_may_be_thin(const qw_run_state *run);

/* Of so many quads in all, how many are for the components that are not small. Where there are too few quads
   for all components, the rest gets its share by area, so that small components do not take quads from it. */
double qw_faces_without_small(const qw_run_state *run, double faces);

/* Of so many quads in all, how many are for what the fields remesh: the core, without the rims that are kept and the
   small components. */
double qw_core_faces(const qw_run_state *run, double faces);

/* The given quads, followed by those of small components. In the current scope. */
qw_quadmesh qw_join_small(qw_run_state *run, const qw_quadmesh *quads);
