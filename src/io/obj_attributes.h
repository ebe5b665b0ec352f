/* What OBJ files hold beside positions and faces: vt, vn, colours behind the coordinates of vertices, and names. */
#pragma once

#include "io/build.h"
#include "io/text.h"

enum { QW_OBJ_OBJECT, QW_OBJ_GROUP, QW_OBJ_MATERIAL, QW_OBJ_SMOOTHING, QW_OBJ_NAMES };

typedef struct qw_obj_extras {
    qw_env *env;
    float *row[2]; /* float[rows][2] of vt, float[rows][3] of vn */
    size_t rows[2], row_capacity[2];
    uint32_t *corner; /* uint32_t[corners][2]: row of vt and of vn, or QW_NONE; NULL: no corner has named one */
    size_t corners, corner_capacity;
    float *colour; /* float[colours][3], of the first vertices; NULL: the first vertex has none */
    size_t colours, colour_capacity;
    qw_names names[QW_OBJ_NAMES];
    char *library;
    size_t library_size, library_capacity;
    bool is_broken[2]; /* a row is not of numbers, or a corner names one that is not there: they are left out */
} qw_obj_extras;

void qw_obj_take_row(qw_obj_extras *x, qw_text *t, int which); /* 0: vt, 1: vn */
/* Three or four numbers behind the coordinates; one alone is a weight. */
void qw_obj_take_colour(qw_obj_extras *x, qw_text *t, uint32_t vertex);
/* more: as in the file, from 1 or back from -1; 0: none. */
void qw_obj_take_corner(qw_obj_extras *x, uint32_t corner, const int64_t more[2]);
void qw_obj_take_library(qw_obj_extras *x, qw_word name);
/* Hands all but the names over to the soup. is_counted_on: rows are not to be trusted. */
void qw_obj_finish(qw_obj_extras *x, qw_soup *soup, bool is_counted_on);
