/* GLB and glTF: what is read of them, what comes out again untouched, and every way in which such a file can be wrong.
 */
#include "suite.h"
#include "loaded.h"
#include "shapes.h"
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

/* What a small file could make endless. */
static void counts_are_bounded(void **state)
{
    (void)state;
    char *text = malloc(2 * MOST_TEXT), *many = malloc(MOST_TEXT);
    size_t size = (size_t)snprintf(many, MOST_TEXT, "\"POSITION\":0");
    for (int i = 0; i < 70; i++) size += (size_t)snprintf(many + size, MOST_TEXT - size, ",\"_A%d\":0", i);
    edit(text, sound, "\"POSITION\":0", many);
    expect(text, strlen(text), QW_TOO_LARGE, "a primitive of it has 71 attributes");
    size = (size_t)snprintf(many, MOST_TEXT, "\"indices\":1,\"targets\":[{}");
    for (int i = 0; i < 1100; i++) size += (size_t)snprintf(many + size, MOST_TEXT - size, ",{}");
    snprintf(many + size, MOST_TEXT - size, "]");
    edit(text, sound, "\"indices\":1", many);
    expect(text, strlen(text), QW_TOO_LARGE, "it has 1101 morph targets");
    /* the square, 500 times: as many vertices as that is, which a limit of the memory ends */
    size = (size_t)snprintf(many, MOST_TEXT, "\"nodes\":[");
    for (int i = 0; i < 500; i++) size += (size_t)snprintf(many + size, MOST_TEXT - size, "{\"mesh\":0},");
    edit(text, sound, "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[", many);
    qw_mesh *mesh = load(text, strlen(text));
    assert_int_equal(qw_mesh_get(mesh).vertex_count, 2004);
    qw_mesh_destroy(mesh);
    const qw_host poor = {.memory_limit = 300000};
    assert_int_equal(qw_load_memory(text, strlen(text), &poor, &mesh), QW_MEMORY);
    qw_mesh_destroy(mesh);
    free(text), free(many);
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

/* ---- through the tool */

#define FOLDER QW_BINARY_DIR "/gltf"

static int tool(const char *arguments)
{
    char command[1024];
    snprintf(command, sizeof command, "cd %s && %s/quadwright -q %s 2> said.txt", FOLDER, QW_BINARY_DIR, arguments);
    return system(command);
}

static void write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    fclose(file);
}

static bool file_holds(const char *path, const char *text)
{
    static char bytes[1 << 20];
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t size = fread(bytes, 1, sizeof bytes, file), length = strlen(text);
    fclose(file);
    for (size_t i = 0; i + length <= size; i++)
        if (memcmp(bytes + i, text, length) == 0) return true;
    return false;
}

static void bounds(const qw_mesh_view *view, double low[3], double high[3])
{
    for (int k = 0; k < 3; k++) low[k] = INFINITY, high[k] = -INFINITY;
    for (size_t i = 0; i < 3 * (size_t)view->vertex_count; i++)
        low[i % 3] = fmin(low[i % 3], view->positions[i]), high[i % 3] = fmax(high[i % 3], view->positions[i]);
}

/* A square in two materials and as two nodes, one of them mirrored, turned and small; with an image beside the file. */
static void write_scene(void)
{
    char *text = malloc(MOST_TEXT), *more = malloc(MOST_TEXT);
    edit(text, sound, "\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"children\":[1]},{\"name\":\"below\"}]",
         "\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"name\":\"large\",\"children\":[1]},{\"name\":\"small\",\"mesh\":0,"
         "\"translation\":"
         "[7,0,1],\"rotation\":[0,0.6,0,0.8],\"scale\":[-0.25,0.25,0.25]}]");
    edit(more, text, "\"indices\":1}]}]",
         "\"indices\":1,\"material\":1}]}],\"materials\":[{\"name\":\"none\"},{\"name\":\"x\",\"pbrMetallicRoughness\":"
         "{\"baseColorTexture\":"
         "{\"index\":0}},\"extensions\":{\"VENDOR_thing\":{\"a\":[1.50,null,true,-1e999]}}}],\"textures\":[{\"source\":"
         "0}],"
         "\"images\":[{\"name\":"
         "\"pic\",\"uri\":\"a%20picture.png\"},{\"uri\":\"../elsewhere.png\"}]");
    write_file(FOLDER "/scene.gltf", more);
    write_file(FOLDER "/a picture.png", "\x89PNG not really one, but nobody looks");
    free(text), free(more);
}

