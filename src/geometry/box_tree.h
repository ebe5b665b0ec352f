/* Trees of axis-aligned boxes, for what encloses many primitives (bvh.h).
 *
 *     node 0 is the root; the two children of a node lie side by side at an even index, in one cache line of 64 bytes
 *     a split of the range begin..end at m puts them at 2m, 2m + 1
 *
 * so 2 * count nodes always suffice and the layout depends on the input alone. */
#pragma once

#include "base/env.h"
#include "base/vec.h"

/* Depth of the tree is less. */
enum { QW_BOX_STACK = 64 };

typedef struct qw_box {
    float lo[3];
    float hi[3];
} qw_box;

/* A box as centre and half sides needs no comparison to find how far a point is outside. */
typedef struct qw_box_node {
    float centre[3];
    uint32_t first; /* inner: index of the left child, the right one follows; leaf: first primitive */
    float half[3];  /* a little more than half the sides, for the rounding */
    uint32_t count; /* primitives of a leaf; 0: inner */
} qw_box_node;

_Static_assert(sizeof(qw_box_node) == 32, "two nodes fill a cache line");

typedef struct qw_box_tree {
    qw_box_node *nodes;
    uint32_t count; /* primitives */
    float slack2;   /* squared distance below which two points are one, for the rounding of the boxes */
} qw_box_tree;

/* order: uint32_t[count], receives the primitives in leaf order. The nodes and nothing else stay in the caller's scope.
 */
qw_box_tree qw_box_tree_build(qw_env *env, const qw_box *boxes, uint32_t count, uint32_t *order);

/* The box of one point or more. */
qw_box qw_box_of(const qw_vec3 *points, int count);

static inline float qw_min_of(float a, float b) { return a < b ? a : b; }
static inline float qw_max_of(float a, float b) { return a > b ? a : b; }
