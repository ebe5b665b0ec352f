/* Sheets as files: what a reader sees in them, and what is left when they cannot be written. */
#include "faults.h"
#include "shapes.h"
#include "suite.h"
#include "products/render/raster.h"
#include "products/render/render.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wstrict-prototypes"
#pragma GCC diagnostic ignored "-Wmissing-prototypes"
#endif
#include <stb/stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

static const char *const path = QW_BINARY_DIR "/test_render.png",
                         *const unwritten = QW_BINARY_DIR "/test_render_memory.png"; /* the suites run side by side */

/* A cube of 2 x 2 quads a side, so that corners have valence 3 and everything else 4. */
static double cube_points[26 * 3];
static uint32_t cube_corners[24 * 4];

static qw_mesh_view cube(void)
{
    qw_mesh_view view = shape_cube_of_quads(2, cube_points, cube_corners);
    for (uint32_t i = 0; i < 3 * view.vertex_count; i++) cube_points[i] = 2 * cube_points[i] - 1;
    return view;
}

typedef struct image {
    int width, height;
    uint8_t *rgb;
} image;

static image render(const render_panel *panels, size_t count, const render_options *o)
{
    char message[256] = "";
    if (render_sheet(panels, count, o, path, NULL, message, sizeof message) != QW_OK) fail_msg("%s", message);
    image im;
    int channels;
    im.rgb = stbi_load(path, &im.width, &im.height, &channels, 3);
    assert_non_null(im.rgb);
    remove(path);
    assert_int_equal(im.width, (int)o->width);
    assert_int_equal(im.height, (int)o->height);
    return im;
}

/* Pixels of part of an image (in tenths of its size) whose hue is near a colour. */
static int count_near(image im, const uint8_t colour[3], int left, int right, int top, int bottom)
{
    int count = 0;
    for (int y = im.height * top / 10; y < im.height * bottom / 10; y++)
        for (int x = im.width * left / 10; x < im.width * right / 10; x++) {
            const uint8_t *c = im.rgb + 3 * (y * im.width + x);
            count += abs(c[0] - colour[0]) < 40 && abs(c[1] - colour[1]) < 40 && abs(c[2] - colour[2]) < 40;
        }
    return count;
}

/* Pixels in which the colour's strongest channel exceeds its weakest by more than half of what it does there. */
static int count_hue(image im, const uint8_t colour[3])
{
    int high = 0, low = 0, count = 0;
    for (int k = 1; k < 3; k++) {
        if (colour[k] > colour[high]) high = k;
        if (colour[k] < colour[low]) low = k;
    }
    for (int i = 0; i < im.width * im.height; i++)
        count += 2 * (im.rgb[3 * i + high] - im.rgb[3 * i + low]) > colour[high] - colour[low];
    return count;
}

static int count_dark(image im)
{
    int count = 0;
    for (int i = 0; i < im.width * im.height; i++)
        count += im.rgb[3 * i] < 120 && im.rgb[3 * i + 1] < 120 && im.rgb[3 * i + 2] < 120;
    return count;
}

static render_options small(uint32_t views)
{
    render_options o;
    render_options_init(&o);
    o.width = 400;
    o.height = 300;
    o.views = views;
    o.labels = false;
    return o;
}

static void test_cube(void **state)
{
    (void)state;
    qw_mesh_view m = cube();
    render_panel panel = {.mesh = &m, .caption = "a cube"};
    for (uint32_t views = 1; views <= 6; views += views == 1 ? 1 : 2) {
        render_options o = small(views);
        image im = render(&panel, 1, &o);
        assert_true(count_near(im, render_kind_colour[RENDER_THREE], 0, 10, 0, 10) > 100);
        assert_int_equal(count_near(im, render_kind_colour[RENDER_FIVE], 0, 10, 0, 10), 0);
        assert_true(count_dark(im) > 100); /* wires */
        const uint8_t *corner = im.rgb, *middle = im.rgb + 3 * (200 + 400 * 150 * (views == 1));
        assert_true(corner[0] > 235 && corner[1] > 235 && corner[2] > 235);
        assert_true(views != 1 || middle[0] < 230);
        stbi_image_free(im.rgb);
    }
    render_options o = small(1);
    o.dots = o.wires = false;
    image plain = render(&panel, 1, &o);
    assert_int_equal(count_near(plain, render_kind_colour[RENDER_THREE], 0, 10, 0, 10), 0);
    assert_int_equal(count_dark(plain), 0);
    stbi_image_free(plain.rgb);
}

