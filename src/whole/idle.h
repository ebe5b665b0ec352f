/* Options that change nothing in this run, as another one is not set, and a target out of all proportion: said in the
 * report. */
#pragma once

#include "whole/state.h"

/* Needs what CLEAN leaves. */
void qw_warn_of_idle(qw_run_state *run);
