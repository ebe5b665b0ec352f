#include "products/atlas/blocks.h"

#include "base/elementary.h"
#include "products/atlas/flat.h"

#include <assert.h>
#include <string.h>

typedef struct block {
    uint32_t *face; /* uint32_t[count] */
    uint32_t count;
    uint32_t side[2]; /* in quads; 0: it is no rectangle */
    uint32_t at[2];   /* in quads, of a tile */
    uint32_t tile;
    bool is_turned; /* by a quarter: its first side runs up */
} block;

typedef struct layer {
    qw_env *env;
    qw_atlas_mesh *m;
    uint32_t room;     /* quads along a side of a tile */
    uint32_t longest;  /* quads along a side of a block, at most */
    double (*uv)[2];   /* double[corner_count][2]: of each corner in its block, in quads */
    uint8_t *is_taken; /* uint8_t[face_count] */
    block *block;
    uint32_t count;
} layer;

/* ---- rectangles */

static bool is_quad(const qw_atlas_mesh *m, uint32_t f) { return m->begin[f + 1] - m->begin[f] == 4; }

/* The half-edge at which a rectangle begins: the boundary leaves no room for a second quad beside it. */
static uint32_t find_corner(const qw_atlas_mesh *m, const block *b)
{
    for (uint32_t i = 0; i < b->count; i++)
        for (uint32_t c = m->begin[b->face[i]]; c < m->begin[b->face[i] + 1]; c++)
            if (m->seam[c] && m->seam[qw_atlas_prev(m, c)]) return c;
    return QW_NONE;
}

/* Takes the row of quads whose first one stands on half-edge c; returns how many, 0 where one is no quad or belongs to
   the rectangle already. */
static uint32_t take_row(layer *k, uint32_t c, uint32_t row)
{
    const qw_atlas_mesh *m = k->m;
    for (uint32_t column = 0;; column++) {
        uint32_t f = m->face[c], e = c;
        if (!is_quad(m, f) || k->is_taken[f] || (row > 0) == (m->seam[c] != 0)) return 0;
        k->is_taken[f] = 1;
        static const uint32_t corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (int i = 0; i < 4; i++, e = qw_atlas_next(m, e))
            k->uv[e][0] = column + corner[i][0], k->uv[e][1] = row + corner[i][1];
        uint32_t right = qw_atlas_next(m, c);
        if (m->seam[right]) return column + 1;
        c = qw_atlas_next(m, m->twin[right]);
    }
}

/* Row by row, until the boundary; all must be as long. */
static bool lay_rectangle(layer *k, block *b)
{
    const qw_atlas_mesh *m = k->m;
    uint32_t c = find_corner(m, b), held = 0;
    b->side[0] = b->side[1] = 0;
    for (uint32_t i = 0; i < b->count; i++) k->is_taken[b->face[i]] = 0;
    for (uint32_t row = 0; c != QW_NONE; row++) {
        uint32_t length = take_row(k, c, row), up = qw_atlas_next(m, qw_atlas_next(m, c));
        if (length == 0 || (row > 0 && length != b->side[0])) return false;
        held += length, b->side[0] = length, b->side[1] = row + 1;
        c = m->seam[up] ? QW_NONE : m->twin[up];
    }
    return held == b->count && b->side[0] <= k->longest && b->side[1] <= k->longest;
}

/* A face that is no quad: a regular polygon within the square of one. */
static void lay_polygon(layer *k, block *b)
{
    const qw_atlas_mesh *m = k->m;
    uint32_t begin = m->begin[b->face[0]], size = m->begin[b->face[0] + 1] - begin;
    for (uint32_t i = 0; i < size; i++) {
        double angle = 2 * QW_PI * i / size;
        k->uv[begin + i][0] = (1 + qw_cos(angle)) / 2, k->uv[begin + i][1] = (1 + qw_sin(angle)) / 2;
    }
    b->side[0] = b->side[1] = 1;
}

