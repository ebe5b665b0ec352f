/* Maps: pictures to and from PNG, what is baked where it can be told otherwise, whole assets, and hostile inputs. */
#include "products/bake/maps.h"
#include "products/attributes/corner_normals.h"
#include "products/bake/shading.h"
#include "faults.h"
#include "io/pictures/deflate.h"
#include "quad_shapes.h"
#include "random.h"
#include "suite.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

typedef struct job {
    qw_env *env;
} job;

static void protect(void (*body)(void *user))
{
    job j = {qw_env_create(NULL, 2)};
    if (qw_protect(j.env, body, &j) != QW_OK) fail_msg("%s", qw_env_message(j.env));
    qw_env_destroy(j.env);
}

/* ---- PNG */

static qw_picture make_picture(qw_env *env, uint32_t width, uint32_t height, uint32_t channels, uint32_t bits,
                               bool noise)
{
    qw_picture p = {width, height, channels, bits, qw_alloc(env, (size_t)width * height, channels * bits / 8)};
    uint64_t random = 5;
    for (size_t i = 0; i < (size_t)width * height * channels; i++) {
        uint32_t smooth = (uint32_t)(i / channels % width + 3 * (i / channels / width));
        uint32_t value = noise ? (uint32_t)(random_bits(&random) >> 20) : smooth * (uint32_t)(1 + i % channels);
        if (bits == 8) ((uint8_t *)p.pixels)[i] = (uint8_t)value;
        else ((uint16_t *)p.pixels)[i] = (uint16_t)(value * 257);
    }
    return p;
}

static uint32_t pixel(const qw_picture *p, size_t i, uint32_t c)
{
    size_t at = i * p->channels + c;
    return p->bits == 8 ? ((const uint8_t *)p->pixels)[at] : ((const uint16_t *)p->pixels)[at];
}

static qw_bytes bytes_of(qw_pen *pen)
{
    size_t size = pen->size;
    memset(qw_pen_room(pen, QW_ZEROS), 0, QW_ZEROS);
    return (qw_bytes){pen->at, size};
}

static bool can_read(qw_env *env)
{
    const char *why;
    qw_pen pen = {.env = env};
    qw_picture p = make_picture(env, 2, 2, 3, 8, false);
    qw_put_png(env, &p, &pen);
    return qw_read_picture(env, bytes_of(&pen), &why).pixels != NULL;
}

static void write_and_read(void *user)
{
    qw_env *env = ((job *)user)->env;
    static const uint32_t sizes[][2] = {{1, 1}, {7, 3}, {300, 200}, {512, 512}};
    if (!can_read(env)) return;
    for (int s = 0; s < 4; s++)
        for (uint32_t channels = 1; channels <= 4; channels++)
            for (int kind = 0; kind < 4; kind++) {
                const char *why;
                qw_pen pen = {.env = env};
                qw_picture p = make_picture(env, sizes[s][0], sizes[s][1], channels, kind & 1 ? 16 : 8, kind & 2);
                qw_put_png(env, &p, &pen);
                size_t raw = (size_t)p.width * p.height * channels * p.bits / 8;
                if (s == 3) assert_true(kind & 2 ? pen.size < raw + raw / 50 : pen.size < raw / 4);
                qw_picture q = qw_read_picture(env, bytes_of(&pen), &why);
                assert_non_null(q.pixels);
                assert_true(q.width == p.width && q.height == p.height && q.bits == p.bits);
                for (size_t i = 0; i < (size_t)p.width * p.height; i++)
                    for (uint32_t c = 0; c < channels; c++) {
                        uint32_t there = channels == 2 && c == 1 ? 3 : c; /* grey and alpha become four */
                        assert_int_equal(pixel(&q, i, there), pixel(&p, i, c));
                    }
            }
}
static void png_comes_back(void **state)
{
    (void)state;
    protect(write_and_read);
}

/* Pictures that are cut, changed, or say that they are vast. */
static void read_hostile(void *user)
{
    qw_env *env = ((job *)user)->env;
    const char *why;
    qw_pen pen = {.env = env};
    qw_picture p = make_picture(env, 40, 30, 3, 8, true);
    qw_put_png(env, &p, &pen);
    qw_bytes whole = bytes_of(&pen);
    char *copy = QW_NEW(env, char, whole.size + QW_ZEROS);
    for (size_t size = 0; size < whole.size; size += 7) {
        qw_scope_begin(env);
        memset(copy, 0, whole.size + QW_ZEROS), memcpy(copy, whole.at, size);
        qw_picture q = qw_read_picture(env, (qw_bytes){copy, size}, &why);
        if (size < whole.size / 2) assert_null(q.pixels);
        qw_scope_end(env);
    }
    uint64_t random = 9;
    for (int i = 0; i < 200; i++) {
        qw_scope_begin(env);
        memcpy(copy, whole.at, whole.size + QW_ZEROS);
        copy[random_bits(&random) % whole.size] ^= (char)(1 << i % 8);
        (void)qw_read_picture(env, (qw_bytes){copy, whole.size}, &why);
        qw_scope_end(env);
    }
    memcpy(copy, whole.at, whole.size);
    copy[18] = copy[22] = (char)0xea, copy[19] = copy[23] = 0x60; /* 60,000 x 60,000 */
    size_t before = qw_env_peak(env);
    assert_null(qw_read_picture(env, (qw_bytes){copy, whole.size}, &why).pixels);
    assert_non_null(strstr(why, "larger"));
    assert_true(qw_env_peak(env) == before);
    static const char jpeg[] =
        "\xff\xd8\xff\xe0\x00\x04\x00\x00\xff\xc0\x00\x11\x08\xea\x60\xea\x60\x03\x01\x22\x00\x02";
    assert_null(qw_read_picture(env, (qw_bytes){jpeg, sizeof jpeg - 1}, &why).pixels);
    assert_non_null(strstr(why, "larger"));
    assert_true(qw_env_peak(env) == before);
    /* a table of 16 x 20 symbols, behind fill bytes as well */
    static char table[400] = "\xff\xff\xd8\xff\xc0\x00\x0b\x08\x00\x02\x00\x02\x01\x01\x11\x00\xff\xff\xc4\x01\x53\x11"
                             "\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14\x14";
    for (int i = 0; i < 2; i++)
        assert_null(qw_read_picture(env, (qw_bytes){table + i, sizeof table - (size_t)i}, &why).pixels);
}
static void hostile_pictures_are_refused(void **state)
{
    (void)state;
    protect(read_hostile);
}

/* A JPEG whose scan names a table that is not there: the same pixels, or none, whatever memory has held before. */
static void read_without_a_table(void *user)
{
    qw_env *env = ((job *)user)->env;
    const char *why;
    qw_bytes bytes = qw_file_read(env, QW_TEST_DATA "/../../fuzz/corpus/fuzz_picture/undefined_table.jpg", "it");
    qw_picture first = qw_read_picture(env, bytes, &why);
    qw_bytes all = qw_file_read(env, QW_TEST_DATA "/../../fuzz/corpus/fuzz_picture/all_symbols.jpg", "it");
    assert_null(qw_read_picture(env, all, &why).pixels); /* stb_image mistakes the 256th */
    for (int fill = 0x55; fill < 0x100; fill += 0x55) {
        enum { BLOCKS = 64 };
        void *held[BLOCKS];
        for (size_t i = 0; i < BLOCKS; i++) held[i] = memset(malloc(16000 + 64 * i), fill, 16000 + 64 * i);
        for (size_t i = 0; i < BLOCKS; i++) free(held[i]);
        qw_picture again = qw_read_picture(env, bytes, &why);
        assert_true((first.pixels == NULL) == (again.pixels == NULL));
        if (first.pixels) assert_memory_equal(first.pixels, again.pixels, (size_t)4 * first.width * first.height);
    }
}
static void tables_that_are_not_there(void **state)
{
    (void)state;
    protect(read_without_a_table);
}

