/* The input as the skin sees it: the triangles that the outside comes near to, and the nearest points on them. Lengths
 * are in units of the lattice. */
#pragma once

#include "products/wrap/wrap_lattice.h"

#include "geometry/bvh.h"

/* Of a cell: how far the skin stays off the input, so that both sides of a sheet have room. */
#define QW_WRAP_OFF  (1.0 / 256)
/* Of a cell: where the skin is farther from the input it closes a gap, and lies where it should. */
#define QW_WRAP_NEAR 0.25

typedef struct qw_wrap_target {
    qw_trimesh mesh;  /* in a box of half to one: positions and corners only */
    double *normal;   /* double[mesh.face_count][3]: unit, or 0 */
    uint32_t *source; /* uint32_t[mesh.face_count]: triangle of the wrap's input */
    qw_bvh *bvh;
    uint8_t *visible; /* uint8_t[triangles of the input]: 1: the outside comes as near as a cell */
    uint32_t hidden;  /* triangles that do not: inside of others */
} qw_wrap_target;

qw_wrap_target qw_wrap_target_build(qw_env *env, const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles,
                                    uint32_t vertex_count);

typedef struct qw_touch {
    double at[3], normal[3]; /* the nearest point, and the unit normal of its triangle, either way */
    double distance;
    uint32_t face; /* of the target's mesh */
} qw_touch;

/* Units of the lattice to the frame of such trees. */
qw_vec3 qw_in_tree(const double point[3]);

/* hint: a face that may be near, or QW_NONE. Thread-safe. */
qw_touch qw_wrap_target_nearest(const qw_wrap_target *t, const double point[3], uint32_t hint);
/* A place that is nearer than `enough`, or where there is none the nearest. */
qw_touch qw_wrap_target_near(const qw_wrap_target *t, const double point[3], uint32_t hint, double enough);