/* A plate like a U, of one polygon that begins at its bottom: what lies between its arms is not filled. */
static void test_concave(void **state)
{
    (void)state;
    const double points[8 * 3] = {0, 0, 0, 3, 0, 0, 3, 3, 0, 2, 3, 0, 2, 1, 0, 1, 1, 0, 1, 3, 0, 0, 3, 0};
    const uint32_t corners[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    const qw_mesh_view m = {.size = sizeof m,
                            .vertex_count = 8,
                            .face_count = 1,
                            .uniform_face_size = 8,
                            .positions = points,
                            .corners = corners};
    render_panel panel = {.mesh = &m};
    render_options o = small(1);
    o.wires = false, o.azimuth = o.elevation = 0;
    image im = render(&panel, 1, &o);
    const uint8_t *gap = im.rgb + 3 * (200 + 400 * 100), *base = im.rgb + 3 * (200 + 400 * 220);
    assert_true(gap[0] > 235 && gap[1] > 235 && gap[2] > 235);
    assert_true(base[0] < 230);
    stbi_image_free(im.rgb);
}

/* A roof of 4 x 4 quads: those beside its ridge follow it. */
static qw_mesh_view roof(void)
{
    static double points[25 * 3];
    static uint32_t corners[16 * 4];
    for (uint32_t i = 0; i < 25; i++) {
        double *p = points + 3 * (size_t)i, x = i % 5;
        p[0] = x - 2, p[1] = 2 - fabs(x - 2), p[2] = 4 - i / 5;
    }
    for (uint32_t f = 0; f < 16; f++) {
        uint32_t a = f / 4 * 5 + f % 4, *c = corners + 4 * (size_t)f;
        c[0] = a, c[1] = a + 1, c[2] = a + 6, c[3] = a + 5;
    }
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = 25,
                          .face_count = 16,
                          .uniform_face_size = 4,
                          .positions = points,
                          .corners = corners};
}

/* Angles of a roof; a strip and rings around a cube; lines along the edges of a cube. */
static void test_paint(void **state)
{
    (void)state;
    static const uint8_t blue[3] = {38, 120, 200}, orange[3] = {244, 148, 40};
    qw_mesh_view m = cube();
    render_panel panel = {.mesh = &m, .caption = "a cube"};
    render_options o = small(1);
    o.dots = false;
    image plain = render(&panel, 1, &o);
    qw_mesh_view folded = roof();
    render_panel fold = {.mesh = &folded, .caption = "a roof"};
    o.follow = &folded;
    image angles = render(&fold, 1, &o);
    o.follow = NULL, o.chord = 1;
    image strip = render(&panel, 1, &o);
    assert_true(count_hue(angles, blue) > 2000 && count_hue(plain, blue) == 0);
    assert_true(count_hue(strip, orange) > 2000 && count_hue(plain, orange) == 0);
    o.chord = 0, o.lines = true;
    image lines = render(&panel, 1, &o);
    static const uint8_t line[3] = {0, 60, 170};
    assert_true(count_hue(lines, line) > 200 && count_hue(plain, line) == 0);
    o.lines = false, o.closed = true;
    static const uint8_t green[3] = {0, 158, 92};
    image rings = render(&panel, 1, &o);
    assert_true(count_hue(rings, green) > 200 && count_hue(plain, green) == 0);
    stbi_image_free(rings.rgb);
    stbi_image_free(plain.rgb), stbi_image_free(angles.rgb), stbi_image_free(strip.rgb), stbi_image_free(lines.rgb);
}

/* Halves of two materials, beside groups that are not shown; then colours, which go before both. */
static void test_own_colours(void **state)
{
    (void)state;
    int32_t group[16] = {0}, material[16];
    float colour[25][3];
    for (int f = 0; f < 16; f++) material[f] = f % 4 < 2 ? 0 : 1;
    for (int v = 0; v < 25; v++) colour[v][0] = 0, colour[v][1] = 1, colour[v][2] = 0;
    const qw_attribute attributes[3] = {
        {.name = "group", .domain = QW_PER_FACE, .kind = QW_LABELS, .components = 1, .count = 16, .labels = group},
        {.name = "material",
         .domain = QW_PER_FACE,
         .kind = QW_LABELS,
         .components = 1,
         .count = 16,
         .labels = material},
        {.name = "color", .domain = QW_PER_VERTEX, .components = 3, .count = 25, .values = colour[0]}};
    const qw_mesh_view m = roof();
    render_panel panel = {.mesh = &m, .attributes = attributes, .attribute_count = 2};
    render_options o = small(1);
    o.own_colours = true, o.wires = o.dots = false, o.azimuth = 0, o.elevation = 89;
    image im = render(&panel, 1, &o);
    const uint8_t *left = im.rgb + 3 * (120 + 400 * 150), *right = im.rgb + 3 * (280 + 400 * 150);
    assert_true(left[0] > left[2] + 40 && right[2] > right[0] + 40); /* orange and blue */
    stbi_image_free(im.rgb);
    panel.attribute_count = 3;
    im = render(&panel, 1, &o);
    right = im.rgb + 3 * (280 + 400 * 150);
    assert_true(right[1] > right[0] + 40 && right[1] > right[2] + 40);
    stbi_image_free(im.rgb);
}

