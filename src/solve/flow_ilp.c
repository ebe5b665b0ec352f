/* Minimum-cost flow as an integer program solved by GLPK: the way of the paper's Equation (6), and the oracle of the
 * tests.
 *
 * A column an arc, a row a node, and for every node with a supply one more column: what of it is left. Each unit left
 * at a node with positive supply costs more than any path, so that as much as possible is met first.
 */
#include "solve/flow.h"

#include "base/elementary.h"

bool qw_flow_has_integer_program(void)
{
#ifdef QW_HAVE_GLPK
    return true;
#else
    return false;
#endif
}

#ifndef QW_HAVE_GLPK

bool qw_flow_integer_program(qw_env *env, const qw_flow_problem *problem, int32_t *flow, qw_flow_result *result)
{
    (void)env, (void)problem, (void)flow, (void)result;
    return false;
}

#else

#include <assert.h>
#include <glpk.h>
#include <limits.h>
#include <math.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

/* GLPK looks at its clock, and tells how far it is, after so many milliseconds: the host is asked then. */
enum { TELL_EVERY = 20 };

typedef struct program {
    qw_env *env;
    const qw_flow_problem *problem;
    int32_t *flow;
    int columns, entries; /* of the matrix */
    int *row, *column;    /* int[1 + entries], as GLPK counts: from 1 */
    double *value;        /* double[1 + entries] */
    int code;             /* what GLPK returned; 0 when the optimum was found */
    jmp_buf failed;
    bool unwanted;  /* the host has cancelled the run */
    char said[160]; /* the last line GLPK wanted to print, but for where in its source */
} program;

/* GLPK ends the process on wrong calls and on missing memory, unless its error hook does not return. */
static void on_error(void *user) { longjmp(((program *)user)->failed, 1); }

/* Its only way out of the simplex method that a clock does not decide on is an error. */
static void leave_if_unwanted(program *p)
{
    if (p->unwanted || qw_is_still_wanted(p->env)) return;
    p->unwanted = true;
    glp_error("the host has cancelled the run\n");
}

static int on_print(void *user, const char *text)
{
    program *p = user;
    leave_if_unwanted(p);
    if (text[0] == '\n' || strncmp(text, "Error detected", 14) == 0) return 1;
    snprintf(p->said, sizeof p->said, "%.*s", (int)strcspn(text, "\n"), text);
    return 1; /* nothing goes to the terminal */
}

static void set_entry(program *p, uint32_t node, int column, double value)
{
    p->entries++;
    p->row[p->entries] = (int)node + 1;
    p->column[p->entries] = column;
    p->value[p->entries] = value;
}

static void set_column(glp_prob *lp, int column, int32_t most, double cost)
{
    glp_set_col_kind(lp, column, GLP_IV);
    glp_set_col_bnds(lp, column, most > 0 ? GLP_DB : GLP_FX, 0, most);
    glp_set_obj_coef(lp, column, cost);
}

/* The rows, columns and entries of the program: a row a node, a column an arc, and one more a supply that may not be
   met. */
static void fill(program *p, glp_prob *lp)
{
    const qw_flow_problem *q = p->problem;
    int32_t dearest = 0;
    glp_set_obj_dir(lp, GLP_MIN);
    if (q->node_count) glp_add_rows(lp, (int)q->node_count);
    if (p->columns) glp_add_cols(lp, p->columns);
    for (uint32_t a = 0; a < q->arc_count; a++) {
        bool loop = q->tail[a] == q->head[a];
        set_column(lp, (int)a + 1, loop ? 0 : q->capacity[a], q->cost[a]);
        if (q->cost[a] > dearest) dearest = q->cost[a];
        if (loop) continue;
        set_entry(p, q->tail[a], (int)a + 1, 1);
        set_entry(p, q->head[a], (int)a + 1, -1);
    }
    double dearer_than_paths = (double)dearest * q->node_count + 1;
    int column = (int)q->arc_count;
    for (uint32_t v = 0; v < q->node_count; v++) {
        int32_t supply = q->supply[v];
        glp_set_row_bnds(lp, (int)v + 1, GLP_FX, supply, supply);
        if (supply == 0) continue;
        set_column(lp, ++column, supply > 0 ? supply : -supply, supply > 0 ? dearer_than_paths : 0);
        set_entry(p, v, column, supply > 0 ? 1 : -1);
    }
    assert(column == p->columns);
    glp_load_matrix(lp, p->entries, p->row, p->column, p->value);
}

static void on_node(glp_tree *tree, void *user)
{
    (void)tree;
    leave_if_unwanted(user);
}

