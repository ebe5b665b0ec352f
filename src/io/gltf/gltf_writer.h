/* What the writer of glTF holds, and the meshes that it writes; the document around them is in gltf_write.c. */
#pragma once

#include "io/gltf/gltf.h"

enum { QW_GLTF_SEMANTIC = 136 }; /* bytes of the longest name */

/* An attribute as glTF has it. */
typedef struct qw_gltf_stream {
    char semantic[QW_GLTF_SEMANTIC];
    const qw_attribute *of;
} qw_gltf_stream;

typedef struct qw_gltf_writer {
    qw_env *env;
    const qw_mesh_view *mesh;
    const qw_attribute *attributes;
    uint32_t count;
    const qw_gltf_rest *rest;                        /* NULL: none */
    const qw_gltf_rest *pictures;                    /* without rest: materials and pictures alone; NULL: none */
    const qw_attribute *object, *material, *weights; /* NULL: none */
    uint32_t material_count; /* those that labels refer to by number; 0: by those of `rest`, or by name */
    qw_gltf_stream *stream;
    uint32_t streams;
    const uint32_t *order;     /* uint32_t[faces]: by object and material; NULL: as they are */
    uint32_t *begin;           /* uint32_t[faces + 1]: corners */
    uint32_t *copy;            /* uint32_t[corners]: vertex of its object's mesh */
    uint32_t *last;            /* uint32_t[vertices]: latest copy of each, plus 1; 0: none */
    uint32_t *before, *corner; /* of each copy: the one before of the same vertex, as in last; a corner that it is of */
    uint32_t copies, first_copy; /* of all objects so far; of this one */
    float centre[3];             /* translation of the nodes of our own; 0 0 0: none */
    qw_pen meshes, views, accessors, bytes;
    uint32_t view_count, accessor_count, mesh_count;
} qw_gltf_writer;

static inline uint32_t qw_gltf_face_at(const qw_gltf_writer *w, uint32_t i) { return w->order ? w->order[i] : i; }

/* The label of faces of that name; NULL: there is none. */
const qw_attribute *qw_gltf_labels(const qw_gltf_writer *w, const char *name);
/* Sets what of the attributes is written, as glTF names it. */
void qw_find_gltf_streams(qw_gltf_writer *w);
/* Sets the translation of our own nodes. */
void qw_find_gltf_centre(qw_gltf_writer *w);
uint32_t qw_gltf_object_of(const qw_gltf_writer *w, uint32_t f);
/* Faces from .. to - 1 of the order are those of one object. */
void qw_put_gltf_mesh(qw_gltf_writer *w, uint32_t from, uint32_t to);
/* The low bytes of a number, the lowest first. */
void qw_put_bits(qw_pen *pen, uint32_t bits, int size);
