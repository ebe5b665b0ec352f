/* When a face counts as flipped: the one predicate, and the limits that `measure` and repairs apply it with.
 *
 * A face is flipped when most of its area opposes the nearest normal of the surface and next to nothing of the surface
 * near by agrees with it: on a wall thinner than an edge the nearest point may well lie on the other side.
 */
#pragma once

#include "geometry/bvh.h"

/* Cosines between the normals of a face and of the surface: below the first they oppose, above the second they agree.
 */
#define QW_FLIP_OPPOSES (-QW_SAME_SHEET)
#define QW_FLIP_AGREES  QW_SAME_SHEET

typedef struct qw_flip_limits {
    float share;        /* of the face's area that opposes, more than this */
    float reach;        /* mean edges within which something would have to agree */
    float alone;        /* of the face's area that must find nothing that agrees, at least */
    float sliver_patch; /* squares of the mean edge: what agrees and is smaller does not count; 0: all counts */
} qw_flip_limits;

/* What `measure` reports. A fifth of a face may agree by chance, as others measure at a few random points of each. */
static const qw_flip_limits QW_FLIP_MEASURED = {0.6f, 1.0f, 0.8f, 0};
/* What is repaired: by a margin more, as measures that take samples miss small bits of surface that agree, and scans
 * have single triangles that face any way. */
static const qw_flip_limits QW_FLIP_CERTAIN = {0.6f, 0.8f, 0.5f, 0.1f};
/* What may be flipped by the samples of another measure: repaired where that costs no area. */
static const qw_flip_limits QW_FLIP_POSSIBLE = {0.3f, 0.4f, 0.5f, 0.1f};

/* QW_FLIPPED is certain, QW_DOUBTFUL possible. */
typedef enum qw_flip { QW_NOT_FLIPPED, QW_DOUBTFUL, QW_FLIPPED } qw_flip;

typedef struct qw_flip_judge {
    const qw_trimesh *surface; /* twins are needed for limits with a sliver patch only */
    const qw_vec3 *normal;     /* qw_vec3[surface->face_count], unit; NULL: of the triangles */
    const uint8_t *both;       /* uint8_t[surface->face_count]: 1: agrees with either side; NULL: none does */
    const qw_bvh *tree;        /* of the surface */
    float edge;                /* mean edge length of the faces that are judged */
    uint64_t *effort;          /* faces of the surface that were looked at are added here; NULL: they are not counted */
} qw_flip_judge;

/* Whether a face is flipped that is cut into `count` triangles: corner[3 count] into position. hint: a triangle of the
   surface that may be near, or QW_NONE; replaced by the last one that was. */
bool qw_is_flipped(const qw_flip_judge *judge, const qw_vec3 *position, const uint32_t *corner, uint32_t count,
                   const qw_flip_limits *limits, uint32_t *hint);

/* Of the quad with these four corners, cut from the first to the third. */
qw_flip qw_flip_of_quad(const qw_flip_judge *judge, const qw_vec3 *position, const uint32_t *corner);
