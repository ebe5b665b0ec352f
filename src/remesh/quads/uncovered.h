/* Finds parts of the surface that vanished although the topology is intact, such as a finger whose cones all rounded to
 * one point. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"
#include "remesh/quads/topology.h"

/* The two triangles of each quad, and a tree over them: for several questions about the same quads. */
typedef struct qw_halves {
    qw_trimesh mesh;
    const qw_bvh *tree;
} qw_halves;
qw_halves qw_halve_quads(qw_env *env, const qw_quadmesh *quads); /* in the current scope; refers to their positions */

/* 1 where a vertex of the surface is further than `far` from every quad: uint8_t[surface->vertex_count], in the current
 * scope. */
uint8_t *qw_mark_uncovered(qw_env *env, const qw_trimesh *surface, const qw_halves *quads, float far);

/* How far points are from the nearest quad: float[count], in the current scope. */
float *qw_distances_to_quads(qw_env *env, const qw_vec3 *point, uint32_t count, const qw_halves *quads);

/* The uncovered vertices, none within half a wanted edge length of another, and the area of all of them. size:
 * float[surface->vertex_count], the wanted edge length there. */
qw_sites qw_uncovered_sites(qw_env *env, const qw_trimesh *surface, const float *size, const qw_halves *quads,
                            float far);
