/* The stages, in order; what each takes from the run, calls and leaves in it is in surface.c, integers.c, quads.c and
 * finish.c.
 */
#pragma once

#include "remesh/quantise/regular.h"
#include "whole/state.h"

#define QW_STAGE(name, title, source, weight) void qw_stage_##name(qw_run_state *run);
#include "quadwright/stages.def"

/* Whether the integers come from closed offsets, which need no position field. */
static inline bool qw_is_closed_flow(const qw_options *options) { return options->flow == QW_FLOW_CLOSED; }

/* In SURFACE, and for the other side of a plane of symmetry: sets run->surface and its census, for the quads of
   run->surface_faces, from the core; run->tree is still to be built. */
void qw_prepare_surface(qw_run_state *run);

/* What HIERARCHY leaves, for a stage that finds none: whole/state.h. In the current scope. */
qw_hierarchy *qw_build_hierarchy(const qw_run_state *run);

/* What the report says of the feature curves that the quads do not follow, from run->curve_outcome. */
void qw_report_curves(qw_run_state *run);
/* Sets report->lost_edges and report->faces_for_edges of the quads, and warns where a sharp edge is gone. */
void qw_report_lost_edges(qw_run_state *run, const qw_quadmesh *quads);
/* Warns where closed curves without corners have fewer edges around than the option `around` asks for. */
void qw_report_edges_around(qw_run_state *run, const qw_quadmesh *quads);

/* In WORKING: sets run->constraint and run->direction, the feature constraints of the working mesh. */
void qw_set_holds(qw_run_state *run);
