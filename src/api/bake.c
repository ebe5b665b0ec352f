/* The public functions that make maps of the input for a result that was unwrapped, and write both. */
#include "api/asset.h"
#include "api/attributes.h"
#include "api/context.h"
#include "api/loaded.h"
#include "products/attributes/corner_normals.h"
#include "products/bake/maps.h"
#include "products/bake/shading.h"
#include "whole/kept_rims.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

static bool is_word(const char *at, size_t size, const char *word)
{
    return strlen(word) == size && memcmp(at, word, size) == 0;
}

qw_status qw_maps_named(const char *text, uint32_t *maps, char *message, size_t message_size)
{
    uint32_t found = QW_MAPS_OF_INPUT;
    if (!text || !maps) return QW_ARGUMENT;
    for (const char *at = text; !is_word(text, strlen(text), "input") && (at == text || *at);) {
        size_t size = strcspn(at, ",");
        uint32_t before = found;
        for (int map = 0; map < QW_MAP_COUNT; map++)
            if (is_word(at, size, qw_map_name((qw_map)map)) || is_word(at, size, "all")) found |= 1u << map;
        if (found == before) {
            snprintf(message, message_size,
                     "bake must be input, all, or any of color, normal, orm, emission, occlusion and height, "
                     "with commas between them and none twice, not \"%.40s\"",
                     text);
            return QW_ARGUMENT;
        }
        at += size + (at[size] == ',');
    }
    *maps = found;
    return QW_OK;
}

typedef struct bake_call {
    qw_context_state *c;
    const qw_mesh *source;
    uint32_t maps;
} bake_call;

void qw_drop_maps(qw_context_state *c)
{
    qw_asset *a = c->asset;
    qw_free(c->env, a->normal), qw_free(c->env, a->tangent), qw_free(c->env, a->image);
    for (uint32_t i = 0; a->picture && i < a->look.tiles * QW_MAP_COUNT; i++) qw_free(c->env, a->picture[i].pixels);
    qw_free(c->env, a->picture), qw_free(c->env, a->alpha);
    a->alpha = NULL, a->alphas = 0;
    a->normal = a->tangent = NULL, a->picture = NULL, a->image = NULL, a->images = 0;
}

/* ---- the input */

/* The pictures of the input's materials, decoded; those that cannot be read stay empty and are told of. */
static qw_picture *read_pictures(qw_env *env, qw_material_list *list)
{
    qw_picture *picture = QW_NEW_ZERO(env, qw_picture, list->image_count);
    for (uint32_t i = 0; i < list->image_count; i++) {
        const char *why = "";
        if (!list->image[i].at) continue;
        picture[i] = qw_read_picture(env, list->image[i], &why);
        if (picture[i].pixels) continue;
        qw_note_material(env, list, "%.60s is left out of the maps: %s", list->image_name[i], why);
    }
    return picture;
}

/* Of a channel, 0 to 1. */
static double alpha_of(const qw_picture *p, size_t pixel, uint32_t channel)
{
    size_t at = pixel * 4 + channel;
    return p->bits == 16 ? ((const uint16_t *)p->pixels)[at] / 65535.0 : ((const uint8_t *)p->pixels)[at] / 255.0;
}

/* uint8_t[materials]: those that a face has; NULL: the file does not say. */
static uint8_t *materials_used(qw_env *env, const qw_mesh *source)
{
    for (uint32_t i = 0; i < source->attribute_count; i++) {
        const qw_attribute *a = &source->attribute[i];
        if (a->kind != QW_LABELS || a->domain != QW_PER_FACE || strcmp(a->name, "material") != 0) continue;
        uint32_t count = source->gltf->material_count;
        for (uint32_t f = 0; f < a->count; f++)
            if (a->labels[f] >= 0 && (uint32_t)a->labels[f] >= count) count = (uint32_t)a->labels[f] + 1;
        uint8_t *used = QW_NEW_ZERO(env, uint8_t, count);
        for (uint32_t f = 0; f < a->count; f++)
            if (a->labels[f] >= 0) used[a->labels[f]] = 1;
        return used;
    }
    return NULL;
}

