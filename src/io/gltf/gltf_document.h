/* A glTF file, parsed: its JSON, its buffers, and the tables of what primitives are made of, all checked. */
#pragma once

#include "io/gltf/gltf.h"
#include "io/json_read.h"

/* The arrays of a parsed document. */
typedef enum qw_gltf_list {
    QW_GLTF_ACCESSORS,
    QW_GLTF_VIEWS,
    QW_GLTF_BUFFERS,
    QW_GLTF_MESHES,
    QW_GLTF_NODES,
    QW_GLTF_SCENES,
    QW_GLTF_SKINS,
    QW_GLTF_MATERIALS,
    QW_GLTF_IMAGES,
    QW_GLTF_ANIMATIONS,
    QW_GLTF_LIST_COUNT
} qw_gltf_list;

typedef struct qw_gltf_view {
    const char *at; /* char[size] */
    size_t size;
    uint32_t stride; /* 0: not given */
} qw_gltf_view;

typedef struct qw_gltf_accessor {
    uint32_t count, components; /* components: 1, 2, 3, 4, 9 or 16 */
    uint32_t view;              /* QW_NONE: zeros */
    size_t offset;              /* in the view */
    uint32_t type, stride;      /* QW_GLTF_INT8 ..., bytes */
    bool is_normalised, is_matrix;
    uint32_t sparse_count, sparse_type, sparse_indices, sparse_values; /* the last two: views */
    size_t indices_offset, values_offset;
    float *values; /* float[count][components]: once they have been asked for */
} qw_gltf_accessor;

typedef struct qw_gltf_document {
    qw_env *env;
    const char *name; /* of the file, for messages */
    const char *path; /* NULL: none */
    qw_json_doc json;
    qw_bytes chunk;                     /* of a GLB; at NULL: there is none */
    uint32_t *list[QW_GLTF_LIST_COUNT]; /* uint32_t[length]: tokens of the objects in each */
    uint32_t length[QW_GLTF_LIST_COUNT];
    qw_gltf_view *buffer; /* qw_gltf_view[]: stride unused */
    qw_gltf_view *view;
    qw_gltf_accessor *accessor;
} qw_gltf_document;

/* Everything but the values of accessors. Fails where the file is none, is cut, or names what is not there. */
qw_gltf_document qw_gltf_open(qw_env *env, const char *name, const char *path, qw_bytes bytes);

/* "PATH: mesh 3: ..." */
_Noreturn void qw_gltf_fail(const qw_gltf_document *d, qw_status status, qw_gltf_list list, uint32_t index,
                            const char *format, ...) __attribute__((format(printf, 5, 6)));

/* A whole number from 0 to most, or `missing` where the object has no such member. list and index are for messages. */
uint64_t qw_gltf_whole(const qw_gltf_document *d, uint32_t object, const char *member, uint64_t most, uint64_t missing,
                       qw_gltf_list list, uint32_t index);
/* The same for a number that names an item of `of`; QW_NONE where there is none. */
uint32_t qw_gltf_index(const qw_gltf_document *d, uint32_t object, const char *member, qw_gltf_list of,
                       qw_gltf_list list, uint32_t index);
/* An item of an array that names one of `of`. */
uint32_t qw_gltf_item_index(const qw_gltf_document *d, uint32_t token, qw_gltf_list of, qw_gltf_list list,
                            uint32_t index);
/* The token of an array, or QW_NONE. Fails where it is something else. */
uint32_t qw_gltf_array(const qw_gltf_document *d, uint32_t object, const char *member, qw_gltf_list list,
                       uint32_t index);

/* float[count][components], integers scaled where they are normalised, sparse ones put in. Kept for the next call. */
const float *qw_gltf_values(qw_gltf_document *d, uint32_t accessor);
/* uint32_t[count] of a scalar of whole numbers, in the caller's scope. */
uint32_t *qw_gltf_indices(const qw_gltf_document *d, uint32_t accessor);

/* The bytes that a URI names: data in it, or a file beside `path`, as qw_file_read_regular; at NULL: it leads
 * elsewhere, or cannot be read, and *why says so. media: where it is in the URI, at most 63 bytes of it; else "". */
qw_bytes qw_gltf_fetch_uri(const qw_gltf_document *d, const char *uri, uint64_t most, bool may_cut, char media[64],
                           const char **why);

/* What is passed on. Objects have all but their texts set, which this sets; names are those of `targets` attributes, in
   the order of the objects' target_begin. Takes over the objects. In the caller's scope. */
qw_gltf_rest *qw_gltf_pass_on(qw_gltf_document *d, qw_gltf_object *objects, uint32_t count, const char *const *names,
                              uint32_t targets);