static void a_scene_keeps_its_nodes(void **state)
{
    (void)state;
    static const char *const paths[] = {FOLDER "/scene.glb", FOLDER "/scene_out.gltf"};
    write_scene();
    qw_mesh *in = load_file(FOLDER "/scene.gltf");
    qw_mesh_view was = qw_mesh_get(in);
    double low[3], high[3], low2[3], high2[3];
    bounds(&was, low, high);
    assert_int_equal(tool("scene.gltf -o scene.glb --faces 200"), 0);
    assert_int_equal(tool("scene.glb -o scene_out.gltf --faces 100"), 0);
    for (int i = 0; i < 2; i++) {
        qw_mesh *out = load_file(paths[i]);
        qw_mesh_view view = qw_mesh_get(out);
        assert_true(view.uniform_face_size == 4 && view.face_count >= 60);
        bounds(&view, low2, high2);
        for (int k = 0; k < 3; k++) assert_true(fabs(low[k] - low2[k]) < 1e-5 && fabs(high[k] - high2[k]) < 1e-5);
        const qw_attribute *object = named(out, "object"), *material = named(out, "material");
        assert_true(object && material && material->label_count == 2);
        assert_string_equal(object->label_names[1], "small");
        uint32_t small = 0;
        double up = 0;
        for (uint32_t f = 0; f < view.face_count; f++) {
            const uint32_t *c = view.corners + 4 * (size_t)f;
            const double *a = view.positions + 3 * (size_t)c[0], *b = view.positions + 3 * (size_t)c[1],
                         *d = view.positions + 3 * (size_t)c[3];
            small += object->labels[f] == 1;
            assert_int_equal(material->labels[f], 1);
            if (object->labels[f] == 0) up += (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]);
        }
        assert_true(small > 0 && small < view.face_count / 4 && fabs(up - 4) < 0.01);
        qw_mesh_destroy(out);
    }
    assert_true(file_holds(FOLDER "/scene.glb", "not really one, but nobody looks"));
    assert_true(
        file_holds(FOLDER "/scene.glb",
                   "{\"name\":\"pic\",\"bufferView\":0,\"mimeType\":\"image/png\"},{\"uri\":\"../elsewhere.png\"}"));
    assert_true(file_holds(FOLDER "/scene.glb", "\"VENDOR_thing\":{\"a\":[1.50,null,true,-3.4028234663852886e38]}"));
    assert_true(file_holds(FOLDER "/scene.glb",
                           "\"translation\":[7,0,1],\"rotation\":[0,0.6,0,0.8],\"scale\":[-0.25,0.25,0.25]"));
    /* what is dropped leaves its node behind, without a mesh */
    assert_int_equal(tool("scene.gltf -o one.glb --faces 100 --min-component 0.2"), 0);
    qw_mesh *one = load_file(FOLDER "/one.glb");
    assert_null(named(one, "object"));
    assert_true(file_holds(FOLDER "/one.glb", "{\"name\":\"small\",\"translation\":[7,0,1]"));
    qw_mesh_destroy(one);
    /* and nothing comes along when it is not wanted */
    assert_int_equal(tool("scene.gltf -o bare.glb --faces 100 --no-attributes"), 0);
    assert_false(file_holds(FOLDER "/bare.glb", "small"));
    assert_false(file_holds(FOLDER "/bare.glb", "materials"));
    qw_mesh_destroy(in);
}

static void other_files_become_glb(void **state)
{
    (void)state;
    write_file(FOLDER "/two.obj",
               "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 5 0 0\nv 7 0 0\nv 5 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
               "o left \"1\"\nusemtl red\nf 1/1 2/2 3/3 4/4\no right\nusemtl blue\nf 5/1 6/2 7/4\n");
    assert_int_equal(tool("two.obj -o two.glb --faces 60"), 0);
    qw_mesh *mesh = load_file(FOLDER "/two.glb");
    qw_mesh_view view = qw_mesh_get(mesh);
    const qw_attribute *uv = named(mesh, "uv"), *object = named(mesh, "object"), *material = named(mesh, "material");
    assert_true(uv && object && material && view.uniform_face_size == 4);
    assert_string_equal(object->label_names[0], "left \"1\"");
    assert_string_equal(material->label_names[material->labels[view.face_count - 1]], "blue");
    for (uint32_t c = 0; c < uv->count; c++) {
        const double *p = view.positions + 3 * (size_t)view.corners[c];
        double x = p[0] < 3 ? p[0] : p[0] - 5;
        assert_true(fabs((double)uv->values[2 * c] - x / 2) < 1e-5 &&
                    fabs((double)uv->values[2 * c + 1] - p[1] / 2) < 1e-5);
    }
    qw_mesh_destroy(mesh);
}

