/* The sheet: which views of which meshes stand where, and what is written above them.
 *
 * A block a mesh: a heading and below it the mesh's views. A single mesh has the whole sheet; several stand in the grid
 * that leaves the views largest, or in columns when each has several views.
 */
#include "products/render/render.h"

#include "io/pictures/picture.h"
#include "products/render/view.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const uint8_t render_kind_colour[RENDER_KINDS][3] = {{126, 48, 190}, {38, 96, 235}, {232, 72, 28}, {22, 150, 72}};

enum { MOST_VIEWS = 6, LEAST_SIZE = 16, MOST_PANELS = 64 };

typedef struct direction {
    double azimuth, elevation;
} direction;

/* The first is the caller's; then front, side, top, back, and the other three-quarter view. */
static const direction directions[MOST_VIEWS] = {{0, 0}, {0, 0}, {90, 0}, {0, 89.9}, {180, 0}, {215, 25}};

typedef struct sheet {
    const render_panel *panels;
    uint32_t count;
    render_options options;
    qw_env *env;
    picture picture;
    scene *scenes; /* scene[count] */
    bool shared;   /* all meshes in one frame */
    uint32_t views, view_columns, view_rows, columns, rows;
    float letters;    /* height of capitals, pixels */
    uint32_t heading; /* height, pixels */
    const char *path; /* of the picture */
} sheet;

void render_options_init(render_options *options)
{
    *options = (render_options){
        .width = 1600, .height = 1200, .wires = true, .dots = true, .labels = true, .azimuth = 35, .elevation = 22};
}

/* ---- layout */

/* How many views a panel has, in which rows and columns panels and views stand, and the size of letters. */
static void arrange(sheet *s)
{
    const render_options *o = &s->options;
    s->views = o->views ? o->views : s->count > 1 ? 1 : 4;
    s->view_columns = s->count > 1 || s->views == 1 ? 1 : s->views == 6 ? 3 : 2;
    s->view_rows = s->views / s->view_columns;
    s->columns = s->count;
    float best = 0;
    for (uint32_t c = 1; s->views == 1 && c <= s->count; c++) {
        uint32_t rows = (s->count + c - 1) / c;
        float room = fminf((float)o->width / (float)c, (float)o->height / (float)rows);
        if (room > best) best = room, s->columns = c;
    }
    s->rows = (s->count + s->columns - 1) / s->columns;
    float block = (float)o->width / (float)s->columns;
    s->letters = fmaxf(fminf(fminf((float)o->height / 70, (float)o->width / 80), block / 26), 7);
    s->heading = o->labels ? (uint32_t)(5.6f * s->letters) : 0;
    if (s->heading > o->height / (3 * s->rows)) s->heading = 0;
}

static view_area block_area(const sheet *s, uint32_t panel)
{
    uint32_t column = panel % s->columns, row = panel / s->columns, w = s->options.width, h = s->options.height;
    uint32_t x = (uint32_t)((uint64_t)w * column / s->columns), y = (uint32_t)((uint64_t)h * row / s->rows);
    return (view_area){x, y, (uint32_t)((uint64_t)w * (column + 1) / s->columns) - x,
                       (uint32_t)((uint64_t)h * (row + 1) / s->rows) - y};
}

static view_area cell_area(const sheet *s, uint32_t panel, uint32_t view)
{
    view_area b = block_area(s, panel);
    b.y += s->heading;
    b.height -= s->heading;
    uint32_t column = view % s->view_columns, row = view / s->view_columns;
    uint32_t x = b.width * column / s->view_columns, y = b.height * row / s->view_rows;
    return (view_area){b.x + x, b.y + y, b.width * (column + 1) / s->view_columns - x,
                       b.height * (row + 1) / s->view_rows - y};
}

/* ---- frames */

