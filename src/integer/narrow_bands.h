/* Narrow bands: places where two constrained curves run side by side less than one wanted length apart, as on the rim
 * of a plate or the walls of a slot.
 *
 * A row of quads has to fit between them, or the band is drawn to a line and one of its curves is lost. So the metric
 * is stretched across the band, and only across it, until the band is one length wide: the row has thin quads with
 * right angles, and all around it sees one row and not the part of one that the width would ask for.
 */
#ifndef QW_INTEGER_NARROW_BANDS_H
#define QW_INTEGER_NARROW_BANDS_H

#include "integer/offsets.h"

/* Stretches m->real across narrow bands, for offsets that are multiplied so that about `quads` quads fit the surface.
   Returns how many triangles lie in narrow bands. */
int64_t qw_stretch_narrow_bands(qw_env *env, qw_offset_mesh *m, double quads);

#endif