static void files_beside_are_read_and_no_others(void **state)
{
    (void)state;
    char *text = malloc(MOST_TEXT);
    static const unsigned char square[60] = {
        [15] = 0x40, [27] = 0x40, [31] = 0x40, [43] = 0x40, [50] = 1, [52] = 2, [56] = 2, [58] = 3};
    FILE *file = fopen(FOLDER "/the bytes.bin", "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(square, 1, 60, file), 60);
    fclose(file);
    edit(text, sound, "data:application/octet-stream;base64," SQUARE, "the%20bytes.bin");
    write_file(FOLDER "/beside.gltf", text);
    qw_mesh *mesh = load_file(FOLDER "/beside.gltf");
    assert_true(qw_mesh_get(mesh).vertex_count == 4 && qw_mesh_get(mesh).positions[6] == 2);
    qw_mesh_destroy(mesh);
    static const char *const outside[] = {"../gltf/the%20bytes.bin",
                                          "/etc/hostname",
                                          "%2e%2e/gltf/the%20bytes.bin",
                                          "file:///etc/hostname",
                                          "x/../../the%20bytes.bin",
                                          "nothing.bin",
                                          "."};
    static const char *const says[] = {"leads out", "leads out",   "leads out", "leads out",
                                       "leads out", "nothing.bin", "directory"};
    for (int i = 0; i < 7; i++) {
        edit(text, sound, "data:application/octet-stream;base64," SQUARE, outside[i]);
        write_file(FOLDER "/outside.gltf", text);
        assert_int_equal(qw_load(FOLDER "/outside.gltf", NULL, &mesh), QW_FILE_MISSING);
        if (!strstr(qw_mesh_message(mesh), says[i])) fail_msg("%s", qw_mesh_message(mesh));
        qw_mesh_destroy(mesh);
    }
    free(text);
}

/* A pipe may never give anything and a device never end: neither is opened for its bytes. Of a file that is larger than
   its buffer only that is read. */
static void only_regular_files_are_read(void **state)
{
    (void)state;
    static const char *const names[] = {"a-pipe", "a-device"};
    char *text = malloc(MOST_TEXT), *more = malloc(MOST_TEXT);
    qw_mesh *mesh;
    assert_int_equal(system("cd " FOLDER " && rm -f a-pipe a-device && mkfifo a-pipe && ln -s /dev/zero a-device &&"
                            " cp 'the bytes.bin' vast.bin && truncate -s 20G vast.bin"),
                     0);
    for (int i = 0; i < 2; i++) {
        edit(text, sound, "data:application/octet-stream;base64," SQUARE, names[i]);
        write_file(FOLDER "/odd.gltf", text);
        assert_int_equal(qw_load(FOLDER "/odd.gltf", NULL, &mesh), QW_FILE_MISSING);
        if (!strstr(qw_mesh_message(mesh), "no regular file")) fail_msg("%s", qw_mesh_message(mesh));
        qw_mesh_destroy(mesh);
    }
    edit(text, sound, "data:application/octet-stream;base64," SQUARE, "vast.bin");
    edit(more, text, ASSET, ASSET "\"images\":[{\"uri\":\"a-pipe\"},{\"uri\":\"a-device\"},{\"uri\":\"vast.bin\"}],");
    write_file(FOLDER "/odd.gltf", more);
    mesh = load_file(FOLDER "/odd.gltf");
    assert_int_equal(qw_mesh_get(mesh).vertex_count, 4);
    assert_int_equal(qw_mesh_save(mesh, FOLDER "/odd_out.gltf", QW_FORMAT_AUTO),
                     QW_OK); /* images stay where they are */
    assert_true(
        file_holds(FOLDER "/odd_out.gltf", "[{\"uri\":\"a-pipe\"},{\"uri\":\"a-device\"},{\"uri\":\"vast.bin\"}]"));
    qw_mesh_destroy(mesh);
    remove(FOLDER "/vast.bin");
    free(text), free(more);
}

/* Whether the bytes of a file are UTF-8. */
static bool is_utf8(const char *path)
{
    char command[256];
    snprintf(command, sizeof command, "iconv -f UTF-8 -t UTF-16 '%s' > /dev/null 2>&1", path);
    return system(command) == 0;
}

static void names_that_are_no_utf8_become_so(void **state)
{
    (void)state;
    char *text = malloc(MOST_TEXT), *more = malloc(MOST_TEXT);
    edit(text, sound, "\"name\":\"below\"", "\"name\":\"K\xe4se \xc3\xa4\xff\",\"extras\":{\"\xfc\":\"\xe2\x82\"}");
    edit(more, text, "\"mesh\":0", "\"mesh\":0,\"name\":\"\xe9t\xe9\"");
    edit(text, more, "\"indices\":1}]",
         "\"indices\":1,\"targets\":[{\"POSITION\":0}]}],\"extras\":{\"targetNames\":[\"\xe8\"]}");
    write_file(FOLDER "/latin.gltf", text);
    qw_mesh *mesh = load_file(FOLDER "/latin.gltf");
    assert_non_null(named(mesh, "target:\xc3\xa8"));
    assert_int_equal(qw_mesh_save(mesh, FOLDER "/latin_out.gltf", QW_FORMAT_AUTO), QW_OK);
    qw_mesh_destroy(mesh);
    assert_true(is_utf8(FOLDER "/latin_out.gltf"));
    assert_true(file_holds(FOLDER "/latin_out.gltf", "K\xc3\xa4se \xc3\xa4\xc3\xbf"));
    assert_true(file_holds(FOLDER "/latin_out.gltf", "\"\xc3\xa9t\xc3\xa9\""));
    mesh = load_file(FOLDER "/latin_out.gltf");
    assert_non_null(named(mesh, "target:\xc3\xa8"));
    qw_mesh_destroy(mesh);
    assert_int_equal(tool("latin.gltf -o latin_quads.gltf --faces 20 --json latin.json"), 0);
    assert_true(file_holds(FOLDER "/latin.json", "are not UTF-8; in names they are taken for letters of Latin-1"));
    assert_true(is_utf8(FOLDER "/latin_quads.gltf"));
    /* of other formats, whose names are any bytes */
    write_file(FOLDER "/latin.obj",
               "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\no \xe9t\xe9\nusemtl gr\xfcn\nf 1 2 3 4\no b\nf 4 3 2 1\n");
    mesh = load_file(FOLDER "/latin.obj");
    assert_int_equal(qw_mesh_save(mesh, FOLDER "/latin_of_obj.gltf", QW_FORMAT_AUTO), QW_OK);
    qw_mesh_destroy(mesh);
    assert_true(is_utf8(FOLDER "/latin_of_obj.gltf"));
    assert_true(file_holds(FOLDER "/latin_of_obj.gltf", "gr\xc3\xbcn"));
    free(text), free(more);
}

/* ---- far from the origin */

/* A grid of squares with its corner at (x, x, x). */
static void write_grid(const char *path, double x, double side, int n)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    for (int i = 0; i < n * n; i++) fprintf(file, "v %.17g %.17g %.17g\n", x + side * (i % n), x + side * (i / n), x);
    for (int i = 0; i < n * (n - 1); i++)
        if (i % n + 1 < n) fprintf(file, "f %d %d %d %d\n", i + 1, i + 2, i + n + 2, i + n + 1);
    fclose(file);
}