/* ---- WebP: 5 x 3 pixels, of which (x, y) is (10 x + 3 y, 200 - 20 y, 40 x), by Debian's cwebp */

static const char lossless[] =
    "\x52\x49\x46\x46\x48\x00\x00\x00\x57\x45\x42\x50\x56\x50\x38\x4c\x3c\x00\x00\x00\x2f\x04\x80\x00"
    "\x00\x77\x40\x90\x6d\x33\x88\xf9\xf3\x1c\x66\x1a\x77\x50\xd3\xb6\x01\xd3\xf1\x85\x3f\xdd\x48\x83"
    "\x32\xff\x5d\x58\xec\x74\x20\x45\x81\xee\x3a\x30\x08\x00\x89\x40\x05\x93\x41\x06\xe1\x65\xb0\xc1"
    "\xac\x11\xfd\x8f\x3e\x72\xf4\x04";
static const char lossy[] =
    "\x52\x49\x46\x46\x54\x00\x00\x00\x57\x45\x42\x50\x56\x50\x38\x20\x48\x00\x00\x00\x10\x02\x00\x9d"
    "\x01\x2a\x05\x00\x03\x00\x00\xc0\x12\x25\xb0\x02\x74\xb7\x00\x01\x90\x83\x7e\xa4\x00\x00\xfe\xde"
    "\x20\xf8\xad\xc0\x18\x1e\x7f\xfe\xd3\xf9\xa7\xef\xbe\xe4\x65\x35\x7f\xd8\xcb\x7d\xf7\xdc\x37\xff"
    "\x9d\xf9\xc7\xc1\x7c\xff\xcd\x8c\xc0\x02\x86\xff\x98\x76\x3f\xe4\x32\x00\x00\x00";

static void read_webp(void *user)
{
    qw_env *env = ((job *)user)->env;
    const qw_bytes file[] = {{lossless, sizeof lossless - 1}, {lossy, sizeof lossy - 1}};
    const int off[] = {0, 24};
    const char *why;
    for (int i = 0; i < 2; i++) {
        uint32_t width = 0, height = 0;
        assert_true(qw_picture_size(file[i], &width, &height));
        assert_int_equal(width, 5), assert_int_equal(height, 3);
        qw_picture p = qw_read_picture(env, file[i], &why);
        if (!qw_reads_webp()) assert_non_null(strstr(why, "libwebp"));
        for (int k = 0; k < 15 && qw_reads_webp(); k++) {
            int x = k % 5, y = k / 5, wanted[4] = {10 * x + 3 * y, 200 - 20 * y, 40 * x, 255};
            assert_int_equal(p.bits, 8);
            for (uint32_t c = 0; c < 4; c++)
                assert_true(abs((int)pixel(&p, (size_t)k, c) - wanted[c]) <= (c < 3 ? off[i] : 0));
        }
    }
}
static void webp_is_read(void **state)
{
    (void)state;
    protect(read_webp);
}

/* Cut, changed, and vast: of 60,000 pixels a side, which no more than the head of a canvas can say. */
static void read_hostile_webp(void *user)
{
    qw_env *env = ((job *)user)->env;
    const qw_bytes file[] = {{lossless, sizeof lossless - 1}, {lossy, sizeof lossy - 1}};
    const char *why;
    char copy[128];
    uint64_t random = 3;
    for (int i = 0; i < 800; i++) {
        const qw_bytes *f = &file[i % 2];
        size_t size = i < 200 ? (size_t)i / 2 % f->size : f->size;
        qw_scope_begin(env);
        memset(copy, 0, sizeof copy), memcpy(copy, f->at, size);
        if (i >= 200) copy[random_bits(&random) % size] ^= (char)(1 << i / 2 % 8);
        qw_picture p = qw_read_picture(env, (qw_bytes){copy, size}, &why);
        if (i < 200 && size < f->size / 2) assert_null(p.pixels);
        qw_scope_end(env);
    }
    static const char canvas[] = "RIFF\x20\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\x5f\xea\0\x5f\xea\0";
    size_t before = qw_env_peak(env);
    assert_null(qw_read_picture(env, (qw_bytes){canvas, sizeof canvas - 1}, &why).pixels);
    assert_non_null(strstr(why, "larger"));
    assert_true(qw_env_peak(env) == before);
}
static void hostile_webp_is_refused(void **state)
{
    (void)state;
    protect(read_hostile_webp);
}

