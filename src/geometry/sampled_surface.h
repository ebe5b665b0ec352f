/* A polygon mesh as triangles, for figures that are found by sampling. */
#pragma once

#include "base/hash.h"
#include "geometry/bvh.h"
#include "geometry/polygons.h"

typedef struct qw_surface {
    qw_trimesh mesh;      /* position, corner and the counts only */
    uint32_t *face_begin; /* uint32_t[polygons + 1]: the triangles of each polygon */
    double *area_end;     /* double[mesh.face_count]: area of this and all earlier triangles, in the frame */
    qw_vec3 *normal;      /* qw_vec3[mesh.face_count], unit */
    uint8_t *used;        /* uint8_t[mesh.vertex_count]: a corner of some triangle */
    qw_bvh *bvh;
} qw_surface;

/* Quads are cut into fans, and all polygons as cleaning does it where there are any; triangles without an area are left
   out. face_begin: uint32_t[face_count + 1], the corners of each face. The arrays belong to the current scope. */
qw_surface qw_surface_make(qw_env *env, const qw_mesh_view *view, const uint32_t *face_begin, const qw_frame *frame);
/* The edges of the triangles; view: the mesh that the surface was made of. */
qw_polygon_edges qw_surface_edges(qw_env *env, const qw_surface *s, const qw_mesh_view *view);

static inline double qw_surface_area(const qw_surface *s, uint32_t t)
{
    return s->area_end[t] - (t ? s->area_end[t - 1] : 0);
}

/* u, v: not negative, u + v at most 1. */
qw_vec3 qw_surface_point(const qw_surface *s, uint32_t triangle, float u, float v);

/* First index whose running sum is above x. */
uint32_t qw_find_in(const double *sums, uint32_t count, double x);

/* The k-th number of sample i, 0 to 1. */
static inline double qw_hashed(uint32_t i, uint32_t k)
{
    return (double)(qw_mix((uint64_t)k << 32 | i) >> 11) * 0x1p-53;
}
