/* What one attempt of a run does otherwise than another. What an attempt was like, and which plan follows: run/retry.h.
 */
#pragma once

#include <stdint.h>

/* Why quads of one side do not suit the other: they lie farther from it, or parts that stick out are lost, as they may
   be on half of a surface. */
typedef enum qw_unlike { QW_SIDES_ALIKE, QW_OTHER_SIDE_FARTHER, QW_PARTS_LOST } qw_unlike;

/* Places around which quads are made smaller, of all retries together. */
enum { QW_MAX_REFINEMENTS = 512 };

/* All that may differ between two attempts. */
typedef struct qw_plan {
    double size_factor; /* of the wanted edge length everywhere */
    double core_faces;  /* no fewer quads are asked of the core: where so few have no room for both sides of a plane of
                           symmetry */
    double reserve;     /* quads of the count that are kept for what sticks out, and grow once all others are there */
    uint32_t plane;     /* planes of symmetry from this one on may be used */
    uint16_t room;      /* how often more room was asked for since this plane is used */
    uint16_t keeps_teeth; /* flag: triangles of a region with two edges on its rim stay as they are */
    uint32_t ringless;    /* flag: no rings are found, only those that were asked for are made */
    uint32_t refinements; /* how many of the run's refinements apply: places around which the wanted edge length is
                             smaller */
} qw_plan;
