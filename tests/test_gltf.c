/* GLB and glTF: what is read of them, what comes out again untouched, and every way in which such a file can be wrong.
 */
#include "suite.h"
#include "io/json_read.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_TEXT = 1 << 16 };

/* A square of two triangles, 2 by 2, in the buffer of most tests: four positions, then six indices of 16 bits. */
#define SQUARE "AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAAAAAAAEAAAAAAAAABAAIAAAACAAMA"
#define ASSET  "\"asset\":{\"version\":\"2.0\"},"
#define NODES  "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"children\":[1]},{\"name\":\"below\"}],"
#define MESHES "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
#define VIEWS  "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":12}],"
#define ACCESSORS                                                                             \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}," \
    "{\"bufferView\":1,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],"
#define BUFFERS "\"buffers\":[{\"byteLength\":60,\"uri\":\"data:application/octet-stream;base64," SQUARE "\"}]"

static const char *const sound = "{" ASSET NODES MESHES ACCESSORS VIEWS BUFFERS "}";

/* The sound text with the first `from` in it become `to`. */
static void edit(char *out, const char *text, const char *from, const char *to)
{
    const char *at = strstr(text, from);
    assert_non_null(at);
    snprintf(out, MOST_TEXT, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
}

static qw_mesh *load(const void *bytes, size_t size)
{
    qw_mesh *mesh;
    qw_status status = qw_load_memory(bytes, size, NULL, &mesh);
    if (status != QW_OK) fail_msg("%s", qw_mesh_message(mesh));
    return mesh;
}

static qw_mesh *load_edited(const char *from, const char *to)
{
    char *text = malloc(MOST_TEXT);
    edit(text, sound, from, to);
    qw_mesh *mesh = load(text, strlen(text));
    free(text);
    return mesh;
}

static qw_mesh *load_file(const char *path)
{
    qw_mesh *mesh;
    qw_status status = qw_load(path, NULL, &mesh);
    if (status != QW_OK) fail_msg("%s", qw_mesh_message(mesh));
    return mesh;
}

static const qw_attribute *named(const qw_mesh *mesh, const char *name)
{
    uint32_t count;
    const qw_attribute *a = qw_mesh_attributes(mesh, &count);
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(a[i].name, name) == 0) return &a[i];
    return NULL;
}

static bool near(double a, double b) { return fabs(a - b) < 1e-6; }

/* ---- wrong ones */

typedef struct wrong {
    const char *from, *to;
    qw_status status;
    const char *says;
} wrong;

