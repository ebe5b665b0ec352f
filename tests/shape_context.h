/* A context that has run up to a stage. Include after cmocka.h. */
#ifndef QW_TESTS_SHAPE_CONTEXT_H
#define QW_TESTS_SHAPE_CONTEXT_H

#include "shapes.h"

static inline qw_context *context_of(const shape *s, int64_t faces, qw_stage last)
{
    qw_context *context;
    qw_mesh_view view = shape_view(s);
    qw_options options;
    qw_options_init(&options);
    options.faces = faces, options.symmetry = 0; /* the surface itself: no attempt goes back to another core */
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run_until(context, &options, last), QW_OK);
    return context;
}

#endif