/* From the front of a cube whose front is open: the inside, in the tint of back faces, and the boundary's colour around
 * it. */
static void test_open(void **state)
{
    (void)state;
    qw_mesh_view m = cube();
    uint32_t kept = 0;
    for (uint32_t f = 0; f < 24; f++) {
        double z = 0;
        for (int k = 0; k < 4; k++) z += cube_points[3 * cube_corners[4 * f + (uint32_t)k] + 2];
        if (z > 3.9) continue;
        memmove(cube_corners + 4 * kept++, cube_corners + 4 * f, 4 * sizeof *cube_corners);
    }
    assert_int_equal(kept, 20);
    m.face_count = kept;
    render_panel panel = {.mesh = &m};
    render_options o = small(1);
    o.azimuth = o.elevation = 0;
    image im = render(&panel, 1, &o);
    int red = 0, teal = 0;
    for (int i = 0; i < im.width * im.height; i++) {
        const uint8_t *c = im.rgb + 3 * i;
        red += c[0] > c[1] + 25 && c[0] > c[2] + 10;
        teal += c[0] < 40 && c[1] > 70 && c[2] > 80 && c[2] < 170;
    }
    assert_true(red > 5000);
    assert_true(teal > 200);
    stbi_image_free(im.rgb);
}

static void test_several(void **state)
{
    (void)state;
    qw_mesh_view m = cube();
    double fins[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1};
    uint32_t book[9] = {0, 1, 2, 0, 3, 1, 0, 1, 4}; /* three triangles at one edge */
    qw_mesh_view b = {.size = sizeof b,
                      .vertex_count = 5,
                      .face_count = 3,
                      .uniform_face_size = 3,
                      .positions = fins,
                      .corners = book};
    render_panel panels[2] = {{.mesh = &m, .caption = "left"}, {.mesh = &b, .caption = "right"}};
    render_options o = small(0);
    o.labels = true;
    image im = render(panels, 2, &o);
    const uint8_t magenta[3] = {230, 0, 186};
    assert_int_equal(count_near(im, magenta, 0, 5, 2, 10), 0);
    assert_true(count_near(im, magenta, 5, 10, 2, 10) > 30);
    assert_true(count_near(im, render_kind_colour[RENDER_THREE], 0, 5, 2, 10) > 50);
    assert_int_equal(count_near(im, render_kind_colour[RENDER_THREE], 5, 10, 2, 10), 0);
    assert_true(count_near(im, (const uint8_t[3]){32, 36, 44}, 0, 5, 0, 1) > 10); /* captions */
    assert_true(count_near(im, (const uint8_t[3]){32, 36, 44}, 5, 10, 0, 1) > 10);
    stbi_image_free(im.rgb);
}

static void test_threads(void **state)
{
    (void)state;
    qw_mesh_view m = cube();
    render_panel panel = {.mesh = &m};
    render_options o = small(4);
    o.threads = 1;
    image first = render(&panel, 1, &o);
    o.threads = 3;
    image again = render(&panel, 1, &o);
    assert_memory_equal(first.rgb, again.rgb, (size_t)(3 * first.width * first.height));
    stbi_image_free(first.rgb);
    stbi_image_free(again.rgb);
}

static void expect_failure(const render_panel *panel, const render_options *o, const char *where, const char *word)
{
    char message[256] = "";
    assert_int_not_equal(render_sheet(panel, 1, o, where, NULL, message, sizeof message), QW_OK);
    if (!strstr(message, word)) fail_msg("\"%s\" does not say \"%s\"", message, word);
}

static void test_failures(void **state)
{
    (void)state;
    qw_mesh_view m = cube(), none = m, bad = m;
    render_panel panel = {.mesh = &m};
    render_options o = small(1);
    expect_failure(&panel, &o, QW_BINARY_DIR "/no such folder/a.png", "no such folder");
    expect_failure(&panel, &o, QW_BINARY_DIR, QW_BINARY_DIR); /* a folder: written beside it, cannot be renamed */
    assert_null(fopen(QW_BINARY_DIR ".0.tmp", "rb"));
    o.views = 3;
    expect_failure(&panel, &o, path, "views");
    o = small(1);
    o.width = 1;
    expect_failure(&panel, &o, path, "width");
    o = small(1);
    none.face_count = 0;
    panel.mesh = &none;
    expect_failure(&panel, &o, path, "no faces");
    bad.face_count = 1;
    bad.corners = (const uint32_t[4]){0, 1, 2, 3};
    bad.face_sizes = (const uint32_t[1]){0};
    panel.mesh = &bad;
    expect_failure(&panel, &o, path, "face");
    assert_null(fopen(path, "rb"));
}

