/* Whole offsets by way of the closed real ones: the closest closed real offsets, their decimated complex, integers
 * chosen there, the surface laid out again around them and rounded (DESIGN 2.8, way B). Position singularities never
 * arise, and the number of quads is known on the decimated complex, where another size costs next to nothing: so the
 * size is searched there.
 */
#ifndef QW_INTEGER_QUANTISE_H
#define QW_INTEGER_QUANTISE_H

#include "integer/regular.h"

typedef struct qw_quantise_counts {
    qw_regular_counts regular; /* of the decimated complex */
    uint32_t decimated_faces, decimated_edges;
    uint32_t tries;         /* sizes tried */
    int64_t released_edges; /* of curves, where two of them leave a corner on one lattice line */
    int64_t band_triangles; /* stretched, as they lie between two close curves */
    uint32_t inverted;      /* triangles of the decimated complex that the integers chosen turn over */
    double squeezed;        /* share of the surface's triangles, before they were last made stiffer */
    double rounding_cost;   /* mean of w (z - x)^2 over the decimated complex's edges */
    double energy;          /* as in qw_flatten_counts */
    uint32_t iterations;
} qw_quantise_counts;

/* Changes m->d, and m->real and m->size by the scale; m->fixed, constraint and direction where edges are released.
   stiff: takes the time to stiffen squeezed triangles until none or few are left. */
qw_quantise_counts qw_quantise(qw_env *env, qw_offset_mesh *m, double quads, bool stiff);

#endif