/* Which channel of a picture of alpha is meant, and whether it cuts or blends. */
static void settle_alphas(qw_material_list *list, const qw_picture *picture)
{
    for (uint32_t i = 0; i < list->count; i++) {
        qw_material *m = &list->material[i];
        const qw_picture *p = m->alpha_map.image == QW_NONE ? NULL : &picture[m->alpha_map.image];
        if (!p || !p->pixels) continue;
        size_t count = (size_t)p->width * p->height, between = 0;
        bool is_clear = false;
        for (size_t k = 0; k < count; k++) is_clear |= alpha_of(p, k, 3) < 1;
        if (m->alpha_map.channel == QW_NONE) m->alpha_map.channel = is_clear ? 3 : 0;
        for (size_t k = 0; k < count; k++) {
            double a = alpha_of(p, k, m->alpha_map.channel);
            between += a > 0.05 && a < 0.95;
        }
        m->alpha = m->color[3] < 1 || between > count / 10 ? 2 : 1;
    }
}

static qw_material_list find_materials(qw_env *env, const qw_mesh *source);

/* Those of each file after those of the files before, as many as it has labels. */
static qw_material_list join_materials(qw_env *env, const qw_mesh *source)
{
    qw_material_list *of = QW_NEW(env, qw_material_list, source->parts), all = {0};
    for (uint32_t i = 0; i < source->parts; i++) {
        of[i] = find_materials(env, &source->part[i]);
        all.count += qw_count_part_materials(&source->part[i]), all.image_count += of[i].image_count;
    }
    uint8_t *used = QW_NEW(env, uint8_t, all.count);
    qw_material *material = all.material = QW_NEW(env, qw_material, all.count);
    all.image = QW_NEW(env, qw_bytes, all.image_count), all.image_name = QW_NEW(env, const char *, all.image_count);
    all.used = used, all.image_count = 0;
    for (uint32_t i = 0; i < source->parts; i++) {
        for (uint32_t k = 0; k < qw_count_part_materials(&source->part[i]); k++, material++) {
            *used++ = k >= of[i].count || qw_is_used(&of[i], k);
            *material = k < of[i].count ? of[i].material[k] : qw_plain_material();
            qw_renumber_images(material, all.image_count);
        }
        for (uint32_t k = 0; k < of[i].image_count; k++, all.image_count++)
            all.image[all.image_count] = of[i].image[k], all.image_name[all.image_count] = of[i].image_name[k];
        for (uint32_t k = 0; k < of[i].note_count; k++) qw_note_material(env, &all, "%s", of[i].note[k]);
    }
    return all;
}

static qw_material_list find_materials(qw_env *env, const qw_mesh *source)
{
    if (source && source->part) return join_materials(env, source);
    if (source && source->gltf) return qw_gltf_materials(env, source->gltf, materials_used(env, source));
    for (uint32_t i = 0; source && source->path && source->library && i < source->attribute_count; i++) {
        const qw_attribute *a = &source->attribute[i];
        if (a->kind == QW_LABELS && a->label_names && strcmp(a->name, "material") == 0)
            return qw_mtl_materials(env, source->path, source->library, a->label_names, a->label_count);
    }
    return (qw_material_list){0};
}

static void require_source(qw_context_state *c, const qw_mesh *source)
{
    if (!source) return;
    if (!source->is_whole) qw_fail(c->env, QW_ARGUMENT, -1, "there is no mesh to bake from: it could not be read");
    if (source->view.face_count != c->input.face_count || source->view.vertex_count != c->input.vertex_count)
        qw_fail(c->env, QW_ARGUMENT, -1, "the mesh to bake from is not that of the context");
}

/* ---- the target */

/* Corners of the result in the frame of the source. */
static qw_vec3 *place_corners(const qw_context_state *c, const qw_mesh_view *view, uint32_t corners)
{
    qw_vec3 *place = QW_NEW(c->env, qw_vec3, corners);
    const qw_quadmesh *quads = &c->run.finished;
    const qw_frame *frame = &c->run.whole.clean.frame;
    for (uint32_t i = 0; i < corners; i++) {
        const double *p = view->positions + 3 * (size_t)view->corners[i];
        if (i < 4 * quads->face_count) place[i] = quads->position[quads->corner[i]];
        else
            place[i] = qw_v3((float)((p[0] - frame->center[0]) * frame->scale),
                             (float)((p[1] - frame->center[1]) * frame->scale),
                             (float)((p[2] - frame->center[2]) * frame->scale));
    }
    return place;
}

/* Files that lie in one another are baked apart: places in a cube of cells, so far from one another that no ray of one
   meets another. */
typedef struct part_cells {
    float step;
    uint32_t across;
    uint32_t *part; /* uint32_t[faces of the input] */
} part_cells;

