/* Integer offsets by way of the closest closed real offsets: these are found first (closed.h), then their decimated
   complex (decimated.h); integers are chosen there (search.h); the surface is laid out around them and rounded
   (flatten.h). No position singularity can arise. The number of quads is known on the decimated complex, where
   trying another size costs next to nothing, so the size is searched there. */
#pragma once

#include "remesh/quantise/regular.h"

typedef struct qw_quantise_counts {
    qw_regular_counts regular; /* of the decimated complex */
    uint32_t decimated_faces, decimated_edges;
    uint32_t tries;         /* sizes tried */
    int64_t released_edges; /* edges of feature curves that were freed, where two of them leave a corner along one
                               lattice line */
    int64_t band_triangles; /* triangles that were stretched, as they lie in narrow bands */
    uint32_t inverted;      /* triangles of the decimated complex that the chosen integers invert */
    double squeezed;        /* share of the surface's triangles, before they were last made stiffer */
    double rounding_cost;   /* mean of w (z - x)^2 over the decimated complex's edges */
    double energy;          /* as in qw_flatten_counts */
    uint32_t iterations;
} qw_quantise_counts;

typedef struct qw_quantise_request {
    double quads;
    double times;         /* as in base/promise.h */
    double loops, follow; /* the options; loops 0 leaves lines as they fall, follow 0 sizes as they are */
    uint8_t *verdict;     /* uint8_t[3 face_count] or NULL: see acute_corners.h */
} qw_quantise_request;

/* Changes m->d; m->real and m->size by the scale; m->fixed, constraint and direction where edges are freed. */
qw_quantise_counts qw_quantise(qw_env *env, qw_offset_mesh *m, const qw_quantise_request *request);
