/* Visible triangle a sample first, colours afterwards, so that each sample is shaded once whatever lies behind it.
 *
 *     project vertices -> z-buffer of ids, SIDE x SIDE samples a pixel -> contact shadows a pixel -> colours, averaged
 * a pixel
 *
 * Wires are no geometry of their own: a sample is dark where its polygon's side is near, so hidden lines cannot show,
 * and each face draws its own half of the line. The id of a sample is the middle corner c of its triangle (first corner
 * of the face, c, c + 1), or BALL and the number of the dot. Light is summed in linear colours.
 */
#include "products/render/view.h"

#include "base/elementary.h"

#include <math.h>
#include <string.h>

enum { MOST_SIDE = 3, PROBES = 16, TILE = 4, BANDS = 24 };
static const uint32_t BALL = 0x80000000u;
static const uint64_t most_samples = 24000000; /* beyond it there are fewer samples a pixel */
static const float reach = 0.22f;              /* of contact shadows, in half diagonals */

typedef struct colour {
    float r, g, b;
} colour;

/* What a pass over the rows of one view needs. */
typedef struct view {
    const scene *scene;
    view_camera camera; /* in samples */
    uint32_t side;
    bool wires, dots;
    float line; /* half the width of a wire, in samples */
    view_area area;
    picture *picture;
    raster raster;
    raster_point *points;                 /* raster_point[vertex_count] */
    float *fade;                          /* float[face_count]: 0 where wires are too dense */
    raster_point *centres;                /* raster_point[dot_count] */
    float *radii;                         /* float[dot_count], samples */
    float *depth;                         /* float[pixels]: of the middle sample */
    float *shadow, *smooth_shadow;        /* float[pixels]: 1 in the open */
    float probes[TILE * TILE][PROBES][2]; /* within the unit circle */
    colour kinds[RENDER_KINDS];
} view;

/* ---- camera */

view_camera view_look(double azimuth, double elevation)
{
    double a = azimuth * 3.14159265358979323846 / 180, e = elevation * 3.14159265358979323846 / 180;
    view_camera c = {.distance = 5, .scale = 1};
    c.toward = qw_v3((float)(qw_sin(a) * qw_cos(e)), (float)qw_sin(e), (float)(qw_cos(a) * qw_cos(e)));
    c.right = qw_v3((float)qw_cos(a), 0, (float)-qw_sin(a));
    c.up = qw_cross(c.toward, c.right);
    return c;
}

static raster_point project(const view_camera *c, qw_vec3 p)
{
    float depth = 1 / (c->distance - qw_dot(c->toward, p));
    return (raster_point){c->left + c->scale * qw_dot(c->right, p) * depth,
                          c->top - c->scale * qw_dot(c->up, p) * depth, depth};
}

void view_include(const view_camera *camera, const scene *s, view_bounds *bounds)
{
    view_camera c = *camera;
    c.scale = 1, c.left = c.top = 0;
    for (uint32_t i = 0; i < s->edges.corner_count; i++) {
        raster_point p = project(&c, s->position[s->mesh->corners[i]]);
        bounds->lo[0] = fminf(bounds->lo[0], p.x), bounds->hi[0] = fmaxf(bounds->hi[0], p.x);
        bounds->lo[1] = fminf(bounds->lo[1], p.y), bounds->hi[1] = fmaxf(bounds->hi[1], p.y);
    }
}

void view_fit(view_camera *camera, const view_bounds *bounds, const view_area *area)
{
    const float margin = 0.05f;
    float width = bounds->hi[0] - bounds->lo[0], height = bounds->hi[1] - bounds->lo[1];
    float room_x = (float)area->width * (1 - 2 * margin), room_y = (float)area->height * (1 - 2 * margin);
    camera->scale = fminf(room_x / fmaxf(width, 1e-6f), room_y / fmaxf(height, 1e-6f));
    camera->left = 0.5f * (float)area->width - camera->scale * 0.5f * (bounds->lo[0] + bounds->hi[0]);
    camera->top = 0.5f * (float)area->height - camera->scale * 0.5f * (bounds->lo[1] + bounds->hi[1]);
}

