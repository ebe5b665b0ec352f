/* Chords of a quad mesh: the rows of quads that follow one another across opposite sides. Splitting one lengthwise adds
 * a row and never changes the topology. */
#pragma once

#include "geometry/quadmesh.h"

/* Length in quads of the chord through half-edge h; more than `most` where it is longer. */
int64_t qw_chord_length(const qw_quadmesh *m, uint32_t h, int64_t most);
/* Adds to `split` (uint8_t[4 face_count]) all sides of the chord through h. */
void qw_mark_chord(const qw_quadmesh *m, uint32_t h, uint8_t *split);
/* Quads of chords that cross themselves, those twice where they do. gone: uint8_t[face_count], faces to leave out; may
   be NULL. chord: uint32_t[2 face_count], to work in. Takes time in proportion to the quads. */
uint32_t qw_crossing_quads(const qw_quadmesh *m, const uint8_t *gone, uint32_t *chord);
/* Splits all chords whose sides are in `split`; where one crosses another or itself there are four quads about a new
   vertex. The mesh's arrays, which must be its own, are freed and made anew. */
void qw_split_chords(qw_env *env, qw_quadmesh *m, const uint8_t *split);
