/* Whether what a caller says of the quads is symmetric as the surface is. */
#pragma once

#include "whole/state.h"

/* What is drawn by hand on both sides is alike within this share of the diagonal. */
#define QW_DRAWN_ALIKE 5e-3f
/* Of a guide: that, or more where it is a loop with rings. scale: of the frame. */
float qw_drawn_alike(const qw_steering *s, uint32_t guide, double scale);

/* What steers the quads on one side of the plane otherwise than on the other, as the subject of a sentence: guides,
   directions, densities, weights and targets; NULL: nothing does. Needs what CLEAN leaves. */
const char *qw_one_sided_steering(const qw_run_state *run, const qw_mirror_plane *plane);
