/* A fill of triangles that closes a boundary loop: as small as it can be, then refined to the lengths of the loop's
 * edges and smoothed so that it goes on as the surface around it does (Liepa 2003; Kobbelt et al. 1998). */
#pragma once

#include "base/env.h"
#include "base/vec.h"

/* The loop, counter-clockwise as the fill sees it, and what the surface beside it has. */
typedef struct qw_hole_rim {
    uint32_t count;
    const qw_vec3 *position; /* qw_vec3[count] */
    const qw_vec3 *beside;   /* qw_vec3[count]: sum of the neighbours of each that are not on the loop */
    const uint32_t *degree;  /* uint32_t[count]: how many these are */
    bool (*is_joined)(const void *user, uint32_t a, uint32_t b); /* whether an edge of the surface joins two of them */
    const void *user;
} qw_hole_rim;

typedef struct qw_hole_fill {
    uint32_t vertex_count, face_count; /* the first vertices are the loop's */
    qw_vec3 *position;                 /* qw_vec3[vertex_count] */
    uint32_t *corner, *twin;           /* uint32_t[3 face_count]; twin: QW_NONE along the loop */
    size_t vertex_capacity, corner_capacity, twin_capacity;
    double area; /* of the triangles that close the loop, before any was split */
} qw_hole_fill;

/* In the current scope. */
qw_hole_fill qw_make_hole_fill(qw_env *env, const qw_hole_rim *rim);
