/* The texture is cut into tiles of TILE x TILE texels, which are filled by themselves on the run's threads: each knows
 * the triangles that may touch it. A texel is the mean of its samples that lie on a triangle; each sample is taken
 * once, by the first triangle that holds it. */
#include "products/bake/maps.h"

#include "base/hash.h"
#include "products/bake/pad.h"
#include "base/elementary.h"
#include "geometry/openness.h"
#include "geometry/polygons.h"

#include <assert.h>
#include <string.h>

enum {
    TILE = 16,
    BLOCK = 4,     /* texels along a side of what is looked at together */
    VALUES = 15,   /* of a sample: colour 4, normal 3, orm 3, emission 3, occlusion 1, height 1 */
    CHECKS = 20000 /* points at which maps are compared with the input */
};
static const double BEFORE = 0.15, AFTER = 0.9; /* shares of the work on all maps when texels begin and end */
static const float OCCLUSION_REACH = 0.25f;     /* diagonals that rays of ambient occlusion go */
static const struct {
    uint32_t first, channels, bits;
} layout[QW_MAP_COUNT] = {
    [QW_MAP_COLOR] = {0, 4, 8},     [QW_MAP_NORMAL] = {4, 3, 8},     [QW_MAP_ORM] = {7, 3, 8},
    [QW_MAP_EMISSION] = {10, 3, 8}, [QW_MAP_OCCLUSION] = {13, 1, 8}, [QW_MAP_HEIGHT] = {14, 1, 16}};

typedef struct baker {
    const qw_bake_target *target;
    const qw_look *look;
    qw_maps *made;
    uint32_t maps, tiles, texels, samples, across; /* across: TILEs along a side */
    uint32_t begin;                                /* of the TILEs that are made now */
    float farthest;
    uint32_t *first, *item; /* triangles by TILE: item[first[i]] .. item[first[i + 1] - 1] */
    uint8_t *covered;       /* uint8_t[tiles][texels][texels]: 1 on charts */
    uint32_t *missed;       /* uint32_t[TILEs] */
    const uint8_t *coded;   /* uint8_t[4096]: sRGB of linear i / 4095 */
    qw_open_rays rays;
} baker;

/* ---- which triangles touch which tiles */

/* Corners of a triangle in texels of its tile, y downward. */
static uint32_t corners_of(const baker *b, uint32_t triangle, double p[3][2])
{
    const uint32_t *c = b->target->corner + 3 * (size_t)triangle;
    double middle = 0;
    for (int k = 0; k < 3; k++) middle += (double)b->target->uv[2 * (size_t)c[k]] / 3;
    double tile = qw_floor(middle);
    for (int k = 0; k < 3; k++) {
        const float *uv = b->target->uv + 2 * (size_t)c[k];
        p[k][0] = ((double)uv[0] - tile) * b->texels, p[k][1] = (1 - (double)uv[1]) * b->texels;
    }
    return tile < 0 ? 0 : tile < b->tiles ? (uint32_t)tile : b->tiles - 1;
}

typedef struct box {
    uint32_t x0, x1, y0, y1; /* the last ones included */
} box;

/* The cells that a triangle reaches, of `size` along a side. */
static box box_of(const double p[3][2], uint32_t size, double unit)
{
    double least[2], most[2];
    uint32_t b[4];
    for (int r = 0; r < 2; r++) {
        least[r] = fmin(p[0][r], fmin(p[1][r], p[2][r])), most[r] = fmax(p[0][r], fmax(p[1][r], p[2][r]));
        least[r] = qw_floor(least[r] / unit), most[r] = qw_floor(most[r] / unit);
        b[2 * r] = least[r] < 0 ? 0 : least[r] < size ? (uint32_t)least[r] : size - 1;
        b[2 * r + 1] = most[r] < 0 ? 0 : most[r] < size ? (uint32_t)most[r] : size - 1;
    }
    return (box){b[0], b[1], b[2], b[3]};
}

/* Lists for each tile of texels the triangles that reach it: counted first, then listed. */
static void sort_triangles(qw_env *env, baker *b)
{
    size_t count = (size_t)b->across * b->across * b->tiles;
    b->first = QW_NEW_ZERO(env, uint32_t, count + 2);
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t f = 0; f < b->target->triangle_count; f++) {
            double p[3][2];
            uint32_t tile = corners_of(b, f, p);
            box t = box_of((const double(*)[2])p, b->across, TILE);
            for (uint32_t y = t.y0; y <= t.y1; y++)
                for (uint32_t x = t.x0; x <= t.x1; x++) {
                    size_t i = ((size_t)tile * b->across + y) * b->across + x;
                    if (pass) b->item[b->first[i + 1]++] = f;
                    else b->first[i + 2]++;
                }
        }
        if (pass) return;
        for (size_t i = 2; i < count + 2; i++) b->first[i] += b->first[i - 1];
        b->item = QW_NEW(env, uint32_t, b->first[count + 1]);
    }
}

