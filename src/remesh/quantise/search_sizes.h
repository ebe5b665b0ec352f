/* The steps of the search for integers that try sizes: of all components together, of long
 * components stretched, and with noise. */
#pragma once

#include "remesh/quantise/search_state.h"

/* Tries sizes around the wanted one, and keeps the best trials. */
void qw_search_sizes(qw_env *env, qw_search *s);

/* Where signs make edges longer than their size asks for and the count is missed by that, tries sizes around another
   one. */
void qw_search_other_sizes(qw_env *env, qw_search *s);

/* Where the count breaks the promise or a triangle is inverted, rounds offsets with more and more noise. Returns how
   many sizes were tried, with those before. */
uint32_t qw_search_noise(qw_env *env, qw_search *s);
