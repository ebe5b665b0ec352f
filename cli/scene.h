/* What is drawn of one mesh, before any view is chosen. */
#ifndef QW_CLI_SCENE_H
#define QW_CLI_SCENE_H

#include "mesh/measure.h"
#include "mesh/trimesh.h"
#include "render.h"

enum { SCENE_WIRE, SCENE_BOUNDARY, SCENE_NONMANIFOLD }; /* kinds of edges */

typedef struct scene_dot {
    uint32_t vertex;
    render_kind kind;
} scene_dot;

typedef struct scene {
    const qw_mesh_view *mesh;
    qw_polygon_edges edges;
    qw_vec3 *position;  /* qw_vec3[vertex_count], in the frame */
    qw_vec3 *normal;    /* qw_vec3[corner_count], unit: smooth over the vertex but not across creases */
    uint8_t *edge_kind; /* uint8_t[corner_count] */
    scene_dot *dots;    /* scene_dot[dot_count]; none unless most faces are quads */
    uint32_t dot_count;
    uint32_t kind_counts[RENDER_KINDS];
    uint64_t quads, triangles;
    float mean_edge; /* in the frame */
} scene;

/* The box of the vertices that faces use; false without any. */
bool scene_box(const qw_mesh_view *mesh, double lo[3], double hi[3]);
scene scene_make(qw_env *env, const qw_mesh_view *mesh, const qw_frame *frame);

#endif