/* Whichever allocation is refused, there is a sentence, no file and no block left. */
static void test_no_memory(void **state)
{
    (void)state;
    qw_mesh_view m = cube();
    render_panel panel = {.mesh = &m, .caption = "cube"};
    render_options o = small(1);
    o.width = 64, o.height = 48, o.threads = 1, o.follow = &m, o.lines = true, o.chord = 1;
    for (int lasting = 0; lasting < 2; lasting++) {
        remove(unwritten);
        for (long n = 0;; n++) {
            faults f = {.allocations = n, .reports = FAULTS_NONE, .is_lasting = lasting};
            qw_host host = faults_host(&f);
            char message[256] = "";
            qw_status status = render_sheet(&panel, 1, &o, unwritten, &host, message, sizeof message);
            assert_int_equal(f.blocks, 0);
            if (status == QW_OK) break;
            assert_int_equal(status, QW_MEMORY);
            assert_true(message[0] != 0);
            assert_null(fopen(unwritten, "rb"));
        }
    }
    remove(unwritten);
}

static double depth_in(raster_point a, raster_point b, raster_point c, double x, double y, double *least)
{
    double area = ((double)b.x - a.x) * ((double)c.y - a.y) - ((double)b.y - a.y) * ((double)c.x - a.x);
    double wb = ((x - a.x) * ((double)c.y - a.y) - (y - a.y) * ((double)c.x - a.x)) / area;
    double wc = (((double)b.x - a.x) * (y - a.y) - ((double)b.y - a.y) * (x - a.x)) / area, wa = 1 - wb - wc;
    double inside = fmin(fmin(wa, wb), wc);
    *least = fmin(*least, fabs(inside));
    return inside > 0 ? wa * a.depth + wb * b.depth + wc * c.depth : 0;
}

enum { SIDE = 160, PIECES = 24, COLUMNS = (SIDE - 1) / RASTER_TILE_WIDTH + 1, BAND = 2 * RASTER_TILE_HEIGHT };

static void fill_at_random(raster *r, raster_point p[PIECES][3], uint32_t *seed)
{
    for (int k = 0; k < PIECES * 9; k++) {
        raster_point *q = &p[k / 9][k / 3 % 3];
        *seed = *seed * 1664525u + 1013904223u;
        float share = (float)(*seed >> 8) / 16777216.0f;
        *(k % 3 == 0 ? &q->x : k % 3 == 1 ? &q->y : &q->depth) = k % 3 < 2 ? share * 220 - 30 : 0.2f + share;
    }
    raster_clear(r, 0, SIDE);
    for (uint32_t top = 0; top < SIDE; top += BAND)
        for (uint32_t k = 0; k < PIECES; k++)
            raster_triangle(r, top, top + BAND < SIDE ? top + BAND : SIDE, p[k][0], p[k][1], p[k][2], 7 + k);
}

/* Every sample inside is drawn, none is drawn that is clearly outside, and the front wins whatever the order. */
static void test_raster(void **state)
{
    (void)state;
    static float depth[SIDE * SIDE], row_depth[SIDE * COLUMNS], tile_depth[SIDE * COLUMNS];
    static uint32_t id[SIDE * SIDE];
    raster r = {SIDE, SIDE, depth, id, row_depth, tile_depth};
    assert_int_equal(raster_columns(&r), COLUMNS);
    uint32_t seed = 1;
    for (int round = 0; round < 60; round++) {
        raster_point p[PIECES][3];
        fill_at_random(&r, p, &seed);
        for (int j = 0; j < SIDE; j++)
            for (int i = 0; i < SIDE; i++) {
                double best = 0, least = 1e9;
                for (int t = 0; t < PIECES; t++)
                    best = fmax(best, depth_in(p[t][0], p[t][1], p[t][2], i + 0.5, j + 0.5, &least));
                if (least < 1e-3) continue; /* on a side: either is right */
                assert_true(fabs(depth[SIDE * j + i] - best) < 1e-4);
                assert_int_equal(id[SIDE * j + i] == RASTER_NOTHING, best == 0);
            }
    }
}

QW_TEST_SUITE(render)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paint),    cmocka_unit_test(test_own_colours), cmocka_unit_test(test_cube),
        cmocka_unit_test(test_open),     cmocka_unit_test(test_several),     cmocka_unit_test(test_threads),
        cmocka_unit_test(test_failures), cmocka_unit_test(test_raster),      cmocka_unit_test(test_concave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* One thread makes the allocations that fail. */
QW_TEST_SUITE(render_memory)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