/* ---- samples */

typedef struct tile_sums {
    float sum[TILE * TILE][VALUES];
    uint64_t taken[TILE * TILE]; /* bits of the samples that were */
    uint8_t missed[TILE * TILE];
} tile_sums;

/* A triangle in a tile, and samples on it that are looked from together. */
typedef struct visit {
    const baker *b;
    uint32_t x0, y0; /* of the tile, in texels */
    double p[3][2];  /* corners of the triangle, in texels */
    qw_bake_face face;
    tile_sums *sums;
    float block[3][3];  /* weights of the centre and of two corners of the block that the samples are in */
    bool is_filled;     /* the cache is that block's */
    qw_bvh_cache cache; /* what rays of the block can meet */
    uint32_t hint;      /* what was met last */
    uint32_t held;      /* samples, of four */
    uint32_t x[QW_LANES], y[QW_LANES], s[QW_LANES]; /* texels in the map, and which of its samples */
    qw_lanes weight[3];
} visit;

/* Coordinates of vectors along three unit vectors that need not be orthogonal. */
static qw_vec3_lanes along(qw_vec3_lanes a, qw_vec3_lanes x, qw_vec3_lanes y, qw_vec3_lanes z)
{
    qw_vec3_lanes yz = qw_cross4(y, z), zx = qw_cross4(z, x), xy = qw_cross4(x, y);
    qw_lanes det = qw_dot4(x, yz), size = qw_choose(det < 0, -det, det), none = qw_lanes_of(0);
    qw_lanes_mask good = size > 1e-6f;
    qw_vec3_lanes n = qw_normalize4((qw_vec3_lanes){qw_dot4(a, yz) / det, qw_dot4(a, zx) / det, qw_dot4(a, xy) / det});
    return (qw_vec3_lanes){qw_choose(good, n.x, none), qw_choose(good, n.y, none),
                           qw_choose(good, n.z, qw_lanes_of(1))};
}

/* What a sample sees is added to its texel. n: the normal that it sees, along those of the target. */
static void add_sample(visit *v, int lane, const qw_sight *s, const qw_seen *seen, qw_vec3 n)
{
    const baker *b = v->b;
    uint32_t i = (v->y[lane] - v->y0) * TILE + v->x[lane] - v->x0;
    assert(i < TILE * TILE);
    /* samples of 3 x 2 have the rays of one spiral */
    uint32_t parts = b->samples > 1 ? QW_OPEN_RAYS / 4 : 1, across = parts > 1 ? 3 : 1, down = parts / across;
    uint32_t x = v->x[lane] * b->samples + v->s[lane] % b->samples,
             y = v->y[lane] * b->samples + v->s[lane] / b->samples;
    uint64_t chance = (uint64_t)(y / down) << 32 | x / across;
    uint32_t part = x % across + across * (y % down);
    if (s->triangle == QW_NONE) {
        v->sums->sum[i][6] += 1, v->sums->missed[i] = 1;
        return;
    }
    float value[VALUES] = {seen->color[0],
                           seen->color[1],
                           seen->color[2],
                           seen->color[3],
                           n.x,
                           n.y,
                           n.z,
                           seen->occlusion,
                           seen->roughness,
                           seen->metallic,
                           seen->emission[0],
                           seen->emission[1],
                           seen->emission[2],
                           1,
                           s->height};
    if (b->maps >> QW_MAP_OCCLUSION & 1)
        value[13] = qw_openness(b->look->source->bvh, &b->rays, s->point, b->look->source->normal[s->triangle], 1e-5f,
                                (double)(qw_mix(chance) >> 11) * 0x1p-53, OCCLUSION_REACH, s->triangle, part, parts);
    for (int k = 0; k < VALUES; k++) v->sums->sum[i][k] += value[k];
    v->sums->missed[i] |= s->is_missed;
}

