/* Closed curves on the input on which a bone's weight is a half: a joint lies there. */
#ifndef QW_PRODUCTS_ATTRIBUTES_EQUAL_WEIGHTS_H
#define QW_PRODUCTS_ATTRIBUTES_EQUAL_WEIGHTS_H

#include "base/env.h"
#include "geometry/clean_input.h"

typedef struct qw_equal_weights {
    uint32_t count;
    uint32_t *begin; /* uint32_t[count + 1]: points of curve i are point[begin[i]] .. point[begin[i + 1]] */
    double *point;   /* double[begin[count]][3], in the coordinates of the input; the last of each is its first */
} qw_equal_weights;

/* Those of all QW_WEIGHTS among the attributes, smooth and with few points; in the caller's scope, with NULL for none.
   Curves that end at a boundary are left out. */
qw_equal_weights qw_find_equal_weights(qw_env *env, const qw_clean_input *input, const qw_attribute *attributes,
                                       uint32_t count);

#endif