static qw_vec3 place_in_cell(const part_cells *cells, uint32_t face, qw_vec3 p)
{
    uint32_t i = cells->part[face], n = cells->across;
    return qw_madd(p, cells->step, qw_v3((float)(i % n), (float)(i / n % n), (float)(i / n / n)));
}

static part_cells find_cells(qw_env *env, const qw_mesh *joined, const qw_trimesh *mesh)
{
    part_cells cells = {.across = 1, .part = QW_NEW(env, uint32_t, joined->view.face_count)};
    uint32_t face = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        cells.step = fmaxf(cells.step, 4 * sqrtf(qw_length2(mesh->position[mesh->corner[h]])));
    while (cells.across * cells.across * cells.across < joined->parts) cells.across++;
    for (uint32_t i = 0; i < joined->parts; i++)
        for (uint32_t f = 0; f < joined->part[i].view.face_count; f++) cells.part[face++] = i;
    return cells;
}

/* The source with each part of it in a cell of its own, and the target's faces in the cell of the part they came
   from: rays of one part meet no other. */
static qw_source part_source(const qw_context_state *c, const qw_mesh *joined, qw_bake_target *target)
{
    qw_source s = c->carried->source;
    const qw_provenance *from = &c->carried->provenance;
    qw_vec3 *place = QW_NEW(c->env, qw_vec3, s.mesh.vertex_count);
    part_cells cells = find_cells(c->env, joined, &s.mesh);
    for (uint32_t h = 0; h < 3 * s.mesh.face_count; h++)
        place[s.mesh.corner[h]] = place_in_cell(&cells, s.face[h / 3], s.mesh.position[s.mesh.corner[h]]);
    for (uint32_t f = 0; f < target->face_count; f++) {
        uint32_t of = QW_NO_FACE;
        for (uint32_t k = target->begin[f]; k < target->begin[f + 1] && k < from->corner_count && of == QW_NO_FACE; k++)
            of = from->corners[k].face;
        for (uint32_t k = target->begin[f]; k < target->begin[f + 1] && of != QW_NO_FACE; k++)
            target->place[k] = place_in_cell(&cells, of, target->place[k]);
    }
    s.mesh.position = place;
    s.bvh = qw_bvh_build(c->env, &s.mesh);
    return s;
}

/* Shading normals at the corners of the result as it is unwrapped, polygons included: float[3 corners]. */
static float *find_normals(qw_context_state *c, const qw_mesh_view *view, const qw_atlas_mesh *mesh)
{
    const qw_quadmesh *quads = &c->run.finished;
    uint32_t *size = QW_NEW(c->env, uint32_t, view->face_count);
    int exponent;
    for (uint32_t f = 0; f < view->face_count; f++) size[f] = mesh->begin[f + 1] - mesh->begin[f];
    const qw_polygon_fans fans = {.vertex_count = view->vertex_count,
                                  .face_count = view->face_count,
                                  .corner_count = mesh->corner_count,
                                  .position = qw_scaled_positions(c->env, view, &exponent),
                                  .face_size = size,
                                  .corner = view->corners,
                                  .mark = quads->mark,
                                  .marked = quads->mark ? 4 * quads->face_count : 0};
    return qw_polygon_shading_normals(c->env, &fans, true);
}

/* What is the same everywhere, where there is no map of it. */
static void take_factors(qw_asset_look *look, const qw_look *seen)
{
    const qw_material *m = &seen->plain;
    for (uint32_t i = seen->list->count; i-- > 0;)
        if (qw_is_used(seen->list, i)) m = &seen->list->material[i];
    memcpy(look->color, m->color, sizeof look->color), memcpy(look->emission, m->emission, sizeof look->emission);
    look->roughness = m->roughness, look->metallic = m->metallic, look->has_occlusion = seen->has_occlusion;
    look->cutoff = seen->alpha == 2 ? 0.5f : seen->cutoff, look->is_unlit = seen->is_unlit;
    look->brightest = seen->brightest, look->color[3] = m->alpha ? m->color[3] : 1;
    for (int k = 0; k < 3; k++) look->emission[k] /= look->brightest;
    for (uint32_t i = 0; i < seen->list->count; i++)
        look->double_sided |= qw_is_used(seen->list, i) && seen->list->material[i].double_sided;
}

/* Whether a face has no material of the list, and so is opaque. */
static bool has_plain(const qw_look *l)
{
    bool has = !l->material && l->list->count != 1;
    for (uint32_t t = 0; l->material && t < l->source->mesh.face_count && !has; t++) {
        int32_t m = l->material[l->source->face[t]];
        has = m < 0 || (uint32_t)m >= l->list->count;
    }
    return has;
}