/* Lists the faces of each block. */
static void take_blocks(layer *k)
{
    qw_atlas_mesh *m = k->m;
    uint32_t *of = qw_label_charts(k->env, m, &k->count);
    k->block = QW_NEW_ZERO(k->env, block, k->count);
    for (uint32_t f = 0; f < m->face_count; f++) k->block[of[f]].count++;
    for (uint32_t i = 0; i < k->count; i++)
        k->block[i].face = QW_NEW(k->env, uint32_t, k->block[i].count), k->block[i].count = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        block *b = &k->block[of[f]];
        b->face[b->count++] = f;
    }
    qw_free(k->env, of);
}

/* Splits patches until each is a rectangle that is not too long, or a single face. */
static void lay_blocks(layer *k)
{
    for (bool again = true; again;) {
        again = false;
        take_blocks(k);
        for (uint32_t i = 0; i < k->count; i++) {
            block *b = &k->block[i];
            if (lay_rectangle(k, b)) continue;
            if (b->count == 1) lay_polygon(k, b);
            else again |= qw_split_patch(k->env, k->m, b->face, b->count);
        }
    }
}

/* ---- packing */

/* How high each column of a tile is filled. */
typedef struct skyline {
    uint32_t *top; /* uint32_t[room] */
    uint32_t tile;
} skyline;

/* The lowest place of a block as it is turned, the leftmost of several. */
static bool find_place(const layer *k, const skyline *s, block *b)
{
    uint32_t across = b->side[b->is_turned], up = b->side[!b->is_turned];
    b->at[1] = QW_NONE;
    for (uint32_t x = 0; x + across <= k->room; x++) {
        uint32_t y = 0;
        for (uint32_t i = 0; i < across; i++) y = s->top[x + i] > y ? s->top[x + i] : y;
        if (y + up <= k->room && y < b->at[1]) b->at[0] = x, b->at[1] = y;
    }
    return b->at[1] != QW_NONE;
}

/* Upright, or where there is no room on its side. */
static bool place_block(const layer *k, skyline *s, block *b)
{
    bool found = find_place(k, s, b);
    if (!found) {
        b->is_turned = !b->is_turned;
        found = find_place(k, s, b);
    }
    if (!found) return false;
    for (uint32_t i = 0; i < b->side[b->is_turned]; i++) s->top[b->at[0] + i] = b->at[1] + b->side[!b->is_turned];
    b->tile = s->tile;
    return true;
}

/* The larger side first, then the smaller, then by number. */
static bool is_before(const block *a, const block *b)
{
    for (int pass = 0; pass < 2; pass++) {
        uint32_t x = a->side[a->is_turned ^ !pass], y = b->side[b->is_turned ^ !pass];
        if (x != y) return x > y;
    }
    return a < b;
}

static void sift(block **heap, uint32_t count, uint32_t at)
{
    for (uint32_t child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && is_before(heap[child], heap[child + 1])) child++;
        if (!is_before(heap[at], heap[child])) return;
        block *moved = heap[at];
        heap[at] = heap[child], heap[child] = moved;
    }
}

static void sort_blocks(block **order, uint32_t count)
{
    for (uint32_t i = count / 2; i-- > 0;) sift(order, count, i);
    for (uint32_t n = count; n-- > 1;) {
        block *last = order[0];
        order[0] = order[n], order[n] = last;
        sift(order, n, 0);
    }
}

/* Upright, the tallest first, into the current tile, else the next. Returns the tiles. */
static uint32_t pack_blocks(layer *k)
{
    block **order = QW_NEW(k->env, block *, k->count);
    for (uint32_t i = 0; i < k->count; i++) {
        order[i] = &k->block[i];
        order[i]->is_turned = order[i]->side[0] > order[i]->side[1];
    }
    sort_blocks(order, k->count);
    uint32_t tiles = 1;
    uint32_t *top = QW_NEW_ZERO(k->env, uint32_t, k->room);
    for (uint32_t left = k->count; left > 0; tiles += left > 0) {
        skyline s = {.top = top, .tile = tiles - 1};
        uint32_t kept = 0;
        memset(top, 0, k->room * sizeof *top);
        for (uint32_t i = 0; i < left; i++)
            if (!place_block(k, &s, order[i])) order[kept++] = order[i];
        assert(kept < left);
        left = kept;
    }
    return tiles;
}

/* ---- all */