static void far_from_the_origin(void **state)
{
    (void)state;
    static const char *const names[] = {"far.glb", "far.gltf"};
    write_grid(FOLDER "/far.obj", 5e6, 0.05, 8);
    for (int i = 0; i < 2; i++) {
        char path[256];
        snprintf(path, sizeof path, FOLDER "/%s", names[i]);
        qw_mesh *mesh = load_file(FOLDER "/far.obj");
        assert_int_equal(qw_mesh_save(mesh, path, QW_FORMAT_AUTO), QW_OK);
        qw_mesh_destroy(mesh);
        mesh = load_file(path);
        qw_mesh_view view = qw_mesh_get(mesh);
        qw_topology t;
        qw_quality q;
        assert_int_equal(qw_measure(&view, NULL, NULL, &t, &q), QW_OK);
        assert_true(t.vertices == 64 && t.faces == 49 && t.euler == 1 && t.degenerate_faces == 0);
        assert_true(fabs(q.mean_edge - 0.05) < 1e-6);
        assert_true(file_holds(path, "\"translation\":["));
        qw_mesh_destroy(mesh);
    }
    /* near it nothing is moved */
    write_grid(FOLDER "/near.obj", 0.3, 0.05, 8);
    qw_mesh *mesh = load_file(FOLDER "/near.obj");
    assert_int_equal(qw_mesh_save(mesh, FOLDER "/near.gltf", QW_FORMAT_AUTO), QW_OK);
    assert_false(file_holds(FOLDER "/near.gltf", "\"translation\":["));
    qw_mesh_destroy(mesh);
    /* what no translation parts is refused, and nothing is written */
    FILE *file = fopen(FOLDER "/wide.obj", "wb");
    assert_non_null(file);
    fputs("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 5e6 0 0\nv 5000000.1 0 0\nv 5000000.1 0.1 0\nf 1 2 3\nf 4 5 6\n", file);
    fclose(file);
    mesh = load_file(FOLDER "/wide.obj");
    assert_int_equal(qw_mesh_save(mesh, FOLDER "/wide.glb", QW_FORMAT_AUTO), QW_FILE_UNWRITABLE);
    assert_non_null(strstr(qw_mesh_message(mesh), "32-bit numbers of glTF"));
    assert_int_equal(qw_mesh_save(mesh, FOLDER "/wide.ply", QW_FORMAT_AUTO), QW_OK);
    qw_mesh_destroy(mesh);
    assert_null(fopen(FOLDER "/wide.glb", "rb"));
}

