/* Cross fields as text (.rosy), as other programs write them: the number of elements, the number of directions of each
 * (4), then x y z of one direction a line. What follows '#' is a comment; one that reads "# per face" or "# per vertex"
 * says what the elements are, and is written at the end, where readers that know no comments have stopped. */
#pragma once

#include "base/env.h"

typedef struct qw_rosy {
    uint32_t count;
    float *direction;          /* float[count][3], finite */
    bool per_vertex, per_face; /* said so; neither where nothing does */
} qw_rosy;

/* In the caller's scope. "-" is standard input. */
qw_rosy qw_read_rosy(qw_env *env, const char *path);
/* "-" is standard output. domain: QW_PER_VERTEX or QW_PER_FACE. */
void qw_write_rosy(qw_env *env, const char *path, qw_domain domain, const float *direction, uint32_t count);