static const wrong wrongs[] = {
    {ASSET, "", QW_FORMAT_UNKNOWN, "not glTF, which has an \"asset\""},
    {"\"2.0\"", "\"1.0\"", QW_UNSUPPORTED, "version 1.0 of glTF"},
    {"\"2.0\"", "2.0", QW_UNSUPPORTED, "version (none)"},
    {ASSET, ASSET "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],", QW_UNSUPPORTED,
     "KHR_draco_mesh_compression"},
    {ASSET, ASSET "\"extensionsRequired\":[\"EXT_meshopt_compression\"],", QW_UNSUPPORTED, "EXT_meshopt_compression"},
    /* JSON */
    {"{\"asset\"", "{asset", QW_FORMAT_SYNTAX, "byte 1 of its JSON: the name of a member"},
    {"\"2.0\"},", "\"2.0\"}", QW_FORMAT_SYNTAX, "a comma or }"},
    {"[0]", "[0", QW_FORMAT_SYNTAX, "a comma or ]"},
    {"[0]", "[00]", QW_FORMAT_SYNTAX, "a comma or ]"},
    {"[0]", "[-]", QW_FORMAT_SYNTAX, "a digit"},
    {"[0]", "[0.]", QW_FORMAT_SYNTAX, "a digit"},
    {"[0]", "[0e]", QW_FORMAT_SYNTAX, "a digit"},
    {"[0]", "[nul]", QW_FORMAT_SYNTAX, "a value"},
    {"[0]", "[,]", QW_FORMAT_SYNTAX, "a value"},
    {"below", "be\\xlow", QW_FORMAT_SYNTAX, "a backslash"},
    {"below", "be\\u12g4low", QW_FORMAT_SYNTAX, "\\u is not followed"},
    {"below", "be\nlow", QW_FORMAT_SYNTAX, "control character"},
    {"\"}]}", "\"}]", QW_FORMAT_TRUNCATED, "a comma or }"},
    {"\"}]}", "\"}]}}", QW_FORMAT_SYNTAX, "something follows"},
    {"\"}]}", "", QW_FORMAT_TRUNCATED, "ends in a string"},
    /* nodes */
    {"\"children\":[1]", "\"children\":[0]", QW_FORMAT_SYNTAX, "node 0: it is below itself"},
    {"\"name\":\"below\"", "\"children\":[0]", QW_FORMAT_SYNTAX, "it is below itself, in a circle"},
    {"\"children\":[1]", "\"children\":[1,1]", QW_FORMAT_SYNTAX, "node 1: it is a child of both node 0 and node 0"},
    {"\"children\":[1]", "\"children\":[2]", QW_INDEX_RANGE, "node 0: it names node 2, but there are 2"},
    {"\"children\":[1]", "\"children\":[-1]", QW_FORMAT_SYNTAX, "not a whole number"},
    {"\"children\":[1]", "\"children\":1", QW_FORMAT_SYNTAX, "children is not an array"},
    {"\"mesh\":0", "\"mesh\":1", QW_INDEX_RANGE, "node 0: it names mesh 1"},
    {"\"mesh\":0", "\"mesh\":0.5", QW_FORMAT_SYNTAX, "not a whole number"},
    {"\"mesh\":0", "\"mesh\":\"0\"", QW_FORMAT_SYNTAX, "not a whole number"},
    {"\"mesh\":0", "\"mesh\":1e999", QW_INDEX_RANGE, "names mesh inf"},
    {"\"mesh\":0", "\"mesh\":0,\"skin\":0", QW_INDEX_RANGE, "names skin 0"},
    {"\"mesh\":0", "\"mesh\":0,\"scale\":[1,1]", QW_FORMAT_SYNTAX, "scale is not 3 finite numbers"},
    {"\"mesh\":0", "\"mesh\":0,\"scale\":[1,1,\"1\"]", QW_FORMAT_SYNTAX, "scale is not 3 finite numbers"},
    {"\"mesh\":0", "\"mesh\":0,\"matrix\":[1,2,3]", QW_FORMAT_SYNTAX, "matrix is not 16 finite numbers"},
    {"\"mesh\":0", "\"mesh\":0,\"translation\":[1e999,0,0]", QW_FORMAT_SYNTAX, "translation is not 3 finite numbers"},
    {"base64,AAAAAAAA", "base64,AADAfwAA", QW_NOT_FINITE, "mesh 0: a coordinate of vertex 0"},
    {"\"mesh\":0,", "", QW_NO_FACES, "no node of its scene shows a mesh"},
    {"\"nodes\":[0]", "\"nodes\":[9]", QW_INDEX_RANGE, "scene 0: it names node 9"},
    {"\"scene\":0", "\"scene\":3", QW_INDEX_RANGE, "it names scene 3"},
    /* meshes */
    {"\"primitives\":[{", "\"primitives\":{", QW_FORMAT_SYNTAX, "JSON"},
    {"\"primitives\"", "\"primitive\"", QW_FORMAT_SYNTAX, "mesh 0: it has no primitives"},
    {"\"attributes\"", "\"attribute\"", QW_FORMAT_SYNTAX, "mesh 0: a primitive of it has no attributes"},
    {"\"POSITION\":0", "\"NORMAL\":0", QW_FORMAT_SYNTAX, "no POSITION"},
    {"\"POSITION\":0", "\"POSITION\":1", QW_FORMAT_SYNTAX, "POSITION is not a VEC3"},
    {"\"POSITION\":0", "\"POSITION\":0,\"TEXCOORD_0\":0", QW_FORMAT_SYNTAX, "TEXCOORD_0 has 3 components"},
    {"\"POSITION\":0", "\"POSITION\":0,\"_heat\":1", QW_FORMAT_SYNTAX, "_heat has 6 elements for 4 vertices"},
    {"\"POSITION\":0", "\"POSITION\":5", QW_INDEX_RANGE, "names accessor 5"},
    {"\"indices\":1", "\"indices\":0", QW_FORMAT_SYNTAX, "accessor 0: it is used for the corners"},
    {"\"indices\":1", "\"indices\":1,\"mode\":7", QW_TOO_LARGE, "mode is 7"},
    {"\"indices\":1", "\"indices\":1,\"mode\":1", QW_NO_FACES, "no node"},
    {"\"indices\":1", "\"indices\":1,\"material\":0", QW_INDEX_RANGE, "names material 0"},
    {"\"indices\":1", "\"indices\":1,\"targets\":4", QW_FORMAT_SYNTAX, "targets of primitive 0"},
    {"\"indices\":1", "\"indices\":1,\"targets\":[{\"POSITION\":1}]", QW_FORMAT_SYNTAX, "target 0 is not a VEC3"},
    {MESHES, "\"meshes\":{},", QW_FORMAT_SYNTAX, "meshes are not an array"},
    {MESHES, "\"meshes\":[7],", QW_FORMAT_SYNTAX, "mesh 0: it is not an object"},
    /* accessors */
    {"\"count\":4", "\"count\":5", QW_FORMAT_TRUNCATED,
     "accessor 0: 5 elements from byte 0 on lie beyond the end of buffer view 0"},
    {"\"count\":4", "\"count\":3", QW_INDEX_RANGE, "mesh 0: corner 5 names vertex 3, but there are 3"},
    {"\"count\":4", "\"count\":-4", QW_FORMAT_SYNTAX, "count is not a whole number"},
    {"\"count\":4", "\"count\":4.5", QW_FORMAT_SYNTAX, "count is not a whole number"},
    {"\"count\":4", "\"count\":4e300", QW_TOO_LARGE, "count is 4"},
    {"\"count\":4", "\"count\":2147483648", QW_TOO_LARGE, "at most 2147483647"},
    {"\"count\":4", "\"count\":2147483647", QW_FORMAT_TRUNCATED, "beyond the end of buffer view 0"},
    {"\"count\":4", "\"count\":4,\"byteOffset\":18446744073709551600", QW_TOO_LARGE, "byteOffset is"},
    {"\"count\":4", "\"count\":4,\"byteOffset\":9007199254740992", QW_FORMAT_TRUNCATED, "beyond the end"},
    {"\"count\":4", "\"count\":4,\"byteOffset\":1", QW_FORMAT_TRUNCATED, "beyond the end"},
    {"5126", "5124", QW_FORMAT_SYNTAX, "componentType 5124"},
    {"5126", "9007199254740991", QW_FORMAT_SYNTAX, "componentType"},
    {"VEC3", "VEC9", QW_FORMAT_SYNTAX, "its type is none of"},
    {"\"VEC3\"", "3", QW_FORMAT_SYNTAX, "its type is none of"},
    {"\"VEC3\"}", "\"VEC3\",\"sparse\":{\"count\":1}}", QW_FORMAT_SYNTAX, "componentType 0"},
    {"\"VEC3\"}", "\"VEC3\",\"sparse\":{\"count\":9,\"indices\":{},\"values\":{}}}", QW_TOO_LARGE, "count is 9"},
    {"\"VEC3\"}",
     "\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5123,\"byteOffset\":2},"
     "\"values\":{\"bufferView\":1}}}",
     QW_OK, ""},
    {"\"VEC3\"}",
     "\"VEC3\",\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":1,\"componentType\":5123},\"values\":{"
     "\"bufferView\":1}}}",
     QW_FORMAT_TRUNCATED, "beyond the end of buffer view 1"},
    {"\"VEC3\"}",
     "\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"componentType\":5123,\"byteOffset\":14},"
     "\"values\":{\"bufferView\":1}}}",
     QW_INDEX_RANGE, "it is sparse and names element 16384"},
    /* views and buffers */
    {"\"byteLength\":48}", "\"byteLength\":4800}", QW_FORMAT_TRUNCATED,
     "buffer view 0: bytes 0 to 4800 lie beyond the end of buffer 0"},
    {"\"byteOffset\":48", "\"byteOffset\":49", QW_FORMAT_TRUNCATED, "buffer view 1: bytes 49 to 61"},
    {"\"byteOffset\":48", "\"byteOffset\":9007199254740990", QW_FORMAT_TRUNCATED, "lie beyond the end"},
    {"\"byteOffset\":48", "\"byteOffset\":18446744073709551615", QW_TOO_LARGE, "byteOffset"},
    {"\"byteLength\":48}", "\"byteLength\":48,\"byteStride\":4}", QW_FORMAT_SYNTAX,
     "elements of 12 bytes are 4 bytes apart"},
    {"\"byteLength\":48}", "\"byteLength\":48,\"byteStride\":16}", QW_FORMAT_TRUNCATED, "beyond the end"},
    {"\"byteLength\":48}", "\"byteLength\":48,\"byteStride\":65536}", QW_TOO_LARGE, "byteStride"},
    {"\"buffer\":0,\"byteLength\":48", "\"buffer\":1,\"byteLength\":48", QW_INDEX_RANGE,
     "buffer view 0: it names buffer 1"},
    {"\"buffer\":0,\"byteLength\":48", "\"byteLength\":48", QW_FORMAT_SYNTAX, "it names no buffer"},
    {"\"byteLength\":60", "\"byteLength\":61", QW_FORMAT_TRUNCATED,
     "buffer 0: it announces 61 bytes, but there are 60"},
    {"base64,AA", "base64,A!", QW_FORMAT_SYNTAX, "not data in base64"},
    {";base64,", ",", QW_FORMAT_SYNTAX, "not data in base64"},
    {"data:application/octet-stream;base64,", "bytes/", QW_FILE_MISSING, "it is in another file"},
    {"\"uri\":\"data", "\"uri\":[\"data", QW_FORMAT_SYNTAX, "JSON"},
};