/* ---- skins */

enum { ROUND = 24, UP = 12 };

/* A tube, 4 high and 1 wide, that hangs on two joints by its height. Positions, joints, weights, corners, inverse bind
   matrices of a skin and of another whose joints are half as large. */
static void write_tube(void)
{
    FILE *file = fopen(FOLDER "/tube.bin", "wb");
    assert_non_null(file);
    for (int what = 0; what < 3; what++)
        for (int i = 0; i < ROUND; i++)
            for (int j = 0; j <= UP; j++) {
                double angle = 2 * 3.14159265358979 * i / ROUND;
                const float p[3] = {(float)cos(angle), 4.0f * (float)j / UP, (float)-sin(angle)},
                            w[4] = {1 - (float)j / UP, (float)j / UP};
                const uint16_t joint[4] = {0, j > 0};
                if (what == 0) fwrite(p, sizeof p, 1, file);
                if (what == 1) fwrite(joint, sizeof joint, 1, file);
                if (what == 2) fwrite(w, sizeof w, 1, file);
            }
    for (uint32_t i = 0; i < ROUND; i++)
        for (uint32_t j = 0; j < UP; j++) {
            uint32_t a = i * (UP + 1) + j, b = (i + 1) % ROUND * (UP + 1) + j;
            const uint32_t corners[6] = {a, b, b + 1, a, b + 1, a + 1};
            fwrite(corners, sizeof corners, 1, file);
        }
    for (int skin = 1; skin <= 2; skin++)
        for (int joint = 0; joint < 2; joint++) {
            float m[16] = {[15] = 1, [13] = (float)(-2 * joint * skin)};
            m[0] = m[5] = m[10] = (float)skin;
            fwrite(m, sizeof m, 1, file);
        }
    fclose(file);
    char text[4096];
    size_t vertices = ROUND * (UP + 1), corners = 6 * ROUND * UP, joints = 12 * vertices,
           weights = joints + 8 * vertices, indices = weights + 16 * vertices, skins = indices + 4 * corners;
    snprintf(
        text, sizeof text,
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"name\":\"A\",\"mesh\":0,\"skin\":0},{\"name\":\"B\",\"mesh\":0,"
        "\"skin\":1},"
        "{\"children\":[3],\"translation\":[-3,0,0]},{\"translation\":[0,2,0]},{\"children\":[5],\"translation\":[5,0,"
        "0],"
        "\"rotation\":[0,0,0.6,0.8]},{\"translation\":[0,4,0]}],\"meshes\":[{\"primitives\":[{\"attributes\":{"
        "\"POSITION\":0,"
        "\"JOINTS_0\":1,\"WEIGHTS_0\":2},\"indices\":3}]}],\"skins\":[{\"joints\":[2,3],\"inverseBindMatrices\":4},"
        "{\"joints\":[4,5],\"inverseBindMatrices\":5}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":%zu,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5123,\"count\":%zu,\"type\":\"VEC4\"},"
        "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5126,\"count\":%zu,\"type\":\"VEC4\"},"
        "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5125,\"count\":%zu,\"type\":\"SCALAR\"},"
        "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5126,\"count\":2,\"type\":\"MAT4\"},"
        "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5126,\"count\":2,\"type\":\"MAT4\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":%zu}],\"buffers\":[{\"byteLength\":%zu,\"uri\":\"tube.bin\"}]}",
        vertices, joints, vertices, weights, vertices, indices, corners, skins, skins + 128, skins + 256, skins + 256);
    write_file(FOLDER "/tubes.gltf", text);
}

