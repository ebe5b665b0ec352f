/* What a caller says of how the quads are to run, beside the options. No run changes it. */
#pragma once

#include "base/env.h"
#include "base/vec.h"

/* A kind of guide that no caller draws, beside those of qw_guide_kind: where a joint was found. */
enum { QW_GUIDE_JOINT = QW_GUIDE_LOOP + 1 };

typedef struct qw_steering {
    qw_domain field_domain; /* QW_PER_VERTEX or QW_PER_FACE, of the input */
    uint32_t field_count;   /* elements; 0: there is no field */
    qw_vec3 *field;         /* qw_vec3[field_count]: one direction of each cross, of unit length, or 0 where the field
                               says nothing; NULL without a field */
    uint32_t guide_count;
    uint32_t *guide_begin; /* uint32_t[guide_count + 1]: the points of guide g are guide_begin[g] .. guide_begin[g + 1];
                              NULL without guides, as the next two */
    uint8_t *guide_kind;   /* uint8_t[guide_count], qw_guide_kind; of a run also QW_GUIDE_JOINT */
    uint32_t *guide_rings; /* uint32_t[guide_count]: rings wanted on each side of it; 0: none */
    double *guide_point;   /* double[guide_begin[guide_count]][3], in the input's coordinates; a closed guide ends with
                              its first point */
    qw_vec3 *motion;       /* qw_vec3[faces of the input], of products/attributes/motion.h; NULL: nothing moves */
    uint32_t joint_count;  /* closed curves in the middle of joints, of products/attributes/equal_weights.h */
    uint32_t *joint_begin; /* uint32_t[joint_count + 1]; NULL without joints, as the next */
    double *joint_point;   /* double[joint_begin[joint_count]][3] */
    uint8_t *region;       /* uint8_t[faces of the input], 1: inside; NULL: all are */
} qw_steering;
