/* The density that --density names: where it comes from, and how colours are understood. */
#pragma once

#include "quadwright/quadwright.h"

/* Paints it on the mesh of the context, which is a copy of `mesh`. from: the name of a vertex property of the mesh,
   "color", whose grey g counts as the density 8^g, black 1 and white 8; or else a text file of one density a vertex.
   On failure writes a sentence into message. */
qw_status qw_paint_density(qw_context *context, const qw_mesh *mesh, const char *from, char *message, size_t size);