/* The program without its integers first, by a call that tells how far it is: the corners of a network's are whole
   (Hoffman and Kruskal), so that little is left to be branched on. Its slack basis is dual feasible. */
static int solve_relaxed(glp_prob *lp)
{
    glp_smcp options;
    glp_init_smcp(&options);
    options.msg_lev = GLP_MSG_ON;
    options.meth = GLP_DUALP;
    options.out_frq = TELL_EVERY;
    return glp_simplex(lp, &options);
}

static int solve_whole(program *p, glp_prob *lp)
{
    glp_iocp options;
    glp_init_iocp(&options);
    options.msg_lev = GLP_MSG_ON;
    options.out_frq = TELL_EVERY;
    options.cb_func = on_node;
    options.cb_info = p;
    return glp_intopt(lp, &options);
}

static void solve(program *p)
{
    glp_prob *lp = glp_create_prob();
    fill(p, lp);
    p->code = p->columns ? solve_relaxed(lp) : 0;
    if (p->columns && p->code == 0) p->code = solve_whole(p, lp);
    if (p->columns && p->code == 0 && glp_mip_status(lp) != GLP_OPT) p->code = -1;
    for (uint32_t a = 0; p->code == 0 && a < p->problem->arc_count; a++)
        p->flow[a] = (int32_t)qw_round_away(glp_mip_col_val(lp, (int)a + 1));
    glp_delete_prob(lp);
}

/* False when GLPK failed. Leaves no memory of GLPK's behind, but keeps the host's if the host uses GLPK itself and all
 * went well. */
static bool call(program *p)
{
    if (setjmp(p->failed) != 0) {
        glp_free_env(); /* all that is allowed after a failure; takes the hooks along */
        return false;
    }
    bool fresh = glp_init_env() == 0;
    glp_term_hook(on_print, p);
    glp_error_hook(on_error, p);
    solve(p);
    glp_error_hook(NULL, NULL);
    glp_term_hook(NULL, NULL);
    if (fresh) glp_free_env();
    return true;
}

/* What a flow costs, and how much of the supply it meets. */
static qw_flow_result sum_up(qw_env *env, const qw_flow_problem *problem, const int32_t *flow)
{
    qw_flow_result result = {0};
    int64_t *sent = QW_NEW_ZERO(env, int64_t, problem->node_count);
    for (uint32_t a = 0; a < problem->arc_count; a++) {
        sent[problem->tail[a]] += flow[a];
        sent[problem->head[a]] -= flow[a];
        result.cost += (int64_t)flow[a] * problem->cost[a];
    }
    for (uint32_t v = 0; v < problem->node_count; v++) {
        if (problem->supply[v] <= 0) continue;
        result.wanted += problem->supply[v];
        result.met += sent[v];
    }
    return result;
}

bool qw_flow_integer_program(qw_env *env, const qw_flow_problem *problem, int32_t *flow, qw_flow_result *result)
{
    uint32_t supplies = 0;
    for (uint32_t v = 0; v < problem->node_count; v++) supplies += problem->supply[v] != 0;
    size_t entries = 2 * (size_t)problem->arc_count + supplies;
    if (entries >= INT_MAX || problem->node_count >= INT_MAX)
        qw_fail(env, QW_TOO_LARGE, -1, "the network is too large for GLPK");

    qw_scope_begin(env);
    program *p = QW_NEW_ZERO(env, program, 1);
    p->env = env;
    p->problem = problem;
    p->columns = (int)(problem->arc_count + supplies);
    p->row = QW_NEW(env, int, 1 + entries);
    p->column = QW_NEW(env, int, 1 + entries);
    p->value = QW_NEW(env, double, 1 + entries);
    p->flow = QW_NEW(env, int32_t, problem->arc_count);
    bool called = call(p);
    if (p->unwanted) qw_cancel(env);
    if (!called) qw_fail(env, QW_MEMORY, -1, "GLPK gave up, most likely for want of memory: %s", p->said);
    if (p->code != 0) qw_fail(env, QW_INTERNAL, -1, "GLPK found no optimum (code %d)", p->code);
    qw_flow_result found = sum_up(env, problem, p->flow);
    if (!qw_flow_is_feasible(env, problem, p->flow, found.met))
        qw_fail(env, QW_INTERNAL, -1, "GLPK's flow is not feasible");
    for (uint32_t a = 0; a < problem->arc_count; a++) flow[a] = p->flow[a];
    *result = found;
    qw_scope_end(env);
    return true;
}

#endif
