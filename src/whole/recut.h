/* Rims that are cut anew (region_rim free). Between corners the rim of a region gets vertices as far apart as the quads
 * are long; the polygons around it are split where it gets more, and lose what shrinks to nothing where it gets fewer.
 * Vertices that stay are those of the input, with all their digits. Where a polygon around would turn over or meet
 * itself, the rim keeps more of its vertices there, at last all of them. Geometry and numbers alone: whole/kept_rims.h
 * says when. */
#pragma once

#include "whole/rim_weld.h"

typedef struct qw_recut {
    /* of the rims: loops as those that came in, of vertices of the input, or from input->vertex_count on of `made` */
    uint32_t *begin, *vertex;
    /* double[begin[count]]: where each lies along the old loop, in its edges; it may lie before the first. */
    double *along;
    uint32_t made_count;
    double *made; /* double[made_count][3] */
    /* of the polygons that were left out, in their order, of which some are several now and some are gone */
    uint32_t face_count;
    uint32_t *face_begin; /* uint32_t[face_count + 1] */
    uint32_t *source;     /* uint32_t[face_count]: the polygon of the input */
    uint32_t *corner;     /* uint32_t[face_begin[face_count]]: vertices as above */
    uint32_t *origin;     /* of each corner: that of the input which it comes from */
} qw_recut;

/* edge: how far apart the vertices are to be, in the input's units. In the current scope. */
qw_recut qw_recut_rims(qw_env *env, const qw_clean_input *input, const uint8_t *left_out, const qw_old_rims *rims,
                       double edge);
