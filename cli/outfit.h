/* What the quads of a run wear in a file: attributes carried over from the input, normals, labels of holes that were
 * closed, texture coordinates of their own, maps on these. */
#pragma once

#include "args.h"

typedef struct qw_outfit {
    qw_attribute *list; /* qw_attribute[count]: what they point to is the context's */
    uint32_t count;
    bool has_transfer, has_asset;
    qw_transfer_report transfer;
    qw_asset_report asset;
} qw_outfit;

/* Fills an outfit that is all 0 with what the arguments ask for; input: NULL: nothing is carried over. What went wrong
   is the context's message. To be taken off in failure too. */
qw_status qw_dress(qw_context *context, const qw_arguments *arguments, const qw_mesh *input, qw_outfit *outfit);
/* Frees the list; the reports stay. */
void qw_undress(qw_outfit *outfit);