/* Looks from the samples that are held. */
static void look(visit *v)
{
    const baker *b = v->b;
    assert(v->held <= QW_LANES);
    if (v->held == 0) return;
    if (!v->is_filled)
        qw_bake_fill_cache(b->look->source, &v->face, (const float(*)[3])v->block, &v->cache), v->is_filled = true;
    qw_bake_points at = qw_bake_points_of(&v->face, v->weight);
    qw_vec3_lanes normal = at.normal;
    qw_sight sight[QW_LANES];
    qw_seen seen[QW_LANES];
    qw_bake_see(b->look->source, &at, v->held, &v->hint, &v->cache, sight);
    for (int i = 0; i < (int)v->held; i++) {
        if (sight[i].triangle == QW_NONE) continue;
        seen[i] = qw_look_at(b->look, sight[i].triangle, sight[i].weight);
        qw_put_lane(&normal, i, seen[i].normal);
    }
    normal = along(normal, at.tangent, at.across, at.normal);
    for (int i = 0; i < (int)v->held; i++) add_sample(v, i, &sight[i], &seen[i], qw_lane(&normal, i));
    v->held = 0;
}

/* ---- one tile */

/* Weights of a point in the plane of a triangle; false where it lies outside. */
static bool weigh(const double p[3][2], double x, double y, float w[3])
{
    double det = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    double b = ((x - p[0][0]) * (p[2][1] - p[0][1]) - (y - p[0][1]) * (p[2][0] - p[0][0])) / det;
    double c = ((p[1][0] - p[0][0]) * (y - p[0][1]) - (p[1][1] - p[0][1]) * (x - p[0][0])) / det, a = 1 - b - c;
    w[0] = (float)a, w[1] = (float)b, w[2] = (float)c;
    return a >= 0 && b >= 0 && c >= 0;
}

/* The samples of a texel that the triangle holds. */
static void take_texel(visit *v, uint32_t x, uint32_t y)
{
    uint32_t across = v->b->samples;
    uint64_t *taken = &v->sums->taken[(y - v->y0) * TILE + x - v->x0];
    for (uint32_t s = 0; s < across * across; s++) {
        float w[3];
        double sx = x + (s % across + 0.5) / across, sy = y + (s / across + 0.5) / across;
        if (*taken >> s & 1 || !weigh((const double(*)[2])v->p, sx, sy, w)) continue;
        *taken |= UINT64_C(1) << s;
        for (int k = 0; k < 3; k++) v->weight[k][v->held] = w[k];
        v->x[v->held] = x, v->y[v->held] = y, v->s[v->held++] = s;
        if (v->held == QW_LANES) look(v);
    }
}

static void begin_visits(visit *v, const baker *b, uint32_t x0, uint32_t y0, tile_sums *sums)
{
    v->b = b, v->x0 = x0, v->y0 = y0, v->sums = sums, v->hint = QW_NONE, v->held = 0;
    for (int k = 0; k < 3; k++) v->weight[k] = qw_lanes_of(1 / 3.0f);
}

/* Block by block, as the rays of a block can meet the same few faces of the input. */
static void visit_triangle(visit *v, uint32_t triangle)
{
    const double(*p)[2] = (const double(*)[2])v->p;
    corners_of(v->b, triangle, v->p);
    v->face = qw_bake_face_of(v->b->target, triangle);
    box t = box_of(p, v->b->texels, 1);
    uint32_t x1 = t.x1 < v->x0 + TILE - 1 ? t.x1 : v->x0 + TILE - 1;
    uint32_t y1 = t.y1 < v->y0 + TILE - 1 ? t.y1 : v->y0 + TILE - 1;
    for (uint32_t by = t.y0 > v->y0 ? t.y0 : v->y0; by <= y1; by += BLOCK)
        for (uint32_t bx = t.x0 > v->x0 ? t.x0 : v->x0; bx <= x1; bx += BLOCK) {
            v->is_filled = false;
            weigh(p, bx + BLOCK / 2.0, by + BLOCK / 2.0, v->block[0]);
            weigh(p, bx, by, v->block[1]), weigh(p, bx + BLOCK, by, v->block[2]);
            for (uint32_t y = by; y <= y1 && y < by + BLOCK; y++)
                for (uint32_t x = bx; x <= x1 && x < bx + BLOCK; x++) take_texel(v, x, y);
            look(v);
        }
}

static uint8_t to_byte(float x) { return (uint8_t)(!(x > 0) ? 0 : x >= 1 ? 255 : (int)(x * 255 + 0.5f)); }

static uint8_t to_coded(const baker *b, float x)
{
    return b->coded[!(x > 0) ? 0 : x >= 1 ? 4095 : (int)(x * 4095 + 0.5f)];
}