/* A picture of one pixel whose rows are those of a large one, as its head was changed. */
static void read_bomb(void *user)
{
    qw_env *env = ((job *)user)->env;
    const char *why;
    qw_pen pen = {.env = env};
    qw_picture p = {4096, 4096, 4, 8, QW_NEW_ZERO(env, uint8_t, 4096 * 4096 * 4)};
    if (!can_read(env)) return;
    qw_put_png(env, &p, &pen);
    qw_bytes bomb = bytes_of(&pen);
    assert_non_null(qw_read_picture(env, bomb, &why).pixels);
    static const char one[8] = {0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(pen.at + 16, one, sizeof one);
    assert_null(qw_read_picture(env, bomb, &why).pixels);
}
static void bombs_are_refused(void **state)
{
    (void)state;
    protect(read_bomb);
}

/* TGA and BMP of two pixels, and what is known not to be read. */
static void read_others(void *user)
{
    qw_env *env = ((job *)user)->env;
    static const char tga[64] = {0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 24, 0, 1, 2, 3, 4, 5, 6};
    static const char bmp[80] = {'B', 'M', 62, 0, 0, 0, 0, 0, 0, 0, 54, 0, 0,        0, 40, 0, 0, 0,
                                 2,   0,   0,  0, 1, 0, 0, 0, 1, 0, 24, 0, [54] = 1, 2, 3,  4, 5, 6};
    const char *why;
    if (!can_read(env)) return;
    for (int i = 0; i < 2; i++) {
        qw_picture p = qw_read_picture(env, i ? (qw_bytes){bmp, 62} : (qw_bytes){tga, 24}, &why);
        assert_non_null(p.pixels);
        assert_true(p.width == 2 && p.height == 1);
        for (uint32_t x = 0; x < 2; x++)
            for (uint32_t c = 0; c < 3; c++) assert_int_equal(pixel(&p, x, c), 3 * x + 3 - c);
        assert_null(qw_read_picture(env, i ? (qw_bytes){bmp, 57} : (qw_bytes){tga, 21}, &why).pixels); /* cut off */
    }
    assert_null(qw_read_picture(env, (qw_bytes){"\xabKTX 20\xbb\r\n\x1a\n........", 20}, &why).pixels);
    assert_non_null(strstr(why, "KTX2"));
    assert_null(qw_read_picture(env,
                                (qw_bytes){"\0\0\0\x1c"
                                           "ftypavif........",
                                           20},
                                &why)
                    .pixels);
    assert_non_null(strstr(why, "AVIF"));
}
static void other_pictures(void **state)
{
    (void)state;
    protect(read_others);
}

/* ---- materials of glTF files that name what is not there, and numbers that are none */

static void read_materials(void *user)
{
    static const char text[] =
        "\0\"materials\":[{\"alphaCutoff\":1e39,\"pbrMetallicRoughness\":{\"baseColorFactor\":[1e999,-1e999,\"x\"],"
        "\"roughnessFactor\":1e39,\"metallicFactor\":-1e300,"
        "\"baseColorTexture\":{\"index\":1e300},\"metallicRoughnessTexture\":{\"index\":0,\"texCoord\":-5}},"
        "\"normalTexture\":{\"index\":1,\"texCoord\":1e300,\"extensions\":{\"KHR_texture_transform\":{\"texCoord\":"
        "1e20,"
        "\"scale\":[1e300,0]}}},\"occlusionTexture\":7,\"emissiveTexture\":{\"index\":2}},7,"
        "{\"emissiveTexture\":{\"index\":3},\"normalTexture\":{\"index\":4}}],"
        "\"textures\":[{\"source\":0,\"sampler\":9},{\"source\":1},{\"source\":77},"
        "{\"source\":0,\"extensions\":{\"EXT_texture_webp\":{\"source\":1}}},"
        "{\"extensions\":{\"EXT_texture_webp\":{\"source\":2}}}],\"samplers\":4,"
        "\"images\":[{\"bufferView\":0},{\"uri\":\"data:image/png;base64,AAAA\"},{\"bufferView\":1}],\0"
        "{\"byteOffset\":4,\"byteLength\":1e300},{\"byteOffset\":-1,\"byteLength\":2},";
    qw_env *env = ((job *)user)->env;
    char bytes[16] = {0}, *copy = QW_NEW(env, char, sizeof text);
    memcpy(copy, text, sizeof text);
    const qw_gltf_rest rest = {.text = copy, .bytes = bytes, .byte_count = 8, .head = 1, .views = 2 + strlen(copy + 1)};
    qw_material_list list = qw_gltf_materials(env, &rest, NULL);
    assert_int_equal(list.count, 3);
    assert_int_equal(list.image_count, 3);
    assert_null(list.image[0].at);
    assert_null(list.image[2].at);
    assert_non_null(list.image[1].at);
    const char *why;
    assert_null(qw_read_picture(env, list.image[1], &why).pixels);
    assert_int_equal(list.material[0].color_map.image, QW_NONE);
    assert_int_equal(list.material[0].emission_map.image, QW_NONE);
    assert_int_equal(list.material[0].roughness_map.image, 0);
    assert_int_equal(list.material[0].roughness_map.set, QW_NONE);
    assert_int_equal(list.material[0].normal_map.set, QW_NONE);
    assert_float_equal(list.material[2].metallic, 1, 0);
    const qw_material *odd = &list.material[0];
    assert_float_equal(odd->color[0], 1, 0);
    assert_float_equal(odd->color[1], 0, 0);
    assert_float_equal(odd->color[2], 1, 0);
    assert_float_equal(odd->roughness, 1, 0);
    assert_float_equal(odd->metallic, 0, 0);
    assert_float_equal(odd->cutoff, QW_MOST_FACTOR, 0);
    assert_float_equal(odd->normal_map.scale[0], QW_MOST_FACTOR, 0);
    assert_true(list.note_count >= 6);
    assert_int_equal(list.material[2].emission_map.image, qw_reads_webp() ? 1 : 0);
    assert_int_equal(list.material[2].normal_map.image, 2);
}
/* Pictures of materials that no face has are not looked for. */
static void read_used(void *user)
{
    static const char text[] =
        "\0\"materials\":[{\"emissiveTexture\":{\"index\":0}},{\"emissiveTexture\":{\"index\":1}}],"
        "\"textures\":[{\"source\":0},{\"source\":1}],\"images\":[{\"uri\":\"data:image/"
        "png;base64,AAAA\"},{\"uri\":\"data:image/png;base64,AAAA\"}],\0";
    qw_env *env = ((job *)user)->env;
    char *copy = QW_NEW(env, char, sizeof text);
    memcpy(copy, text, sizeof text);
    const qw_gltf_rest rest = {.text = copy, .material_count = 2, .head = 1, .views = 2 + strlen(copy + 1)};
    qw_material_list list = qw_gltf_materials(env, &rest, (const uint8_t[]){0, 1});
    assert_null(list.image[0].at);
    assert_non_null(list.image[1].at);
    assert_int_equal(list.note_count, 0);
}
static void unused_pictures(void **state)
{
    (void)state;
    protect(read_used);
}

static void hostile_materials(void **state)
{
    (void)state;
    protect(read_materials);
}

/* ---- a sphere above a flat square, whose tangents are x and y */

/* The square is shaded as the sphere is in the mean around its corners: outward, and less than at the corners
   themselves. Where the input is shaded sideways, it stays as it was. */
static void shade_as_input(qw_env *env, const qw_bake_target *target, qw_look *look)
{
    const float *made = qw_shading_of_input(env, target, look);
    for (int c = 0; c < 4; c++) {
        const float *n = made + 3 * c;
        float x = n[0] / target->place[c].x, y = n[1] / target->place[c].y;
        assert_float_equal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-5);
        assert_true(x > 0.1f && x < 0.8f && y > 0.1f && y < 0.8f);
    }
    for (uint32_t h = 0; h < 3 * look->source->mesh.face_count; h++) look->normal[h] = qw_v3(0.95f, 0, 0.3f);
    made = qw_shading_of_input(env, target, look);
    for (int c = 0; c < 4; c++) assert_true(made[3 * c] == 0 && made[3 * c + 1] == 0 && made[3 * c + 2] == 1);
}

