/* The closed offsets nearest to the real ones, for complexes that are small: all sums of moves (closed_moves.h) whose
 * cost is below a bound, which is raised until enough have been seen. Rounding finds one of them; which is best may
 * depend on much that no sum of squares knows. */
#pragma once

#include "remesh/quantise/complex.h"

typedef struct qw_nearest_request {
    uint32_t most;   /* offsets to visit */
    double farthest; /* cost, qw_complex_cost, above that of the nearest real point that keeps what is fixed */
    void (*visit)(qw_env *env, void *user); /* with the offsets in c->d */
    void *user;
} qw_nearest_request;

/* c: closed, with weights. Visits none twice, in no order but that of the bounds; puts c->d back. Returns how many were
   visited: 0 where the complex has no moves or too many (closed_moves.h). */
uint32_t qw_visit_nearest(qw_env *env, qw_complex *c, const qw_nearest_request *request);
