/* The quads around a place, taken out as a small mesh of their own: grown by rings, tried, scored against what they
 * were and put back, or dropped. All repairs of flipped quads work on windows, and none writes to the mesh otherwise.
 */
#pragma once

#include "geometry/flips.h"
#include "geometry/quad_edit.h"
#include "remesh/relax/relax_curves.h"

enum { QW_WINDOW_FACES = 256, QW_WINDOW_SEEDS = 4, QW_WINDOW_VERTICES = 4 * QW_WINDOW_FACES + QW_WINDOW_SEEDS };

/* What is wrong with quads: how many are flipped, how many may be (geometry/flips.h), how many corners are inverted. */
typedef struct qw_faults {
    int32_t flipped, doubtful, inverted;
} qw_faults;

/* Of those that are not flipped: one in doubt counts as much as its four corners. */
static inline int32_t qw_lesser_faults(qw_faults f) { return 4 * f.doubtful + f.inverted; }

/* Flipped ones are worse than any number of others. */
static inline bool qw_fewer_faults(qw_faults a, qw_faults b)
{
    return a.flipped != b.flipped ? a.flipped < b.flipped : qw_lesser_faults(a) < qw_lesser_faults(b);
}

static inline void qw_add_faults(qw_faults *sum, qw_faults f, int32_t times)
{
    sum->flipped += times * f.flipped, sum->doubtful += times * f.doubtful, sum->inverted += times * f.inverted;
}

static inline bool qw_is_faultless(qw_faults f) { return f.flipped == 0 && qw_lesser_faults(f) == 0; }

/* A mesh under repair and the surface that it lies on. */
typedef struct qw_repair_site {
    qw_env *env;
    qw_quad_edit e;
    const qw_trimesh *surface; /* vertices move on this one */
    const qw_bvh *tree;
    qw_flip_judge judge;             /* by which quads are flipped; its surface may be a finer one */
    float edge;                      /* mean length of the quads' edges */
    float least_area;                /* a quad counts as no smaller, times two */
    qw_curve_binding curves;         /* edge: NULL where no vertex is bound */
    const qw_curve_tree *all_curves; /* NULL: there are none, or none may be left */
    const uint8_t *stays;            /* uint8_t[vertices]: 1: fixed; NULL: none is */
    const qw_vec3 *home;             /* qw_vec3[vertices]: where they were at first */
    qw_vec3 *ground; /* qw_vec3[vertices]: normal of the surface where a vertex lies, 0 where that is unknown */
    uint64_t budget; /* steps left: a vertex that searches, or a quad that is judged */
    uint32_t *vertex_in, *face_in, round; /* [vertices], [faces]: the last window that each was in */
    uint32_t *number, *face_number;       /* and its number there */
} qw_repair_site;

/* Takes the steps from the budget, and more where they looked at very many triangles of the surface. */
void qw_spend(qw_repair_site *site, uint64_t steps, uint64_t looked);

/* How far vertices may go: along their own curves; or corners too, along any curve. */
typedef enum qw_freedom { QW_ON_CURVES, QW_CORNERS_SLIDE } qw_freedom;

/* FIXED: stays. BOUND: slides on its own curve. CORNER: slides on any. */
typedef enum qw_role { QW_ROLE_FIXED, QW_ROLE_FREE, QW_ROLE_BOUND, QW_ROLE_CORNER } qw_role;

typedef struct qw_window {
    qw_quadmesh quads;                                                   /* linked, in numbers of its own */
    uint32_t face[QW_WINDOW_FACES], vertex[QW_WINDOW_VERTICES];          /* numbers in the mesh */
    uint32_t begin[QW_WINDOW_VERTICES + 2], around[4 * QW_WINDOW_FACES]; /* half-edges that leave each vertex */
    uint32_t corner[4 * QW_WINDOW_FACES], twin[4 * QW_WINDOW_FACES];
    uint8_t kind[QW_WINDOW_VERTICES], mark[4 * QW_WINDOW_FACES], role[QW_WINDOW_VERTICES];
    qw_vec3 position[QW_WINDOW_VERTICES], ground[QW_WINDOW_VERTICES], home[QW_WINDOW_VERTICES];
    uint32_t edge[QW_WINDOW_VERTICES];                 /* half-edge of the surface that a BOUND vertex lies on */
    uint32_t moving[QW_WINDOW_VERTICES], moving_count; /* those that are not fixed */
    qw_freedom freedom;
    qw_faults faults;     /* of the best so far, which is saved */
    float farthest, area; /* of the first; farthest < 0: not known yet */
    float least_area;     /* share of the first's area that must be left */
    qw_vec3 saved_position[QW_WINDOW_VERTICES], saved_ground[QW_WINDOW_VERTICES];
    uint32_t saved_edge[QW_WINDOW_VERTICES];
    qw_vec3 up[QW_WINDOW_FACES], foot[QW_WINDOW_FACES]; /* scratch of the search: the surface at each quad's middle */
    uint8_t awake[QW_WINDOW_VERTICES];
} qw_window;

/* Takes the quads in so many rings around the vertices, fewer where there is no room. Those inside may move. */
void qw_window_take(qw_repair_site *site, qw_window *window, const uint32_t *seeds, uint32_t seed_count, uint32_t rings,
                    qw_freedom freedom);

/* The component of the surface that all of the window is of; QW_NONE: that is not known. */
static inline uint32_t qw_window_component(const qw_repair_site *site, const qw_window *window)
{
    return site->e.mesh.component ? site->e.mesh.component[window->vertex[0]] : QW_NONE;
}

/* What is wrong with the window, or with one of its quads, as it is now. */
qw_faults qw_window_faults_of(qw_repair_site *site, const qw_window *window, uint32_t f);

/* Whether the window has fewer faults than what is saved and has kept its shape: then it is what is saved. */
bool qw_window_keep_better(qw_repair_site *site, qw_window *window);
void qw_window_save(qw_window *window);
void qw_window_restore(qw_window *window);

/* Into the mesh. */
void qw_window_put(qw_repair_site *site, const qw_window *window);

/* ---- one quad, given by its four corners */

/* How many are inverted, against the quad itself. */
uint32_t qw_inverted_corners(const qw_vec3 *position, const uint32_t *corner);
/* Cheap, and true of all that can be flipped: a corner is inverted, the surface at a corner does not agree, or nothing
   is known of it at any. ground: as in qw_repair_site. */
bool qw_may_be_flipped(const qw_vec3 *position, const qw_vec3 *ground, const uint32_t *corner);
/* A flat quad is worse than a flipped one. ground: NULL where nothing is known. */
qw_faults qw_faults_of_quad(const qw_flip_judge *judge, const qw_vec3 *position, const qw_vec3 *ground,
                            const uint32_t *corner);

/* ---- better positions, place.c */

typedef enum qw_placing {
    QW_MEMBRANE,       /* spread out between what is fixed, then brought back onto the surface */
    QW_SEARCH,         /* vertex by vertex, from where they are */
    QW_MEMBRANE_SEARCH /* vertex by vertex, from the membrane */
} qw_placing;

/* Saves the best that is found; the window is left as saved. window->faults: of the window as it is. */
void qw_window_place(qw_repair_site *site, qw_window *window, qw_placing placing);

/* Corners that left their place go back or half the way where that is no worse; saved. */
void qw_window_put_on_curves(qw_repair_site *site, qw_window *patch);
