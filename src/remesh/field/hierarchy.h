/* The hierarchy of vertex graphs on which both fields are solved, coarse to fine (paper Section 3.1, after Jakob et al.
 * 2015).
 *
 * Level 0 is the working mesh; each vertex of a coarser level stands for one or two of the finer one. Positions and
 * normals are means weighted by area, but what a curve or corner holds stays there. Every level is coloured, so that
 * Gauss-Seidel can update all vertices of a colour in parallel and give the same answer at any thread count.
 */
#pragma once

#include "geometry/trimesh.h"

enum { QW_MAX_LEVELS = 40 };

typedef struct qw_level {
    uint32_t vertex_count;
    qw_vec3 *position, *normal; /* qw_vec3[vertex_count] */
    float *area;                /* float[vertex_count] */
    uint32_t *begin;            /* uint32_t[vertex_count + 1] into neighbour and weight */
    uint32_t *neighbour;        /* uint32_t[begin[vertex_count]] */
    float *weight;              /* float[begin[vertex_count]], symmetric */
    uint32_t color_count;
    uint32_t *color_begin; /* uint32_t[color_count + 1] into by_color */
    uint32_t *by_color;    /* uint32_t[vertex_count], vertices by colour */
    uint32_t *parent;      /* uint32_t[vertex_count]: vertex of the next level; NULL at the coarsest */
    uint8_t *constraint;   /* uint8_t[vertex_count], qw_vertex_kind */
    /* qw_vec3[vertex_count]: unit tangent where hold is CURVE (tilted near sharp corners), else 0 */
    qw_vec3 *direction;
} qw_level;

typedef struct qw_hierarchy {
    uint32_t level_count;
    qw_level level[QW_MAX_LEVELS]; /* 0 is the finest */
} qw_hierarchy;

/* normal: qw_vec3[vertex_count] for the finest level. hold and direction as above, or NULL for none. Allocated in the
 * caller's scope. */
qw_hierarchy qw_hierarchy_build(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const uint8_t *constraint,
                                const qw_vec3 *direction);

/* Frees all arrays of the hierarchy. */
void qw_hierarchy_free(qw_env *env, qw_hierarchy *hierarchy);

/* Runs update(user, vertex) once for each vertex of the level, colour by colour. update may write what belongs to its
   vertex and read its neighbours. */
typedef void (*qw_vertex_update)(void *user, uint32_t vertex);
void qw_level_sweep(qw_env *env, const qw_level *level, qw_vertex_update update, void *user);

/* Sets the constraint and direction of every vertex from the marked edges and, if wanted, the boundary. A vertex is
   a corner where it is a feature point, where other than two curve edges meet, or where the curve turns by more than
   `corner_angle` radians: at the vertex itself and, unless span is NULL, also between the points of the curve that are
   span[v] along it from v, so that details smaller than a quad make no corner. cut: uint8_t[vertex_count], 1 where the
   surface was cut apart: a curve between such vertices has no corners, as there are none in the whole; may be NULL. */
void qw_find_constraints(qw_env *env, const qw_trimesh *mesh, bool with_boundary, double corner_angle,
                         const float *span, const uint8_t *cut, uint8_t **constraint, qw_vec3 **direction);

/* Its last step: tilts the directions near corners sharper than half a right angle, so that the crosses along the
   two curves differ by a quarter turn there. */
void qw_open_sharp_corners(qw_env *env, const qw_trimesh *mesh, bool with_boundary, const uint8_t *constraint,
                           qw_vec3 *direction);