/* One mesh on two skins, the second twice as large and turned: each comes back as it lies in its bind pose, on its own
 * joints. */
static void skins_keep_their_joints(void **state)
{
    (void)state;
    write_tube();
    assert_int_equal(tool("tubes.gltf -o tubes.glb --faces 600 --fit 0 --adaptive 0"), 0);
    qw_mesh *mesh = load_file(FOLDER "/tubes.glb");
    qw_mesh_view view = qw_mesh_get(mesh);
    const qw_attribute *weights = named(mesh, "weights"), *object = named(mesh, "object");
    assert_true(weights && object && weights->label_count == 4);
    uint32_t quads[2] = {0, 0};
    for (uint32_t c = 0; c < 4 * view.face_count; c++) {
        uint32_t v = view.corners[c], which = (uint32_t)object->labels[c / 4];
        const double *p = view.positions + 3 * (size_t)v;
        double x = p[0] - (which ? 5 : -3), height, wide, upper = 0;
        if (which)
            height = (0.28 * p[1] - 0.96 * x) / 2,
            wide = sqrt((0.96 * p[1] + 0.28 * x) * (0.96 * p[1] + 0.28 * x) + p[2] * p[2]) / 2;
        else height = p[1], wide = sqrt(x * x + p[2] * p[2]);
        assert_true(height > -1e-5 && height < 4 + 1e-5 && wide > 0.98 && wide < 1.001);
        for (size_t k = 0; k < weights->components; k++) {
            float w = weights->values[weights->components * (size_t)v + k];
            uint32_t joint = weights->group[weights->components * (size_t)v + k];
            if (w > 0) assert_int_equal(joint / 2, which);
            if (joint % 2) upper += (double)w;
        }
        assert_true(fabs(upper - height / 4) < 1e-4);
        quads[which] += c % 4 == 0;
    }
    assert_true(quads[1] > 3 * quads[0] / 2 && quads[0] > 80); /* in one scene: four times the area, bowed as much */
    qw_mesh_destroy(mesh);
}

/* ---- normals of the quads */

static void write_cube(const char *path)
{
    shape s = shape_cube(8);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        fprintf(file, "v %g %g %g\n", s.position[3 * v], s.position[3 * v + 1], s.position[3 * v + 2]);
    for (uint32_t f = 0; f < s.face_count; f++)
        fprintf(file, "f %u %u %u\n", s.corner[3 * f] + 1, s.corner[3 * f + 1] + 1, s.corner[3 * f + 2] + 1);
    fclose(file);
    shape_free(&s);
}

