/* Quad meshes as they leave extraction. Half-edge h = 4 f + i goes from corner[h] to corner[4 f + (i + 1) % 4]. */
#pragma once

#include "base/env.h"
#include "geometry/trimesh.h"

typedef struct qw_quadmesh {
    uint32_t vertex_count, face_count;
    qw_vec3 *position; /* qw_vec3[vertex_count] */
    uint32_t *corner;  /* uint32_t[4 face_count] */
    uint32_t *twin;    /* uint32_t[4 face_count], half-edge or QW_NONE; NULL until linked */
    uint8_t *kind;     /* uint8_t[vertex_count], qw_vertex_kind: where a vertex may go when the mesh is relaxed; may be
                          NULL: all free */
    /* uint8_t[4 face_count], QW_MARK_FEATURE on edges that lie on a sharp edge of the input; may be NULL */
    uint8_t *mark;
    /* uint32_t[vertex_count]: component of the working mesh that the vertex came from; may be NULL */
    uint32_t *component;
} qw_quadmesh;

static inline uint32_t qw_quad_next(uint32_t h) { return (h & ~3u) | ((h + 1) & 3u); }
static inline uint32_t qw_quad_across(uint32_t h) { return (h & ~3u) | ((h + 2) & 3u); } /* the opposite side */
static inline uint32_t qw_quad_prev(uint32_t h) { return (h & ~3u) | ((h + 3) & 3u); }

/* Cross product of the diagonals of the quad with these corners: normal to it, its length twice the quad's area. */
static inline qw_vec3 qw_quad_cross(const qw_vec3 *position, const uint32_t *corner)
{
    return qw_cross(qw_sub(position[corner[2]], position[corner[0]]), qw_sub(position[corner[3]], position[corner[1]]));
}
static inline qw_vec3 qw_quad_middle(const qw_vec3 *position, const uint32_t *corner)
{
    return qw_scale(
        qw_add(qw_add(position[corner[0]], position[corner[1]]), qw_add(position[corner[2]], position[corner[3]])),
        0.25f);
}

static inline float qw_quad_angle(const qw_quadmesh *mesh, uint32_t h) /* at the corner of h, in [0, pi] */
{
    const qw_vec3 *p = mesh->position;
    return (float)qw_angle_at(p[mesh->corner[h]], p[mesh->corner[qw_quad_next(h)]], p[mesh->corner[qw_quad_prev(h)]]);
}
/* The lengths of all quads' sides together, four a quad: over their number, the mean edge. */
double qw_sum_of_sides(const qw_quadmesh *mesh);

/* Sets twins from the corners. Fails with QW_INTERNAL where an edge has more than two sides, or two of one direction.
 */
void qw_quadmesh_link(qw_env *env, qw_quadmesh *quads);

/* What the promise says of the connectivity, counted on the quads' own adjacency and by vertex numbers. */
typedef struct qw_quad_census {
    int64_t vertices, edges, faces, components, boundary_loops, euler;
    int64_t degenerate_faces; /* a repeated corner */
    /* edges between vertices that another edge joins, and loops; those of duplicate faces as well */
    int64_t double_edges;
    int64_t irregular; /* interior vertices of valence other than 4 */
} qw_quad_census;
qw_quad_census qw_quadmesh_census(qw_env *env, const qw_quadmesh *mesh);

/* A copy that has all arrays, of marks, kinds and components 0 where the mesh has none, and room for so many more
   vertices and faces behind its own. The mesh is linked. */
qw_quadmesh qw_quadmesh_copy(qw_env *env, const qw_quadmesh *mesh, uint32_t more_vertices, uint32_t more_faces);

/* Fails with QW_INTERNAL where corners and twins disagree or a vertex has more than one fan. */
void qw_quadmesh_validate(qw_env *env, const qw_quadmesh *mesh);

/* One outgoing half-edge a vertex, the first of its fan at a boundary: uint32_t[vertex_count], QW_NONE for vertices
 * without a face. */
uint32_t *qw_quadmesh_outgoing(qw_env *env, const qw_quadmesh *mesh);
/* The next outgoing half-edge counter-clockwise around the tail of h, or QW_NONE past the last. */
static inline uint32_t qw_quad_around(const qw_quadmesh *mesh, uint32_t h) { return mesh->twin[qw_quad_prev(h)]; }
/* Edges at the tail of `first` (as from qw_quadmesh_outgoing). */
uint32_t qw_quad_valence(const qw_quadmesh *mesh, uint32_t first, bool *on_boundary);

/* A sphere of fewer quads than a cube has vertices with two edges. */
enum { QW_LEAST_SHELL = 6 };
/* A closed component with handles of fewer quads has double edges. */
enum { QW_LEAST_HANDLED = 3 };
/* A disc may be one quad. */
enum { QW_LEAST_OPEN = 1 };
/* Whether the component of face f is closed and has at most `most` (<= QW_LEAST_SHELL) quads. */
bool qw_quad_is_small_shell(const qw_quadmesh *mesh, uint32_t f, uint32_t most);

/* Half-edges whose edge joins the same two vertices as another edge does, or a vertex with itself: marks them in
   uint8_t[4 face_count] (may be NULL); returns how many edges would have to go. */
int64_t qw_quadmesh_double_edges(qw_env *env, const qw_quadmesh *mesh, uint8_t *is_double);

/* Of unit length, or 0. */
qw_vec3 qw_quad_normal(const qw_quadmesh *mesh, uint32_t f);
qw_vec3 *qw_quadmesh_vertex_normals(qw_env *env, const qw_quadmesh *mesh);
