/* Quads coloured by their angle to the shape, lines of the base complex, and a single chord. */
#include "scene.h"

#include "mesh/base_complex.h"
#include "mesh/shape.h"

#include <math.h>
#include <string.h>

const uint8_t render_angle_colour[RENDER_ANGLES][3] = {{38, 120, 200}, {112, 186, 120}, {250, 196, 60}, {214, 48, 39}};
static const uint8_t chord_colour[3] = {244, 148, 40}, crossing_colour[3] = {206, 30, 60};

/* A direction is as good as fully clear from this weight on. */
static const float clear_weight = 0.4f;

static void put(scene *s, uint32_t face, const uint8_t colour[3], uint8_t amount)
{
    memcpy(s->paint[face], colour, 3);
    s->paint[face][3] = amount;
}

/* A direction that leaves the quad's plane may be more than 45 degrees from both axes. */
static void put_angle(scene *s, uint32_t face, float angle, float weight)
{
    float at = fminf(angle / 45, 1) * (RENDER_ANGLES - 1);
    int low = at < RENDER_ANGLES - 1 ? (int)at : RENDER_ANGLES - 2;
    uint8_t colour[3];
    for (int k = 0; k < 3; k++) {
        float a = render_angle_colour[low][k], b = render_angle_colour[low + 1][k];
        colour[k] = (uint8_t)(a + (b - a) * (at - (float)low) + 0.5f);
    }
    put(s, face, colour, (uint8_t)(255 * (weight < clear_weight ? weight / clear_weight : 1)));
}

static void paint_angles(qw_env *env, scene *s, const qw_base_complex *b, const qw_mesh_view *against)
{
    float *angle = QW_NEW(env, float, b->quads), *weight = QW_NEW(env, float, b->quads);
    qw_find_quad_angles(env, s->mesh, against, b->face, b->quads, angle, weight);
    double sum = 0, all = 0;
    for (uint32_t q = 0; q < b->quads; q++) {
        put_angle(s, b->face[q], angle[q], weight[q]);
        sum += (double)(angle[q] * weight[q]), all += (double)weight[q];
    }
    if (all > 0) s->follow = sum / all;
}

static void paint_chord(scene *s, const qw_base_complex *b, uint32_t chord)
{
    s->chords = b->chord_count;
    s->chord = chord < b->chord_count ? chord : b->chord_count;
    if (s->chord == 0) return;
    s->chord_length = b->length[s->chord - 1];
    for (uint32_t q = 0; q < b->quads; q++) {
        uint32_t times = (b->chord[2 * q] == s->chord - 1) + (b->chord[2 * q + 1] == s->chord - 1);
        if (times > 0) put(s, b->face[q], times > 1 ? crossing_colour : chord_colour, 255);
        s->chord_crossings += times > 1;
    }
}

static void mark_lines(scene *s, const qw_base_complex *b)
{
    s->lines = true;
    s->patches = b->patches;
    for (uint32_t h = 0; h < 4 * b->quads; h++) {
        uint8_t *kind = &s->edge_kind[s->edges.face_begin[b->face[h / 4]] + h % 4];
        if (b->line[h] && *kind == SCENE_WIRE) *kind = SCENE_LINE;
    }
}

void scene_paint(qw_env *env, scene *s, const render_options *options)
{
    if (!options->follow && !options->lines && !options->chord) return;
    s->paint = qw_alloc_zero(env, s->mesh->face_count, sizeof *s->paint);
    qw_scope_begin(env);
    qw_base_complex b = qw_find_base_complex(env, s->mesh, &s->edges);
    if (options->follow) paint_angles(env, s, &b, options->follow);
    if (options->chord) paint_chord(s, &b, options->chord);
    if (options->lines) mark_lines(s, &b);
    qw_scope_end(env);
}
