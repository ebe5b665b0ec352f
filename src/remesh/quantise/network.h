/* From equations to a network (paper, Section 3.3, "Balancing Variables" and "Feasibility Condition").
 *
 * A node is one scalar row of one triangle's Eq. (3): node 2 f + row. A variable is one component of one edge, 2 e +
 * component; it appears in two nodes. Every node gets a sign by breadth-first search so that along the search tree each
 * variable appears once with + and once with -; it is then an arc in either direction. Where a variable closes a cycle
 * with equal signs it cannot be balanced and is frozen. A variable of a boundary edge appears in one node only; its
 * other end is the ground, one more node that gives or takes whatever is needed.
 */
#pragma once

#include "remesh/quantise/complex.h"
#include "solve/flow.h"

typedef struct qw_network {
    uint32_t node_count;     /* 2 face_count + 1, the last is the ground */
    uint32_t variable_count; /* balanced ones */
    uint32_t *variable;      /* uint32_t[variable_count]: 2 e + component */
    uint32_t *minus, *plus;  /* uint32_t[variable_count]: raising the variable by one is one unit from minus to plus */
    int8_t *sign;            /* int8_t[node_count], +1 or -1 */
    uint32_t *component;     /* uint32_t[node_count], connected component by balanced variables */
    uint32_t component_count;
    uint32_t ground_component; /* QW_NONE where no variable touches the ground */
    uint32_t frozen_count;
    uint32_t *frozen; /* uint32_t[frozen_count]: unbalanced variables */
} qw_network;

qw_network qw_network_build(qw_env *env, const qw_complex *complex);

/* Changes frozen variables so that the supplies of every component but the ground's sum to zero. Returns how many
   components have a sum that no frozen variable can change; *bad (uint8_t[component_count], may be NULL) marks them. */
uint32_t qw_network_balance_sums(qw_env *env, const qw_network *network, qw_complex *complex, uint8_t *bad);

/* Supplies that Eq. (3) asks for now: int32_t[node_count]; the ground's makes the sum zero. */
void qw_network_supply(const qw_network *network, const qw_complex *complex, int32_t *supply);

/* Where component k of an edge shows up in the frame of the triangle for a half-edge with this rot. */
typedef struct qw_row {
    uint8_t row;
    int8_t sign;
} qw_row;
static inline qw_row qw_row_of(unsigned rot, unsigned k)
{
    static const qw_row rows[4][2] = {{{0, 1}, {1, 1}}, {{1, 1}, {0, -1}}, {{0, -1}, {1, -1}}, {{1, -1}, {0, 1}}};
    return rows[rot & 3u][k & 1u];
}