/* ---- z-buffer */

static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }

/* 0 below low, 1 above high, smooth between. */
static inline float ramp(float low, float high, float x)
{
    float t = smaller(larger((x - low) / (high - low), 0), 1);
    return t * t * (3 - 2 * t);
}

/* How many pixels a face is across: area over longest side. */
static void project_faces(void *user, uint32_t begin, uint32_t end)
{
    view *v = user;
    const uint32_t *corner = v->scene->mesh->corners, *face_begin = v->scene->edges.face_begin;
    for (uint32_t f = begin; f < end; f++) {
        float area = 0, longest = 1e-6f;
        for (uint32_t c = face_begin[f]; c < face_begin[f + 1]; c++) {
            raster_point a = v->points[corner[c]], b = v->points[corner[qw_polygon_next(&v->scene->edges, c)]];
            area += 0.5f * (a.x * b.y - a.y * b.x);
            longest = larger(longest, sqrtf((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y)));
        }
        v->fade[f] = fabsf(area) / longest / (float)v->side;
    }
}

/* Wires fade where faces are only a few pixels across, on the average of the neighbourhood: a single larger face among
   the dense ones keeps no wire of its own. */
static void find_fades(qw_env *env, view *v)
{
    const qw_mesh_view *m = v->scene->mesh;
    const uint32_t *face = v->scene->edges.face, *face_begin = v->scene->edges.face_begin;
    float *sum = QW_NEW(env, float, m->vertex_count);
    uint32_t *count = QW_NEW_ZERO(env, uint32_t, m->vertex_count);
    for (uint32_t c = 0; c < v->scene->edges.corner_count; c++) count[m->corners[c]]++;
    for (int round = 0; round < 2; round++) {
        memset(sum, 0, m->vertex_count * sizeof *sum);
        for (uint32_t c = 0; c < v->scene->edges.corner_count; c++)
            sum[m->corners[c]] += v->fade[face[c]] / (float)count[m->corners[c]];
        memset(v->fade, 0, m->face_count * sizeof *v->fade);
        for (uint32_t c = 0; c < v->scene->edges.corner_count; c++)
            v->fade[face[c]] += sum[m->corners[c]] / (float)(face_begin[face[c] + 1] - face_begin[face[c]]);
    }
    for (uint32_t f = 0; f < m->face_count; f++) v->fade[f] = ramp(1.8f, 6.0f, v->fade[f]);
    qw_free(env, sum);
    qw_free(env, count);
}

static void place_dots(view *v)
{
    bool dense = v->scene->dot_count >
                 v->scene->mesh->vertex_count / 10; /* dots of a visible size would hide the mesh */
    float least = (dense ? 0.6f : 2.3f) * (float)v->side, most = 0.014f * (float)v->raster.height;
    for (uint32_t i = 0; v->dots && i < v->scene->dot_count; i++) {
        v->centres[i] = v->points[v->scene->dots[i].vertex];
        float radius = 0.27f * v->scene->mean_edge * v->camera.scale * v->centres[i].depth;
        v->radii[i] = larger(smaller(radius, most), least);
    }
}

/* Draws the triangles and dots that reach the rows top .. bottom. */
static void draw_band(void *user, uint32_t top, uint32_t bottom)
{
    view *v = user;
    const scene *s = v->scene;
    const uint32_t *corner = s->mesh->corners;
    raster_clear(&v->raster, top, bottom);
    for (uint32_t f = 0; f < s->mesh->face_count; f++)
        for (uint32_t c = s->edges.face_begin[f] + 1; c + 1 < s->edges.face_begin[f + 1]; c++) {
            const uint32_t *k = s->triangle + 3 * (size_t)c;
            raster_triangle(&v->raster, top, bottom, v->points[corner[k[0]]], v->points[corner[k[1]]],
                            v->points[corner[k[2]]], c);
        }
    for (uint32_t i = 0; v->dots && i < s->dot_count; i++)
        raster_ball(&v->raster, top, bottom, v->centres[i], v->radii[i], v->camera.scale * v->centres[i].depth,
                    BALL | i);
}

