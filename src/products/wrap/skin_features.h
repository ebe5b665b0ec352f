/* Sharp edges of the input on the skin: vertices are put on them, and edges between those. */
#pragma once

#include "products/wrap/guard.h"
#include "products/wrap/wrap_target.h"

/* A face of the target near to each of the first vertices of the skin, where a search may begin: no result depends on
 * it. */
typedef struct qw_near_faces {
    uint32_t count;
    const uint32_t *face; /* uint32_t[count] */
} qw_near_faces;

/* Moves vertices onto the sharp edges and corners of the input that pass close by. */
void qw_snap_to_features(qw_env *env, qw_guard *g, const qw_wrap_target *target, const qw_near_faces *near);
/* Splits edges that cut off an edge or a corner of the input, where they do. */
void qw_split_at_features(qw_env *env, qw_guard *g, const qw_wrap_target *target, const qw_near_faces *near);
/* Flips edges where the other diagonal is nearer to the input. */
void qw_flip_to_features(qw_env *env, qw_guard *g, const qw_wrap_target *target, const qw_near_faces *near);
/* Collapses edges much shorter than a cell, unless the skin would leave the input. */
void qw_collapse_short(qw_env *env, qw_guard *g, const qw_wrap_target *target);
