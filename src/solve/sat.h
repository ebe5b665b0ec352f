/* Satisfiability through CaDiCaL, in process, with limits in conflicts (never in seconds, so that a result does not
 * depend on the machine). Literals: variable v >= 1 is v, its negation -v. */
#pragma once

#include "base/env.h"

typedef struct qw_sat qw_sat;
typedef enum qw_sat_answer { QW_SAT_UNKNOWN, QW_SAT_YES, QW_SAT_NO } qw_sat_answer;

bool qw_sat_available(void); /* false in a build without CaDiCaL: then qw_sat_solve always answers QW_SAT_UNKNOWN */
qw_sat *qw_sat_begin(qw_env *env); /* lives in the current scope, also when a failure unwinds it */
void qw_sat_clause(qw_sat *sat, const int *literals, uint32_t count);
/* conflict_limit: of this call alone; negative: none. After QW_SAT_UNKNOWN a further call, with more conflicts or more
   clauses, goes on with what has been learnt. */
qw_sat_answer qw_sat_solve(qw_sat *sat, int64_t conflict_limit);
bool qw_sat_value(const qw_sat *sat, int variable); /* after QW_SAT_YES; false for a variable that no clause holds */
int64_t qw_sat_conflicts(
    const qw_sat *sat); /* of the last call: the limit where it was reached, otherwise the clauses learnt */
/* Certificate: with QW_SAT_YES, whether the values satisfy each clause that was added. */
bool qw_sat_check(const qw_sat *sat);