/* Of the blocks as they lie, quads as large as they are in the mean. */
static void measure(layer *k, qw_atlas *atlas)
{
    const qw_atlas_mesh *m = k->m;
    uint32_t *local = QW_NEW(k->env, uint32_t, m->corner_count);
    qw_flat *flat = QW_NEW(k->env, qw_flat, k->count);
    double total = 0;
    for (uint32_t i = 0; i < k->count; i++) {
        flat[i] = qw_flat_of(k->env, m, k->block[i].face, k->block[i].count, local);
        total += flat[i].total;
    }
    assert(k->count > 0);
    double side = sqrt(total / m->face_count);
    for (uint32_t i = 0; i < k->count; i++) {
        qw_flat *t = &flat[i];
        for (uint32_t n = 0; n < t->corner_count; n++)
            for (int r = 0; r < 2; r++) t->at[t->vertex[n]][r] = side * k->uv[t->place[n]][r];
        qw_stretch s = qw_flat_stretch(t);
        atlas->angle += s.angle * t->total / total, atlas->area += s.area * t->total / total;
    }
    atlas->packing.scale = 1 / (side * k->room);
}

/* Writes the texture coordinates of block i where it was packed, turned if need be. quad: side of a quad there. */
static void write_block(const layer *k, uint32_t i, qw_atlas *atlas, double quad)
{
    const block *b = &k->block[i];
    const qw_atlas_mesh *m = k->m;
    for (uint32_t n = 0; n < b->count; n++) {
        atlas->chart[b->face[n]] = i;
        for (uint32_t c = m->begin[b->face[n]]; c < m->begin[b->face[n] + 1]; c++) {
            double x = k->uv[c][0], y = k->uv[c][1];
            if (b->is_turned) x = b->side[1] - k->uv[c][1], y = k->uv[c][0];
            const double p[2] = {(b->at[0] + x) * quad, (b->at[1] + y) * quad};
            for (int r = 0; r < 2; r++) {
                double grid = 1 << QW_UV_BITS;
                atlas->uv[2 * (size_t)c + (size_t)r] = (float)(qw_round_even(p[r] * grid) / grid + (r ? 0 : b->tile));
            }
        }
    }
}

qw_atlas qw_make_block_atlas(qw_env *env, qw_atlas_mesh *mesh, const qw_block_options *options)
{
    qw_atlas atlas = {.uv = QW_NEW(env, float, 2 * (size_t)mesh->corner_count)};
    atlas.chart = QW_NEW(env, uint32_t, mesh->face_count);
    if (options->per_quad > options->texels)
        qw_fail(env, QW_ARGUMENT, -1, "a texture of %u x %u has no quad of %u texels", options->texels, options->texels,
                options->per_quad);
    qw_scope_begin(env);
    layer k = {.env = env, .m = mesh, .room = options->texels / options->per_quad};
    k.uv = qw_alloc(env, mesh->corner_count, sizeof *k.uv), k.is_taken = QW_NEW(env, uint8_t, mesh->face_count);
    k.longest = k.room;
    qw_cut_patches(env, mesh);
    lay_blocks(&k);
    uint32_t tiles = pack_blocks(&k);
    while (tiles > options->tiles && k.longest > 1) { /* smaller ones leave less room between them */
        k.longest /= 2;
        lay_blocks(&k);
        tiles = pack_blocks(&k);
    }
    if (tiles > options->tiles)
        qw_fail(env, QW_ARGUMENT, -1, "blocks of %u texels a quad need %u textures of %u x %u", options->per_quad,
                tiles, options->texels, options->texels);
    assert(tiles > 0);
    atlas.charts = atlas.patches = k.count;
    measure(&k, &atlas);
    double quad = (double)options->per_quad / options->texels, cells = 0;
    for (uint32_t i = 0; i < k.count; i++) {
        write_block(&k, i, &atlas, quad);
        cells += (double)k.block[i].side[0] * k.block[i].side[1];
    }
    atlas.packing.used = cells * quad * quad / tiles, atlas.packing.tiles = tiles;
    atlas.packing.scale *= k.room * quad;
    atlas.seam_length = qw_seam_length(mesh);
    qw_scope_end(env);
    return atlas;
}
