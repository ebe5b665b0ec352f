/* The state of one run: the values that the stages hand on, in order. Each stage reads what earlier ones left and
 * writes its own part; none changes another's. What is added here, or to what is held here, needs a line in
 * run/dump.def.
 */
#pragma once

#include "base/env.h"
#include "remesh/features/verdict.h"
#include "remesh/field/orientation.h"
#include "remesh/sizes/necks.h"
#include "products/attributes/motion.h"
#include "remesh/sizes/wanted_sizes.h"
#include "remesh/field/hierarchy.h"
#include "remesh/offsets/offsets.h"
#include "geometry/bvh.h"
#include "remesh/clean/clean.h"
#include "geometry/quadmesh.h"
#include "remesh/working/working.h"
#include "whole/plan.h"
#include "remesh/quads/extract.h"
#include "whole/steering.h"
#include "whole/plane.h"

/* What the stages from SURFACE on remesh, and the quads of the small components, which were made straight from their
   triangles (whole/small.h). */
typedef struct qw_core {
    qw_trimesh mesh;             /* the clean surface's own arrays where no component is small */
    qw_census census;            /* of mesh */
    double area, extent, needed; /* of mesh, as area, extent and faces_needed of the run are of the whole surface */
    qw_quadmesh small_quads;     /* component: their numbers in the clean census */
} qw_core;

/* The finished quads together with the polygons of the input that were left out. */
typedef struct qw_joined {
    uint32_t vertex_count, face_count, corner_count; /* all 0 where nothing was left out */
    double *position;                                /* double[vertex_count][3] */
    uint32_t *face_size;                             /* uint32_t[face_count]: the quads come first */
    uint32_t *corner;                                /* uint32_t[corner_count] */
} qw_joined;

/* What the caller gave, and its clean surface. The stages from SURFACE on see the core of it only. */
typedef struct qw_whole {
    const qw_clean_input *input;
    const qw_steering *steering;
    uint8_t *left_out; /* uint8_t[faces of the input]: 1: stays as it is; NULL: none */
    qw_clean clean;
    qw_census census;
    double area;                   /* in the frame of the clean surface */
    double hidden;                 /* share of the area that other parts hide, where there are many; else 0 */
    const qw_motion_field *motion; /* made by CORE; NULL: nothing moves, or is not followed */
} qw_whole;

/* How the core of a symmetric surface becomes the whole again: whole/mirror.h. */
typedef struct qw_mirror {
    uint32_t is_used; /* flag: the core is one side of the first plane */
    uint32_t planes;  /* 0 where it is not used */
    /* in the coordinates of the input; the others are across the first and one another, along which that side was cut
       again (whole/across.h), or those of other components (whole/own_planes.h) */
    qw_mirror_plane plane[QW_MOST_CUTS];
    uint8_t *own; /* uint8_t[whole.census.components]: p + 1: it has plane p for itself; 0: none; NULL: planes are the
                     whole's */
    double far;   /* of qw_mirror_search */
    double times; /* how many quads of the result stand for one of the core, in the mean: 2 where all are
                     reflected, 4 or 8 with planes across, 1 without symmetry */
    int64_t components, boundary_loops, euler; /* of the core sewn to its reflection */
    uint8_t *about; /* uint8_t[clean_census.components]: bit p: it is reflected about plane p; 0: it has no twin;
                       NULL: all are reflected about all planes */
} qw_mirror;