/* Each way that alpha is shown by a face of the input. */
static void take_alphas(qw_env *env, qw_asset *a, const qw_look *seen)
{
    bool has[3] = {has_plain(seen), false, false};
    a->alphas = seen->list->count, a->alpha = QW_NEW(env, uint8_t, a->alphas);
    for (uint32_t i = 0; i < a->alphas; i++) {
        a->alpha[i] = (uint8_t)seen->list->material[i].alpha;
        if (qw_is_used(seen->list, i)) has[a->alpha[i]] = true;
    }
    for (int k = 2; k >= 0; k--)
        if (has[k] || (k == 0 && a->look.alphas == 0)) a->look.alpha[a->look.alphas++] = k;
    qw_keep(env, a->alpha);
}

static uint32_t maps_of(const qw_look *l)
{
    return 1u << QW_MAP_NORMAL | (uint32_t)l->has_color << QW_MAP_COLOR |
           (uint32_t)(l->has_roughness || l->has_occlusion) << QW_MAP_ORM |
           (uint32_t)l->has_emission << QW_MAP_EMISSION;
}

/* The maps that were made, as the caller sees them: one for each map and tile that has pixels. */
static void list_images(qw_env *env, qw_asset *a)
{
    a->image = QW_NEW(env, qw_image, a->look.tiles * (size_t)QW_MAP_COUNT);
    for (uint32_t i = 0; i < a->look.tiles * QW_MAP_COUNT; i++) {
        const qw_picture *p = &a->picture[i];
        if (!p->pixels) continue;
        a->image[a->images++] = (qw_image){.size = sizeof *a->image,
                                           .map = (qw_map)(i % QW_MAP_COUNT),
                                           .tile = i / QW_MAP_COUNT,
                                           .width = p->width,
                                           .height = p->height,
                                           .channels = p->channels,
                                           .bits = p->bits,
                                           .pixels = p->pixels};
    }
}

/* Makes the asset the owner of the maps, and reports texels, those missed, and errors in the units of the input. */
static void keep_maps(qw_context_state *c, qw_asset *a, const qw_maps *maps, const qw_bake_target *target)
{
    qw_asset_report *r = &a->report;
    double scale = c->run.whole.clean.frame.scale;
    a->look.picture = a->picture = maps->picture, a->look.tiles = maps->tiles;
    qw_keep(c->env, a->picture), qw_keep(c->env, a->normal);
    for (uint32_t i = 0; i < maps->tiles * QW_MAP_COUNT; i++) qw_keep(c->env, a->picture[i].pixels);
    a->tangent = target->tangent, qw_keep(c->env, a->tangent);
    r->texels = (int64_t)maps->texels, r->missed_texels = (int64_t)maps->missed;
    r->normal_error = maps->normal_error, r->color_error = maps->color_error;
    r->height_scale = (double)maps->height_scale / scale;
}

/* Bakes the maps of the context's asset from its input; the pictures that it had before are freed. */
static void bake(void *user)
{
    bake_call *call = user;
    qw_context_state *c = call->c;
    qw_asset *a = c->asset;
    require_source(c, call->source);
    qw_drop_maps(c);
    qw_begin_work(c->env);
    qw_scope_begin(c->env);
    qw_mesh_view view = qw_view_of_result(&c->run);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(c->env, &view, NULL, 0, NULL);
    qw_material_list list = find_materials(c->env, call->source);
    qw_picture *picture = read_pictures(c->env, &list);
    settle_alphas(&list, picture);
    qw_source source = c->carried->source;
    qw_look look = qw_begin_look(c->env, &source, call->source ? call->source->attribute : NULL,
                                 call->source ? call->source->attribute_count : 0, call->source && !call->source->gltf,
                                 &list, picture);
    float *shape = find_normals(c, &view, &mesh);
    qw_bake_target target = {.corner_count = mesh.corner_count,
                             .face_count = mesh.face_count,
                             .begin = mesh.begin,
                             .vertex = mesh.corner,
                             .twin = mesh.twin,
                             .aim = shape,
                             .normal = shape,
                             .uv = a->atlas.uv};
    target.place = place_corners(c, &view, mesh.corner_count);
    if (call->source && call->source->part) source = part_source(c, call->source, &target);
    target.normal = a->normal = qw_shading_of_input(c->env, &target, &look);
    qw_bake_target_begin(c->env, &target);
    float cage = (float)(a->options.cage * c->run.whole.clean.frame.scale);
    float farthest = qw_bake_target_cage(c->env, &target, &source, cage);
    a->look = (qw_asset_look){0};
    take_factors(&a->look, &look);
    take_alphas(c->env, a, &look);
    uint32_t maps = call->maps == QW_MAPS_OF_INPUT ? maps_of(&look) : call->maps;
    qw_maps made = qw_bake_maps(c->env, &target, &look, maps, (uint32_t)a->report.tiles, (uint32_t)a->options.texture,
                                (uint32_t)a->options.samples, (uint32_t)a->options.margin, farthest);
    keep_maps(c, a, &made, &target);
    if (look.uv[0]) {
        uint32_t *neighbour = qw_find_neighbours(c->env, &source);
        a->report.charts_before = qw_find_charts(c->env, &source, neighbour, look.uv[0]).count;
    }
    for (uint32_t i = 0; i < list.note_count; i++) qw_warn_once(&c->run, list.note[i]);
    qw_scope_end(c->env);
    list_images(c->env, a);
}

