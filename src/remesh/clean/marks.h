/* Edges that the input marks as sharp, found again on the clean surface. */
#pragma once

#include "geometry/clean_input.h"
#include "geometry/trimesh.h"

/* Marks the interior edges that lie where input->mark says, by the places of their ends. Returns their number.
 * Allocates mesh->mark. */
int64_t qw_take_marks(qw_env *env, const qw_clean_input *input, const qw_frame *frame, qw_trimesh *mesh);
/* The same beside the marks that mesh has. Returns how many came to them. */
int64_t qw_add_marks(qw_env *env, const qw_clean_input *input, const qw_frame *frame, qw_trimesh *mesh);

/* The places of the vertices at which marks end, to be asked for. */
typedef struct qw_mark_ends {
    uint64_t *key; /* the caller's scope */
    size_t count;
} qw_mark_ends;
qw_mark_ends qw_find_mark_ends(qw_env *env, const qw_clean_input *input, const qw_frame *frame);
bool qw_is_mark_end(const qw_mark_ends *ends, qw_vec3 place);
