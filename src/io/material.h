/* Materials of files, as far as maps are made of them: factors and textures of glTF 2.0's metallic-roughness model. */
#pragma once

#include "io/gltf/gltf.h"
#include "io/pictures/picture.h"

typedef struct qw_texture {
    uint32_t image;                      /* among the images of the list; QW_NONE: there is no texture */
    uint32_t set;                        /* of texture coordinates */
    int wrap[2];                         /* 0 repeats, 1 clamps, 2 is mirrored, along u and v */
    float offset[2], scale[2], rotation; /* KHR_texture_transform, v downward */
    uint32_t channel;                    /* the first of those that are taken; QW_NONE: not known yet */
} qw_texture;

typedef struct qw_material {
    const char *name;
    float color[4], emission[3]; /* linear */
    float metallic, roughness, normal_scale, occlusion_strength;
    qw_texture color_map, alpha_map, metallic_map, roughness_map, occlusion_map, emission_map, normal_map;
    int alpha; /* 0 opaque, 1 cut off, 2 blended */
    float cutoff;
    bool double_sided, is_unlit;
} qw_material;

typedef struct qw_material_list {
    qw_material *material; /* qw_material[count] */
    uint32_t count, image_count, note_count;
    qw_bytes *image;         /* qw_bytes[image_count]: of files; at NULL: it cannot be had, which a note says */
    const char **image_name; /* char *[image_count]: for messages */
    const uint8_t *used;     /* uint8_t[count]: whether a face has it; NULL: all are used */
    const char **note;       /* char *[note_count]: what was left out or changed, a sentence each */
    size_t note_room;
} qw_material_list;

static inline bool qw_is_used(const qw_material_list *list, uint32_t i) { return !list->used || list->used[i]; }

enum { QW_MATERIAL_NOTE = 160 }; /* bytes: as a report holds them */
/* Adds a note to the list, unless it says so already or has as many as a report holds. */
void qw_note_material(qw_env *env, qw_material_list *list, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* A material of white, rough, and without textures. */
qw_material qw_plain_material(void);

/* Where so many images stand before those of its list. */
void qw_renumber_images(qw_material *material, uint32_t before);

/* What a number of a material may be. */
typedef struct qw_factor_range {
    float least, most;
} qw_factor_range;
/* Such bounds where the format has none: far more than any picture shows, and far from what single precision holds. */
#define QW_MOST_FACTOR 1e9f
extern const qw_factor_range qw_factor_share, qw_factor_upward, qw_factor_any;
/* A number of a file as a factor: the nearest one within the range where it lies outside of it, and `kept` where it is
   none, each with a note that names the material and the number. */
float qw_checked_factor(qw_env *env, qw_material_list *list, const char *material, const char *name, double value,
                        qw_factor_range range, float kept);
/* All in the caller's scope; bytes are those of rest or copies. used: uint8_t[rest->material_count]: images of others
   are not looked for; NULL: all are used. */
qw_material_list qw_gltf_materials(qw_env *env, const qw_gltf_rest *rest, const uint8_t *used);
/* By the names of the labels, from the MTL files of an OBJ: library: a line each, beside `path`. What is not found is
   plain, with a warning. */
qw_material_list qw_mtl_materials(qw_env *env, const char *path, const char *library, const char *const *names,
                                  uint32_t count);
