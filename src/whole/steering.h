/* What a caller says of how the quads are to run, beside the options. No run changes it. */
#ifndef QW_WHOLE_STEERING_H
#define QW_WHOLE_STEERING_H

#include "base/env.h"
#include "base/vec.h"

typedef struct qw_steering {
    qw_domain field_domain; /* QW_PER_VERTEX or QW_PER_FACE, of the input */
    uint32_t field_count;   /* elements; 0: there is no field */
    qw_vec3 *field;         /* qw_vec3[field_count]: one direction of each cross, of unit length, or 0 where the field
                               says nothing; NULL without a field */
    uint32_t guide_count;
    uint32_t *guide_begin; /* uint32_t[guide_count + 1]: the points of guide g are guide_begin[g] .. guide_begin[g + 1];
                              NULL without guides, as the next two */
    uint8_t *guide_kind;   /* uint8_t[guide_count], qw_guide_kind */
    uint32_t *guide_rings; /* uint32_t[guide_count]: rings wanted on each side of it; 0: none */
    double *guide_point;   /* double[guide_begin[guide_count]][3], in the input's coordinates; a closed guide ends with
                              its first point */
    qw_vec3 *motion;       /* qw_vec3[faces of the input], of products/attributes/motion.h; NULL: nothing moves */
    uint8_t *region;       /* uint8_t[faces of the input], 1: inside; NULL: all are */
} qw_steering;

#endif
