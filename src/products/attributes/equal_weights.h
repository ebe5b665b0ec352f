/* Closed curves on the input on which a bone's weight is a half, as around a joint, or on which a target moves half as
 * far as it moves anything. */
#pragma once

#include "products/attributes/motion.h"

typedef struct qw_equal_weights {
    uint32_t count;
    uint32_t *begin; /* uint32_t[count + 1]: points of curve i are point[begin[i]] .. point[begin[i + 1]] */
    double *point;   /* double[begin[count]][3], in the coordinates of the input; the last of each is its first */
} qw_equal_weights;

/* Those of all QW_WEIGHTS and targets among the attributes, smooth and with few points; in the caller's scope, with
   NULL for none. Curves that end at a boundary are left out, and of targets those across which movement changes unlike.
   largest, motion: qw_largest_offsets and qw_motion_of_faces of the attributes. */
qw_equal_weights qw_find_equal_weights(qw_env *env, const qw_clean_input *input, const qw_attribute *attributes,
                                       uint32_t count, const double *largest, const qw_vec3 *motion);
