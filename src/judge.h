/* What an attempt was like, as far as a stage shows it. */
#ifndef QW_JUDGE_H
#define QW_JUDGE_H

#include "quad/rounds.h"
#include "quad/topology.h"
#include "run.h"

typedef struct qw_judgement {
    qw_verdict verdict;   /* what was known before, with what this stage shows */
    qw_sites places;      /* verdict.places of them: where quads may be made smaller, in the scope of the stage */
    qw_quadmesh composed; /* where verdict.is_composed: of each component the best so far, in the scope of the stage */
    uint8_t *composed_flipped;
} qw_judgement;

/* rounds: what the attempts before gave, to which the quads of RELAX are added. */
void qw_judge(const qw_run_state *run, qw_stage finished, qw_rounds *rounds, qw_judgement *judgement);

#endif
