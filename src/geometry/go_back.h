/* Vertices go back to where they were, half the way or all of it, where a quad around them became worse. */
#pragma once

#include "geometry/quadmesh.h"

typedef struct qw_going_back {
    const qw_quadmesh *quads;
    bool at_once; /* all the way; else half of it, a quarter, an eighth, and then all */
    void *user;
    /* Sets uint8_t[quads->face_count], which are 0, to 1. */
    void (*judge)(qw_env *env, void *user, uint8_t *is_worse);
    void (*put)(void *user, uint32_t v, float share); /* of the way from where v was at first */
} qw_going_back;

/* Judges and takes back until no quad is worse that has a vertex left to take back; false after too many rounds.
   went_back: uint8_t[quads->vertex_count], 1: not all the way to where it was to go; NULL: not wanted. */
bool qw_go_back(qw_env *env, const qw_going_back *g, uint8_t *went_back);

/* Takes back so much of the way from `before` to quads->position, qw_vec3[quads->vertex_count] both, that no corner of
   a quad becomes inverted or flipped. Returns how many vertices were held back. */
uint32_t qw_hold_back_flips(qw_env *env, qw_quadmesh *quads, const qw_vec3 *before);
