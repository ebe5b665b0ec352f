/* The density that a host has painted on the input, on the surface that is remeshed. */
#pragma once

#include "remesh/clean/clean.h"

/* At the vertices of the surface that was made of the clean one: qw_density[surface->vertex_count], in the current
   scope; NULL where none was painted. input: what was cleaned. */
qw_density *qw_painted_density(qw_env *env, const qw_clean_input *input, const qw_clean *clean,
                               const qw_trimesh *surface);

/* The same at the vertices of the clean surface. Where one was painted. */
qw_density *qw_painted_at_clean(qw_env *env, const qw_clean_input *input, const qw_clean *clean);
