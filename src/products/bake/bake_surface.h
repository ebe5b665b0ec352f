/* What the input looks like at a point: its materials, textures and colours, and its shading normal. */
#pragma once

#include "products/attributes/uv_charts.h"
#include "io/material.h"

enum { QW_MOST_SETS = 4 }; /* of texture coordinates */

typedef struct qw_look {
    const qw_source *source;
    qw_vec3 *normal;                      /* qw_vec3[3 source triangles]: unit, at the corners */
    const qw_attribute *uv[QW_MOST_SETS]; /* NULL: none */
    const qw_attribute *color;            /* NULL: none */
    bool color_is_srgb;                   /* of the attribute; else it is linear, as glTF has it */
    const int32_t *material;              /* int32_t[faces of the input]; NULL: all have the first */
    const qw_material_list *list;
    const qw_picture *picture; /* qw_picture[list->image_count] */
    const float *linear;       /* float[256]: of 8 bits of sRGB */
    qw_material plain;         /* of faces without a material */
    bool has_color, has_roughness, has_emission, has_occlusion, is_unlit;
    /* of what is written: 0 all of it opaque, 1 cut off below cutoff, 2 blended */
    int alpha;
    float cutoff, brightest; /* brightest: the largest emission, at least 1; what is seen is a share of it */
} qw_look;

/* attributes: of the input. list: with its pictures decoded; all refers to them. In the caller's scope. */
qw_look qw_begin_look(qw_env *env, const qw_source *source, const qw_attribute *attributes, uint32_t count,
                      bool color_is_srgb, const qw_material_list *list, const qw_picture *picture);

typedef struct qw_seen {
    float color[4]; /* linear, and alpha */
    float occlusion, roughness, metallic;
    float emission[3]; /* linear, of the brightest */
    qw_vec3 normal;    /* unit */
} qw_seen;
qw_seen qw_look_at(const qw_look *look, uint32_t triangle, const float weight[3]);

/* From a linear value to sRGB and back, 0 to 1. */
double qw_to_srgb(double linear);