/* Split: those of the sides, to the last bit but a few. Smooth: at the corners of the cube along its diagonals. */
static void normals_are_smooth_or_split(void **state)
{
    (void)state;
    static const char *const outputs[] = {"split.obj", "split.glb", "smooth.obj", "smooth.glb", "smooth.ply"};
    write_cube(FOLDER "/cube.obj");
    for (int i = 0; i < 5; i++) {
        char arguments[256], path[256];
        bool split = i < 2;
        snprintf(arguments, sizeof arguments, "cube.obj -o %s --faces 150 --normals %s", outputs[i],
                 split ? "split" : "smooth");
        snprintf(path, sizeof path, FOLDER "/%s", outputs[i]);
        assert_int_equal(tool(arguments), 0);
        qw_mesh *mesh = load_file(path);
        qw_mesh_view view = qw_mesh_get(mesh);
        const qw_attribute *normal = named(mesh, "normal");
        assert_non_null(normal);
        uint32_t corners = 0;
        for (uint32_t c = 0; c < 4 * view.face_count; c++) {
            const float *n = normal->values + 3 * (size_t)(normal->domain == QW_PER_CORNER ? c : view.corners[c]);
            const double *p = view.positions + 3 * (size_t)view.corners[c],
                         *q = view.positions + 3 * (size_t)view.corners[c - c % 4 + (c + 2) % 4];
            int flat = 0, along = 0;
            assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-5f);
            for (int k = 0; k < 3; k++) {
                along += fabs(p[k] - 0.5) > 0.4999;
                if (fabs(p[k] - q[k]) < 1e-4 && fabs(p[k] - 0.5) > 0.4999)
                    flat = k; /* the side on which the quad lies */
            }
            if (split) assert_true(near((double)n[flat], p[flat] > 0.5 ? 1 : -1));
            if (!split && along == 3)
                for (int k = 0; k < 3; k++) assert_true(fabs((double)n[k] * (p[k] > 0.5 ? 1 : -1) - 0.57735) < 0.02);
            corners += along == 3;
        }
        assert_int_equal(corners, 24);
        qw_mesh_destroy(mesh);
    }
    assert_true(tool("cube.obj -o x.ply --faces 150 --normals split") != 0 &&
                file_holds(FOLDER "/said.txt", "one normal a vertex"));
    assert_true(tool("cube.obj -o x.off --faces 150 --normals smooth") != 0 &&
                file_holds(FOLDER "/said.txt", "OFF holds none"));
    assert_true(tool("cube.obj -o x.obj --faces 150 --normals odd") != 0 &&
                file_holds(FOLDER "/said.txt", "--normals must be"));
    assert_int_equal(tool("smooth.obj -o none.obj --faces 150 --normals none"), 0);
    assert_int_equal(tool("smooth.obj -o carried.obj --faces 150"), 0);
    assert_false(file_holds(FOLDER "/none.obj", "vn"));
    assert_true(file_holds(FOLDER "/carried.obj", "vn"));
}

/* The upper side of a cube in quads, the others as they were: every normal is that of its side. */
static void normals_of_a_region(void **state)
{
    (void)state;
    static const char *const outputs[] = {"part.obj", "part.glb"};
    shape s = shape_cube(8);
    FILE *file = fopen(FOLDER "/sides.obj", "w");
    assert_non_null(file);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        fprintf(file, "v %g %g %g\n", s.position[3 * v], s.position[3 * v + 1], s.position[3 * v + 2]);
    for (uint32_t f = 0; f < s.face_count; f++) {
        const uint32_t *c = s.corner + 3 * f;
        bool top = s.position[3 * c[0] + 2] + s.position[3 * c[1] + 2] + s.position[3 * c[2] + 2] > 2.999;
        fprintf(file, "g %s\nf %u %u %u\n", top ? "top" : "rest", c[0] + 1, c[1] + 1, c[2] + 1);
    }
    fclose(file);
    shape_free(&s);
    for (int i = 0; i < 4; i++) {
        char arguments[256], path[256];
        snprintf(arguments, sizeof arguments, "sides.obj -o %s --faces 40 --region top --normals %s", outputs[i % 2],
                 i < 2 ? "split" : "smooth");
        snprintf(path, sizeof path, FOLDER "/%s", outputs[i % 2]);
        assert_int_equal(tool(arguments), 0);
        qw_mesh *mesh = load_file(path);
        qw_mesh_view view = qw_mesh_get(mesh);
        const qw_attribute *normal = named(mesh, "normal");
        assert_true(normal && view.face_sizes);
        uint32_t quads = 0, c = 0;
        for (uint32_t f = 0; f < view.face_count; c += view.face_sizes[f++]) {
            double low[3] = {9, 9, 9}, high[3] = {-9, -9, -9};
            quads += view.face_sizes[f] == 4;
            for (uint32_t k = 0; k < 3 * view.face_sizes[f]; k++) {
                double p = view.positions[3 * (size_t)view.corners[c + k / 3] + k % 3];
                low[k % 3] = fmin(low[k % 3], p), high[k % 3] = fmax(high[k % 3], p);
            }
            for (uint32_t k = 0; k < 3 * view.face_sizes[f]; k++) {
                float n = normal->values[3 * (size_t)(c + k / 3) + k % 3];
                bool flat = high[k % 3] - low[k % 3] < 1e-5;
                double wanted = flat ? (low[k % 3] > 0.5 ? 1 : -1) : 0;
                assert_true(i < 2 ? fabs((double)n - wanted) < 1e-5 : !flat || (double)n * wanted > 0.5);
            }
        }
        assert_true(quads > 20 && quads < 80);
        qw_mesh_destroy(mesh);
    }
}

