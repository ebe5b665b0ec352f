/* Planes of symmetry across one another: of a surface that has two or three, a quarter or an eighth is remeshed. */
#pragma once

#include "whole/state.h"

/* Whether of the surface whose reflection lies as far off so little does that positions are reflected exactly. edge:
   that of a quad, in diagonals of the surface. */
bool qw_is_alike(double far, double edge);

/* Of the planes that were found after the first those, made orthogonal to it and to one another, about which the
   surface is as symmetric as qw_is_alike wants; a third may follow from two. Sets across and returns how many. None
   where the first is not such a plane. edge: as above. */
uint32_t qw_find_across(const qw_run_state *run, const qw_mirror_search *found, uint32_t count, double edge,
                        qw_mirror_plane across[QW_MOST_PLANES - 1]);
