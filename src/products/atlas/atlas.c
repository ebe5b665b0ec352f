#include "products/atlas/atlas.h"

#include "products/atlas/charts.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

typedef struct maker {
    qw_env *env;
    const qw_atlas_mesh *mesh;
    const qw_charts_made *made;
    qw_flat *flat;   /* qw_flat[charts] */
    qw_piece *piece; /* qw_piece[charts] */
    qw_atlas *atlas;
} maker;

/* Charts as packing sees them. local: uint32_t[corner_count], scratch. */
static void take_pieces(maker *k, uint32_t *local)
{
    k->flat = QW_NEW(k->env, qw_flat, k->made->count), k->piece = QW_NEW(k->env, qw_piece, k->made->count);
    for (uint32_t a = 0; a < k->made->count; a++) {
        const qw_chart *c = &k->made->chart[a];
        qw_flat *t = &k->flat[a];
        *t = qw_flat_of(k->env, k->mesh, c->face, c->count, local);
        for (uint32_t i = 0; i < t->corner_count; i++)
            memcpy(t->at[t->vertex[i]], k->made->uv[t->place[i]], sizeof *t->at);
        k->piece[a] = (qw_piece){.at = (const double(*)[2])t->at,
                                 .point_count = t->vertex_count,
                                 .triangle_count = t->triangle_count,
                                 .corner = t->corner};
    }
}

/* How many times as large as the others a chart of small quads may be, along each side, and how many times as small one
   of large quads. */
static const double MOST_FOCUS = 2;

/* Makes charts larger where their quads are smaller than in the mean. */
static void focus_charts(maker *k, double focus)
{
    double area = 0, faces = 0;
    for (uint32_t a = 0; a < k->made->count; a++) area += k->flat[a].total, faces += k->made->chart[a].count;
    for (uint32_t a = 0; a < k->made->count && focus > 0; a++) {
        qw_flat *t = &k->flat[a];
        double own = t->total / k->made->chart[a].count, times = own > 0 ? qw_pow(area / faces / own, focus / 2) : 1;
        times = fmin(fmax(times, 1 / MOST_FOCUS), MOST_FOCUS);
        for (uint32_t v = 0; v < t->vertex_count; v++) t->at[v][0] *= times, t->at[v][1] *= times;
    }
}

static void sum_stretch(maker *k)
{
    double total = 0;
    for (uint32_t a = 0; a < k->made->count; a++) {
        const qw_flat *t = &k->flat[a];
        qw_stretch s = qw_flat_stretch(t);
        if (k->made->chart[a].is_stub) s = (qw_stretch){.angle = 1, .area = 1};
        k->atlas->angle += s.angle * t->total, k->atlas->area += s.area * t->total, total += t->total;
    }
    if (total > 0) k->atlas->angle /= total, k->atlas->area /= total;
}

/* Of the square, by charts that pack well, as a short search for their places in large cells has it: the whole one
   fills some hundredths more. */
static const double FILLED = 0.64;

typedef struct judging {
    maker k;
    qw_pack_options pack;
    double focus;
    uint32_t *local;
} judging;

static bool try_packing(void *user, const qw_charts_made *made)
{
    judging *t = user;
    qw_scope_begin(t->k.env);
    t->k.made = made;
    take_pieces(&t->k, t->local);
    focus_charts(&t->k, t->focus);
    double used = qw_pack(t->k.env, t->k.piece, made->count, &t->pack).used;
    qw_scope_end(t->k.env);
    return used >= FILLED;
}

/* Rounds a chart's place to whole multiples of the grid. at: double[vertex_count][2], within the tile; shift: of the
   grid, below one of its steps. */
static void round_chart(qw_flat *t, const double (*at)[2], const double shift[2])
{
    const double grid = 1.0 / (1 << QW_UV_BITS);
    for (uint32_t v = 0; v < t->vertex_count; v++)
        for (int r = 0; r < 2; r++) t->at[v][r] = qw_round_even(at[v][r] / grid + shift[r]) * grid;
}

/* Triangles that are hardly wider than a step of the grid, and parts of a boundary that are as near, may cross by
   rounding alone: then the chart is rounded from other places within a step until none do. */
static bool settle_chart(maker *k, qw_flat *t)
{
    enum { TRIES = 64 };
    const double grid = 1.0 / (1 << QW_UV_BITS);
    double(*at)[2] = qw_alloc(k->env, t->vertex_count, sizeof *at), shift[2] = {0, 0};
    bool simple = false;
    memcpy(at, t->at, t->vertex_count * sizeof *at);
    for (int i = 0; i < TRIES && !simple; i++) {
        round_chart(t, (const double(*)[2])at, shift);
        simple = qw_flat_is_simple(k->env, t, grid);
        for (int r = 0; r < 2; r++) { /* multiples of irrational numbers: spread evenly over the step */
            shift[r] += QW_ROBERTS[r];
            if (shift[r] >= 0.5) shift[r] -= 1;
        }
    }
    qw_free(k->env, at);
    return simple;
}

/* Moves chart a to where it was packed and writes its texture coordinates; counts it if it still overlaps itself. */
static void place_chart(maker *k, uint32_t a)
{
    qw_flat *t = &k->flat[a];
    const qw_piece *p = &k->piece[a];
    for (uint32_t v = 0; v < t->vertex_count; v++) {
        double to[2];
        qw_place_in_tile(p, k->atlas->packing.scale, t->at[v], to);
        memcpy(t->at[v], to, sizeof to);
    }
    k->atlas->overlapping += !settle_chart(k, t);
    for (uint32_t i = 0; i < t->corner_count; i++) {
        float *uv = k->atlas->uv + 2 * (size_t)t->place[i];
        assert(t->vertex[i] < t->vertex_count);
        uv[0] = (float)(t->at[t->vertex[i]][0] + p->tile), uv[1] = (float)t->at[t->vertex[i]][1];
    }
    for (uint32_t i = 0; i < k->made->chart[a].count; i++) k->atlas->chart[k->made->chart[a].face[i]] = a;
}

qw_atlas qw_make_atlas(qw_env *env, qw_atlas_mesh *mesh, const qw_atlas_options *options)
{
    qw_atlas atlas = {.uv = QW_NEW(env, float, 2 * (size_t)mesh->corner_count)};
    atlas.chart = QW_NEW(env, uint32_t, mesh->face_count);
    qw_scope_begin(env);
    uint32_t *local = QW_NEW(env, uint32_t, mesh->corner_count);
    maker k = {.env = env, .mesh = mesh, .atlas = &atlas};
    judging t = {.k = k, .pack = options->pack, .focus = options->focus, .local = local};
    t.pack.is_untold = true, t.pack.scale = 0, t.pack.enough = FILLED;
    double margin = (double)options->pack.margin / options->pack.texels,
           longest = options->pack.scale > 0 ? (1 - margin) / options->pack.scale : INFINITY;
    if (options->focus > 0) longest /= MOST_FOCUS;
    qw_charts_made made = qw_make_charts(env, mesh, options->most_stretch, longest, options->weight, options->mirror,
                                         try_packing, &t);
    k.made = &made;
    assert(made.count > 0 && made.count <= mesh->face_count);
    take_pieces(&k, local);
    sum_stretch(&k);
    focus_charts(&k, options->focus);
    atlas.charts = made.count, atlas.patches = made.patches;
    atlas.packing = qw_pack(env, k.piece, made.count, &options->pack);
    for (uint32_t a = 0; a < made.count; a++) place_chart(&k, a);
    atlas.seam_length = qw_seam_length(mesh);
    qw_scope_end(env);
    return atlas;
}
