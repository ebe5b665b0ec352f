/* Meshes of glTF as their primitives are read: vertices as the file has them, one for each combination of attributes.
 */
#pragma once

#include "io/build.h"
#include "io/gltf/gltf_scene.h"

/* A number of vertices or several, on its way to an attribute. */
typedef struct qw_gltf_channel {
    const char *name;
    qw_attribute_kind kind;
    uint32_t components;
    float missing;     /* where a primitive has none */
    float *values;     /* float[vertices][components] */
    size_t capacity;   /* vertices */
    bool is_broken;    /* there is a value that is not finite */
    bool is_of_vertex; /* keeps vertices apart that lie at one place: how they move */
} qw_gltf_channel;

typedef struct qw_gltf_surface {
    qw_gltf_document *d;
    qw_builder build; /* vertices are not shared yet */
    qw_gltf_channel *channel;
    uint32_t channels;
    uint32_t influences; /* of a vertex, 4 or more where there are skins; else 0 */
    float *weight;       /* float[vertices][influences] */
    uint32_t *joint;     /* uint32_t[vertices][influences]: among the joints of all skins */
    size_t weight_capacity, joint_capacity;
    int32_t *material, *object; /* int32_t[faces] */
    size_t material_capacity, object_capacity;
    uint32_t *owner; /* uint32_t[vertices]: object */
    size_t owner_capacity;
    uint32_t *stamp, *known; /* uint32_t[most vertices of an accessor]: primitive that used it, as which vertex */
    uint32_t stamp_size, stamps;
    uint32_t *target; /* uint32_t[targets]: channels, those of a mesh together */
    uint32_t targets;
    size_t target_capacity;
    struct {
        uint32_t begin, count; /* in target[] */
    } * of_mesh;               /* [meshes] */
    uint32_t skipped;          /* primitives of points and lines */
} qw_gltf_surface;

/* Channels of all that the primitives of a mesh have, and its morph targets. */
void qw_gltf_plan_mesh(qw_gltf_surface *s, uint32_t mesh);
void qw_gltf_take_object(qw_gltf_surface *s, uint32_t number, const qw_gltf_object *object,
                         const qw_gltf_map *to_scene);