static void carry(void *user) { qw_find_carried(((bake_call *)user)->c); }

qw_status qw_bake(qw_context *context, const qw_mesh *source, uint32_t maps, const qw_image **images, uint32_t *count,
                  qw_asset_report *report)
{
    if (!context || !images || !count) return QW_ARGUMENT;
    *images = NULL, *count = 0;
    qw_context_state *c = &context->state;
    if (c->done < QW_STAGE_COUNT || !c->asset || !c->has_input)
        return qw_refuse(context, QW_NOT_READY, "qw_unwrap was not called yet: there are no texture coordinates");
    if (maps >> QW_MAP_COUNT) return qw_refuse(context, QW_ARGUMENT, "there are no such maps");
    bake_call call = {c, source, maps};
    qw_status status = qw_protect_listening(c->env, carry, &call);
    if (status == QW_OK) status = qw_protect_working(context, bake, &call);
    if (status != QW_OK) {
        qw_asset *a = c->asset; /* what was made of it was unwound */
        a->normal = a->tangent = NULL, a->picture = NULL, a->image = NULL, a->images = 0, a->look = (qw_asset_look){0};
        a->alpha = NULL, a->alphas = 0;
        return qw_done(context, status);
    }
    *images = c->asset->image, *count = c->asset->images;
    if (report) *report = c->asset->report;
    return qw_done(context, status);
}

/* ---- saving */

typedef struct save_call {
    qw_context_state *c;
    const qw_attribute *attributes;
    uint32_t count;
    const char *path;
    qw_format format;
} save_call;

/* Which of the ways that alpha is shown a face has: that of its material, or opaque, or the first. */
static int32_t alpha_of_face(const qw_asset *a, const qw_attribute *material, uint32_t f)
{
    int32_t m = material && f < material->count ? material->labels[f] : a->alphas == 1 ? 0 : -1;
    int alpha = m >= 0 && (uint32_t)m < a->alphas ? a->alpha[m] : 0;
    for (uint32_t i = 0; i < a->look.alphas; i++)
        if (a->look.alpha[i] == alpha) return (int32_t)i;
    return 0;
}

/* Texture coordinates within the square of their tile; *label: the material of each face. */
static qw_attribute part_tiles(qw_env *env, const qw_asset *a, const qw_atlas_mesh *mesh, const qw_attribute *material,
                               bool shift, int32_t *label)
{
    qw_attribute uv = a->uv;
    float *value = QW_NEW(env, float, 2 * (size_t)mesh->corner_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        float tile = INFINITY; /* a corner may lie on its far border */
        for (uint32_t c = mesh->begin[f]; c < mesh->begin[f + 1]; c++) tile = fminf(tile, a->atlas.uv[2 * (size_t)c]);
        label[f] = (int32_t)fmaxf(tile, 0);
        for (uint32_t c = mesh->begin[f]; c < mesh->begin[f + 1]; c++) {
            value[2 * c] = a->atlas.uv[2 * c] - (shift ? (float)label[f] : 0);
            value[2 * c + 1] = a->atlas.uv[2 * c + 1];
        }
        label[f] = label[f] * (int32_t)a->look.alphas + alpha_of_face(a, material, f);
    }
    uv.values = value;
    return uv;
}

static bool is_left_out(const qw_attribute *a, bool has_color)
{
    return a->kind == QW_UVS || a->kind == QW_NORMALS || a->kind == QW_WEIGHTS || strcmp(a->name, "material") == 0 ||
           strncmp(a->name, "target:", 7) == 0 || (has_color && strncmp(a->name, "color", 5) == 0) ||
           strcmp(a->name, "tangent") == 0;
}