static void expect(const char *text, size_t size, qw_status status, const char *says)
{
    qw_mesh *mesh;
    qw_status got = qw_load_memory(text, size, NULL, &mesh);
    if (got != status || !strstr(qw_mesh_message(mesh), says))
        fail_msg("%s \"%s\", not %s \"%s\", of %.300s", qw_status_name(got), qw_mesh_message(mesh),
                 qw_status_name(status), says, text);
    if (status != QW_OK) assert_int_equal(qw_mesh_get(mesh).face_count, 0);
    qw_mesh_destroy(mesh);
}

static void wrong_files_fail_with_a_sentence(void **state)
{
    (void)state;
    char *text = malloc(MOST_TEXT);
    expect(sound, strlen(sound), QW_OK, "");
    for (size_t i = 0; i < sizeof wrongs / sizeof *wrongs; i++) {
        edit(text, sound, wrongs[i].from, wrongs[i].to);
        expect(text, strlen(text), wrongs[i].status, wrongs[i].says);
    }
    for (size_t cut = 1; cut < strlen(sound); cut++) { /* nothing that is cut is whole */
        qw_mesh *mesh;
        assert_true(qw_load_memory(sound, cut, NULL, &mesh) != QW_OK && qw_mesh_message(mesh)[0]);
        qw_mesh_destroy(mesh);
    }
    memset(text, '[', 4000);
    memcpy(text, "{\"a\":", 5);
    expect(text, 4000, QW_FORMAT_SYNTAX, "nested more than 256 deep");
    free(text);
}

