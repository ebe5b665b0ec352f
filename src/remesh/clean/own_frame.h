/* Frames of their own for components that single precision would flatten.
 *
 * The centred frame has diagonal 1, and in it single precision resolves about 6e-8. A component that is hardly wider
 * than that anywhere would be made of quads whose corners fall together. Such a component is taken out of its place and
 * enlarged along its own axes, from the double precision of the input, until it can be resolved. It goes to a slot
 * beside the frame's box, so that its vertices tell by where they lie that they belong there, and on the way out each
 * is taken back.
 */
#pragma once

#include "base/vec.h"
#include "remesh/clean/sheets.h"

typedef struct qw_own_frame {
    double center[3];  /* of the component, in the centred frame */
    double axis[3][3]; /* orthonormal and right-handed, the longest extent of the component first */
    double stretch[3]; /* along each axis: at least 1 */
} qw_own_frame;

typedef struct qw_own_frames {
    uint32_t count;
    qw_own_frame *frame; /* qw_own_frame[count], one a slot; the scope of the clean surface */
} qw_own_frames;

/* Drops components of which no triangle has an area in the precision of its coordinates, unless all are so. offset:
   largest coordinate of the input in lengths of the frame, at least 1. *first: a polygon of the file whose component
   went. Returns how many were dropped. s has components. */
uint32_t qw_drop_flat_components(qw_env *env, qw_sheets *s, double offset, uint32_t *first);

/* Finds the components that need a frame of their own and moves their vertices in position, qw_vec3[s->vertex_count],
   into their slots. */
qw_own_frames qw_take_own_frames(qw_env *env, const qw_sheets *s, qw_vec3 *position);

/* Whether p lies in a slot; then sets q to its place in the centred frame. */
bool qw_leave_own_frame(const qw_own_frames *own, qw_vec3 p, double q[3]);

/* The slot that p lies in, or QW_NONE; and the place in a slot of a point q of the centred frame. */
uint32_t qw_own_frame_of(const qw_own_frames *own, qw_vec3 p);
qw_vec3 qw_enter_own_frame(const qw_own_frames *own, uint32_t slot, const double q[3]);

/* Whether twice the area of face f exceeds what the rounding of its written coordinates can make. */
bool qw_face_has_area(const qw_sheets *s, uint32_t f, double offset);
