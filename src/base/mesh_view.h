/* Meshes as callers hand them in: nothing about them is believed until qw_require_view has looked at every number. */
#pragma once

#include "base/env.h"

/* Fails with QW_ARGUMENT (a wrong size stamp, a missing array, a face of fewer than three corners), QW_TOO_LARGE (more
   corners than a uint32_t counts), QW_INDEX_RANGE or QW_NOT_FINITE, and names the element. what: "mesh", "input": for
   the message. A mesh without faces passes. Returns the number of corners. */
uint32_t qw_require_view(qw_env *env, const qw_mesh_view *view, const char *what);
/* That no coordinate is beyond 1e300: what is worked on. Fails with QW_TOO_LARGE. */
void qw_require_moderate(qw_env *env, const qw_mesh_view *view, const char *what);

static inline uint32_t qw_view_face_size(const qw_mesh_view *view, uint32_t f)
{
    return view->face_sizes ? view->face_sizes[f] : view->uniform_face_size;
}

/* Texture coordinates of an attribute that differ by no more than this are the same: exporters and transforms round
   them, now on this and now on that side of an edge. */
float qw_rounding_of(const qw_attribute *a);
