/* The steps of the search for integers that try sizes of all components together. */
#pragma once

#include "remesh/quantise/search_state.h"

/* Tries sizes around the wanted one, and keeps the best trials. */
void qw_search_sizes(qw_env *env, qw_search *s);
