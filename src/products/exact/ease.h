/* Angles of quads on planes, cylinders and their like, where circles and rows were made even. */
#pragma once

#include "products/exact/held.h"

/* Moves vertices on their primitives where that makes the corners around nearer to right angles:
   those all of whose neighbours lie on the primitive too, and, along it, those on the curve of two. stays:
   uint8_t[quads->vertex_count], 1: has its place. quads: linked. No quad that is not flipped becomes so. */
void qw_ease_angles(qw_env *env, const qw_quadmesh *quads, const qw_held *held, const uint8_t *stays);