/* The hypotenuse, whose square need not be a number. */
static double longer(double a, double b)
{
    double most = fmax(fabs(a), fabs(b));
    if (!(most > 0)) return 0;
    return most * sqrt((a / most) * (a / most) + (b / most) * (b / most));
}

static qw_frame frame_of(const double lo[3], const double hi[3])
{
    qw_frame f = {.scale = 1};
    double half = 0;
    for (int k = 0; k < 3; k++) {
        f.center[k] = 0.5 * lo[k] + 0.5 * hi[k];
        half = longer(half, 0.5 * hi[k] - 0.5 * lo[k]);
    }
    if (half > 0) f.scale = fmin(1 / half, 1e300);
    return f;
}

/* Meshes are compared in one frame when they may well be the same thing: of like size, and in the same place. */
static bool alike(const qw_frame *a, const qw_frame *b)
{
    double apart = 0;
    for (int k = 0; k < 3; k++) apart = longer(apart, a->center[k] * a->scale - b->center[k] * a->scale);
    return apart < 0.3 && a->scale < 1.4 * b->scale && b->scale < 1.4 * a->scale;
}

/* Scenes of all panels, in one frame if the meshes are alike in size and place. */
static void make_scenes(sheet *s)
{
    double lo[3], hi[3], all_lo[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, all_hi[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
    qw_frame frames[MOST_PANELS];
    s->shared = true;
    for (uint32_t i = 0; i < s->count; i++) {
        if (!scene_box(s->panels[i].mesh, lo, hi))
            qw_fail(s->env, QW_NO_FACES, i, "mesh %u has no faces to be drawn", i);
        for (int k = 0; k < 3; k++) {
            all_lo[k] = fmin(all_lo[k], lo[k]);
            all_hi[k] = fmax(all_hi[k], hi[k]);
        }
        frames[i] = frame_of(lo, hi);
        s->shared = s->shared && alike(&frames[0], &frames[i]);
    }
    s->scenes = QW_NEW(s->env, scene, s->count);
    qw_frame common = frame_of(all_lo, all_hi);
    for (uint32_t i = 0; i < s->count; i++)
        s->scenes[i] = scene_make(s->env, s->panels[i].mesh, s->shared ? &common : &frames[i]);
    for (uint32_t i = 0; i < s->count; i++) scene_paint(s->env, &s->scenes[i], &s->panels[i], &s->options);
}

/* ---- heading */

/* 1234567 as "1,234,567". */
static void print_count(char *text, size_t size, uint64_t n)
{
    char digits[32];
    int count = snprintf(digits, sizeof digits, "%" PRIu64, n);
    size_t used = 0;
    for (int i = 0; i < count && used + 2 < size; i++) {
        if (i > 0 && (count - i) % 3 == 0) text[used++] = ',';
        text[used++] = digits[i];
    }
    text[used] = 0;
}

typedef struct pen {
    picture *picture;
    float x, y, size;
    bool measure; /* only move on */
    bool brief;   /* short words beside the discs */
} pen;

static void write_text(pen *p, const uint8_t colour[3], const char *text)
{
    if (!p->measure) letters_draw(p->picture, p->x, p->y, p->size, colour, text);
    p->x += letters_width(text, p->size);
}

/* Counts, and a disc of its colour before each kind of irregular vertex that there is. */
static void write_counts(pen *p, const scene *s)
{
    static const uint8_t grey[3] = {92, 98, 108};
    static const char *const names[RENDER_KINDS] = {" of valence 2 or less", " of valence 3", " of valence 5",
                                                    " of valence 6 or more"};
    static const char *const brief[RENDER_KINDS] = {" v2", " v3", " v5", " v6+"};
    const qw_mesh_view *m = s->mesh;
    char text[96], number[32];
    print_count(number, sizeof number, m->face_count);
    const char *what = s->quads == m->face_count ? "quads" : s->triangles == m->face_count ? "triangles" : "faces";
    snprintf(text, sizeof text, "%s %s", number, what);
    write_text(p, grey, text);
    if (2 * s->quads <= m->face_count) return;
    print_count(number, sizeof number, s->dot_count);
    snprintf(text, sizeof text, "%s irregular", number);
    p->x += 1.6f * p->size;
    write_text(p, grey, text);
    for (int k = 0; k < RENDER_KINDS; k++) {
        if (s->kind_counts[k] == 0) continue;
        p->x += 2.0f * p->size;
        if (!p->measure) letters_disc(p->picture, p->x, p->y - 0.5f * p->size, 0.48f * p->size, render_kind_colour[k]);
        p->x += 1.1f * p->size;
        print_count(number, sizeof number, s->kind_counts[k]);
        snprintf(text, sizeof text, "%s%s", number, p->brief ? brief[k] : names[k]);
        write_text(p, grey, text);
    }
}

/* What was painted, after the counts. */
static void write_paint(pen *p, const scene *s)
{
    static const uint8_t grey[3] = {92, 98, 108};
    char text[96];
    if (s->follow >= 0) {
        snprintf(text, sizeof text, "follows within %.1f degrees:", s->follow);
        p->x += 2.0f * p->size;
        write_text(p, grey, text);
        for (int k = 0; k < RENDER_ANGLES; k++) {
            p->x += 1.2f * p->size;
            if (!p->measure)
                letters_disc(p->picture, p->x, p->y - 0.5f * p->size, 0.48f * p->size, render_angle_colour[k]);
            p->x += 0.8f * p->size;
            snprintf(text, sizeof text, "%d", 45 * k / (RENDER_ANGLES - 1));
            write_text(p, grey, text);
        }
    }
    if (s->lines) {
        snprintf(text, sizeof text, "%" PRIu32 " patches", s->patches);
        p->x += 2.0f * p->size;
        write_text(p, grey, text);
    }
    if (s->closed) {
        snprintf(text, sizeof text, "%" PRIu32 " rings", s->rings);
        p->x += 2.0f * p->size;
        write_text(p, grey, text);
    }
    if (s->chord > 0) {
        snprintf(text, sizeof text,
                 "chord %" PRIu32 " of %" PRIu32 ": %" PRIu32 " quads, crosses itself %" PRIu32 " times", s->chord,
                 s->chords, s->chord_length - s->chord_crossings, s->chord_crossings);
        p->x += 2.0f * p->size;
        write_text(p, grey, text);
    }
}

/* Centred over its block where there are several, at the left where there is one. */
static void write_heading(sheet *s, uint32_t panel)
{
    static const uint8_t ink[3] = {32, 36, 44};
    view_area b = block_area(s, panel);
    const char *caption = s->panels[panel].caption;
    pen p = {.picture = &s->picture, .size = 0.86f * s->letters, .measure = true};
    write_counts(&p, &s->scenes[panel]);
    write_paint(&p, &s->scenes[panel]);
    float room = (float)b.width - 4 * s->letters;
    p.brief = p.x > room;
    float left = (float)b.x + 2 * s->letters, line = (float)b.y + 2.6f * s->letters;
    if (caption && *caption) {
        float size = s->letters * 1.15f, width = letters_width(caption, size);
        if (width > room) size *= room / width, width = room;
        letters_draw(&s->picture, s->count > 1 ? left + 0.5f * (room - width) : left, line, size, ink, caption);
        line += 2.2f * s->letters;
    }
    p.x = 0;
    write_counts(&p, &s->scenes[panel]);
    write_paint(&p, &s->scenes[panel]);
    if (p.x > room) p.size *= room / p.x, p.x = room;
    p.measure = false;
    p.x = s->count > 1 ? left + 0.5f * (room - p.x) : left;
    p.y = line;
    write_counts(&p, &s->scenes[panel]);
    write_paint(&p, &s->scenes[panel]);
}

/* ---- sheet */

static void paint_paper(picture *p)
{
    for (uint32_t j = 0; j < p->height; j++) {
        uint8_t shade = (uint8_t)(252 - 14 * (uint64_t)j / p->height);
        for (uint32_t i = 0; i < p->width; i++) {
            uint8_t *c = p->rgb + 3 * ((size_t)j * p->width + i);
            c[0] = (uint8_t)(shade - 1), c[1] = shade, c[2] = (uint8_t)(shade + 2);
        }
    }
}

static view_camera camera_of(const sheet *s, uint32_t view)
{
    direction d = directions[view];
    if (view == 0) d = (direction){s->options.azimuth, s->options.elevation};
    if (view == 1 && s->views == 2) d = (direction){s->options.azimuth + 180, s->options.elevation};
    return view_look(d.azimuth, d.elevation);
}

/* Draws all views of a panel, and its heading. */
static void draw_panel(sheet *s, uint32_t panel)
{
    for (uint32_t view = 0; view < s->views; view++) {
        view_camera camera = camera_of(s, view);
        view_bounds bounds = {{FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX}};
        for (uint32_t i = 0; i < s->count; i++)
            if (s->shared || i == panel) view_include(&camera, &s->scenes[i], &bounds);
        view_area area = cell_area(s, panel, view);
        if (area.width == 0 || area.height == 0) continue;
        view_fit(&camera, &bounds, &area);
        view_draw(s->env, &s->scenes[panel], &camera, s->options.wires, s->options.dots, &s->picture, area);
    }
    if (s->heading > 0) write_heading(s, panel);
}

static void draw_sheet(sheet *s)
{
    s->picture = (picture){s->options.width, s->options.height,
                           QW_NEW(s->env, uint8_t, 3 * (size_t)s->options.width * s->options.height)};
    arrange(s);
    make_scenes(s);
    paint_paper(&s->picture);
    for (uint32_t i = 0; i < s->count; i++) draw_panel(s, i);
}

/* Fails at options and panels that no picture can be made of. */
static void check(qw_env *env, const render_panel *panels, size_t count, const render_options *o)
{
    const char *wrong = NULL;
    if (count == 0 || count > MOST_PANELS) wrong = "a sheet shows 1 to 64 meshes";
    else if (o->views > MOST_VIEWS || o->views == 3 || o->views == 5)
        wrong = "views: 1, 2, 4 or 6 (0: a suitable number)";
    else if (o->width < LEAST_SIZE || o->width > QW_MOST_PIXELS_ALONG || o->height < LEAST_SIZE ||
             o->height > QW_MOST_PIXELS_ALONG)
        wrong = "width and height: 16 to 16384 pixels";
    else if (!isfinite(o->azimuth) || !isfinite(o->elevation)) wrong = "azimuth and elevation: degrees";
    for (size_t i = 0; !wrong && i < count; i++)
        if (!panels[i].mesh) wrong = "a mesh is missing";
    if (wrong) qw_fail(env, QW_ARGUMENT, -1, "%s", wrong);
}

static void make_sheet(void *user)
{
    sheet *s = user;
    check(s->env, s->panels, s->count, &s->options);
    draw_sheet(s);
    qw_picture sheet_picture = {s->picture.width, s->picture.height, 3, 8, s->picture.rgb};
    qw_write_png(s->env, s->path, &sheet_picture);
}

qw_status render_sheet(const render_panel *panels, size_t count, const render_options *options, const char *path,
                       const qw_host *host, char *message, size_t message_size)
{
    sheet s = {.panels = panels,
               .count = (uint32_t)(count < UINT32_MAX ? count : UINT32_MAX),
               .options = *options,
               .path = path,
               .env = qw_env_create(host, options->threads)};
    qw_status status = s.env ? qw_protect(s.env, make_sheet, &s) : QW_MEMORY;
    snprintf(message, message_size, "%s", s.env ? qw_env_message(s.env) : qw_status_text(QW_MEMORY));
    qw_env_destroy(s.env);
    return status;
}
