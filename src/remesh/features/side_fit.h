/* A smooth side of a surface as a quadric: a height over its plane, fitted to the vertices of one side near a point. */
#pragma once

#include "remesh/features/sides.h"

enum { QW_FIT_TERMS = 6 };
typedef struct qw_side_fit {
    qw_vec3 origin, x, y, n;
    float unit;                /* of lengths */
    double term[QW_FIT_TERMS]; /* height: 1, x, y, x x, x y, y y */
} qw_side_fit;

/* At vertex v, to what edges lead to without crossing a barred one, uint8_t[3 face_count]. A plane where that does
   nearly as well. ring: uint8_t[vertex_count]: what has a low number is only taken where there is too little else. */
qw_side_fit qw_fit_side(const qw_sides *s, uint32_t v, const uint8_t *barred, const uint8_t *ring);

/* The point that lies on all of up to three sides, nearest to the one given; as nearly as can be where two of them are
   nearly parallel. */
qw_vec3 qw_meet_sides(const qw_side_fit *const *fit, int count, qw_vec3 from);

/* Height of a point over the side, and the unit normal there. */
double qw_height_over(const qw_side_fit *fit, qw_vec3 point);
qw_vec3 qw_normal_of(const qw_side_fit *fit, qw_vec3 point);
