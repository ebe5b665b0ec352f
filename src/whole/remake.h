/* Small components with flipped quads, made anew from their triangles alone: what is left where vertices were moved and
 * edges turned in vain (remesh/relax/flip_repair.h). Large components are left, as a repair there has room around it.
 */
#pragma once

#include "whole/state.h"

/* Replaces the components of quads that have flipped ones and can be made without, with about as many quads; *flipped,
   uint8_t[quads->face_count] (qw_flip), goes with them. All others stay as they are. Returns how many quads were
   flipped in those that were made. In the current scope. */
uint32_t qw_remake_flipped(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped);