static void normals_of_a_context(void **state)
{
    (void)state;
    shape s = shape_sphere(6);
    qw_mesh_view view = shape_view(&s);
    qw_context *context;
    qw_attribute normals;
    qw_options options;
    qw_options_init(&options);
    options.faces = 300;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_get_normals(NULL, QW_SHADING_SMOOTH, &normals), QW_ARGUMENT);
    assert_int_equal(qw_get_normals(context, QW_SHADING_SMOOTH, NULL), QW_ARGUMENT);
    assert_int_equal(qw_get_normals(context, QW_SHADING_SMOOTH, &normals), QW_NOT_READY);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_OK);
    assert_int_equal(qw_get_normals(context, (qw_shading)7, &normals), QW_ARGUMENT);
    qw_mesh_view quads;
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    for (int shading = 0; shading < 2; shading++) { /* nothing is sharp on a sphere */
        assert_int_equal(qw_get_normals(context, (qw_shading)shading, &normals), QW_OK);
        assert_int_equal(normals.count, shading ? 4 * quads.face_count : quads.vertex_count);
        for (uint32_t i = 0; i < normals.count; i++) {
            const double *p = quads.positions + 3 * (size_t)(shading ? quads.corners[i] : i);
            const float *n = normals.values + 3 * (size_t)i;
            double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
            assert_true((p[0] * (double)n[0] + p[1] * (double)n[1] + p[2] * (double)n[2]) / length > 0.99);
        }
    }
    /* a mesh of a caller's, without a file behind it */
    assert_int_equal(qw_save_from(context, &normals, 1, NULL, FOLDER "/sphere.glb", QW_FORMAT_AUTO), QW_OK);
    assert_int_equal(qw_save_from(NULL, &normals, 1, NULL, FOLDER "/sphere.glb", QW_FORMAT_AUTO), QW_ARGUMENT);
    normals.count--;
    assert_int_equal(qw_save_from(context, &normals, 1, NULL, FOLDER "/sphere.glb", QW_FORMAT_AUTO), QW_ARGUMENT);
    qw_mesh *mesh = load_file(FOLDER "/sphere.glb");
    assert_int_equal(qw_mesh_get(mesh).face_count, quads.face_count);
    assert_true(qw_mesh_get(mesh).vertex_count == quads.vertex_count && named(mesh, "normal"));
    qw_mesh_destroy(mesh);
    qw_destroy(context);
    shape_free(&s);
}

static int make_folder(void **state)
{
    (void)state;
    return system("mkdir -p " FOLDER);
}

QW_TEST_SUITE(gltf)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wrong_files_fail_with_a_sentence),
        cmocka_unit_test(wrong_glb_fails_with_a_sentence),
        cmocka_unit_test(counts_are_bounded),
        cmocka_unit_test(strips_fans_and_maps_are_read),
        cmocka_unit_test(everything_of_a_scene_is_read),
        cmocka_unit_test(names_are_read_with_their_escapes),
        cmocka_unit_test(a_scene_keeps_its_nodes),
        cmocka_unit_test(other_files_become_glb),
        cmocka_unit_test(files_beside_are_read_and_no_others),
        cmocka_unit_test(only_regular_files_are_read),
        cmocka_unit_test(names_that_are_no_utf8_become_so),
        cmocka_unit_test(far_from_the_origin),
        cmocka_unit_test(skins_keep_their_joints),
        cmocka_unit_test(normals_are_smooth_or_split),
        cmocka_unit_test(normals_of_a_region),
        cmocka_unit_test(normals_of_a_context),
    };
    return cmocka_run_group_tests(tests, make_folder, NULL);
}
