/* The count: quads are added or removed where the integers could not give as many as were asked for (parts thinner than
 * a quad, curves that leave no freedom, components rebuilt from triangles). The topology stays.
 */
#pragma once

#include "remesh/quads/wanted.h"

/* A new mesh in the current scope, of at least `least` quads and, if it has fewer now, of at most `most` (>= least).
   Whole chords are split as long as one fits, those first whose edges are longest, over what is wanted there (NULL: the
   same everywhere); then pairs of quads become three. There may be fewer where nothing is left to split. */
qw_quadmesh qw_add_quads(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least, int64_t most);

/* A new mesh in the current scope, with fewer chords as long as there are more than `most` quads and at least `least`
   would be left: of those that can be contracted without moving curves or making anything double, those that stretch
   the quads beside them least, over what is wanted there. */
qw_quadmesh qw_remove_chords(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least,
                             int64_t most);
