/* Closed feature and boundary curves that meet no other curve: circles, rims of holes. Each has an even number of quads
 * along it where that can be had: its halves are alike then. */
#pragma once

#include "remesh/quantise/complex_components.h"

/* Edges of the quads around a hole at least: with fewer it would close. */
enum { QW_HOLE_EDGES = 4 };

typedef struct qw_closed_curves {
    uint32_t count;
    uint32_t *begin; /* uint32_t[count + 1]: edges of curve i are edge[begin[i]] to edge[begin[i + 1]] */
    uint32_t *edge;  /* of the component's complex */
} qw_closed_curves;

/* In the current scope. */
qw_closed_curves qw_find_closed_curves(qw_env *env, const qw_component *component);

/* How many have an odd number of quads along them. d: qw_int2[edges]. */
uint32_t qw_count_odd_curves(const qw_closed_curves *curves, const qw_int2 *d);

/* Single edges of odd curves are made one quad longer or shorter, at the least cost, and the offsets c->d closed again,
   as long as fewer are odd then, no edge loses its length, no more triangles are inverted and no more curves touch;
   at last the area in quads is brought within the bounds by other curves, or as far as it was there is taken. c: the
   component's, with offsets and real lengths of the caller's. *work: triangles that may be looked at; is lowered by
   those that were. Returns how many are odd. */
uint32_t qw_make_curves_even(qw_env *env, const qw_component *component, qw_complex *c, double least_area,
                             double most_area, double *work);
