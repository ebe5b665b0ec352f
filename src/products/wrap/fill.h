/* Holes of a clean surface are closed: boundary loops of few edges. */
#pragma once

#include "remesh/clean/clean.h"

typedef struct qw_fill_counts {
    int64_t holes, triangles, left; /* closed; triangles that closed them; boundary loops that stay */
} qw_fill_counts;

/* Closes the loops of at most `edges` edges, but those whose fill would be nearly as large as their component, which
 * would be closed by its own reflection. New triangles come from the polygon of one beside their loop. Changes
 * clean->mesh, its component and source_face: arrays of the current scope. */
qw_fill_counts qw_fill_holes(qw_env *env, qw_clean *clean, int64_t edges);