/* The mean of the samples of a texel, as the maps hold it. */
static void put_texel(const baker *b, uint32_t tile, uint32_t x, uint32_t y, const float *sum, float count)
{
    assert(count > 0);
    float v[VALUES];
    for (int k = 0; k < VALUES; k++) v[k] = sum[k] / count;
    qw_vec3 n = qw_normalize(qw_v3(v[4], v[5], v[6]));
    v[4] = n.x / 2 + 0.5f, v[5] = n.y / 2 + 0.5f, v[6] = n.z / 2 + 0.5f;
    for (int map = 0; map < QW_MAP_COUNT; map++) {
        const qw_picture *p = &b->made->picture[tile * QW_MAP_COUNT + (uint32_t)map];
        if (!p->pixels) continue;
        size_t at = ((size_t)y * p->width + x) * p->channels;
        if (map == QW_MAP_HEIGHT) {
            double h = 0.5 + 0.5 * (double)v[14] / (double)b->farthest;
            ((uint16_t *)p->pixels)[at] = (uint16_t)(!(h > 0) ? 0 : h >= 1 ? 65535 : h * 65535 + 0.5);
            continue;
        }
        for (uint32_t c = 0; c < p->channels; c++) {
            bool is_coded = c < 3 && (map == QW_MAP_COLOR || map == QW_MAP_EMISSION);
            float value = v[layout[map].first + c];
            ((uint8_t *)p->pixels)[at + c] = is_coded ? to_coded(b, value) : to_byte(value);
        }
    }
}

/* Bakes tiles of texels: the mean of the samples that triangles cover in each. */
static void bake_tiles(void *user, uint32_t begin, uint32_t end)
{
    baker *b = user;
    for (uint32_t i = b->begin + begin; i < b->begin + end; i++) {
        tile_sums sums;
        visit v;
        uint32_t x0 = i % b->across * TILE, y0 = i / b->across % b->across * TILE, tile = i / b->across / b->across;
        assert(tile < b->tiles);
        b->missed[i] = 0;
        if (b->first[i] == b->first[i + 1]) continue;
        memset(&sums, 0, sizeof sums);
        begin_visits(&v, b, x0, y0, &sums);
        for (uint32_t k = b->first[i]; k < b->first[i + 1]; k++) visit_triangle(&v, b->item[k]);
        for (uint32_t k = 0; k < TILE * TILE; k++) {
            uint32_t x = x0 + k % TILE, y = y0 + k / TILE;
            if (!sums.taken[k] || x >= b->texels || y >= b->texels) continue;
            b->covered[((size_t)tile * b->texels + y) * b->texels + x] = 1;
            b->missed[i] += sums.missed[k];
            put_texel(b, tile, x, y, sums.sum[k], (float)__builtin_popcountll(sums.taken[k]));
        }
    }
}

/* Some at a time, so that the host hears how far it is. */
static void bake_all(qw_env *env, baker *b, uint32_t count)
{
    enum { PARTS = 40, GRAIN = 4 };
    uint32_t part = (count / PARTS / GRAIN + 1) * GRAIN;
    for (b->begin = 0; b->begin < count; b->begin += part) {
        qw_progress_work(env, BEFORE + (AFTER - BEFORE) * b->begin / count);
        qw_parallel(env, count - b->begin < part ? count - b->begin : part, GRAIN, bake_tiles, b);
    }
    qw_progress_work(env, AFTER);
}

typedef struct smoothing {
    const baker *b;
    const uint8_t *covered;
    uint8_t *pixels;
    const uint8_t *before; /* uint8_t[texels][texels] */
} smoothing;

/* Rows of a map, each texel the mean of the covered ones of three by three. */
static void smooth_rows(void *user, uint32_t begin, uint32_t end)
{
    const smoothing *m = user;
    uint32_t n = m->b->texels;
    for (uint32_t y = begin; y < end; y++)
        for (uint32_t x = 0; x < n; x++) {
            uint32_t sum = 0, count = 0;
            for (uint32_t i = y - (y > 0); i <= y + 1 && i < n; i++)
                for (uint32_t k = x - (x > 0); k <= x + 1 && k < n; k++)
                    if (m->covered[(size_t)i * n + k]) sum += m->before[(size_t)i * n + k], count++;
            if (m->covered[(size_t)y * n + x]) m->pixels[(size_t)y * n + x] = (uint8_t)((sum + count / 2) / count);
        }
}

