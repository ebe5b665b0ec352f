/* What a glTF file holds beside its surface, as qw_read_gltf leaves it and qw_put_gltf takes it up: nodes, materials,
 * textures, images, skins, animations, cameras and all extensions, their text and bytes as they were. Only the numbers
 * by which they refer to accessors and views of the buffer are new. */
#pragma once

#include "io/file.h"
#include "io/pen.h"
#include "io/soup.h"

enum qw_gltf_number_type {
    QW_GLTF_INT8 = 5120,
    QW_GLTF_UINT8,
    QW_GLTF_INT16,
    QW_GLTF_UINT16,
    QW_GLTF_UINT32 = 5125,
    QW_GLTF_FLOAT32
};
/* Joints of one set; bytes: to which views and chunks are aligned, and those before the chunks of a GLB and before
   each of them. */
enum { QW_GLTF_SET = 4, QW_GLTF_ALIGNMENT = 4, QW_GLB_HEADER = 12, QW_GLB_CHUNK_HEADER = 8 };

#define QW_GLTF_TEXT(x)  #x
#define QW_GLTF_DIGIT(x) QW_GLTF_TEXT(x)
/* Members of the asset that is written. */
#define QW_GLTF_ASSET                                                                \
    "\"generator\":\"Quadwright " QW_GLTF_DIGIT(QW_VERSION_MAJOR) "." QW_GLTF_DIGIT( \
        QW_VERSION_MINOR) "." QW_GLTF_DIGIT(QW_VERSION_PATCH) "\",\"version\":\"2.0\""

/* A node that shows a mesh. Objects are in the order of the nodes; faces name them by the label "object". */
typedef struct qw_gltf_object {
    double to_local[12];               /* double[3][4]: from the coordinates of the soup to those of the node's mesh */
    bool is_mirrored;                  /* to_local turns triangles inside out */
    uint32_t node, mesh;               /* in the file that was read */
    size_t nodes;                      /* text: of the nodes up to the place of this object's "mesh" */
    size_t members;                    /* text: of the node beside its "mesh" where it has one, each after a comma */
    size_t head;                       /* text: members of the mesh beside its primitives, each followed by a comma */
    uint32_t joint_begin, joint_count; /* of its skin, among the joints of all skins; count 0: it has none */
    uint32_t target_begin, target_count; /* in target[] */
} qw_gltf_object;

struct qw_gltf_rest {
    char *text;  /* pieces of JSON, NUL-terminated; size_t members say where each begins */
    char *bytes; /* char[byte_count]: beginning of the buffer */
    size_t byte_count;
    qw_gltf_object *object; /* qw_gltf_object[object_count] */
    uint32_t object_count;
    size_t *target;                                      /* size_t[]: text: names of attributes, "target:Smile" */
    uint32_t material_count, view_count, accessor_count; /* of what is passed on */
    size_t head;                                         /* text: members of the document, each followed by a comma */
    size_t look;             /* text: those of them that say what a surface looks like: materials, textures, images */
    size_t nodes_end;        /* text: of the nodes after the last object's mesh; "" where there are none */
    size_t views, accessors; /* text: items, each followed by a comma */
    size_t used;             /* text: extensions that are used, each followed by a comma */
    size_t required;         /* text: those that are required, with commas between them */
};

/* GLB, or the JSON of a .gltf: `path` tells where the files lie that it names; NULL: there are none. */
qw_soup qw_read_gltf(qw_env *env, const char *name, const char *path, qw_bytes bytes);
bool qw_is_glb(qw_bytes bytes);
bool qw_is_gltf(qw_bytes bytes); /* begins as JSON does */

/* Adds to paths, each with its zero, where the files are that a glTF file names, whether they are there or not. Fails
   where its JSON is none. In the caller's scope. */
void qw_gltf_list_files(qw_env *env, const char *name, const char *path, qw_bytes bytes, qw_pen *paths);

/* rest: NULL: none; without objects: materials and pictures alone (io/asset_file.h), and a node for each label
   "object". is_binary: GLB, or else JSON with the buffer in a data URI. */
void qw_put_gltf(qw_env *env, qw_file *file, bool is_binary, const qw_mesh_view *mesh, const qw_attribute *attributes,
                 uint32_t count, const qw_gltf_rest *rest);

/* One of several meshes of one surface, the finest first. */
typedef struct qw_gltf_level {
    const qw_mesh_view *mesh;
    const qw_attribute *attributes; /* qw_attribute[count] */
    uint32_t count;
} qw_gltf_level;

/* A node and a mesh for each; the first names the others by MSFT_lod, and alone is in the scene. count: at least 1.
   pictures: what is written of materials, to which labels of faces refer by their numbers (io/asset_file.h, or what a
   file held that was read); NULL: their names. */
void qw_put_gltf_levels(qw_env *env, qw_file *file, bool is_binary, const qw_gltf_level *levels, uint32_t count,
                        const qw_gltf_rest *pictures);

/* Blocks that belong to it, for qw_keep and qw_free: `each` is called for them and for the structure. */
void qw_gltf_each_block(qw_env *env, qw_gltf_rest *rest, void (*each)(qw_env *env, void *block));
