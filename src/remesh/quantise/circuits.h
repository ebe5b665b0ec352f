/* Improves integer offsets that obey Eq. (3) by circuits: closed walks along which variables rise and fall by one, so
 * that every row keeps its sum.
 *
 * A variable appears in two rows (in one at a boundary). A walk arrives at a row with its sum off by +1 or -1;
 * changing another variable of that row sets the sum right and puts the row at its other end off. Where the walk
 * comes back to the row and sign that it began with, every row is right again. Walks of negative cost are searched
 * for by Bellman's and Ford's shortest paths over (row, sign) until there is none. The double cover of
 * remesh/quantise/bidirected.h has the same states.
 */
#pragma once

#include "remesh/quantise/complex.h"

/* Lowers the sum of weight * (d - real)^2 over the edges by circuits of at most `longest` steps; changes c->d. Eq. (3)
   must hold and does so afterwards. Returns the number of circuits. */
uint32_t qw_improve_offsets(qw_env *env, qw_complex *c, uint32_t longest);

/* Makes closed what is open in few rows, by the cheapest walks of at most `longest` steps from one row that is off to
   another. Changes c->d; returns whether Eq. (3) then holds everywhere, at a cost of at most `most`. */
bool qw_close_offsets(qw_env *env, qw_complex *c, uint32_t longest, double most);

/* Changes component v, 2 edge + (it is y), by so much, holds it, and closes the offsets again in the same way. */
bool qw_step_offsets(qw_env *env, qw_complex *c, uint32_t v, int32_t by, uint32_t longest, double most);
