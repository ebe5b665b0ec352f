/* What an attempt was like, as far as a stage shows it. */
#pragma once

#include "remesh/quads/rounds.h"
#include "remesh/quads/topology.h"
#include "whole/state.h"
#include "run/retry.h"

typedef struct qw_judgement {
    qw_verdict verdict;   /* of the attempt so far, including what this stage shows */
    qw_sites places;      /* verdict.places of them: where quads may be made smaller, in the scope of the stage */
    qw_quadmesh composed; /* set where verdict.is_composed: the best version so far of each component, in the scope of
                             the stage */
    uint8_t *composed_flipped;
} qw_judgement;

/* Adds to the verdict what the finished stage shows. rounds: the results of earlier rounds; those of RELAX are added
   to them. */
void qw_judge(const qw_run_state *run, qw_stage finished, qw_rounds *rounds, qw_judgement *judgement);
