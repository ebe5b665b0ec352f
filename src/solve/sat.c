#include "solve/sat.h"

#include <assert.h>
#include <limits.h>
#include <string.h>

#ifdef QW_HAVE_CADICAL
#include <ccadical.h>
#else
typedef struct CCaDiCaL CCaDiCaL;
#endif

struct qw_sat {
    qw_env *env;
    CCaDiCaL *solver; /* NULL without CaDiCaL */
    int *literals;    /* all clauses, each ended by 0 */
    size_t literal_count, literal_capacity;
    int variable_count; /* the largest variable seen */
    int8_t *values;     /* int8_t[1 + value_count] after QW_SAT_YES */
    size_t value_capacity;
    int value_count;
    int64_t conflicts; /* of the last call, by the clauses it learnt */
};

#ifdef QW_HAVE_CADICAL

bool qw_sat_available(void) { return true; }

static void release(void *user)
{
    qw_sat *sat = user;
    if (sat->solver) ccadical_release(sat->solver);
}

/* One clause is learnt a conflict; preprocessing learns a few without one. */
static void count_conflict(void *user, int *clause)
{
    (void)clause;
    ((qw_sat *)user)->conflicts++;
}

static void start(qw_sat *sat)
{
    sat->solver = ccadical_init();
    if (!sat->solver) qw_fail(sat->env, QW_MEMORY, -1, "no memory for the SAT solver");
    ccadical_set_option(sat->solver, "quiet", 1);
    ccadical_set_option(sat->solver, "seed", 0); /* the environment variable CADICAL_SEED would change it */
    ccadical_set_learn(sat->solver, sat, INT_MAX, count_conflict);
}

static void pass_on(qw_sat *sat, int literal) { ccadical_add(sat->solver, literal); }

static qw_sat_answer search(qw_sat *sat, int64_t conflict_limit)
{
    int limit = conflict_limit < 0 ? -1 : conflict_limit > INT_MAX ? INT_MAX : (int)conflict_limit;
    ccadical_limit(sat->solver, "conflicts", limit);
    int code = ccadical_solve(sat->solver);
    if (code != 10) return code == 20 ? QW_SAT_NO : QW_SAT_UNKNOWN;
    for (int v = 1; v <= sat->value_count; v++) sat->values[v] = ccadical_val(sat->solver, v) > 0;
    return QW_SAT_YES;
}

#else

bool qw_sat_available(void) { return false; }
static void release(void *user) { (void)user; }
static void start(qw_sat *sat) { (void)sat; }
static void pass_on(qw_sat *sat, int literal) { (void)sat, (void)literal; }

static qw_sat_answer search(qw_sat *sat, int64_t conflict_limit)
{
    (void)sat, (void)conflict_limit;
    return QW_SAT_UNKNOWN;
}

#endif

qw_sat *qw_sat_begin(qw_env *env)
{
    qw_sat *sat = QW_NEW_ZERO(env, qw_sat, 1);
    sat->env = env;
    qw_defer(env, release, sat); /* before there is anything to release: the registration itself may fail */
    start(sat);
    return sat;
}

void qw_sat_clause(qw_sat *sat, const int *literals, uint32_t count)
{
    /* All that may fail comes first: the solver must not be left with half a clause. */
    sat->literals = qw_grow(sat->env, sat->literals, &sat->literal_capacity, sat->literal_count + count + 1,
                            sizeof(int));
    for (uint32_t i = 0; i < count; i++) {
        assert(literals[i] != 0 && literals[i] != INT_MIN);
        int variable = literals[i] < 0 ? -literals[i] : literals[i];
        if (variable > sat->variable_count) sat->variable_count = variable;
        sat->literals[sat->literal_count++] = literals[i];
        pass_on(sat, literals[i]);
    }
    sat->literals[sat->literal_count++] = 0;
    pass_on(sat, 0);
}

bool qw_sat_value(const qw_sat *sat, int variable)
{
    assert(variable > 0);
    return variable > 0 && variable <= sat->value_count && sat->values[variable];
}

bool qw_sat_check(const qw_sat *sat)
{
    bool met = false;
    for (size_t i = 0; i < sat->literal_count; i++) {
        int literal = sat->literals[i];
        if (literal == 0) {
            if (!met) return false;
            met = false;
        } else if (literal > 0 ? qw_sat_value(sat, literal) : !qw_sat_value(sat, -literal)) {
            met = true;
        }
    }
    return true;
}

qw_sat_answer qw_sat_solve(qw_sat *sat, int64_t conflict_limit)
{
    sat->values = qw_grow(sat->env, sat->values, &sat->value_capacity, (size_t)sat->variable_count + 1, sizeof(int8_t));
    sat->value_count = sat->variable_count;
    memset(sat->values, 0, (size_t)sat->value_count + 1);
    sat->conflicts = 0;
    qw_sat_answer answer = search(sat, conflict_limit);
    assert(answer != QW_SAT_YES || qw_sat_check(sat));
    bool limited = conflict_limit >= 0 && sat->solver;
    if (limited && (answer == QW_SAT_UNKNOWN || sat->conflicts > conflict_limit)) sat->conflicts = conflict_limit;
    return answer;
}

int64_t qw_sat_conflicts(const qw_sat *sat) { return sat->conflicts; }
