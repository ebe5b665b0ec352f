/* From triangles connected in any way to an oriented manifold: which sides meet at each edge, which way each face is
 * turned, and which corners share a vertex. qw_clean_surface calls these in the order they stand here. */
#pragma once

#include "geometry/edges.h"

/* QW_FACE_BOTH: the file has the face from both sides, as often the one as the other, so that it may be turned either
 * way. */
enum qw_face_fate { QW_FACE_DROPPED = 1, QW_FACE_BOTH = 2 };

typedef struct qw_sheets {
    uint32_t vertex_count, face_count;
    double *position; /* double[point_count][3], centred frame */
    uint32_t point_count;
    uint32_t *point; /* uint32_t[vertex_count]: the position of each vertex; NULL until qw_split_fans: its own number */
    uint32_t *corner; /* uint32_t[3 face_count] */
    uint32_t *source; /* uint32_t[face_count]: polygon of the file */
    /* uint32_t[3 face_count], half-edge or QW_NONE; may join sides of the same direction until oriented */
    uint32_t *twin;
    /* uint32_t[3 face_count]: the vertices of the corners as the file names them, and numbers from `names` on where
       edges were split; NULL: all corners are apart there, or nothing was joined */
    uint32_t *named, names;
    uint32_t *sheet; /* uint32_t[face_count]: the same for those that hang together by vertices of the file; NULL until
                        qw_find_double_layers */
    uint64_t *layered; /* uint64_t[layers]: pairs of sheets that lie on one another, sorted */
    size_t layers;
    uint32_t apart;                  /* sides that were not paired, as they lie on one another */
    uint8_t *kind;                   /* uint8_t[face_count]: 0 or QW_FACE_BOTH; NULL until qw_pair_sides */
    uint32_t *component, components; /* uint32_t[face_count]: of each face, as qw_label_components has them; NULL until
                                        qw_orient_sheets */
} qw_sheets;

/* Cosines of the angle between two faces at a line below which they lie on one another there. */
typedef struct qw_fold_limits {
    double agreeing;    /* of sides that run in opposite directions, as those of one surface do */
    double disagreeing; /* of sides of the same direction */
} qw_fold_limits;
/* Whether the faces of a and b, which run along one line, lie on one another there instead of going on from one
   another. */
bool qw_fold_back(const qw_sheets *s, uint32_t a, uint32_t b, const qw_fold_limits *limits);
/* Whether the sheets of the file that these are of are listed as layers. */
bool qw_are_layered(const qw_sheets *s, uint32_t a, uint32_t b);
/* Either, for sides that have both vertices in common now and had not in the file. */
bool qw_stay_apart(const qw_sheets *s, uint32_t a, uint32_t b);

/* Whether the file has both sides between the same vertices. */
bool qw_is_named_alike(const qw_sheets *s, uint32_t a, uint32_t b);
/* Sets sheet, and layered to the pairs of which a good part of one lies on faces of the other, or most of it where
   neither has sides that nothing closes. edges: of the faces as they are. */
void qw_find_double_layers(qw_env *env, qw_sheets *s, const qw_edges *edges);

/* Drops faces that repeat a vertex; returns their number. */
uint32_t qw_drop_degenerate(qw_sheets *s);
/* Marks as dropped all but one of the faces with the same three vertices, and small flaps altogether: faces that lie on
   one another in opposite directions and hang on a surface that is complete without them. Sheets that lie on one
   another with some of their faces lose none. kind: uint8_t[face_count], zeroed. Returns the number dropped. */
uint32_t qw_find_duplicates(qw_env *env, const qw_sheets *s, const qw_edges *edges, uint8_t *kind);
/* Drops duplicates and sets twin and kind. Where more than two sides meet at an edge, those stay paired that are so in
   the file; others of opposite direction are paired by the widest angle, then those of faces that may be turned either
   way, and what is left becomes boundary; so do sides that stay apart. Sets `apart`.
   *nonmanifold: the number of such edges. Returns the number of faces dropped. */
uint32_t qw_pair_sides(qw_env *env, qw_sheets *s, const qw_edges *edges, uint32_t *nonmanifold);
/* What orienting changed. */
typedef struct qw_oriented {
    uint32_t seams;      /* edges that were cut, as a component is one-sided */
    uint32_t triangles;  /* flipped in all */
    uint32_t alone;      /* of these, flipped to agree with their neighbours */
    uint32_t components; /* closed ones flipped as a whole, as they were inside out */
} qw_oriented;

/* Turns neighbours alike, closed components outward unless all are inside out, open ones, and without `outward` closed
   ones too, as most of their area was. Cuts the edges where that cannot be (one-sided components). */
qw_oriented qw_orient_sheets(qw_env *env, qw_sheets *s, bool outward);
/* Gives every fan of faces around a vertex a vertex of its own and drops vertices without faces. Sets point and
   vertex_count. Returns the number of vertices added. */
uint32_t qw_split_fans(qw_env *env, qw_sheets *s);
/* Drops the other faces, and the vertices that only they have; numbers of components stay as they were. kept:
   uint8_t[face_count]. After qw_split_fans. */
void qw_keep_faces(qw_env *env, qw_sheets *s, const uint8_t *kept);
/* Drops components of less than this share of the whole area, but never the largest, and the vertices that only they
   have. Returns their number. After qw_split_fans. */
uint32_t qw_drop_small_components(qw_env *env, qw_sheets *s, double least_share);
/* Cutting may leave two edges between the same two vertices. Splits all but one of such edges, and their faces, in the
   middle, so that two vertices tell an edge again. Returns the number of edges split. */
uint32_t qw_split_parallel_edges(qw_env *env, qw_sheets *s);