static void wrong_glb_fails_with_a_sentence(void **state)
{
    (void)state;
    char *text = malloc(MOST_TEXT);
    static const struct {
        uint32_t at, value;
        qw_status status;
        const char *says;
    } cases[] = {{4, 1, QW_UNSUPPORTED, "version 1 of GLB"},
                 {8, 5000, QW_FORMAT_TRUNCATED, "announces 5000 bytes"},
                 {8, UINT32_MAX, QW_FORMAT_TRUNCATED, "announces 4294967295 bytes"},
                 {12, 4000, QW_FORMAT_TRUNCATED, "a chunk has 4000 bytes"},
                 {12, UINT32_MAX, QW_FORMAT_TRUNCATED, "a chunk has 4294967295 bytes"},
                 {16, 0x1234, QW_FORMAT_SYNTAX, "no chunk of JSON"},
                 {8, 12, QW_FORMAT_SYNTAX, "no chunk of JSON"}};
    FILE *file = fopen(QW_TEST_DATA "/io/scene.glb", "rb");
    assert_non_null(file);
    size_t size = fread(text, 1, MOST_TEXT, file);
    fclose(file);
    expect(text, size, QW_OK, "");
    expect(text, 11, QW_FORMAT_TRUNCATED, "header of GLB");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *copy = malloc(size);
        memcpy(copy, text, size);
        for (int k = 0; k < 4; k++) copy[cases[i].at + (uint32_t)k] = (char)(cases[i].value >> 8 * k);
        expect(copy, size, cases[i].status, cases[i].says);
        free(copy);
    }
    free(text);
}