static void bake_cap(void *user)
{
    enum { N = 48, V = (N + 1) * (N + 1), F = 2 * N * N, TEXELS = 64 };
    qw_env *env = ((job *)user)->env;
    qw_vec3 *position = QW_NEW(env, qw_vec3, V), *normal = QW_NEW(env, qw_vec3, F);
    uint32_t *corner = QW_NEW(env, uint32_t, 3 * F), *face = QW_NEW_ZERO(env, uint32_t, F);
    for (uint32_t i = 0; i < V; i++) {
        float x = (float)(i % (N + 1)) / N * 0.8f - 0.4f, y = (float)(i / (N + 1)) / N * 0.8f - 0.4f;
        position[i] = qw_v3(x, y, sqrtf(1 - x * x - y * y));
    }
    for (uint32_t i = 0; i < N * N; i++) {
        uint32_t a = i / N * (N + 1) + i % N, q[6] = {a, a + 1, a + N + 2, a, a + N + 2, a + N + 1};
        memcpy(corner + 6 * (size_t)i, q, sizeof q);
    }
    qw_trimesh mesh = {.vertex_count = V, .face_count = F, .position = position, .corner = corner};
    for (uint32_t f = 0; f < F; f++) normal[f] = qw_normalize(qw_face_cross(&mesh, f));
    const qw_clean_input input = {.vertex_count = V, .face_count = F, .corner = corner};
    qw_source source = {.input = &input, .mesh = mesh, .face = face, .normal = normal, .bvh = qw_bvh_build(env, &mesh)};
    source.corner = QW_NEW(env, uint32_t, 3 * F);
    for (uint32_t h = 0; h < 3 * F; h++) source.corner[h] = h;
    const qw_material_list none = {0};
    qw_look look = qw_begin_look(env, &source, NULL, 0, false, &none, NULL);

    static const uint32_t begin[2] = {0, 4}, vertex[4] = {0, 1, 2, 3}, twin[4] = {QW_NONE, QW_NONE, QW_NONE, QW_NONE};
    static const float up[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, uv[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    qw_vec3 place[4] = {qw_v3(-0.3f, -0.3f, 0.95f), qw_v3(0.3f, -0.3f, 0.95f), qw_v3(0.3f, 0.3f, 0.95f),
                        qw_v3(-0.3f, 0.3f, 0.95f)};
    qw_bake_target target = {.corner_count = 4,
                             .face_count = 1,
                             .begin = begin,
                             .vertex = vertex,
                             .twin = twin,
                             .place = place,
                             .aim = up,
                             .normal = up,
                             .uv = uv};
    qw_bake_target_begin(env, &target);
    for (int c = 0; c < 4; c++) {
        const float want[4] = {1, 0, 0, 1};
        for (int k = 0; k < 4; k++) assert_float_equal(target.tangent[4 * c + k], want[k], 1e-6);
    }
    float far = qw_bake_target_cage(env, &target, &source, 0);
    qw_maps maps = qw_bake_maps(env, &target, &look, 1 << QW_MAP_NORMAL | 1 << QW_MAP_HEIGHT, 1, TEXELS, 2, 4, far);
    assert_int_equal(maps.missed, 0);
    assert_int_equal(maps.texels, TEXELS * TEXELS);
    for (uint32_t i = 0; i < TEXELS * TEXELS; i++) {
        double x = ((i % TEXELS + 0.5) / TEXELS - 0.5) * 0.6, y = (0.5 - (i / TEXELS + 0.5) / TEXELS) * 0.6;
        double z = sqrt(1 - x * x - y * y), n[3], l = 0;
        for (uint32_t c = 0; c < 3; c++) n[c] = pixel(&maps.picture[QW_MAP_NORMAL], i, c) / 127.5 - 1, l += n[c] * n[c];
        assert_true((n[0] * x + n[1] * y + n[2] * z) / sqrt(l) > cos(0.7 * 3.14159265 / 180));
        double h = (pixel(&maps.picture[QW_MAP_HEIGHT], i, 0) / 65535.0 - 0.5) * 2 * (double)maps.height_scale;
        assert_float_equal(h, z - 0.95, 5e-4);
    }
    assert_true(maps.normal_error >= 0 && maps.normal_error < 0.5);
    shade_as_input(env, &target, &look);
}
static void normals_of_a_sphere(void **state)
{
    (void)state;
    protect(bake_cap);
}

/* ---- occlusion on a floor beside a wall: of rays that are as many as their cosines ask for, those meet it that leave
   the floor's unit circle beyond its share of the reach */

static void bake_beside_wall(void *user)
{
    enum { TEXELS = 64 };
    qw_env *env = ((job *)user)->env;
    static const qw_vec3 place[6] = {{0, -1, 0}, {1, -1, 0}, {1, 1, 0}, {0, 1, 0}, {0, -1, 1}, {0, 1, 1}};
    static const uint32_t corners[12] = {0, 1, 2, 0, 2, 3, 4, 0, 3, 4, 3, 5};
    qw_vec3 position[6], normal[4], square[4] = {{0, 0, 0}, {0.3f, 0, 0}, {0.3f, 0.3f, 0}, {0, 0.3f, 0}};
    uint32_t corner[12], face[4] = {0};
    memcpy(position, place, sizeof place), memcpy(corner, corners, sizeof corner);
    qw_trimesh mesh = {.vertex_count = 6, .face_count = 4, .position = position, .corner = corner};
    for (uint32_t f = 0; f < 4; f++) normal[f] = qw_normalize(qw_face_cross(&mesh, f));
    const qw_clean_input input = {.vertex_count = 6, .face_count = 4, .corner = corner};
    qw_source source = {.input = &input,
                        .mesh = mesh,
                        .face = face,
                        .normal = normal,
                        .bvh = qw_bvh_build(env, &mesh),
                        .corner = corner};
    const qw_material_list none = {0};
    qw_look look = qw_begin_look(env, &source, NULL, 0, false, &none, NULL);
    static const uint32_t begin[2] = {0, 4}, vertex[4] = {0, 1, 2, 3}, twin[4] = {QW_NONE, QW_NONE, QW_NONE, QW_NONE};
    static const float up[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, uv[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    qw_bake_target target = {.corner_count = 4,
                             .face_count = 1,
                             .begin = begin,
                             .vertex = vertex,
                             .twin = twin,
                             .place = square,
                             .aim = up,
                             .normal = up,
                             .uv = uv};
    qw_bake_target_begin(env, &target);
    float far = qw_bake_target_cage(env, &target, &source, 0.01f);
    for (uint32_t samples = 1; samples < 4; samples++) {
        qw_maps maps = qw_bake_maps(env, &target, &look, 1 << QW_MAP_OCCLUSION, 1, TEXELS, samples, 4, far);
        double sum = 0, most = 0;
        for (uint32_t i = 0; i < TEXELS * TEXELS; i++) {
            double k = (i % TEXELS + 0.5) / TEXELS * 0.3 / 0.25,
                   open = k < 1 ? (acos(k) - k * sqrt(1 - k * k)) / acos(-1) : 0;
            double off = fabs(pixel(&maps.picture[QW_MAP_OCCLUSION], i, 0) / 255.0 - (1 - open));
            sum += off, most = off > most ? off : most;
        }
        assert_true(sum / (TEXELS * TEXELS) < 0.012 && most < 0.1);
    }
}
static void occlusion_beside_a_wall(void **state)
{
    (void)state;
    protect(bake_beside_wall);
}

/* ---- shading normals */

/* Two quads that meet at a right angle: a sharp edge has a normal on either side, a ring one. */
static void shade_fold(void *user)
{
    job *j = user;
    static const qw_vec3 place[6] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 1, 1}, {1, 1, 1}};
    static const uint32_t corner[8] = {0, 1, 3, 2, 2, 3, 5, 4};
    qw_vec3 position[6];
    uint32_t corners[8], twin[8];
    memcpy(position, place, sizeof place), memcpy(corners, corner, sizeof corner);
    memset(twin, 0xff, sizeof twin), twin[2] = 4, twin[4] = 2;
    for (int ring = 0; ring < 2; ring++) {
        uint8_t mark[8] = {[2] = ring ? QW_MARKS : QW_MARK_FEATURE, [4] = ring ? QW_MARKS : QW_MARK_FEATURE};
        const qw_quadmesh quads = {
            .vertex_count = 6, .face_count = 2, .position = position, .corner = corners, .twin = twin, .mark = mark};
        const float *n = qw_shading_normals(j->env, &quads, true), *a = n + 3 * 3, *b = n + 3 * 4;
        float cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        assert_float_equal(cosine, ring ? 1 : 0, 1e-6);
    }
}
static void rings_are_smooth(void **state)
{
    (void)state;
    protect(shade_fold);
}

/* ---- shading normals of an input without any */

/* A low pyramid whose sides are alike but for their lengths: its tip faces up, however large they are. */
static void look_at_tip(void *user)
{
    qw_env *env = ((job *)user)->env;
    static const float length[4] = {1, 3, 1, 0.5f};
    static uint32_t corner[12] = {4, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0}, face[4] = {0, 1, 2, 3};
    qw_vec3 position[5] = {0}, normal[4];
    for (int i = 0; i < 4; i++) {
        float x = i == 0 ? 1 : i == 2 ? -1 : 0, y = i == 1 ? 1 : i == 3 ? -1 : 0;
        position[i] = qw_scale(qw_v3(x, y, -0.3f), length[i]);
    }
    qw_trimesh mesh = {.vertex_count = 5, .face_count = 4, .position = position, .corner = corner};
    for (uint32_t f = 0; f < 4; f++) normal[f] = qw_normalize(qw_face_cross(&mesh, f));
    const qw_source source = {.mesh = mesh, .face = face, .normal = normal};
    const qw_material_list none = {0};
    qw_look look = qw_begin_look(env, &source, NULL, 0, false, &none, NULL);
    for (size_t f = 0; f < 4; f++) assert_true(look.normal[3 * f].z > 0.99999f);
}
static void tips_face_up(void **state)
{
    (void)state;
    protect(look_at_tip);
}

/* ---- whole assets */

typedef struct asset {
    qw_context *context;
    qw_mesh *source;
    quad_shape shape;
    const qw_image *images;
    uint32_t count;
    qw_asset_report report;
} asset;

static int serial_only(void *user, qw_stage stage, double fraction)
{
    (void)user, (void)stage, (void)fraction;
    return 0;
}

static void begin_asset(asset *a, quad_shape shape, const qw_attribute *attributes, uint32_t count, int64_t threads)
{
    qw_options options;
    const qw_host host = {.progress = serial_only};
    a->shape = shape;
    qw_mesh_view view = quad_shape_view(&a->shape);
    qw_options_init(&options);
    options.faces = 150, options.threads = threads;
    assert_int_equal(qw_create(&host, &a->context), QW_OK);
    assert_int_equal(qw_set_mesh(a->context, &view), QW_OK);
    assert_int_equal(qw_run(a->context, &options), QW_OK);
    assert_int_equal(qw_mesh_wrap(&view, attributes, count, NULL, NULL, NULL, &a->source), QW_OK);
}

static void unwrap_and_bake(asset *a, int64_t texture, uint32_t maps)
{
    qw_asset_options options;
    qw_attribute uv;
    qw_asset_options_init(&options);
    options.texture = texture, options.margin = 2;
    if (qw_unwrap(a->context, &options, NULL, &uv, &a->report) != QW_OK) fail_msg("%s", qw_message(a->context));
    assert_int_equal(a->report.overlapping_charts, 0);
    if (qw_bake(a->context, a->source, maps, &a->images, &a->count, &a->report) != QW_OK)
        fail_msg("%s", qw_message(a->context));
}

static void end_asset(asset *a) { qw_destroy(a->context), qw_mesh_destroy(a->source), quad_shape_free(&a->shape); }

/* One colour everywhere comes out as that colour, in every texel. */
static void constant_color(void **state)
{
    (void)state;
    asset a = {0};
    quad_shape shape = quad_sphere(8);
    float *value = malloc(3 * shape.vertex_count * sizeof *value);
    for (uint32_t i = 0; i < 3 * shape.vertex_count; i++) value[i] = (float[]){0.2f, 0.6f, 1.0f}[i % 3];
    const qw_attribute color = {.size = sizeof color,
                                .name = "color",
                                .domain = QW_PER_VERTEX,
                                .kind = QW_VALUES,
                                .components = 3,
                                .count = shape.vertex_count,
                                .values = value};
    begin_asset(&a, shape, &color, 1, 1);
    unwrap_and_bake(&a, 128, QW_MAPS_OF_INPUT);
    assert_int_equal(a.count, 2);
    assert_int_equal(a.images[0].map, QW_MAP_COLOR);
    assert_int_equal(a.images[0].channels, 3);
    static const int want[3] = {51, 153, 255};
    for (uint32_t i = 0; i < 3 * 128 * 128; i++)
        assert_true(abs(((const uint8_t *)a.images[0].pixels)[i] - want[i % 3]) <= 1);
    assert_true(a.report.color_error >= 0 && a.report.color_error < 0.01);
    assert_true(a.report.normal_error >= 0 && a.report.normal_error < 4);
    assert_true(a.report.missed_texels < a.report.texels / 100);
    end_asset(&a);
    free(value);
}

/* Squares of lengths that overflow or vanish: there are few charts all the same, not one for each quad. */
static void charts_at_any_scale(void **state)
{
    (void)state;
    static const double scales[] = {1, 0x1p660, 0x1p-660};
    for (int i = 0; i < 3; i++) {
        asset a = {0};
        qw_asset_options options;
        qw_attribute uv;
        quad_shape shape = quad_sphere(8);
        for (uint32_t k = 0; k < 3 * shape.vertex_count; k++) shape.position[k] *= scales[i];
        begin_asset(&a, shape, NULL, 0, 1);
        qw_asset_options_init(&options);
        assert_int_equal(qw_unwrap(a.context, &options, NULL, &uv, &a.report), QW_OK);
        assert_true(a.report.charts < 10);
        assert_true(a.report.seam_length > scales[i] && a.report.seam_length < 100 * scales[i]);
        assert_true(a.report.texel_density * scales[i] > 1 && a.report.texel_density * scales[i] < 2048);
        end_asset(&a);
    }
}

/* So far that cross products of edges overflow or vanish: the normals are those of a sphere all the same. */
static void maps_at_any_scale(void **state)
{
    (void)state;
    static const double scales[] = {0x1p660, 0x1p-660};
    for (int i = 0; i < 2; i++) {
        asset a = {0};
        quad_shape shape = quad_sphere(8);
        for (uint32_t k = 0; k < 3 * shape.vertex_count; k++) shape.position[k] *= scales[i];
        begin_asset(&a, shape, NULL, 0, 1);
        unwrap_and_bake(&a, 64, 1 << QW_MAP_NORMAL);
        assert_true(a.report.missed_texels * 50 < a.report.texels);
        assert_true(a.report.normal_error >= 0 && a.report.normal_error < 8);
        end_asset(&a);
    }
}

/* ---- what fails on the way */

static qw_status try_asset(asset *a)
{
    qw_asset_options options;
    qw_attribute uv;
    qw_asset_options_init(&options), options.texture = 48, options.margin = 1, options.samples = 1;
    qw_status status = qw_unwrap(a->context, &options, NULL, &uv, &a->report);
    return status != QW_OK ? status : qw_bake(a->context, a->source, 0x23, &a->images, &a->count, &a->report);
}

/* Allocations that fail, and reports that cancel, at some places over all of it: what is held goes with the context,
 * and the next call on it gives the same maps. */
static void failures_leave_nothing(void **state)
{
    (void)state;
    asset a = {.shape = quad_sphere(4)};
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
    const qw_host host = faults_host(&f);
    qw_mesh_view view = quad_shape_view(&a.shape);
    qw_options options;
    qw_options_init(&options), options.faces = 54, options.threads = 1;
    assert_int_equal(qw_create(&host, &a.context), QW_OK);
    assert_int_equal(qw_set_mesh(a.context, &view), QW_OK);
    assert_int_equal(qw_run(a.context, &options), QW_OK);
    assert_int_equal(qw_mesh_wrap(&view, NULL, 0, NULL, NULL, NULL, &a.source), QW_OK);
    assert_int_equal(try_asset(&a), QW_OK);
    assert_int_equal(a.count, 3);
    size_t size = (size_t)48 * 48 * a.images[0].channels;
    uint8_t *first = malloc(size);
    memcpy(first, a.images[0].pixels, size);
    int failed = 0, cancelled = 0;
    for (long n = 0, finished = 0; !finished; n += n / 8 + 1) {
        f.allocations = n;
        qw_status status = try_asset(&a);
        finished = f.allocations >= 0, f.allocations = FAULTS_NONE;
        assert_int_equal(status, finished ? QW_OK : QW_MEMORY);
        failed += status != QW_OK;
    }
    for (long n = 0, finished = 0; !finished; n += n / 8 + 1) {
        f.reports = n;
        qw_status status = try_asset(&a);
        finished = f.reports >= 0, f.reports = FAULTS_NONE;
        assert_int_equal(status, finished ? QW_OK : QW_CANCELLED);
        cancelled += status != QW_OK;
    }
    assert_true(failed > 20 && cancelled > 5);
    assert_int_equal(try_asset(&a), QW_OK);
    assert_memory_equal(first, a.images[0].pixels, size);
    end_asset(&a), free(first);
    assert_int_equal(f.blocks, 0);
    assert_int_equal(f.held, 0);
}

/* What the host is told of both calls: from 0 on, never less, by the name of that work. */
typedef struct told {
    double last;
    int count, falls;
} told;

static int hear(void *user, qw_stage stage, double fraction)
{
    told *t = user;
    if (stage != QW_STAGE_COUNT) return 0;
    t->count++, t->falls += fraction < t->last;
    t->last = fraction;
    return 0;
}

static void progress_is_told(void **state)
{
    (void)state;
    told t = {0};
    const qw_host host = {.progress = hear, .progress_user = &t};
    asset a = {.shape = quad_sphere(6)};
    qw_mesh_view view = quad_shape_view(&a.shape);
    qw_options options;
    qw_options_init(&options), options.faces = 100, options.threads = 1;
    assert_int_equal(qw_create(&host, &a.context), QW_OK);
    assert_int_equal(qw_set_mesh(a.context, &view), QW_OK);
    assert_int_equal(qw_run(a.context, &options), QW_OK);
    assert_int_equal(t.count, 0);
    unwrap_and_bake(&a, 256, QW_MAPS_OF_INPUT);
    assert_true(t.count > 20 && t.last > 0.8);
    assert_int_equal(t.falls, 1); /* the second call begins anew */
    assert_string_equal(qw_stage_title(QW_STAGE_COUNT), "texture coordinates and maps");
    end_asset(&a);
}

/* The same bytes at any number of threads; all maps; several calls, one after the other. */
static void same_bytes(void **state)
{
    (void)state;
    asset a[2] = {{0}};
    for (int i = 0; i < 2; i++) {
        begin_asset(&a[i], quad_sheet(20, 10, 1, 1, 0), NULL, 0, i ? 3 : 1);
        if (i) unwrap_and_bake(&a[i], 64, 1 << QW_MAP_NORMAL);
        unwrap_and_bake(&a[i], 96, (1u << QW_MAP_COUNT) - 1);
    }
    assert_int_equal(a[0].count, QW_MAP_COUNT);
    assert_int_equal(a[1].count, QW_MAP_COUNT);
    for (uint32_t i = 0; i < QW_MAP_COUNT; i++) {
        const qw_image *x = &a[0].images[i], *y = &a[1].images[i];
        assert_int_equal(x->map, i);
        assert_true(x->channels == y->channels && x->bits == y->bits);
        assert_memory_equal(x->pixels, y->pixels, (size_t)96 * 96 * x->channels * x->bits / 8);
    }
    end_asset(&a[0]), end_asset(&a[1]);
}

static void calls_out_of_place(void **state)
{
    (void)state;
    asset a = {0};
    begin_asset(&a, quad_sphere(6), NULL, 0, 1);
    assert_int_equal(qw_bake(a.context, NULL, 0, &a.images, &a.count, NULL), QW_NOT_READY);
    assert_int_equal(qw_save_asset(a.context, NULL, 0, QW_BINARY_DIR "/x.glb", QW_FORMAT_AUTO), QW_NOT_READY);
    unwrap_and_bake(&a, 64, QW_MAPS_OF_INPUT);
    assert_int_equal(qw_bake(a.context, NULL, 1u << QW_MAP_COUNT, &a.images, &a.count, NULL), QW_ARGUMENT);
    assert_int_equal(qw_save_asset(a.context, NULL, 0, QW_BINARY_DIR "/x.ply", QW_FORMAT_PLY), QW_ARGUMENT);
    assert_int_equal(qw_save_asset(a.context, NULL, 0, "-", QW_FORMAT_OBJ), QW_ARGUMENT);
    assert_int_equal(qw_bake(a.context, NULL, 0, &a.images, &a.count, &a.report), QW_OK); /* the shape alone */
    assert_int_equal(a.count, 1);
    end_asset(&a);
}

/* ---- files */

static void put_file(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static void write_red(void *user)
{
    qw_env *env = ((job *)user)->env;
    qw_pen pen = {.env = env};
    qw_picture p = make_picture(env, 4, 4, 3, 8, false);
    for (int i = 0; i < 48; i++) ((uint8_t *)p.pixels)[i] = i % 3 ? 10 : 200;
    qw_put_png(env, &p, &pen);
    put_file(QW_BINARY_DIR "/bake red.png", pen.at, pen.size);
}

/* A sphere as OBJ, so far along x. head: its first lines; color: what follows the coordinates. */
static void write_sphere(const char *path, const char *head, const char *color, double x)
{
    quad_shape shape = quad_sphere(6);
    FILE *file = fopen(path, "w");
    fputs(head, file);
    for (uint32_t v = 0; v < shape.vertex_count; v++) {
        const double *p = shape.position + 3 * (size_t)v;
        fprintf(file, "v %g %g %g %s\n", p[0] + x, p[1], p[2], color);
    }
    for (uint32_t f = 0; f < shape.face_count; f++) {
        const uint32_t *c = shape.corner + 4 * (size_t)f;
        bool has_uv = strstr(head, "vt") != NULL;
        fputs("f", file);
        for (uint32_t k = 0; k < 4; k++) fprintf(file, has_uv ? " %u/%u" : " %u", c[k] + 1, k + 1);
        fputs("\n", file);
    }
    fclose(file), quad_shape_free(&shape);
}

/* An OBJ with the texture of its MTL, to an OBJ with its own, and to GLB; both are read again. */
static void from_obj_to_files(void **state)
{
    (void)state;
    static const char mtl[] = "newmtl other\nKd 0 0 0\nnewmtl red\nKd 1 1 1\nmap_Kd -clamp on bake red.png\n";
    protect(write_red);
    put_file(QW_BINARY_DIR "/bake_in.mtl", mtl, sizeof mtl - 1);
    write_sphere(QW_BINARY_DIR "/bake_in.obj", "mtllib bake_in.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\n", "",
                 0);
    qw_mesh *source, *again;
    qw_context *context;
    qw_options options;
    assert_int_equal(qw_load(QW_BINARY_DIR "/bake_in.obj", NULL, &source), QW_OK);
    qw_mesh_view view = qw_mesh_get(source);
    qw_options_init(&options), options.faces = 100, options.threads = 1;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_OK);
    asset a = {.context = context, .source = source};
    unwrap_and_bake(&a, 64, QW_MAPS_OF_INPUT);
    const uint8_t *texel = a.images[0].pixels;
    if (a.images[0].map == QW_MAP_COLOR && a.count == 2) { /* with stb_image */
        assert_in_range(texel[0], 199, 201);
        assert_in_range(texel[1], 9, 11);
    }
    assert_int_equal(qw_save_asset(context, NULL, 0, QW_BINARY_DIR "/bake_out.glb", QW_FORMAT_AUTO), QW_OK);
    assert_int_equal(qw_save_asset(context, NULL, 0, QW_BINARY_DIR "/bake_out.obj", QW_FORMAT_AUTO), QW_OK);
    for (int i = 0; i < 2; i++) {
        uint32_t count, found = 0;
        assert_int_equal(qw_load(i ? QW_BINARY_DIR "/bake_out.obj" : QW_BINARY_DIR "/bake_out.glb", NULL, &again),
                         QW_OK);
        const qw_attribute *of = qw_mesh_attributes(again, &count);
        for (uint32_t k = 0; k < count; k++)
            found += strcmp(of[k].name, "uv") == 0 || strcmp(of[k].name, "normal") == 0;
        assert_int_equal(found, 2);
        assert_int_equal(qw_mesh_get(again).face_count, qw_get_report(context)->topology.faces);
        if (i) assert_string_equal(qw_mesh_library(again), "bake_out.mtl");
        qw_mesh_destroy(again);
    }
    static const char *const beside[] = {"/bake_out.mtl", "/bake_out_color.png", "/bake_out_normal.png"};
    for (int i = 0; i < 3; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s%s", QW_BINARY_DIR, beside[i]);
        FILE *file = fopen(path, "rb");
        if (i != 1 || a.count == 2) assert_non_null(file);
        if (file) fclose(file);
    }
    qw_destroy(context), qw_mesh_destroy(source);
}

/* Whether all of a quad shows a colour of red and green. */
static void require_color(const qw_image *image, const float *uv, const uint8_t color[2])
{
    for (int i = 1; i < 40; i++) {
        float x = (float)(i % 6 + 1) / 8, y = (float)(i / 6 + 1) / 8,
              w[4] = {(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y};
        float at[2] = {0, 0};
        for (int k = 0; k < 8; k++) at[k % 2] += w[k / 2] * uv[k];
        uint32_t column = (uint32_t)(at[0] * (float)image->width), row = (uint32_t)((1 - at[1]) * (float)image->height);
        const uint8_t *texel = (const uint8_t *)image->pixels + ((size_t)row * image->width + column) * image->channels;
        for (int k = 0; k < 2; k++) assert_in_range(texel[k] + 2, color[k], color[k] + 4);
    }
}

/* Two files whose surfaces pass through one another, in one square: each keeps its own colour up to the line. */
static void files_that_meet(void **state)
{
    (void)state;
    static const char *const paths[] = {QW_BINARY_DIR "/bake_red.obj", QW_BINARY_DIR "/bake_green.obj"};
    static const char mtl[] = "newmtl green\nKd 0 1 0\n";
    static const uint8_t colors[2][2] = {{255, 0}, {0, 255}};
    put_file(QW_BINARY_DIR "/bake_green.mtl", mtl, sizeof mtl - 1);
    write_sphere(paths[0], "", "1 0 0", 0);
    write_sphere(paths[1], "mtllib bake_green.mtl\nusemtl green\n", "", 0.5);
    asset a = {0};
    qw_options options;
    assert_int_equal(qw_load_together(paths, 2, NULL, &a.source), QW_OK);
    qw_mesh_view view = qw_mesh_get(a.source), quads;
    qw_options_init(&options), options.faces = 400;
    assert_int_equal(qw_create(NULL, &a.context), QW_OK);
    assert_int_equal(qw_set_mesh(a.context, &view), QW_OK);
    assert_int_equal(qw_run(a.context, &options), QW_OK);
    uint32_t count, object = 0, of[2] = {0, 0};
    const qw_attribute *given = qw_mesh_attributes(a.source, &count), *carried;
    assert_int_equal(qw_transfer(a.context, given, count, 0, &carried, NULL), QW_OK);
    while (strcmp(carried[object].name, "object") != 0) object++;
    assert_string_equal(given[object].label_names[1], "bake_green");
    unwrap_and_bake(&a, 256, QW_MAPS_OF_INPUT);
    assert_int_equal(a.images[0].map, QW_MAP_COLOR);
    assert_int_equal(qw_get_mesh(a.context, &quads), QW_OK);
    qw_attribute uv = {0};
    assert_int_equal(qw_save_asset(a.context, carried, count, QW_BINARY_DIR "/bake_both.glb", QW_FORMAT_AUTO), QW_OK);
    qw_mesh *again;
    assert_int_equal(qw_load(QW_BINARY_DIR "/bake_both.glb", NULL, &again), QW_OK);
    given = qw_mesh_attributes(again, &count);
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(given[i].name, "object") == 0) object = i;
    assert_string_equal(given[object].label_names[0], "bake_red"); /* a node each */
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(given[i].name, "uv") == 0) uv = given[i];
    for (uint32_t f = 0; f < quads.face_count; f++) {
        int32_t label = given[object].labels[f];
        require_color(&a.images[0], uv.values + 8 * (size_t)f, colors[label]);
        of[label]++;
    }
    assert_true(of[0] > 150 && of[1] > 150);
    qw_mesh_destroy(again), qw_destroy(a.context), qw_mesh_destroy(a.source);
}

/* Extensions that are converted, kept, or spoken of. */
static void read_extended(void *user)
{
    static const char text[] =
        "\0\"materials\":[{\"name\":\"a\",\"extensions\":{\"KHR_materials_pbrSpecularGlossiness\":{\"diffuseFactor\":["
        "0.5,"
        "0.25,0.125,0.5],\"glossinessFactor\":0.25,\"specularFactor\":[0.04,0.04,0.04]}}},"
        "{\"extensions\":{\"KHR_materials_pbrSpecularGlossiness\":{\"diffuseFactor\":[0,0,0,1],\"specularFactor\":[0.9,"
        "0.6,"
        "0.3]}}},{\"emissiveFactor\":[1,0.5,0],\"extensions\":{\"KHR_materials_emissive_strength\":{"
        "\"emissiveStrength\":6},"
        "\"KHR_materials_unlit\":{}}},{\"name\":\"glass\",\"extensions\":{\"KHR_materials_transmission\":{}}}],"
        "\"animations\":[{}],\"extensions\":{\"KHR_materials_variants\":{\"variants\":[]},\"EXT_other\":3},\0";
    qw_env *env = ((job *)user)->env;
    char *copy = QW_NEW(env, char, sizeof text);
    memcpy(copy, text, sizeof text);
    const qw_gltf_rest rest = {.text = copy, .material_count = 4, .head = 1, .views = 2 + strlen(copy + 1)};
    qw_material_list list = qw_gltf_materials(env, &rest, NULL);
    const qw_material *m = list.material;
    assert_float_equal(m[0].color[1], 0.25, 1e-6);
    assert_float_equal(m[0].roughness, 0.75, 1e-6);
    assert_float_equal(m[0].metallic, 0, 1e-6);
    assert_float_equal(m[1].metallic, 1, 0.01);
    assert_float_equal(m[1].color[0], 0.9, 0.01);
    assert_float_equal(m[1].color[2], 0.3, 0.01);
    assert_float_equal(m[2].emission[0], 6, 1e-6);
    assert_float_equal(m[2].emission[1], 3, 1e-6);
    assert_true(m[2].is_unlit && !m[1].is_unlit);
    assert_int_equal(list.note_count, 4);
    static const char *const left_out[] = {"KHR_materials_transmission", "animations", "KHR_materials_variants",
                                           "EXT_other"};
    for (int i = 0; i < 4; i++) assert_non_null(strstr(list.note[i], left_out[i]));
}
static void extensions_of_materials(void **state)
{
    (void)state;
    protect(read_extended);
}

static void read_statements(void *user)
{
    static const char mtl[] =
        "newmtl a\nKd 0 0 0\nmap_Kd -s 3 2 1 -o .25 .1 0 -clamp on bake there.png\nTr 0.25\n"
        "newmtl b\nMAP_KD bake there.png\nkd 0 0 0\nd 0.5\nTr 0.125\nmap_d -imfchan g \"bake there.png\"\n"
        "newmtl c\nKd 0.5\nmap_Bump -bm 0.3 bake there.png\nmap_ks bake_gone.png\nRefl -type sphere bake_gone.png\n";
    static const char *const names[] = {"a", "b", "c"};
    qw_env *env = ((job *)user)->env;
    put_file(QW_BINARY_DIR "/bake there.png", "x", 1);
    put_file(QW_BINARY_DIR "/bake_words.mtl", mtl, sizeof mtl - 1);
    qw_material_list list = qw_mtl_materials(env, QW_BINARY_DIR "/x.obj", "\"bake_words.mtl\"\nbake_none.mtl", names,
                                             3);
    const qw_material *m = list.material;
    assert_float_equal(m[0].color[0], 1, 0);
    assert_float_equal(m[0].color[3], 0.75, 1e-6);
    assert_int_equal(m[0].alpha, 2);
    assert_float_equal(m[0].color_map.scale[0], 3, 0);
    assert_float_equal(m[0].color_map.scale[1], 2, 0);
    assert_float_equal(m[0].color_map.offset[0], 0.25, 1e-6);
    assert_float_equal(m[0].color_map.offset[1], -1.1, 1e-6); /* v grows downward */
    assert_int_equal(m[0].color_map.wrap[1], 1);
    assert_float_equal(m[1].color[2], 1, 0);
    assert_float_equal(m[1].color[3], 0.5, 0);
    assert_int_equal(m[1].alpha_map.image, 0);
    assert_int_equal(m[1].alpha_map.channel, 1);
    assert_float_equal(m[2].color[2], 0.5, 0);
    assert_int_equal(m[2].normal_map.image, QW_NONE);
    assert_int_equal(list.image_count, 1);
    assert_int_equal(list.note_count, 4);
    static const char *const left_out[] = {"map_Bump", "map_Ks", "refl", "bake_none.mtl"};
    for (int i = 0; i < 4; i++) assert_non_null(strstr(list.note[i], left_out[i]));
}
static void statements_of_mtl(void **state)
{
    (void)state;
    protect(read_statements);
}

/* What is drawn of an opaque sheet, of two that are cut off at their own thresholds, and of a blended one: all have
   alpha of a half. */
static void look_at_alphas(void *user)
{
    qw_env *env = ((job *)user)->env;
    qw_vec3 position[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, normal = {0, 0, 1};
    uint32_t corner[] = {0, 1, 2}, twin[] = {QW_NONE, QW_NONE, QW_NONE}, face = 0;
    int32_t label = 0;
    qw_material m[4];
    for (int i = 0; i < 4; i++) m[i] = qw_plain_material(), m[i].color[3] = 0.5f, m[i].alpha = i == 3 ? 2 : i > 0;
    m[1].cutoff = 0.25f, m[2].cutoff = 0.75f;
    qw_source source = {
        .mesh = {.vertex_count = 3, .face_count = 1, .position = position, .corner = corner, .twin = twin},
        .normal = &normal,
        .face = &face};
    for (uint32_t count = 2; count <= 4; count++) {
        qw_material_list list = {.material = m, .count = count};
        qw_look look = qw_begin_look(env, &source, NULL, 0, false, &list, NULL);
        look.material = &label;
        assert_int_equal(look.alpha, count == 4 ? 2 : 1);
        for (label = 0; (uint32_t)label < count; label++) {
            float a = qw_look_at(&look, 0, (const float[]){0.4f, 0.3f, 0.3f}).color[3];
            float drawn = look.alpha == 2 ? a : a >= look.cutoff;
            assert_float_equal(drawn, label == 2 ? 0 : label == 3 ? 0.5 : 1, 0);
        }
        if (count == 2) assert_float_equal(look.cutoff, 0.25, 0);
    }
}
static void alphas_as_drawn(void **state)
{
    (void)state;
    protect(look_at_alphas);
}

/* Numbers of an MTL beyond what they may be: the nearest that may, or what there is without them, and a note each. */
static void numbers_of_mtl(void **state)
{
    (void)state;
    static const char mtl[] = "newmtl a\nKd nan 2 -1e300\nKe -1 1e39 inf\nPr 1e300\nPm -inf\nd nan\n";
    static const char obj[] =
        "mtllib bake_ends.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl a\nf 1 3 2\nf 1 2 4\nf 2 "
        "3 4\nf 3 1 4\n";
    put_file(QW_BINARY_DIR "/bake_ends.mtl", mtl, sizeof mtl - 1);
    put_file(QW_BINARY_DIR "/bake_ends.obj", obj, sizeof obj - 1);
    qw_options options;
    asset a = {0};
    assert_int_equal(qw_load(QW_BINARY_DIR "/bake_ends.obj", NULL, &a.source), QW_OK);
    qw_mesh_view view = qw_mesh_get(a.source);
    qw_options_init(&options), options.faces = 60, options.threads = 1;
    assert_int_equal(qw_create(NULL, &a.context), QW_OK);
    assert_int_equal(qw_set_mesh(a.context, &view), QW_OK);
    assert_int_equal(qw_run(a.context, &options), QW_OK);
    unwrap_and_bake(&a, 64, QW_MAPS_OF_INPUT);
    assert_int_equal(qw_save_asset(a.context, NULL, 0, QW_BINARY_DIR "/bake_ends_out.obj", QW_FORMAT_AUTO), QW_OK);
    assert_int_equal(qw_save_asset(a.context, NULL, 0, QW_BINARY_DIR "/bake_ends_out.glb", QW_FORMAT_AUTO), QW_OK);
    const qw_report *r = qw_get_report(a.context);
    uint32_t notes = 0;
    for (uint32_t i = 0; i < r->warning_count; i++) notes += strstr(r->warnings[i], "material \"a\"") != NULL;
    assert_int_equal(notes, 9);
    qw_destroy(a.context), qw_mesh_destroy(a.source);
}

/* A cube of which half is opaque, with a material or without any, and half blended: a material for each, with the same
   pictures. */
static void check_alphas_apart(const char *opaque)
{
    static const char mtl[] = "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\nd 0.5\n";
    char obj[512];
    int size = snprintf(obj, sizeof obj,
                        "mtllib bake_apart.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\n"
                        "v 0 1 1\n%sf 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nusemtl b\nf 3 4 8 7\nf 4 1 5 8\n"
                        "f 5 6 7 8\n",
                        opaque);
    put_file(QW_BINARY_DIR "/bake_apart.mtl", mtl, sizeof mtl - 1);
    put_file(QW_BINARY_DIR "/bake_apart.obj", obj, (size_t)size);
    qw_options options;
    asset a = {0};
    assert_int_equal(qw_load(QW_BINARY_DIR "/bake_apart.obj", NULL, &a.source), QW_OK);
    qw_mesh_view view = qw_mesh_get(a.source);
    qw_options_init(&options), options.faces = 54, options.threads = 1;
    assert_int_equal(qw_create(NULL, &a.context), QW_OK);
    assert_int_equal(qw_set_mesh(a.context, &view), QW_OK);
    assert_int_equal(qw_run(a.context, &options), QW_OK);
    uint32_t count;
    const qw_attribute *of_input = qw_mesh_attributes(a.source, &count), *carried;
    assert_int_equal(qw_transfer(a.context, of_input, count, 0, &carried, NULL), QW_OK);
    unwrap_and_bake(&a, 64, QW_MAPS_OF_INPUT);
    static const char *const path = QW_BINARY_DIR "/bake_apart_out.glb";
    assert_int_equal(qw_save_asset(a.context, carried, count, path, QW_FORMAT_AUTO), QW_OK);
    qw_mesh *back;
    assert_int_equal(qw_load(path, NULL, &back), QW_OK);
    const qw_attribute *list = qw_mesh_attributes(back, &count);
    view = qw_mesh_get(back);
    uint32_t faces[2] = {0, 0}, materials = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(list[i].name, "material") != 0) continue;
        materials = list[i].label_count;
        assert_string_equal(list[i].label_names[0], "asset_blended");
        assert_string_equal(list[i].label_names[1], "asset_opaque");
        for (uint32_t f = 0; f < view.face_count; f++) faces[list[i].labels[f]]++;
    }
    assert_int_equal(materials, 2);
    assert_true(faces[0] > 0 && faces[0] + faces[1] == view.face_count);
    assert_int_equal(faces[0], faces[1]);
    qw_mesh_destroy(back), qw_destroy(a.context), qw_mesh_destroy(a.source);
}

