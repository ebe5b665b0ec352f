/* A run whose result is symmetric: one side of the surface is remeshed in a context of its own, and its quads are sewn
   together with their reflection. */
#ifndef QW_SYMMETRIC_H
#define QW_SYMMETRIC_H

#include "api/context.h"

/* qw_drive for options with a symmetry. */
qw_status qw_drive_symmetric(qw_context *context, const qw_options *options, qw_stage last);
/* Frees what qw_drive_symmetric keeps in the context. */
void qw_forget_half(qw_context *context);

#endif