/* Few rays leave noise, which the texels around take away. */
static void smooth_occlusion(qw_env *env, const baker *b)
{
    enum { ROWS = 16 };
    size_t size = (size_t)b->texels * b->texels;
    if (!(b->maps >> QW_MAP_OCCLUSION & 1)) return;
    uint8_t *before = QW_NEW(env, uint8_t, size);
    for (uint32_t i = 0; i < b->tiles; i++) {
        smoothing m = {b, b->covered + size * i, b->made->picture[i * QW_MAP_COUNT + QW_MAP_OCCLUSION].pixels, before};
        memcpy(before, m.pixels, size);
        qw_parallel(env, b->texels, ROWS, smooth_rows, &m);
    }
    qw_free(env, before);
}

/* ---- how far the maps are from the input */

/* The picture at (x, y) in texels, between the four texels around. */
static void read_map(const qw_picture *p, double x, double y, double to[4])
{
    x -= 0.5, y -= 0.5;
    double fx = x - qw_floor(x), fy = y - qw_floor(y);
    for (uint32_t c = 0; c < p->channels; c++) {
        to[c] = 0;
        for (int i = 0; i < 4; i++) {
            int64_t px = (int64_t)qw_floor(x) + (i & 1), py = (int64_t)qw_floor(y) + (i >> 1);
            px = px < 0           ? 0
                 : px >= p->width ? p->width - 1
                                  : px,
            py = py < 0            ? 0
                 : py >= p->height ? p->height - 1
                                   : py;
            to[c] += (i & 1 ? fx : 1 - fx) * (i >> 1 ? fy : 1 - fy) *
                     ((const uint8_t *)p->pixels)[((size_t)py * p->width + (size_t)px) * p->channels + c] / 255.0;
        }
    }
}

/* A point of the target, and how far the maps are from the input there. */
typedef struct check {
    uint32_t triangle;
    float w[3];
    double angle, color;
} check;

typedef struct checks {
    const baker *b;
    check *at; /* check[count] */
    size_t capacity;
    uint32_t count;
} checks;

/* Adds by how much the maps, read at a point of the target, miss the normal, in degrees, and the colour that are seen
   there. */
static void check_point(const baker *b, uint32_t triangle, const float w[3], double *angle, double *color)
{
    double p[3][2], at[2] = {0, 0}, read[4];
    uint32_t tile = corners_of(b, triangle, p), hint = QW_NONE;
    for (int k = 0; k < 3; k++) at[0] += (double)w[k] * p[k][0], at[1] += (double)w[k] * p[k][1];
    qw_bake_face face = qw_bake_face_of(b->target, triangle);
    qw_bake_points point =
        qw_bake_points_of(&face, (const qw_lanes[3]){qw_lanes_of(w[0]), qw_lanes_of(w[1]), qw_lanes_of(w[2])});
    qw_sight sight[QW_LANES];
    qw_bake_see(b->look->source, &point, 1, &hint, NULL, sight);
    qw_sight s = sight[0];
    if (s.triangle == QW_NONE) return;
    qw_seen seen = qw_look_at(b->look, s.triangle, s.weight);
    const qw_picture *picture = &b->made->picture[tile * QW_MAP_COUNT];
    if (picture[QW_MAP_NORMAL].pixels) {
        read_map(&picture[QW_MAP_NORMAL], at[0], at[1], read);
        qw_vec3 n = qw_scale(qw_lane(&point.tangent, 0), (float)(2 * read[0] - 1));
        n = qw_madd(n, (float)(2 * read[1] - 1), qw_lane(&point.across, 0));
        n = qw_madd(n, (float)(2 * read[2] - 1), qw_lane(&point.normal, 0));
        double cosine = (double)qw_dot(qw_normalize(n), seen.normal);
        *angle += qw_acos(cosine < -1 ? -1 : cosine > 1 ? 1 : cosine) * 180 / QW_PI;
    }
    if (picture[QW_MAP_COLOR].pixels) {
        read_map(&picture[QW_MAP_COLOR], at[0], at[1], read);
        for (int c = 0; c < 3; c++) *color += fabs(read[c] - qw_to_srgb((double)seen.color[c])) * 255 / 3;
    }
}

static void check_points(void *user, uint32_t begin, uint32_t end)
{
    const checks *all = user;
    for (uint32_t i = begin; i < end; i++)
        check_point(all->b, all->at[i].triangle, all->at[i].w, &all->at[i].angle, &all->at[i].color);
}

