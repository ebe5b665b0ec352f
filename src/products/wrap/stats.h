/* What a wrap has done to its input, for the report. */
#pragma once

#include "products/wrap/skin.h"
#include "products/wrap/wrap_target.h"

typedef struct qw_wrap_stats {
    double seen_off;    /* mean distance to the skin of the part of the input that is seen, in units of the lattice */
    double skin_off;    /* the largest distance of the middle of a triangle of the skin to the input, likewise */
    double hidden_area; /* share of the input's area */
    int64_t shells;     /* components of the input of which nothing is seen: joined by their vertices */
    int64_t bridges;    /* parts of the skin that lie farther than a quarter of a cell from the input: holes and gaps */
} qw_wrap_stats;

/* touch: float[skin->face_count], distance of the middle of each triangle of the packed skin to the input. */
qw_wrap_stats qw_wrap_stats_of(qw_env *env, const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles,
                               uint32_t vertex_count, const qw_skin *skin, const qw_wrap_target *target,
                               const float *touch);

/* The share of the area of the triangles that is not seen from outside. */
double qw_hidden_area(const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles);