/* ---- right ones */

static void strips_fans_and_maps_are_read(void **state)
{
    (void)state;
    qw_mesh *mesh = load_edited("\"indices\":1", "\"mode\":6");
    qw_mesh_view view = qw_mesh_get(mesh);
    static const uint32_t fan[] = {0, 1, 2, 0, 2, 3}, strip[] = {0, 1, 2, 1, 3, 2};
    assert_int_equal(view.face_count, 2);
    assert_memory_equal(view.corners, fan, sizeof fan);
    qw_mesh_destroy(mesh);
    mesh = load_edited("\"indices\":1", "\"mode\":5");
    view = qw_mesh_get(mesh);
    assert_int_equal(view.face_count, 2);
    assert_memory_equal(view.corners, strip, sizeof strip);
    qw_mesh_destroy(mesh);
    mesh = load_edited("\"indices\":1", "\"indices\":1,\"extensions\":{\"FB_ngon_encoding\":{}}");
    view = qw_mesh_get(mesh);
    assert_true(view.face_count == 1 && view.uniform_face_size == 4);
    qw_mesh_destroy(mesh);
    /* a quarter turn about z, twice as large, shifted; and inside a node that mirrors */
    mesh = load_edited("{\"mesh\":0,\"children\":[1]},{\"name\":\"below\"}",
                       "{\"children\":[1],\"scale\":[1,1,-1]},{\"mesh\":0,\"translation\":[1,2,3],\"scale\":[2,2,2],"
                       "\"rotation\":[0,0,0.70710678118654752,0.70710678118654752]}");
    view = qw_mesh_get(mesh);
    const double *p = view.positions;
    assert_true(near(p[0], 1) && near(p[1], 2) && near(p[2], -3));
    for (uint32_t c = 0; c < 6; c++) { /* (2, 0, 0) goes to (0, 4, 0) + (1, 2, 3) */
        const double *q = p + 3 * (size_t)view.corners[c];
        assert_true(near(q[2], -3) && (near(q[0], 1) || near(q[0], -3)) && (near(q[1], 2) || near(q[1], 6)));
    }
    const double *a = p + 3 * (size_t)view.corners[0], *b = p + 3 * (size_t)view.corners[1],
                 *c = p + 3 * (size_t)view.corners[2];
    assert_true((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0); /* mirrored: it faces down now */
    qw_mesh_destroy(mesh);
    mesh = load_edited("\"mesh\":0", "\"mesh\":0,\"matrix\":[0,1,0,0, -1,0,0,0, 0,0,1,0, 5,6,7,1]");
    p = qw_mesh_get(mesh).positions;
    assert_true(near(p[0], 5) && near(p[1], 6) && near(p[2], 7));
    assert_true(near(p[3], 5) && near(p[4], 8) && near(p[5], 7));
    qw_mesh_destroy(mesh);
}

static void everything_of_a_scene_is_read(void **state)
{
    (void)state;
    qw_mesh *mesh = load_file(QW_TEST_DATA "/io/scene.glb");
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_true(view.vertex_count == 9 && view.face_count == 4 && view.face_sizes && view.face_sizes[0] == 4);
    for (uint32_t v = 0; v < 4; v++) assert_true(view.positions[3 * v] <= 0 && view.positions[3 * v + 2] == 1);
    for (uint32_t v = 4; v < 9; v++)
        assert_true(view.positions[3 * v] < 2 &&
                    view.positions[3 * v + 2] == 1); /* a skin goes by its joints, not by its node */
    const qw_attribute *uv = named(mesh, "uv"), *color = named(mesh, "color"), *normal = named(mesh, "normal"),
                       *weights = named(mesh, "weights"), *bulge = named(mesh, "target:Bulge"),
                       *material = named(mesh, "material"), *object = named(mesh, "object");
    assert_true(uv && color && normal && weights && bulge && material && object);
    for (uint32_t c = 0; c < 4; c++) { /* u goes against x, which is mirrored; v is from below */
        const double *p = view.positions + 3 * (size_t)view.corners[c];
        assert_true(near((double)uv->values[2 * c], -p[0]) && near((double)uv->values[2 * c + 1], p[1]));
    }
    assert_true(color->domain == QW_PER_VERTEX && color->components == 4 && color->values[0] == 1 &&
                near((double)color->values[15], 128 / 255.0));
    assert_true(normal->values[3 * 4 + 2] == 1);
    assert_true(weights->components == 4 && weights->label_count == 2);
    assert_string_equal(weights->label_names[1], "knee");
    assert_true(near((double)weights->values[4 * 6 + 1], 128 / 255.0) && weights->group[4 * 6 + 1] == 1);
    assert_true(bulge->values[3 * 8 + 1] == 0.5f && bulge->values[3 * 8 + 2] == 0.25f && bulge->values[3 * 7 + 1] == 0);
    assert_string_equal(material->label_names[material->labels[0]], "painted");
    assert_string_equal(material->label_names[material->labels[1]], "plain");
    assert_string_equal(object->label_names[object->labels[0]], "tile");
    qw_mesh_destroy(mesh);
}

/* Escapes in names and keys, and what JSON allows elsewhere. */
static void names_are_read_with_their_escapes(void **state)
{
    (void)state;
    qw_mesh *mesh = load_edited("\"children\":[1]},{\"name\":\"below\"",
                                "\"name\":\"a\\\"\\\\\\/\\t\\u00e9\\ud83d\\ude00\\ud800\"},{\"mesh\":0");
    qw_mesh_destroy(mesh);
    mesh = load_edited("\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"children\":[1]},{\"name\":\"below\"",
                       "\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0,\"name\":\"a\\\"\\\\\\/"
                       "\\t\\u00e9\\ud83d\\ude00\\ud800\\u0000\"},{\"mesh\":0");
    const qw_attribute *object = named(mesh, "object");
    assert_non_null(object);
    assert_string_equal(object->label_names[0], "a\"\\/_\xc3\xa9\xf0\x9f\x98\x80\xef\xbf\xbd");
    assert_string_equal(object->label_names[1], "node 1");
    assert_int_equal(qw_mesh_get(mesh).vertex_count, 8); /* two objects share no vertices */
    qw_mesh_destroy(mesh);
}

QW_TEST_SUITE(gltf)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wrong_files_fail_with_a_sentence),  cmocka_unit_test(wrong_glb_fails_with_a_sentence),
        cmocka_unit_test(strips_fans_and_maps_are_read),     cmocka_unit_test(everything_of_a_scene_is_read),
        cmocka_unit_test(names_are_read_with_their_escapes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