typedef struct qw_run_state {
    qw_env *env;
    qw_options options;
    qw_report *report; /* written to, never read */

    /* set by the driver (run/driver.c): stages read the plan and the refinements */
    qw_plan plan;                    /* of the current attempt */
    const qw_refinement *refinement; /* qw_refinement[QW_MAX_REFINEMENTS], of which the first plan.refinements hold */

    /* CLEAN */
    qw_whole whole;
    /* CORE: what the fields remesh. Without symmetry that is all of the whole, whose arrays it shares. */
    qw_mirror mirror;
    qw_clean_input input; /* of which `clean` was made */
    qw_steering steering; /* its guides, and the region and field of the whole */
    qw_clean clean;
    qw_census clean_census;
    double area;         /* of the surface, centred frame */
    double extent;       /* sum of the diagonals of the boxes about its components */
    double faces_needed; /* the least number of quads in which all components keep their topology */
    /* SURFACE */
    qw_core core;
    qw_trimesh surface; /* the clean surface with its features marked, sharp where they were sampled; coarser where it
                           was much finer than the quads */
    qw_necks necks;     /* those with rings around them, which are marked on the surface; without their ratios */
    qw_census surface_census;
    float *circles;       /* float[surface vertices], of sizes/around.h; NULL: none is asked for */
    double surface_faces; /* the most quads that this surface is fine enough for */
    qw_bvh *tree;         /* of qw_parted_surface */
    /* WORKING */
    double faces_wanted;
    double rho; /* mean edge length wanted, centred frame */
    /* (length of the sharp edges + an allowance for each handle and hole) / area, in wanted edges: whole/sizes.c */
    double feature_density;
    qw_working working;
    uint8_t *curve_verdict; /* qw_curve_verdict, [3 working faces]: what becomes of the feature curve along an edge */
    uint8_t *constraint;    /* qw_vertex_kind, [working vertices] */
    qw_vec3 *direction;
    qw_vec3 *nested;  /* qw_vec3[working vertices]: along the rings of nests, 0 outside; NULL: there are none */
    qw_vec3 *normal;  /* smoothed at the scale of the quads */
    qw_tip_list tips; /* what sticks out of the surface, at the scale of the quads */
    float *smoothed;  /* share of the smoothing radius that was used at each vertex */
    /* HIERARCHY */
    qw_hierarchy *hierarchy; /* NULL once the orientation field is solved: a quarter of what a run holds then; a
                                position field, or another orientation field, has it built again */
    /* ORIENTATION */
    qw_vec3 *orientation;
    qw_vec3 *alignment; /* [working vertices] along which the shape wants the quads, as long as it does, 0 to 1; NULL
                           where they are not to follow it */
    /* SCALE */
    float *size; /* wanted edge length, [working vertices] */
    /* POSITION */
    qw_vec3 *lattice;
    /* REGULAR */
    uint8_t *curve_outcome; /* curve_verdict, with those that the integers have not kept */
    /* 1: the decimated complex has more triangles than quads are wanted, or lines run together; 2: it has many times as
       many (QW_MOST_DECIMATED) */
    uint32_t lacks_room;
    int64_t irregular; /* triangles that break Eq. (3): the paper's flows may leave some */
    /* INVERSIONS */
    int64_t inverted; /* triangles left inverted */
    /* one of each of OFFSETS, REGULAR, INVERSIONS */
    qw_offset_mesh offsets, regular, inversion_free;
    /* QUADS */
    qw_extraction extraction;
    /* POSITIONS */
    qw_quadmesh embedded;
    /* REPAIR, SIMPLIFY, RELAX */
    qw_quadmesh repaired, simplified, relaxed;
    uint32_t topology_kept;     /* flag: the repaired quads have the topology of the surface */
    uint8_t *flipped;           /* [relaxed faces]: qw_flip (geometry/flips.h) of each quad */
    uint32_t grown;             /* protrusions that grew in RELAX */
    const qw_bvh *working_tree; /* over the working mesh; NULL: not made yet, or read from a dump */
    uint32_t relaxed_covers;    /* flag: known that nothing is to grow out of the relaxed quads; not in dumps */
    double lacking;             /* quads that these would have taken, where room had to be made for them; else 0 */
    /* FINISH */
    qw_quadmesh fitted;
    uint32_t rims_flipped; /* quads beside the rim of a region that are flipped or have no area */
    uint32_t sides_meet;   /* flag: without symmetry 1; else: the quads have the topology of the core, and sewn to their
                              reflection that of the whole. ASSEMBLE may take it back */
    /* ASSEMBLE: in the frame of the whole */
    uint32_t sides_unlike; /* qw_unlike */
    qw_quadmesh finished;  /* the quads of the core, those of small components, the reflections of both */
    uint32_t reflected;    /* the first quad that is a reflection: finished.face_count where there is none */
    uint32_t *source;      /* uint32_t[finished.face_count]: the quad that each is or is the reflection of; NULL without
                              symmetry */
    double *output;        /* double[finished.vertex_count][3], in the coordinates of the input */
    uint32_t *rim; /* uint32_t[finished.vertex_count]: the vertex of the input that one of a rim that was kept is,
                      or QW_NONE; NULL where no rim was to be kept */
    /* What was split: its vertices come first in `finished`, and the quads of its quad f are 4^K f ... there, if it was
       split K times. No faces where nothing was split. */
    qw_quadmesh coarse;
    double *coarse_output; /* double[coarse.vertex_count][3]; NULL */
    uint32_t *creases; /* uint32_t[crease_count][2]: of what was split, or else of the result, where that was fitted to
                          its limit surface, as qw_mesh_view has them; NULL: none */
    uint32_t crease_count;
    qw_joined joined;
} qw_run_state;

/* run->surface_faces as a run with these options would have it. Needs what CLEAN leaves. */
double qw_surface_faces(const qw_run_state *run, const qw_options *options);

/* How many quads there were before they were split: that which was asked for. */
static inline uint32_t qw_unsplit_faces(const qw_run_state *run)
{
    return run->coarse.face_count ? run->coarse.face_count : run->finished.face_count;
}

/* How many quads the core is to have with those that are kept for what sticks out. */
static inline double qw_faces_with_reserve(const qw_run_state *run) { return run->faces_wanted + run->plan.reserve; }

/* How often the quads of the core are in the result. */
static inline double qw_times_used(const qw_run_state *run) { return run->mirror.times; }

/* run->surface, whose trees tell its components apart: the quads' components have the same numbers. */
qw_trimesh qw_parted_surface(const qw_run_state *run);
void qw_build_tree(qw_run_state *run); /* run->tree */
/* The same of the working mesh, with numbers in the current scope. */
qw_trimesh qw_parted_working(const qw_run_state *run);

/* The components of run->clean that the quads' vertices are of, which may be those of qw_join_small (whole/small.h):
   uint32_t[quads->vertex_count]. */
uint32_t *qw_clean_components(const qw_run_state *run, const qw_quadmesh *quads);
/* The same of the faces of the surface or of the working mesh: uint32_t[faces]. */
uint32_t *qw_clean_components_of_faces(const qw_run_state *run, const qw_trimesh *mesh);

/* A sentence for the report and the log. */
void qw_warn(qw_run_state *run, const char *text);
void qw_warn_once(qw_run_state *run, const char *text); /* unless the report says so already */
