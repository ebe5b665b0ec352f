/* A triangle mesh that can be edited: split, flip and collapse an edge, each O(valence), topology kept.
 *
 *     half-edge h = 4 f + i of face f goes from corner[i] to corner[(i + 1) % 3]; 4 f + 3 is never used
 *
 * A face and a vertex are 32 bytes each, so that what an operation reads of one lies in one cache line. Dead slots stay
 * until qw_edit_pack renumbers everything along a space-filling curve. Nothing here looks at geometry or decides
 * anything: whether an operation is wanted is the caller's business (remesh/working/working.c); whether it is a legal
 * one can be asked of the two `can` functions.
 */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_edit_vertex {
    qw_vec3 position;
    float target;
    uint32_t out;   /* an outgoing half-edge, on the boundary the one without twin; QW_NONE: dead */
    uint32_t home;  /* half-edge of the input mesh (3 f + i): free vertices lie in its face, curve vertices on it, and
                       corners are its tail */
    uint32_t seen;  /* scratch of qw_edit_can_collapse */
    uint16_t block; /* of vertices that lay together when last packed; new ones are in that of a neighbour */
    uint8_t kind;   /* qw_vertex_kind */
    uint8_t inner;  /* scratch of remesh/working/mesh_blocks.h */
} qw_edit_vertex;

typedef struct qw_edit_face {
    uint32_t corner[3]; /* corner[0] == QW_NONE: dead */
    uint32_t twin[3];   /* half-edge or QW_NONE */
    uint8_t mark[3];
} qw_edit_face;

typedef struct qw_edit {
    qw_env *env;
    qw_edit_vertex *vertex; /* qw_edit_vertex[vertex_capacity], vertex_count in use, dead ones among them */
    qw_edit_face *face;     /* qw_edit_face[face_capacity], face_count in use, dead ones among them */
    size_t vertex_capacity, face_capacity;
    uint32_t vertex_count, face_count;
    uint32_t live_vertices, live_faces;
    uint32_t round;       /* of `seen` */
    uint32_t block_count; /* 0: never packed */
} qw_edit;

static inline uint32_t qw_edit_next(uint32_t h) { return (h & 3) == 2 ? h - 2 : h + 1; }
static inline uint32_t qw_edit_prev(uint32_t h) { return (h & 3) == 0 ? h + 2 : h - 1; }
static inline uint32_t qw_edit_tail(const qw_edit *e, uint32_t h) { return e->face[h >> 2].corner[h & 3]; }
static inline uint32_t qw_edit_head(const qw_edit *e, uint32_t h) { return qw_edit_tail(e, qw_edit_next(h)); }
static inline uint32_t qw_edit_apex(const qw_edit *e, uint32_t h) { return qw_edit_tail(e, qw_edit_prev(h)); }
static inline uint32_t qw_edit_twin(const qw_edit *e, uint32_t h) { return e->face[h >> 2].twin[h & 3]; }
static inline uint8_t qw_edit_mark(const qw_edit *e, uint32_t h) { return e->face[h >> 2].mark[h & 3]; }
/* The next outgoing half-edge counter-clockwise around the tail, or QW_NONE past the last. */
static inline uint32_t qw_edit_around(const qw_edit *e, uint32_t h) { return qw_edit_twin(e, qw_edit_prev(h)); }
static inline bool qw_edit_on_curve(const qw_edit *e, uint32_t h)
{
    return qw_edit_twin(e, h) == QW_NONE || qw_edit_mark(e, h) != 0;
}
static inline bool qw_edit_dead(const qw_edit *e, uint32_t f) { return e->face[f].corner[0] == QW_NONE; }

/* home of each vertex is outgoing[v], kind is FREE. The arrays belong to the current scope. outgoing:
 * uint32_t[mesh->vertex_count]. */
qw_edit qw_edit_open(qw_env *env, const qw_trimesh *mesh, const float *target, const uint32_t *outgoing);
/* The same, packed as by qw_edit_pack: vertex v of the mesh is vertex (*rank)[v], uint32_t[mesh->vertex_count]. */
qw_edit qw_edit_open_packed(qw_env *env, const qw_trimesh *mesh, const float *target, const uint32_t *outgoing,
                            uint32_t **rank);

/* Puts a vertex on the edge; both halves keep its marks, and the vertex is CURVE where the edge lies on a curve.
   Returns the vertex; the half-edge h then ends there. */
uint32_t qw_edit_split(qw_edit *e, uint32_t h, qw_vec3 position, float target, uint32_t home);
/* Puts a FREE vertex into the face and returns it. */
uint32_t qw_edit_split_face(qw_edit *e, uint32_t f, qw_vec3 position, float target, uint32_t home);

/* The other diagonal is no edge yet. h must have a twin. */
bool qw_edit_can_flip(const qw_edit *e, uint32_t h);
/* h becomes the edge between the two apices, from the twin's to its own. */
void qw_edit_flip(qw_edit *e, uint32_t h);

/* Whether the edge can shrink to a point and the surface stays one: the link condition, boundary included; no closed
   curve, boundary loops included, is left with fewer than three edges. */
bool qw_edit_can_collapse(qw_edit *e, uint32_t h);
/* Draws `gone`, the tail or the head of h, into the other end, which stays as it is. */
void qw_edit_collapse(qw_edit *e, uint32_t h, uint32_t gone);

/* The half-edge from a to b, or from b to a where only that is there; QW_NONE: they are not joined. */
uint32_t qw_edit_between(const qw_edit *e, uint32_t a, uint32_t b);

/* Drops dead slots and renumbers vertices in Morton order, faces after their vertices. Half of all in a row are a
   block, but no fewer and no more than these: small ones have more at their seams, few ones leave threads idle. */
enum { QW_EDIT_BLOCK_LEAST = 512, QW_EDIT_BLOCK_MOST = 4096, QW_EDIT_BLOCKS = 1 << 16 };
void qw_edit_pack(qw_edit *e);
/* The packed mesh as arrays of the current scope. *target: float[vertex_count]. mark is NULL where no edge has one. */
qw_trimesh qw_edit_close(qw_edit *e, float **target);
/* The mesh as it is, where nothing was collapsed: old vertices and faces keep their numbers. Its arrays are kept for
   the scope outside the current one. point: uint8_t[points] of the first vertices; may be NULL. */
qw_trimesh qw_edit_plain(const qw_edit *e, const uint8_t *point, uint32_t points);
