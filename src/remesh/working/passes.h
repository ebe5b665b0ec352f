/* Passes over a surface that is reshaped to target lengths: in each every face or vertex is looked at once. The blocks
 * of remesh/working/mesh_blocks.h do theirs on threads, what lies between blocks is done on one, in the same order at
 * any thread count. */
#pragma once

#include "remesh/working/reshape.h"

typedef struct qw_pass {
    qw_env *env;
    double from, to; /* what is told of the progress at its beginning and at its end */
} qw_pass;

/* Lengths are in the target lengths at the edge. */
static inline float qw_edge_ratio2(const qw_edit *e, uint32_t h)
{
    uint32_t a = qw_edit_tail(e, h), b = qw_edit_head(e, h);
    float target = qw_edge_target(e, a, b);
    return qw_edge_length2(e, a, b) / (target * target);
}

/* Each edge once: the half-edge without twin, or the greater of the two. */
static inline bool qw_is_first_side(const qw_edit *e, uint32_t h)
{
    uint32_t t = qw_edit_twin(e, h);
    return t == QW_NONE || t < h;
}

/* The half-edge of the face that is longest, and the square of its length. */
uint32_t qw_longest_edge(const qw_edit *e, uint32_t f, float *longest2);

/* Each returns how many operations it did. Collapses edges shorter than `below` unless one longer than `longest` would
   arise. */
uint32_t qw_collapse_pass(qw_reshape *r, float below, float longest, qw_pass p);
/* Splits edges longer than `above`, the longest of their faces first. */
uint32_t qw_split_pass(qw_reshape *r, float above, qw_pass p);
/* Flips edges toward Delaunay. */
uint32_t qw_flip_pass(qw_reshape *r, qw_pass p);
/* Moves free vertices to the middle of their neighbours, on the surface. */
void qw_smooth_pass(qw_reshape *r, qw_pass p);
/* Removes faces that are nearly segments. */
void qw_sliver_pass(qw_reshape *r, qw_pass p);

/* Splits what joins two curves across a face: chords that are long enough for it, the longest side of faces that would
   have all three corners or two sides on curves, and, failing that, the face. */
void qw_free_faces(qw_reshape *r, qw_pass p);
/* A curve from corner to corner gets a vertex in between: the cross there follows the curve, while that of a corner
   can't follow all of the curves that meet in it. */
void qw_split_short_curves(qw_reshape *r, qw_pass p);
/* Splits edges between two curves that are longer than half a target. */
void qw_split_between_curves(qw_reshape *r, qw_pass p);
