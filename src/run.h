/* The state of one run: the values that the stages hand on, in order. Each stage reads what earlier ones left and
 * writes its own part; none changes another's. What is added here, or to what is held here, needs a line in state.def.
 */
#ifndef QW_RUN_H
#define QW_RUN_H

#include "base/env.h"
#include "field/orientation.h"
#include "hierarchy/hierarchy.h"
#include "integer/offsets.h"
#include "mesh/bvh.h"
#include "mesh/clean.h"
#include "mesh/quadmesh.h"
#include "mesh/working.h"
#include "quad/extract.h"
#include "retry.h"

/* Within radius of center (centred frame) the wanted edge length is smaller, once for each round. */
typedef struct qw_refinement {
    qw_vec3 center;
    float radius;
    uint32_t round; /* 1, 2, ... */
} qw_refinement;

/* What was made of the smallest components straight away, and what the stages from SURFACE on see: see apart.h. */
typedef struct qw_apart {
    qw_trimesh rest;             /* the clean surface's own arrays where nothing was made so */
    qw_census census;            /* of the rest */
    double area, extent, needed; /* of the rest, as area, extent and faces_needed of the run are of the whole */
    qw_quadmesh quads;           /* of the others; component: their numbers in the clean census */
} qw_apart;

typedef struct qw_run_state {
    qw_env *env;
    const qw_clean_input *input;
    qw_options options;
    qw_report *report; /* written to, never read */

    /* the driver's (driver.c): stages read the plan and the refinements */
    qw_plan plan;                    /* of the current attempt */
    const qw_refinement *refinement; /* qw_refinement[QW_MAX_REFINEMENTS], of which the first plan.refinements hold */

    /* CLEAN */
    qw_clean clean;
    qw_census clean_census;
    double area;         /* of the surface, centred frame */
    double extent;       /* sum of the diagonals of the boxes about its components */
    double faces_needed; /* so many at the least have the surface's components, whatever they look like */
    /* SURFACE */
    qw_apart apart;
    qw_trimesh surface; /* the clean surface with its features marked; coarser where it was much finer than the quads */
    qw_census surface_census;
    double surface_faces; /* made for up to so many quads */
    /* WORKING */
    double faces_wanted;
    double rho;    /* mean edge length wanted, centred frame */
    double detail; /* length of the sharp edges, and what handles and holes count for, in rho; to the area in rho^2 */
    qw_working working;
    uint8_t *constraint; /* QW_CONSTRAINT_, [working vertices] */
    qw_vec3 *direction;
    qw_vec3 *normal; /* smoothed at the scale of the quads */
    float *smoothed; /* what share of that scale counted, [working vertices] */
    /* HIERARCHY */
    qw_hierarchy *hierarchy;
    /* ORIENTATION */
    qw_vec3 *orientation;
    /* SCALE */
    float *size; /* wanted edge length, [working vertices] */
    /* POSITION */
    qw_vec3 *lattice;
    /* REGULAR */
    uint32_t stiff_is_vain; /* flag: a stiffer surface would have no better integers */
    int64_t irregular;      /* triangles whose offsets do not close: the paper's flows may leave some */
    /* INVERSIONS */
    int64_t inverted; /* triangles left inverted */
    /* OFFSETS, REGULAR, INVERSIONS: each its own */
    qw_offset_mesh offsets, regular, inversion_free;
    /* QUADS */
    qw_extraction extraction;
    /* POSITIONS */
    qw_quadmesh embedded;
    /* REPAIR, SIMPLIFY, RELAX */
    qw_quadmesh repaired, simplified, relaxed;
    uint32_t topology_kept; /* flag: repaired has the topology of the surface */
    uint8_t *flipped;       /* [relaxed faces]: qw_flip (mesh/flips.h) of each quad */
    uint32_t grown;         /* protrusions that RELAX let grow */
    /* FINISH */
    qw_quadmesh finished; /* with the quads that were made apart behind the others */
    double *output;       /* double[finished.vertex_count][3], in the coordinates of the input */
} qw_run_state;

/* run->surface_faces as a run with these options would have it. Needs what CLEAN leaves. */
double qw_surface_faces(const qw_run_state *run, const qw_options *options);

/* A sentence for the report and the log. */
void qw_warn(qw_run_state *run, const char *text);

#endif
