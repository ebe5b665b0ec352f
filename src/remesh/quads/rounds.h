/* What several rounds made of each component of a surface, and the best of it: a leg that one round keeps and the next
 * one loses is taken from the first. */
#pragma once

#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"
#include "remesh/quads/topology.h"

typedef struct qw_rounds {
    uint32_t count, component_count; /* component_count: of the surface */
    /* of all rounds, one after another; component: round * component_count + its number on the surface */
    qw_quadmesh quads;
    uint8_t *flipped; /* uint8_t[quads.face_count] */
    uint32_t last;    /* the first face of the last round */
    double *penalty;  /* double[count * component_count]: what is left uncovered, in quads, and quads flipped; a little
                     for  irregular vertices */
} qw_rounds;

/* None yet. The arrays stay in the scope that they are begun in. */
qw_rounds qw_rounds_begin(qw_env *env);

/* Forgets what was added; the arrays stay for others. */
void qw_rounds_drop(qw_rounds *rounds);

typedef struct qw_round {
    const qw_trimesh *surface, *working; /* the same in all rounds; what this round's quads were made from */
    const qw_quadmesh *quads;            /* components are those of `working` */
    const uint8_t *flipped;              /* uint8_t[quads->face_count] */
    double rho;                          /* mean edge length wanted */
    float far;                           /* what is further from every quad is left uncovered */
    double least, most;                  /* quads, in all; a round alone may have others */
} qw_round;

/* Adds a round and composes the best so far in the current scope, as quads of this round's working mesh, with their
   flags. False, and nothing is composed, where there is one component only, where the first round left nothing
   uncovered or certainly flipped, or where components cannot be matched: then earlier rounds are dropped too. */
bool qw_rounds_add(qw_env *env, qw_rounds *rounds, const qw_round *round, qw_quadmesh *best, uint8_t **flipped);

/* The places where the next round is to have smaller quads: what `best` leaves uncovered and, in components with
   uncovered parts, what the last round left uncovered, as that may be another protrusion of the same component.
   size: float[working->vertex_count], the wanted edge length. */
qw_sites qw_rounds_uncovered(qw_env *env, const qw_rounds *rounds, const qw_trimesh *working, const float *size,
                             const qw_quadmesh *best, float far);