/* Points that are spread evenly over the target by its area. */
static checks list_checks(qw_env *env, const baker *b)
{
    const qw_bake_target *t = b->target;
    double total = 0, sum = 0;
    uint64_t chance = 1;
    checks all = {.b = b};
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t f = 0; f < t->triangle_count; f++) {
            const uint32_t *c = t->corner + 3 * (size_t)f;
            qw_vec3 n = qw_cross(qw_sub(t->place[c[1]], t->place[c[0]]), qw_sub(t->place[c[2]], t->place[c[0]]));
            if (!pass) {
                total += (double)qw_length(n);
                continue;
            }
            for (sum += (double)qw_length(n); total > 0 && (double)all.count < sum / total * CHECKS; all.count++) {
                double u = (double)((chance = qw_mix(chance)) >> 11) / 9007199254740992.0;
                double v = (double)((chance = qw_mix(chance)) >> 11) / 9007199254740992.0, r = sqrt(u);
                all.at = qw_grow(env, all.at, &all.capacity, all.count + (size_t)1, sizeof *all.at);
                all.at[all.count] = (check){f, {(float)(1 - r), (float)(r * (1 - v)), (float)(r * v)}, 0, 0};
            }
        }
    return all;
}

static void check_maps(qw_env *env, const baker *b)
{
    checks all = list_checks(env, b);
    double angle = 0, color = 0;
    qw_parallel(env, all.count, 256, check_points, &all);
    for (uint32_t i = 0; i < all.count; i++) angle += all.at[i].angle, color += all.at[i].color;
    if (all.count == 0) return;
    if (b->maps >> QW_MAP_NORMAL & 1) b->made->normal_error = angle / all.count;
    if (b->maps >> QW_MAP_COLOR & 1) b->made->color_error = color / all.count;
}

/* ---- all */

/* Makes empty pictures for the maps that are asked for, in every tile. */
static void begin_pictures(qw_env *env, baker *b)
{
    b->made->picture = QW_NEW_ZERO(env, qw_picture, b->tiles * (size_t)QW_MAP_COUNT);
    for (uint32_t i = 0; i < b->tiles * QW_MAP_COUNT; i++) {
        uint32_t map = i % QW_MAP_COUNT;
        if (!(b->maps >> map & 1)) continue;
        qw_picture *p = &b->made->picture[i];
        *p = (qw_picture){
            .width = b->texels, .height = b->texels, .channels = layout[map].channels, .bits = layout[map].bits};
        if (map == QW_MAP_COLOR && b->look->alpha == 0) p->channels = 3;
        p->pixels = qw_alloc_zero(env, (size_t)p->width * p->height, p->channels * p->bits / 8);
    }
}

qw_maps qw_bake_maps(qw_env *env, const qw_bake_target *target, const qw_look *look, uint32_t maps, uint32_t tiles,
                     uint32_t texels, uint32_t samples, uint32_t pad, float farthest)
{
    qw_maps made = {.tiles = tiles, .height_scale = farthest, .normal_error = -1, .color_error = -1};
    baker b = {.target = target,
               .look = look,
               .made = &made,
               .maps = maps,
               .tiles = tiles,
               .texels = texels,
               .samples = samples,
               .across = (texels + TILE - 1) / TILE,
               .farthest = farthest > 0 ? farthest : 1,
               .rays = qw_begin_open_rays()};
    uint32_t count = b.across * b.across * tiles;
    assert(samples >= 1 && samples * samples <= 64);
    begin_pictures(env, &b);
    qw_scope_begin(env);
    uint8_t *coded = QW_NEW(env, uint8_t, 4096);
    for (int i = 0; i < 4096; i++) coded[i] = (uint8_t)(qw_to_srgb(i / 4095.0) * 255 + 0.5);
    b.coded = coded, b.covered = QW_NEW_ZERO(env, uint8_t, (size_t)texels * texels * tiles);
    b.missed = QW_NEW(env, uint32_t, count);
    sort_triangles(env, &b);
    bake_all(env, &b, count);
    smooth_occlusion(env, &b);
    for (uint32_t i = 0; i < count; i++) made.missed += b.missed[i];
    for (size_t i = 0; i < (size_t)texels * texels * tiles; i++) made.texels += b.covered[i];
    for (uint32_t i = 0; i < tiles; i++)
        qw_pad_pictures(env, made.picture + i * QW_MAP_COUNT, QW_MAP_COUNT, b.covered + (size_t)texels * texels * i,
                        texels, pad);
    check_maps(env, &b); /* as what is written shows it */
    qw_scope_end(env);
    return made;
}
