/* A straight segment between two vertices of a layout becomes edges: others are flipped away, and where it crosses
   constrained ones a vertex is put on them. */
#pragma once

#include "remesh/meetings/layout.h"

typedef struct qw_segment {
    uint32_t start;   /* half-edge at whose corner, and into whose triangle, it leaves */
    uint32_t end;     /* vertex */
    qw_double2 to;    /* from one to the other, in the frame of the start's triangle */
    unsigned quarter; /* of that frame, nearest to it: the edges that it becomes are constrained to it */
} qw_segment;

/* Returns false where a parallel constrained edge is in the way, or too little room; the layout is to be copied back
   then. The steps of the edges that it becomes are left as they are, also where they are constrained to none. */
bool qw_make_segment(qw_env *env, qw_layout *l, qw_segment s);
