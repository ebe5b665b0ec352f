/* What is drawn of one mesh, before any view is chosen. */
#pragma once

#include "products/measure/measure.h"
#include "geometry/trimesh.h"
#include "products/render/panel.h"

enum { SCENE_WIRE, SCENE_BOUNDARY, SCENE_NONMANIFOLD, SCENE_LINE, SCENE_RING, SCENE_KINDS }; /* kinds of edges */

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
    uint32_t *triangle; /* uint32_t[corner_count][3], corners: of all corners of a face but the first and the last, its
                           triangles */
    scene_dot *dots;    /* scene_dot[dot_count]; none unless most faces are quads */
    uint32_t dot_count;
    uint32_t kind_counts[RENDER_KINDS];
    uint64_t quads, triangles;
    uint8_t (*paint)[4]; /* uint8_t[face_count][4]: a colour and how much of it, 0 to 255; NULL: none */
    bool lines, closed;  /* SCENE_LINE, SCENE_RING is in use */
    double follow;       /* mean angle of the quads, degrees, by how clear the directions are; negative: not known */
    uint32_t patches, chords, chord, chord_length, chord_crossings, rings; /* patches, chord, rings: 0 unless drawn */
    float mean_edge;                                                       /* in the frame */
} scene;

/* The box of the vertices that faces use; false without any. */
bool scene_box(const qw_mesh_view *mesh, double lo[3], double hi[3]);
/* What the options ask to be seen of the faces: their own colours, angles, lines, rings, a chord. */
void scene_paint(qw_env *env, scene *s, const render_panel *panel, const render_options *options);
scene scene_make(qw_env *env, const qw_mesh_view *mesh, const qw_frame *frame);
