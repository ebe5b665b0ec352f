/* What sticks out of a surface: horns, ears, fingers, fins, tails. Each is what lies around its tip, along the surface,
 * up to its neck.
 *
 * Around a point of a plane the ways at a distance r are 2 pi r long in all; around the tip of what sticks out far
 * fewer, until r reaches the neck and they grow fast. So tips are where the surface lies most to one side, and each is
 * followed to where its girth, over that of a plane, is least.
 */
#pragma once

#include "remesh/sizes/cells.h"

typedef struct qw_tip {
    qw_vec3 point;
    float length; /* from the tip to the neck, along the surface */
    float girth;  /* the mean length of a way around */
} qw_tip;

typedef struct qw_tip_list {
    uint32_t count;
    qw_tip *tip; /* qw_tip[count]: what makes more of the outline first */
} qw_tip_list;

/* What is thinner than a few edges of this length, no shorter than `shortest` and touches no boundary; in the current
   scope. surface: cells for that edge. */
qw_tip_list qw_find_tips(qw_env *env, const qw_surface_cells *surface, float edge, float shortest);

/* The tip that each vertex of any mesh of the surface belongs to, or QW_NONE: uint32_t[mesh->vertex_count], in the
   current scope. */
uint32_t *qw_tips_of_vertices(qw_env *env, const qw_trimesh *mesh, const qw_tip_list *tips);
