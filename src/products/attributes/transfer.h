/* Attributes from the input to the quads. */
#pragma once

#include "products/attributes/uv_charts.h"

/* Fails with QW_ARGUMENT or QW_NOT_FINITE, and a sentence that names the attribute and the element, where one of them
   cannot be of a mesh with so many vertices, corners and faces. */
void qw_require_attributes(qw_env *env, const qw_attribute *attributes, uint32_t count, uint32_t vertices,
                           uint32_t corners, uint32_t faces);

/* qw_attribute[count], in the caller's scope, with all that they refer to. most_weights: 0 or 1 to QW_MOST_COMPONENTS.
 */
qw_attribute *qw_transfer_attributes(qw_env *env, const qw_source *source, const qw_quadmesh *quads,
                                     const qw_origins *origins, const qw_attribute *attributes, uint32_t count,
                                     uint32_t most_weights, qw_transfer_report *report);
