/* Narrow bands: places where two constrained curves run side by side, less than one wanted length apart, as on the
 * rim of a plate or the walls of a slot.
 *
 * A row of quads has to fit between them, or the band is drawn to a line and one of its curves is lost. So lengths
 * are stretched across the band, and only across it, until it is one wanted length wide. The band then gets one row
 * of thin quads with right angles, and everything around it counts one row there instead of a fraction.
 */
#pragma once

#include "remesh/offsets/offsets.h"

/* Stretches m->real across narrow bands, for offsets that are multiplied so that about `quads` quads fit the surface.
   Returns how many triangles lie in narrow bands. */
int64_t qw_stretch_narrow_bands(qw_env *env, qw_offset_mesh *m, double quads);
