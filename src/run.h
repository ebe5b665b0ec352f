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
#include "quad/rounds.h"
#include "quad/topology.h"

/* Within radius of center (centred frame) the wanted size is made smaller, once an attempt. */
enum { QW_MAX_REFINEMENTS = 512 };
typedef struct qw_refinement {
    qw_vec3 center;
    float radius;
    uint8_t attempt; /* 1, 2, ... */
} qw_refinement;

/* Ways to regular offsets, each tried where the one before leaves triangles that can't be put upright. */
typedef enum qw_integer_way { QW_WAY_CLOSED, QW_WAY_CLOSED_STIFF, QW_INTEGER_WAYS } qw_integer_way;

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
    qw_report *report;

    /* decided between attempts, kept across them */
    double rho_scale; /* correction of rho so that the count fits; 1 at first */
    uint32_t count_attempts;
    double best_off,
        best_scale; /* of those: the least that the count was off by, as a ratio of 1 or more, and its rho_scale */
    uint32_t corners_freed; /* 1: cones lie beside the corners of the curves, as with them there the integers have no
                               such count; 2: that was no better */
    double corners_off, corners_scale;     /* best_off and best_scale of the attempts before */
    uint32_t way_attempts;                 /* ways to the integers that left triangles turned over */
    qw_integer_way way;                    /* the one to go */
    int64_t way_inverted[QW_INTEGER_WAYS]; /* triangles that each left */
    uint32_t refine_rounds;                /* rounds of refinement so far, of either kind */
    uint32_t refine_attempts;              /* of those for the topology */
    uint32_t reach_attempts; /* those where parts of the surface were out of the quads' reach, or quads turned over */
    uint32_t flip_attempts;  /* those of these where but quads were turned over */
    double least_bad;        /* of the results so far; see qw_adjust_result */
    uint32_t best_refine_count; /* refine_count of the best of them */
    double best_refine_scale;   /* and its rho_scale */
    qw_integer_way best_refine_way;
    uint32_t best_refine_way_attempts;
    uint32_t best_refine_corners; /* corners_freed */
    uint32_t settled;             /* 1: the best is being made once more */
    uint32_t refine_count;        /* places around which the quads must be smaller */
    qw_refinement refine[QW_MAX_REFINEMENTS];

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
    qw_rounds rounds;     /* results of RELAX so far, where one that lost something is followed by others */
    /* WORKING */
    double faces_wanted;
    double rho;    /* mean edge length wanted, centred frame */
    double detail; /* length of the sharp edges, and what handles and holes count for, in rho; to the area in rho^2 */
    qw_working working;
    uint8_t *hold; /* QW_HOLD_, [working vertices] */
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
    uint32_t stiff_is_vain; /* a stiffer surface would have no better integers */
    /* OFFSETS, REGULAR, UPRIGHT: each its own */
    qw_offset_mesh offsets, regular, upright;
    /* QUADS */
    qw_extraction extraction;
    /* POSITIONS */
    qw_quadmesh placed;
    /* REPAIR, RELAX */
    qw_quadmesh repaired, relaxed;
    uint8_t *flipped;    /* [relaxed faces]: as in quad/untangle.h: where relaxation left a quad turned over */
    qw_losses unreached; /* what the relaxed quads do not reach, where reach_known; not kept in a dump, as only the
                            attempts after RELAX ask for it again */
    bool reach_known;
    bool topology_kept; /* repaired has the topology of the surface */
    uint32_t mended;    /* quads turned over that are so no more: then nothing else follows */
    qw_quadmesh result; /* the relaxed quads and those that were made apart; the same arrays where there are none */
    double *output;     /* double[result.vertex_count][3], in the coordinates of the input */
} qw_run_state;

/* The stages, in order, each documented in stages.c. */
#define QW_STAGE(name, title, source, weight) void qw_stage_##name(qw_run_state *run);
#include "quadwright/stages.def"
#undef QW_STAGE

/* run->surface_faces as a run with these options would have it. Needs what CLEAN leaves. */
double qw_surface_faces(const qw_run_state *run, const qw_options *options);

/* After UPRIGHT or REPAIR: whether rho should change for the count to fit; sets rho_scale. */
bool qw_adjust_count(qw_run_state *run, qw_stage finished);
/* After UPRIGHT: whether triangles are left turned over and another way to the integers is to be gone; sets way. */
bool qw_adjust_way(qw_run_state *run);
/* After REPAIR: whether the topology differs from the surface's; sets refine around where it does. */
bool qw_adjust_refinement(qw_run_state *run);
/* After RELAX: whether parts of the surface are out of the quads' reach (quad/reach.h); sets refine around them. After
   the last round, whether an earlier one left less out of reach or turned over: that is then made once more. */
bool qw_adjust_result(qw_run_state *run);

#endif