qw_attribute *qw_list_asset(qw_env *env, const qw_asset *a, const qw_mesh_view *view, const qw_attribute *attributes,
                            uint32_t *total, bool is_gltf)
{
    qw_atlas_mesh mesh = qw_atlas_mesh_of(env, view, NULL, 0, NULL);
    qw_attribute *list = QW_NEW(env, qw_attribute, *total + (size_t)4);
    uint32_t count = 0;
    int32_t *label = QW_NEW(env, int32_t, mesh.face_count);
    const qw_attribute *own = NULL;
    for (uint32_t i = 0; i < *total; i++) {
        const qw_attribute *at = &attributes[i];
        if (!is_left_out(at, a->picture[QW_MAP_COLOR].pixels)) list[count++] = *at;
        if (at->kind == QW_LABELS && at->domain == QW_PER_FACE && strcmp(at->name, "material") == 0) own = at;
    }
    list[count++] = part_tiles(env, a, &mesh, own, is_gltf, label);
    list[count++] = (qw_attribute){.size = sizeof *list,
                                   .name = "normal",
                                   .domain = QW_PER_CORNER,
                                   .kind = QW_NORMALS,
                                   .components = 3,
                                   .count = mesh.corner_count,
                                   .values = a->normal};
    if (is_gltf)
        list[count++] = (qw_attribute){.size = sizeof *list,
                                       .name = "tangent",
                                       .domain = QW_PER_CORNER,
                                       .kind = QW_VALUES,
                                       .components = 4,
                                       .count = mesh.corner_count,
                                       .values = a->tangent};
    list[count++] = (qw_attribute){.size = sizeof *list,
                                   .name = "material",
                                   .domain = QW_PER_FACE,
                                   .kind = QW_LABELS,
                                   .components = 1,
                                   .count = mesh.face_count,
                                   .labels = label};
    *total = count;
    return list;
}

/* Writes the asset: mesh, texture coordinates, attributes, and its materials within glTF or as an MTL library. */
static void save_asset(void *user)
{
    save_call *call = user;
    qw_env *env = call->c->env;
    const qw_asset *a = call->c->asset;
    bool is_gltf = call->format == QW_FORMAT_GLB || call->format == QW_FORMAT_GLTF;
    qw_scope_begin(env);
    qw_mesh_view view = qw_view_of_result(&call->c->run);
    qw_carried_along along = {.count = call->count};
    qw_attribute *list = qw_list_asset(env, a, &view, call->attributes, &along.count, is_gltf);
    qw_attribute *material = &list[along.count - 1];
    const char **names = NULL;
    const qw_asset_look *look = &a->look;
    if (is_gltf) along.gltf = qw_gltf_of_looks(env, &look, 1, false);
    else along.library = qw_write_mtl(env, call->path, &a->look, &names);
    material->label_names = names, material->label_count = names ? a->look.tiles * a->look.alphas : 0;
    along.attributes = list;
    qw_write_with(env, call->path, call->format, &view, &along);
    qw_scope_end(env);
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    if (n < m) return false;
    for (size_t i = 0; i < m; i++) {
        char c = text[n - m + i];
        if ((c >= 'A' && c <= 'Z' ? (char)(c + 32) : c) != end[i]) return false;
    }
    return true;
}

qw_status qw_save_asset(qw_context *context, const qw_attribute *attributes, uint32_t count, const char *path,
                        qw_format format)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to write to");
    if (context->state.done < QW_STAGE_COUNT || !context->state.asset || !context->state.asset->picture)
        return qw_refuse(context, QW_NOT_READY, "qw_bake was not called yet: there are no maps");
    if (format == QW_FORMAT_AUTO)
        format = ends_with(path, ".glb") ? QW_FORMAT_GLB : ends_with(path, ".gltf") ? QW_FORMAT_GLTF : QW_FORMAT_OBJ;
    if (format != QW_FORMAT_GLB && format != QW_FORMAT_GLTF && format != QW_FORMAT_OBJ)
        return qw_refuse(context, QW_ARGUMENT, "maps are written with GLB, glTF and OBJ only");
    if (format == QW_FORMAT_OBJ && strcmp(path, "-") == 0)
        return qw_refuse(context, QW_ARGUMENT, "OBJ has its maps in files beside it: standard output has no folder");
    save_call call = {&context->state, attributes, count, path, format};
    return qw_done(context, qw_protect_listening(context->state.env, save_asset, &call));
}
