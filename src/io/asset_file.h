/* Maps as materials of files: for each tile one of each way that alpha is shown. */
#pragma once

#include "io/gltf/gltf.h"
#include "io/pictures/picture.h"

/* The pictures of all tiles, and what is the same for a whole material where there is no map of it. */
typedef struct qw_asset_look {
    const qw_picture *picture; /* qw_picture[tiles][QW_MAP_COUNT]: without pixels: there is none */
    uint32_t tiles;
    float color[4], emission[3], roughness, metallic;
    bool has_occlusion;      /* in the first channel of QW_MAP_ORM */
    uint32_t alphas;         /* at least 1; that of tile t with the i-th is material t * alphas + i */
    int alpha[3];            /* 0 opaque, 1 cut off, 2 blended; the greatest first */
    float cutoff, brightest; /* brightest: what the emission is a share of; at least 1 */
    bool double_sided, is_unlit;
} qw_asset_look;

/* What the i-th way that alpha is shown adds to the name of a material. */
static inline const char *qw_alpha_suffix(const qw_asset_look *look, uint32_t i)
{
    static const char *const suffix[] = {"_opaque", "_cutout", "_blended"};
    return look->alphas > 1 ? suffix[look->alpha[i]] : "";
}

/* Their materials and pictures, for glTF: those of one after those of the other, named as levels, the finest first, or
   not. It has no objects. In the caller's scope. */
qw_gltf_rest *qw_gltf_of_looks(qw_env *env, const qw_asset_look *const *look, uint32_t count, bool are_levels);

/* Writes the pictures and an MTL beside an OBJ: NAME_color.png and so on, with .1001 and so on where there are several
   tiles. Returns the name of the MTL without its folder; *names: char *[tiles * alphas], of the materials. In the
   caller's scope. */
const char *qw_write_mtl(qw_env *env, const char *obj_path, const qw_asset_look *look, const char ***names);
