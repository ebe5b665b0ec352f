/* Places and steps of the vertices of a skin, as shrink.c and skin_features.c share them. Lengths are in units of the
 * lattice.
 */
#pragma once

#include "products/wrap/guard.h"
#include "products/wrap/wrap_target.h"

void qw_skin_place(const qw_skin *s, uint32_t v, double p[3]);
/* Unit, outward, by area. */
void qw_skin_normal(const qw_skin *s, uint32_t v, double normal[3]);
/* The nearest point of the lattice within the box of the skin. */
qw_wrap_lattice_point qw_rounded(const qw_skin *s, const double p[3]);
/* A point a little off the input where it was touched, on the side of `outward`. */
void qw_lift(const qw_skin *s, const qw_touch *touch, const double outward[3], double to[3]);
/* The same for a point of the input. */
void qw_lift_from(const qw_skin *s, double at[3], const double outward[3]);
/* Moves a vertex as far to a place as the guard allows, by halves; true: all the way. */
bool qw_step_towards(qw_guard_room *room, uint32_t v, const double to[3]);