static void alphas_apart(void **state)
{
    (void)state;
    check_alphas_apart("usemtl a\n");
    check_alphas_apart("");
}

QW_TEST_SUITE(bake)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hostile_materials),
        cmocka_unit_test(unused_pictures),
        cmocka_unit_test(numbers_of_mtl),
        cmocka_unit_test(extensions_of_materials),
        cmocka_unit_test(statements_of_mtl),
        cmocka_unit_test(alphas_as_drawn),
        cmocka_unit_test(png_comes_back),
        cmocka_unit_test(hostile_pictures_are_refused),
        cmocka_unit_test(tables_that_are_not_there),
        cmocka_unit_test(bombs_are_refused),
        cmocka_unit_test(other_pictures),
        cmocka_unit_test(webp_is_read),
        cmocka_unit_test(hostile_webp_is_refused),
        cmocka_unit_test(normals_of_a_sphere),
        cmocka_unit_test(occlusion_beside_a_wall),
        cmocka_unit_test(tips_face_up),
        cmocka_unit_test(rings_are_smooth),
        cmocka_unit_test(constant_color),
        cmocka_unit_test(charts_at_any_scale),
        cmocka_unit_test(maps_at_any_scale),
        cmocka_unit_test(failures_leave_nothing),
        cmocka_unit_test(progress_is_told),
        cmocka_unit_test(same_bytes),
        cmocka_unit_test(calls_out_of_place),
        cmocka_unit_test(from_obj_to_files),
        cmocka_unit_test(files_that_meet),
        cmocka_unit_test(alphas_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