/* ---- surface */

typedef struct surface_point {
    qw_vec3 normal; /* in the camera's axes, towards it */
    bool back;
} surface_point;

static qw_vec3 turned(const view_camera *c, qw_vec3 n)
{
    return qw_v3(qw_dot(c->right, n), qw_dot(c->up, n), qw_dot(c->toward, n));
}

/* The smooth normal at a sample, which the nearest side of the triangle faces. */
static surface_point surface_at(const view *v, uint32_t id, float x, float y)
{
    if (id & BALL) {
        raster_point c = v->centres[id & ~BALL];
        float r = v->radii[id & ~BALL], dx = (x - c.x) / r, dy = (y - c.y) / r;
        return (surface_point){qw_v3(dx, -dy, sqrtf(larger(1 - dx * dx - dy * dy, 0))), false};
    }
    const scene *s = v->scene;
    const uint32_t *k = s->triangle + 3 * (size_t)id;
    raster_point a = v->points[s->mesh->corners[k[0]]], b = v->points[s->mesh->corners[k[1]]],
                 c = v->points[s->mesh->corners[k[2]]];
    float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    float wb = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area * b.depth;
    float wc = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area * c.depth;
    float wa = (1 - wb / b.depth - wc / c.depth) * a.depth;
    qw_vec3 n = qw_madd(qw_madd(qw_scale(s->normal[k[0]], wa), wb, s->normal[k[1]]), wc, s->normal[k[2]]);
    n = qw_normalize(turned(&v->camera, n));
    bool back = area > 0;
    if (back) n = qw_scale(n, -1);
    if (n.z < 0) n = qw_normalize(qw_v3(n.x, n.y, 0)); /* smooth normals may turn away near the outline */
    return (surface_point){n, back};
}

/* ---- contact shadows */

static uint32_t middle_sample(const view *v, uint32_t i, uint32_t j)
{
    return (j * v->side + v->side / 2) * v->raster.width + i * v->side + v->side / 2;
}

static void gather_depths(void *user, uint32_t begin, uint32_t end)
{
    view *v = user;
    for (uint32_t j = begin; j < end; j++)
        for (uint32_t i = 0; i < v->area.width; i++)
            v->depth[(size_t)j * v->area.width + i] = v->raster.depth[middle_sample(v, i, j)];
}

static qw_vec3 place_of(const view *v, uint32_t i, uint32_t j, float depth)
{
    float x = ((float)(i * v->side + v->side / 2) + 0.5f - v->camera.left) / v->camera.scale;
    float y = (v->camera.top - (float)(j * v->side + v->side / 2) - 0.5f) / v->camera.scale;
    return qw_v3(x / depth, y / depth, v->camera.distance - 1 / depth);
}

/* A spiral, turned differently at each pixel of a tile. */
static void place_probes(view *v)
{
    for (int t = 0; t < TILE * TILE; t++)
        for (int k = 0; k < PROBES; k++) {
            float radius = ((float)k + 0.5f) / PROBES,
                  angle = 6.2831853f * ((float)t + 0.5f) / (TILE * TILE) + 2.3999632f * (float)k;
            v->probes[t][k][0] = radius * (float)qw_cos((double)angle);
            v->probes[t][k][1] = radius * (float)qw_sin((double)angle);
        }
}

/* Share of the sky that nearer surface hides. */
static float hidden_sky(const view *v, uint32_t i, uint32_t j, qw_vec3 p, qw_vec3 n, float depth)
{
    float pixels = reach * v->camera.scale * depth / (float)v->side, hidden = 0;
    const float(*probe)[2] = v->probes[i % TILE + TILE * (j % TILE)];
    for (int k = 0; k < PROBES; k++) {
        int x = (int)i + (int)qw_floor((double)(pixels * probe[k][0]) + 0.5),
            y = (int)j + (int)qw_floor((double)(pixels * probe[k][1]) + 0.5);
        if (x < 0 || y < 0 || x >= (int)v->area.width || y >= (int)v->area.height) continue;
        float there = v->depth[(size_t)y * v->area.width + (size_t)x];
        if (there <= 0) continue;
        qw_vec3 to = qw_sub(place_of(v, (uint32_t)x, (uint32_t)y, there), p);
        float d2 = qw_length2(to), fall = 1 - d2 / (reach * reach);
        if (fall > 0 && d2 > 0) hidden += fall * larger(qw_dot(to, n) / sqrtf(d2) - 0.12f, 0);
    }
    return hidden / PROBES;
}

