/* Orientation-preserving offsets: no triangle inverted, Eq. (4) (paper, Section 3.4). Needs regular offsets whose
 * components are -1, 0 or 1. */
#pragma once

#include "remesh/offsets/offsets.h"

typedef struct qw_inversion_counts {
    int64_t inverted_before, inverted_after_greedy, inverted_after;
    int64_t moves;
    int64_t sat_calls, sat_solved, sat_conflicts;
} qw_inversion_counts;

/* Moves single vertices by whole lattice steps. All edges at a vertex change together, so Eq. (3) stays true; a vertex
   with a cone cannot move, and one on a curve only along it. Each move makes the sum of inverted areas smaller and no
   edge long. */
void qw_remove_inversions_greedy(qw_env *env, qw_offset_mesh *m, qw_inversion_counts *counts);

/* Solves for the triangles that are left by SAT, in growing neighbourhoods: in small ones only, or in all that may
   have an answer. Limits are numbers of conflicts. */
typedef enum qw_sat_effort { QW_SAT_NEAR, QW_SAT_FAR } qw_sat_effort;
void qw_remove_inversions_sat(qw_env *env, qw_offset_mesh *m, qw_sat_effort effort, qw_inversion_counts *counts);

/* Shared by both: frames of the triangles around a vertex and the effect of moving it. */
typedef struct qw_star {
    uint32_t count; /* triangles around the vertex */
    uint32_t *out;  /* uint32_t[count]: their half-edges that leave the vertex */
    uint8_t *turn;  /* uint8_t[count]: quarter turns from the frame of the first triangle to each one's */
    bool movable;   /* false at a cone */
    size_t capacity;
} qw_star;
void qw_star_at(qw_env *env, const qw_offset_mesh *m, uint32_t outgoing, qw_star *star);
/* Moves the star's vertex by t, in the frame of the star's first triangle. */
void qw_star_move(qw_offset_mesh *m, const qw_star *star, qw_int2 t);
uint32_t *qw_offset_outgoing(qw_env *env, const qw_offset_mesh *m); /* as qw_trimesh_outgoing */
