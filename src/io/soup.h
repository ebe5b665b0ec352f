/* Polygons as read from a file: nothing is known of them but that indices are in range and coordinates finite. */
#pragma once

#include "base/env.h"

typedef struct qw_gltf_rest qw_gltf_rest; /* io/gltf/gltf.h */

typedef struct qw_soup {
    uint32_t vertex_count, face_count;
    double *position;     /* double[vertex_count][3], finite */
    uint32_t *face_begin; /* uint32_t[face_count + 1]: corners of face f are corner[face_begin[f]] ..
                             corner[face_begin[f + 1]] */
    uint32_t *corner;     /* uint32_t[face_begin[face_count]], each below vertex_count */
    uint32_t *mark; /* uint32_t[mark_count][2], vertices: edges that the file marks, some perhaps more than once; NULL:
                       none */
    uint32_t mark_count;
    qw_attribute *attribute; /* qw_attribute[attribute_count]: NULL: none; what they refer to is the soup's */
    uint32_t attribute_count;
    char *library;         /* OBJ: the names that follow mtllib, a line each; NULL: none */
    qw_gltf_rest *gltf;    /* glTF: what the file holds beside the surface; else NULL */
    bool separate_corners; /* the format shares no vertices between faces (STL): equal positions are one vertex */
} qw_soup;

/* Reads a whole file, or standard input for "-". The format is judged by the contents, never by the name. Faces keep
   their polygons; faces of fewer than three corners are skipped. All failures of the file and of its contents have
   their own status, and the message names the path and the line (text) or the element (binary). Allocated in the
   caller's scope. */
qw_soup qw_read(qw_env *env, const char *path);
qw_soup qw_read_memory(qw_env *env, const void *bytes, size_t size, const char *name_for_messages);

/* The points of a file without faces: PLY, PCD, the vertices of an OBJ, or lines that begin with three numbers (XYZ).
   face_count is 0. Fails as qw_read does, with QW_NO_FACES where there are fewer than three. */
qw_soup qw_read_points(qw_env *env, const char *path);
qw_soup qw_read_points_memory(qw_env *env, const void *bytes, size_t size, const char *name_for_messages);

/* Writes through a temporary file beside the target that is renamed at the end: the target is whole or untouched. "-"
   writes standard output. Numbers read back to the same doubles. Binary little-endian PLY with double coordinates.
   QW_FORMAT_AUTO: by the extension, or fails with QW_FORMAT_UNKNOWN; "-" is OBJ. */
void qw_write(qw_env *env, const char *path, qw_format format, const qw_mesh_view *mesh);

/* What is written beside the mesh; all of it may be missing. See qw_save_from. */
typedef struct qw_carried_along {
    const qw_attribute *attributes;
    uint32_t count;
    const char *library;      /* for OBJ */
    const qw_gltf_rest *gltf; /* for GLB and glTF */
    bool second_order;        /* for elements (io/elements.h) */
} qw_carried_along;

void qw_write_with(qw_env *env, const char *path, qw_format format, const qw_mesh_view *mesh,
                   const qw_carried_along *along);

/* The order in which faces are written: by the labels of the attributes that go by faces, one after the other, and else
   as they are. uint32_t[face_count], or NULL where that changes nothing. */
uint32_t *qw_order_faces(qw_env *env, uint32_t face_count, const qw_attribute *attributes, uint32_t count);

/* Edges at which one of the attributes (of corners or faces) differs between two faces: uint32_t[*edges][2], NULL where
   there is none. In the caller's scope. */
uint32_t *qw_find_attribute_borders(qw_env *env, const qw_mesh_view *mesh, const qw_attribute *const *attributes,
                                    uint32_t count, uint32_t *edges);
