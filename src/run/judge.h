/* What an attempt was like, as far as a stage shows it. */
#pragma once

#include "remesh/quads/topology.h"
#include "whole/state.h"
#include "run/retry.h"

typedef struct qw_judgement {
    qw_verdict verdict; /* of the attempt so far, including what this stage shows */
    qw_sites places;    /* verdict.places of them: where quads may be made smaller, in the scope of the stage */
} qw_judgement;

/* Adds to the verdict what the finished stage shows. */
void qw_judge(const qw_run_state *run, qw_stage finished, qw_judgement *judgement);
