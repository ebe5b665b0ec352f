/* Sharp edges of the input on the skin: vertices are put on them, and edges between those. */
#ifndef QW_WRAP_FEATURES_H
#define QW_WRAP_FEATURES_H

#include "wrap/guard.h"
#include "wrap/wrap_target.h"

/* Moves vertices onto the sharp edges and corners of the input that pass close by. */
void qw_snap_to_features(qw_env *env, qw_guard *g, const qw_wrap_target *target);
/* Splits edges that cut off an edge or a corner of the input, where they do. */
void qw_split_at_features(qw_env *env, qw_guard *g, const qw_wrap_target *target);
/* Flips edges where the other diagonal is nearer to the input. */
void qw_flip_to_features(qw_env *env, qw_guard *g, const qw_wrap_target *target);
/* Collapses edges much shorter than a cell, unless the skin would leave the input. */
void qw_collapse_short(qw_env *env, qw_guard *g, const qw_wrap_target *target);

#endif