/* How open to the sky each pixel is, from 0 to 1. */
static void find_shadows(void *user, uint32_t begin, uint32_t end)
{
    view *v = user;
    for (uint32_t j = begin; j < end; j++)
        for (uint32_t i = 0; i < v->area.width; i++) {
            uint32_t at = middle_sample(v, i, j), id = v->raster.id[at];
            float depth = v->raster.depth[at], open = 1;
            if (id != RASTER_NOTHING && !(id & BALL)) {
                uint32_t x = i * v->side + v->side / 2, y = j * v->side + v->side / 2;
                qw_vec3 n = surface_at(v, id, (float)x + 0.5f, (float)y + 0.5f).normal;
                open = larger(1 - 2.6f * hidden_sky(v, i, j, place_of(v, i, j, depth), n, depth), 0);
            }
            v->shadow[(size_t)j * v->area.width + i] = open;
        }
}

/* Averages a tile around each pixel, over what lies at about the same depth. */
static void smooth_shadows(void *user, uint32_t begin, uint32_t end)
{
    view *v = user;
    for (uint32_t j = begin; j < end; j++)
        for (uint32_t i = 0; i < v->area.width; i++) {
            float sum = 0, count = 0, depth = v->depth[(size_t)j * v->area.width + i];
            for (int y = (int)j - TILE / 2; y < (int)j + TILE / 2 && depth > 0; y++)
                for (int x = (int)i - TILE / 2; x < (int)i + TILE / 2; x++) {
                    if (x < 0 || y < 0 || x >= (int)v->area.width || y >= (int)v->area.height) continue;
                    float there = v->depth[(size_t)y * v->area.width + (size_t)x];
                    if (there <= 0 || fabsf(1 / there - 1 / depth) > 0.15f * reach) continue;
                    sum += v->shadow[(size_t)y * v->area.width + (size_t)x];
                    count++;
                }
            v->smooth_shadow[(size_t)j * v->area.width + i] = count > 0 ? sum / count : 1;
        }
}

/* ---- colours */

static float linear_of(uint8_t c) { return (float)qw_pow((double)c / 255, 2.2); }
static uint8_t byte_of(float c) { return (uint8_t)(255 * qw_pow((double)smaller(larger(c, 0), 1), 1 / 2.2) + 0.5); }
static colour mix(colour a, colour b, float t)
{
    return (colour){a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b)};
}
static colour times(colour a, colour b) { return (colour){a.r * b.r, a.g * b.g, a.b * b.b}; }
static void add(colour *a, colour b, float s) { a->r += s * b.r, a->g += s * b.g, a->b += s * b.b; }

static const colour front_material = {0.70f, 0.685f, 0.655f}, back_material = {0.46f, 0.26f, 0.30f};
static const colour wire_colour = {0.012f, 0.016f, 0.026f}, boundary_colour = {0.0f, 0.16f, 0.20f},
                    broken_colour = {0.80f, 0.0f, 0.50f}, line_colour = {0.0f, 0.05f, 0.42f},
                    ring_colour = {0.0f, 0.36f, 0.12f};

