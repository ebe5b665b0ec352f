/* What each stage must leave behind, checked where one stage hands over to the next: builds for debugging and with
   sanitizers do so after every stage. What is promised of the result itself is checked in every build
   (remesh/quads/topology.h). */
#pragma once

#include "whole/state.h"

#ifndef QW_CHECKS_BORDERS
#define QW_CHECKS_BORDERS 0
#endif

/* Fails with QW_INTERNAL, naming the first element that is wrong. */
void qw_check_border(qw_run_state *run, qw_stage finished);
