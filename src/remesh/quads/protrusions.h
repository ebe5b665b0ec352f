/* Protrusions that the quads do not reach: a horn, a leg or a finger that the integers made vanish as a disc grows out
 * of the quad below it, in rings of four, as one would extrude it by hand. The topology stays.
 */
#pragma once

#include "remesh/sizes/tips.h"
#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"

/* What is to grow. */
typedef struct qw_growth {
    const qw_trimesh *surface;
    float edge;    /* the mean length of an edge */
    float far;     /* what is farther from every quad, somewhere, is a protrusion as far as it is half an edge away */
    bool marked;   /* those that have marked edges, which their quads do not follow; else those that have none */
    uint32_t most; /* at most so many quads more */
    uint32_t tip_count;
    const qw_tip *tip; /* qw_tip[tip_count]: grow as far as they are long, the first ones first */
} qw_growth;

/* A new mesh in the current scope, on the surface but not relaxed; the same where nothing grew. A protrusion is a disc.
   Returns how many grew. */
uint32_t qw_extrude_protrusions(qw_env *env, qw_quadmesh *quads, const qw_growth *growth);