/* A warm light from the upper left, a cool one from the right, and the sky; all hang on the camera. */
static colour lit(colour material, qw_vec3 n, float open, float shine)
{
    const qw_vec3 key = {-0.42f, 0.58f, 0.70f}, fill = {0.85f, 0.05f, 0.52f}, half = {-0.228f, 0.315f, 0.921f};
    const colour key_light = {0.80f, 0.77f, 0.72f}, fill_light = {0.14f, 0.17f, 0.22f};
    const colour sky = {0.30f, 0.32f, 0.35f}, ground = {0.15f, 0.14f, 0.13f};
    colour light = {0, 0, 0};
    add(&light, mix(ground, sky, 0.5f + 0.5f * n.y), open);
    add(&light, key_light, larger((qw_dot(n, key) + 0.15f) / 1.15f, 0) * (0.45f + 0.55f * open));
    add(&light, fill_light, larger((qw_dot(n, fill) + 0.3f) / 1.3f, 0) * open);
    colour c = times(material, light);
    float s = larger(qw_dot(n, half), 0);
    s *= s, s *= s, s *= s;
    s *= s * s * s * s * shine * open; /* the 40th power */
    return (colour){c.r + s, c.g + s, c.b + s};
}

static float distance_to_side(raster_point a, raster_point b, float x, float y)
{
    float dx = b.x - a.x, dy = b.y - a.y, l = dx * dx + dy * dy, t = 0;
    if (l > 0) t = smaller(larger(((x - a.x) * dx + (y - a.y) * dy) / l, 0), 1);
    dx = x - a.x - t * dx, dy = y - a.y - t * dy;
    return dx * dx + dy * dy;
}

/* Blends the sides of the face over what was shaded. */
static colour with_wires(const view *v, uint32_t face, float x, float y, colour c)
{
    const scene *s = v->scene;
    float nearest[SCENE_KINDS] = {INFINITY, INFINITY, INFINITY, INFINITY, INFINITY};
    uint32_t begin = s->edges.face_begin[face], end = s->edges.face_begin[face + 1];
    for (uint32_t k = begin; k < end; k++) {
        float *d = &nearest[s->edge_kind[k]];
        *d = smaller(*d, distance_to_side(v->points[s->mesh->corners[k]],
                                          v->points[s->mesh->corners[k + 1 == end ? begin : k + 1]], x, y));
    }
    const colour colours[SCENE_KINDS] = {wire_colour, boundary_colour, broken_colour, line_colour, ring_colour};
    const float widths[SCENE_KINDS] = {v->line * (0.5f + 0.5f * v->fade[face]), 2.6f * v->line, 3.2f * v->line,
                                       2.4f * v->line, 2.4f * v->line};
    /* beside lines the plain wires stand back */
    const float strengths[SCENE_KINDS] = {(s->lines || s->closed ? 0.4f : 0.88f) * v->fade[face], 1, 1, 1, 1};
    for (int kind = 0; kind < SCENE_KINDS; kind++) {
        float width = widths[kind] + 0.5f;
        if (nearest[kind] > width * width) continue;
        float cover = smaller(width - sqrtf(nearest[kind]), 1);
        c = mix(c, colours[kind], cover * strengths[kind]);
    }
    return c;
}

/* The colour of what lies at a sample: a dot, a painted face or plain material, in its light. */
static colour shade(const view *v, uint32_t id, float x, float y, float open)
{
    surface_point p = surface_at(v, id, x, y);
    if (!(id & BALL)) {
        colour material = p.back ? back_material : front_material;
        if (v->scene->paint) {
            const uint8_t *c = v->scene->paint[v->scene->edges.face[id]];
            material = mix(material, (colour){linear_of(c[0]), linear_of(c[1]), linear_of(c[2])}, (float)c[3] / 255);
        }
        return lit(material, p.normal, open, 0.05f);
    }
    colour own = v->kinds[v->scene->dots[id & ~BALL].kind];
    return mix(lit(own, p.normal, 1, 0.25f), own, 0.55f);
}

