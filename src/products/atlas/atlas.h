/* Texture coordinates for a mesh: charts, each laid flat and turned so that rows of quads run along the axes, packed.
 */
#pragma once

#include "products/atlas/pack.h"
#include "products/atlas/seams.h"

typedef struct qw_atlas_options {
    double most_stretch; /* of a chart in the mean: charts.h */
    double focus;        /* 0 to 1: how far charts of smaller quads are larger */
    qw_pack_options pack;
    const double *weight;   /* double[corner_count]: seams to be avoided: charts.h; may be NULL */
    const uint32_t *mirror; /* uint32_t[corner_count]: charts.h; may be NULL */
} qw_atlas_options;

typedef struct qw_atlas {
    float *uv;       /* float[corner_count][2]: whole multiples of 2^-QW_UV_BITS; tile t begins at u = t */
    uint32_t *chart; /* uint32_t[face_count] */
    uint32_t charts, patches;
    uint32_t overlapping; /* charts with an inverted triangle, or whose boundary crosses itself, exactly */
    double angle, area;   /* stretch: mean of s1 / s2, and of the larger of s1 s2 and 1 / (s1 s2), over all charts */
    double seam_length;   /* in space, boundaries of the mesh left out */
    qw_packing packing;
} qw_atlas;

enum { QW_UV_BITS = 20 };

/* In the caller's scope; sets the seams of the mesh. */
qw_atlas qw_make_atlas(qw_env *env, qw_atlas_mesh *mesh, const qw_atlas_options *options);
