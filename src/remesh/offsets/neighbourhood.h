/* Parts of whole offsets that the SAT solver may change: the paper's encoding (Section 3.4) with one change. The paper
 * gives every edge nine Booleans, one a value of its offset, and adds Eq. (3) as clauses. Inside a disc offsets that
 * satisfy Eq. (3) are differences of vertex positions, so we give every vertex nine instead, one a step it may take;
 * Eq. (3) then holds by itself, there are a third of the variables, and 81 clauses an edge stand for 729 a triangle.
 * Vertices with a cone and vertices outside the neighbourhood stay.
 *
 * Variables of the i-th vertex of the neighbourhood: 9 i + 1 "it moves", 9 i + 1 + k "it takes step k", k = 1..8. All
 * variables start out false in the solver, so it tries first to leave things as they are.
 */
#pragma once

#include "remesh/offsets/inversions.h"
#include "solve/sat.h"

enum { QW_STEPS = 9 }; /* step 0 is to stay */

typedef struct qw_corner_turns {
    uint8_t turn[3]; /* quarter turns from the frame of the corner's star to the triangle's */
} qw_corner_turns;

typedef struct qw_neighbourhood {
    const qw_offset_mesh *m;
    const uint32_t *outgoing;
    uint32_t *number; /* [V] place in `vertex`, or QW_NONE */
    uint32_t *vertex; /* [count] */
    uint32_t count;
    uint32_t *face; /* [face_count] triangles with at least one vertex in the neighbourhood */
    uint32_t face_count;
    qw_corner_turns *turns; /* [F], valid for the corners that are in */
    uint8_t *face_in;       /* [F] */
    qw_star star;
} qw_neighbourhood;

/* Empty, in the current scope. */
qw_neighbourhood qw_neighbourhood_make(qw_env *env, const qw_offset_mesh *m);
/* Adds all vertices within `radius` rings of the triangle, through any vertex. */
void qw_neighbourhood_grow(qw_env *env, qw_neighbourhood *n, uint32_t seed, uint32_t radius);
void qw_neighbourhood_forget(qw_neighbourhood *n);

/* The literal that is false exactly when vertex v takes step k; 0 where the vertex cannot move (then only k = 0
 * happens). */
int qw_denies(const qw_neighbourhood *n, uint32_t v, int k);
static inline int qw_step_count(const qw_neighbourhood *n, uint32_t v)
{
    return n->number[v] == QW_NONE ? 1 : QW_STEPS;
}
/* The vector along h, in its triangle's frame, when tail and head take their steps. */
qw_int2 qw_along_after(const qw_neighbourhood *n, uint32_t h, int tail, int head);
/* At most three literals, of which those that are 0 are left out. */
void qw_neighbourhood_clause(qw_sat *sat, const int *literals, int count);

/* That each vertex takes one step, that no edge gets long or leaves its curve, that no triangle is inverted. */
void qw_neighbourhood_forbid_inversions(const qw_neighbourhood *n, qw_sat *sat);
/* The step that the solver gave to the vertex. */
int qw_taken_step(const qw_neighbourhood *n, const qw_sat *sat, uint32_t v);
void qw_take_steps(const qw_neighbourhood *n, const qw_sat *sat, qw_offset_mesh *m);