/* Colours rows of the picture: each pixel is the mean of the samples that it was drawn with. */
static void colour_rows(void *user, uint32_t begin, uint32_t end)
{
    view *v = user;
    float share = 1.0f / (float)(v->side * v->side);
    for (uint32_t j = begin; j < end; j++)
        for (uint32_t i = 0; i < v->area.width; i++) {
            uint8_t *out = v->picture->rgb + 3 * ((size_t)(v->area.y + j) * v->picture->width + v->area.x + i);
            float open = v->smooth_shadow[(size_t)j * v->area.width + i];
            colour sum = {0, 0, 0}, c = {0, 0, 0};
            uint32_t empty = 0, shaded = RASTER_NOTHING;
            for (uint32_t k = 0; k < v->side * v->side; k++) {
                uint32_t x = i * v->side + k % v->side, y = j * v->side + k / v->side,
                         id = v->raster.id[(size_t)y * v->raster.width + x];
                if (id == RASTER_NOTHING) {
                    empty++;
                    continue;
                }
                if (id != shaded || id & BALL) /* a face changes little within a pixel */
                    c = shade(v, id, (float)x + 0.5f, (float)y + 0.5f, open);
                shaded = id;
                bool wired = v->wires && !(id & BALL);
                add(&sum, wired ? with_wires(v, v->scene->edges.face[id], (float)x + 0.5f, (float)y + 0.5f, c) : c,
                    share);
            }
            if (empty == v->side * v->side) continue;
            add(&sum, (colour){linear_of(out[0]), linear_of(out[1]), linear_of(out[2])}, (float)empty * share);
            out[0] = byte_of(sum.r), out[1] = byte_of(sum.g), out[2] = byte_of(sum.b);
        }
}

void view_draw(qw_env *env, const scene *s, const view_camera *camera, bool wires, bool dots, picture *p,
               view_area area)
{
    qw_scope_begin(env);
    view v = {
        .scene = s, .camera = *camera, .side = MOST_SIDE, .wires = wires, .dots = dots, .area = area, .picture = p};
    uint64_t pixels = (uint64_t)area.width * area.height;
    while (v.side > 1 && pixels * v.side * v.side > most_samples) v.side--;
    v.camera.scale *= (float)v.side, v.camera.left *= (float)v.side, v.camera.top *= (float)v.side;
    v.line = 0.5f * (float)v.side * larger(1.0f, (float)area.height / 950.0f);
    v.raster = (raster){.width = area.width * v.side, .height = area.height * v.side};
    v.raster.depth = QW_NEW(env, float, pixels *v.side *v.side);
    v.raster.id = QW_NEW(env, uint32_t, pixels * v.side * v.side);
    v.raster.row_depth = QW_NEW(env, float, (size_t)raster_columns(&v.raster) * v.raster.height);
    v.raster.tile_depth = QW_NEW(env, float, (size_t)raster_columns(&v.raster) * raster_rows(&v.raster));
    v.points = QW_NEW(env, raster_point, s->mesh->vertex_count);
    v.fade = QW_NEW(env, float, s->mesh->face_count);
    v.centres = QW_NEW(env, raster_point, s->dot_count);
    v.radii = QW_NEW(env, float, s->dot_count);
    v.depth = QW_NEW(env, float, pixels);
    v.shadow = QW_NEW(env, float, pixels);
    v.smooth_shadow = QW_NEW(env, float, pixels);
    for (uint32_t i = 0; i < s->mesh->vertex_count; i++) v.points[i] = project(&v.camera, s->position[i]);
    qw_parallel(env, s->mesh->face_count, 8192, project_faces, &v);
    find_fades(env, &v);
    place_dots(&v);
    place_probes(&v);
    for (int k = 0; k < RENDER_KINDS; k++) {
        const uint8_t *c = render_kind_colour[k];
        v.kinds[k] = (colour){linear_of(c[0]), linear_of(c[1]), linear_of(c[2])};
    }
    uint32_t tiles = raster_rows(&v.raster) / BANDS + 1;
    qw_parallel(env, v.raster.height, tiles * RASTER_TILE_HEIGHT, draw_band, &v);
    qw_parallel(env, area.height, 16, gather_depths, &v);
    qw_parallel(env, area.height, 16, find_shadows, &v);
    qw_parallel(env, area.height, 16, smooth_shadows, &v);
    qw_parallel(env, area.height, 16, colour_rows, &v);
    qw_scope_end(env);
}
