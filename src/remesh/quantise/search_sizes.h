/* The steps of the search for integers that try sizes: of all components together, of long
 * components stretched, and with noise. */
#pragma once

#include "remesh/quantise/search_state.h"

/* Tries sizes around the wanted one, and keeps the best trials. */
void qw_search_sizes(qw_env *env, qw_search *s);

/* Where the count breaks the promise or a triangle is inverted, rounds offsets with more and more noise. */
void qw_search_noise(qw_env *env, qw_search *s);
