/* Faces in their own colours or by their angle to the shape, lines of the base complex, and a single chord. */
#include "products/render/scene.h"

#include "products/measure/base_complex.h"
#include "products/measure/follow.h"

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

/* Paints the quads of a chord, numbered from 1; where it crosses itself in another colour. */
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

/* The next half-edge straight on from one inside; QW_NONE: a boundary. */
static uint32_t straight_on(const qw_base_complex *b, uint32_t h)
{
    uint32_t across = b->twin[qw_quad_next(h)];
    return across == QW_NONE ? QW_NONE : qw_quad_next(across);
}

/* Marks the edges of all rings: lines of edges that close and pass no vertex twice. */
static void mark_rings(qw_env *env, scene *s, const qw_base_complex *b)
{
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)b->quads);
    uint32_t *passed = QW_NEW_ZERO(env, uint32_t, s->mesh->vertex_count);
    s->closed = true;
    for (uint32_t h = 0; h < 4 * b->quads; h++) {
        if (seen[h] || b->line[h]) continue; /* no line of an irregular vertex closes */
        bool is_ring = true;
        uint32_t at = h;
        do {
            seen[at] = seen[b->twin[at]] = 1;
            is_ring &= passed[b->corner[at]] != h + 1, passed[b->corner[at]] = h + 1;
            at = straight_on(b, at);
        } while (at != QW_NONE && !seen[at]);
        if (at != h || !is_ring) continue;
        s->rings++;
        do {
            const uint32_t sides[] = {at, b->twin[at]};
            for (int k = 0; k < 2; k++)
                s->edge_kind[s->edges.face_begin[b->face[sides[k] / 4]] + sides[k] % 4] = SCENE_RING;
            at = straight_on(b, at);
        } while (at != h);
    }
}

/* ---- own colours */

/* Where in a at->values a corner's element begins. */
static const float *value_at(const qw_attribute *at, const scene *s, uint32_t corner)
{
    uint32_t of[] = {
        [QW_PER_VERTEX] = s->mesh->corners[corner], [QW_PER_CORNER] = corner, [QW_PER_FACE] = s->edges.face[corner]};
    return at->values + (size_t)at->components * of[at->domain];
}

/* Each face has the mean of its corners' colours. */
static void paint_colours(scene *s, const qw_attribute *colours)
{
    for (uint32_t f = 0; f < s->mesh->face_count; f++) {
        uint32_t begin = s->edges.face_begin[f], end = s->edges.face_begin[f + 1];
        uint8_t colour[3];
        for (uint32_t k = 0; k < 3; k++) {
            float sum = 0;
            for (uint32_t c = begin; c < end; c++) sum += value_at(colours, s, c)[k];
            colour[k] = (uint8_t)(255 * fminf(fmaxf(sum / (float)(end - begin), 0), 1) + 0.5f);
        }
        put(s, f, colour, 255);
    }
}

/* Labels beyond the last colour begin with the first again; a face without one keeps the material. */
static void paint_labels(scene *s, const qw_attribute *labels)
{
    static const uint8_t colours[][3] = {{232, 170, 84},  {104, 154, 204}, {140, 184, 112},
                                         {206, 116, 116}, {164, 138, 200}, {120, 190, 190}};
    for (uint32_t f = 0; f < s->mesh->face_count; f++)
        if (labels->labels[f] >= 0)
            put(s, f, colours[(uint32_t)labels->labels[f] % (sizeof colours / sizeof *colours)], 255);
}

/* The colours of the mesh where it has some, else its first labels of faces: materials before groups. */
static void paint_own(scene *s, const render_panel *panel)
{
    const qw_attribute *labels = NULL;
    for (uint32_t i = 0; i < panel->attribute_count; i++) {
        const qw_attribute *at = &panel->attributes[i];
        if (at->kind == QW_VALUES && at->components >= 3 && strcmp(at->name, "color") == 0) return paint_colours(s, at);
        bool of_faces = at->kind == QW_LABELS && at->domain == QW_PER_FACE;
        if (of_faces && (!labels || strcmp(at->name, "material") == 0)) labels = at;
    }
    if (labels) paint_labels(s, labels);
}

void scene_paint(qw_env *env, scene *s, const render_panel *panel, const render_options *options)
{
    if (!options->own_colours && !options->follow && !options->lines && !options->closed && !options->chord) return;
    s->paint = qw_alloc_zero(env, s->mesh->face_count, sizeof *s->paint);
    if (options->own_colours) paint_own(s, panel);
    qw_scope_begin(env);
    qw_base_complex b = qw_find_base_complex(env, s->mesh, &s->edges);
    if (options->follow) paint_angles(env, s, &b, options->follow);
    if (options->chord) paint_chord(s, &b, options->chord);
    if (options->lines) mark_lines(s, &b);
    if (options->closed) mark_rings(env, s, &b);
    qw_scope_end(env);
}
