/* Attributes through files: what is read, what the tool writes, and what of it comes back. */
#include "suite.h"
#include "loaded.h"
#include "shapes.h"
#include "io/json_read.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

enum { MOST_TEXT = 1 << 16 };

static void obj_attributes_are_read(void **state)
{
    (void)state;
    qw_mesh *mesh = load_text(
        "mtllib a.mtl\nmtllib b c.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\no first\nusemtl skin tone\ns 1\nf 1/1/1 2/2/1 3/-1/-1\n"
        "f 1 2\nusemtl cloth\ng a b\nf 1/1/1 3/3/1 4//1\n");
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(view.face_count, 2);
    assert_string_equal(qw_mesh_library(mesh), "a.mtl\nb c.mtl");
    const qw_attribute *uv = named(mesh, "uv"), *normal = named(mesh, "normal"), *colour = named(mesh, "color"),
                       *material = named(mesh, "material"), *group = named(mesh, "group");
    assert_true(uv && normal && colour && material && group && named(mesh, "object") && named(mesh, "smoothing"));
    static const float want[] = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 0};
    assert_int_equal(uv->count, 6);
    assert_memory_equal(uv->values, want, sizeof want);
    for (int c = 0; c < 6; c++) assert_true(normal->values[3 * c + 2] == 1);
    assert_true(colour->count == 4 && colour->values[4] == 1 && colour->values[3] == 0);
    assert_string_equal(material->label_names[material->labels[0]], "skin tone");
    assert_string_equal(material->label_names[material->labels[1]], "cloth");
    assert_int_equal(group->labels[0], -1);
    assert_string_equal(group->label_names[group->labels[1]], "a b");
    qw_mesh_destroy(mesh);
}

/* What is wrong with coordinates of textures is no reason to refuse a surface. */
static void broken_rows_are_left_out(void **state)
{
    (void)state;
    static const char *const texts[] = {"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/3\n",
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt nan 1\nf 1/1 2/2 3/1\n",
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt\nf 1/1 2/1 3/1\n",
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/-9 3/1\n",
                                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/99999999999999999999 3/1\n"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        qw_mesh *mesh = load_text(texts[i]);
        assert_int_equal(qw_mesh_get(mesh).face_count, 1);
        assert_null(named(mesh, "uv"));
        qw_mesh_destroy(mesh);
    }
}

/* Texture coordinates by vertices are written as those by corners are. */
static void coordinates_of_vertices_are_written(void **state)
{
    (void)state;
    static const double places[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    static const float at[] = {0, 0, 0.5f, 0, 0.5f, 0.25f, 0, 0.25f};
    static const uint32_t corners[] = {0, 1, 2, 0, 2, 3}, of[] = {0, 1, 2, 0, 2, 3};
    const qw_mesh_view view = {.size = sizeof view,
                               .vertex_count = 4,
                               .face_count = 2,
                               .uniform_face_size = 3,
                               .positions = places,
                               .corners = corners};
    const qw_attribute uv = {.size = sizeof uv,
                             .name = "uv",
                             .domain = QW_PER_VERTEX,
                             .kind = QW_UVS,
                             .components = 2,
                             .count = 4,
                             .values = at};
    static const char *const paths[] = {"vertices.obj", "vertices.ply"};
    for (int i = 0; i < 2; i++) {
        qw_mesh *mesh, *again;
        assert_int_equal(qw_mesh_wrap(&view, &uv, 1, NULL, NULL, NULL, &mesh), QW_OK);
        assert_int_equal(qw_mesh_save(mesh, paths[i], QW_FORMAT_AUTO), QW_OK);
        assert_int_equal(qw_load(paths[i], NULL, &again), QW_OK);
        const qw_attribute *found = named(again, "uv");
        assert_true(found && found->domain == QW_PER_CORNER && found->count == 6);
        for (size_t c = 0; c < 6; c++) assert_memory_equal(found->values + 2 * c, at + 2 * of[c], 2 * sizeof *at);
        qw_mesh_destroy(mesh), qw_mesh_destroy(again);
    }
}

static void ply_and_off_attributes_are_read(void **state)
{
    (void)state;
    qw_mesh *mesh = load_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty uchar red\n"
                              "property float y\nproperty float z\nproperty uchar green\nproperty uchar blue\n"
                              "property float heat\nelement face 2\nproperty int part\n"
                              "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
                              "0 255 0 0 0 51 0.5\n1 0 0 0 0 0 1.5\n0 0 1 0 0 0 2.5\n"
                              "4 2 0 1 0\n9 3 0 1 2 6 0 0 1 0 0 1\n");
    const qw_attribute *colour = named(mesh, "color"), *heat = named(mesh, "heat"), *part = named(mesh, "part"),
                       *uv = named(mesh, "uv");
    assert_true(colour && heat && part && uv);
    assert_true(colour->storage == QW_UINT8 && colour->components == 3 && colour->values[0] == 1);
    assert_true(fabsf(colour->values[2] - 0.2f) < 1e-6f && heat->values[2] == 2.5f);
    assert_true(part->kind == QW_LABELS && part->count == 1 && part->labels[0] == 9);
    assert_true(uv->count == 3 && uv->values[2] == 1 && uv->values[5] == 1);
    qw_mesh_destroy(mesh);
    mesh = load_text("COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 51 255\n3 0 1 2\n");
    colour = named(mesh, "color");
    assert_true(colour && colour->components == 4 && colour->values[0] == 1);
    assert_true(fabsf(colour->values[10] - 0.2f) < 1e-6f);
    qw_mesh_destroy(mesh);
    mesh = load_text("COFF\n3 1 0\n0 0 0 1 0 0\n1 0 0 0 0.5 0\n0 1 0 0 0 1\n3 0 1 2\n");
    colour = named(mesh, "color");
    assert_true(colour && colour->components == 3 && colour->values[4] == 0.5f);
    qw_mesh_destroy(mesh);
}

/* ---- through the tool */

/* A box in two materials with a texture on each of its sides, colours and groups. */
static void write_box(const char *path)
{
    shape s = shape_cube(6);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("mtllib box.mtl\n", file);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        const double *p = s.position + 3 * (size_t)v;
        fprintf(file, "v %g %g %g %g %g 0.5\n", p[0], p[1], p[2], p[0], p[1]);
    }
    for (uint32_t h = 0; h < 3 * s.face_count; h++) {
        const double *p = s.position + 3 * (size_t)s.corner[h];
        fprintf(file, "vt %g %g\n", p[0] + p[2] / 4, p[1] + p[2] / 4);
    }
    for (uint32_t f = 0; f < s.face_count; f++) {
        const uint32_t *c = s.corner + 3 * (size_t)f;
        double middle = 0;
        for (int k = 0; k < 3; k++) middle += s.position[3 * (size_t)c[k]] / 3;
        fprintf(file, "usemtl %s\ng side%d\nf %u/%u %u/%u %u/%u\n", middle < 0.5 ? "left" : "right", (int)(f % 2),
                c[0] + 1, 3 * f + 1, c[1] + 1, 3 * f + 2, c[2] + 1, 3 * f + 3);
    }
    fclose(file);
    shape_free(&s);
}

static int run_tool(const char *arguments)
{
    char command[1024];
    snprintf(command, sizeof command, "%s/quadwright %s -q", QW_BINARY_DIR, arguments);
    return system(command);
}

typedef struct json_check {
    qw_env *env;
    const char *text;
    size_t size;
    uint32_t corners;
} json_check;

static void parse_provenance(void *user)
{
    json_check *check = user;
    qw_json_doc doc = qw_json_parse(check->env, "provenance", check->text, check->size);
    check->corners = doc.token[qw_json_member(&doc, 0, "corners")].count;
}

/* Small enough to be read by hand: brackets close, and no byte is other than JSON has. */
static void provenance_is_json(void **state)
{
    (void)state;
    static char text[1 << 16];
    FILE *file = fopen(QW_BINARY_DIR "/flat_in.obj", "wb");
    assert_non_null(file);
    fputs("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n", file);
    fclose(file);
    assert_int_equal(run_tool(QW_BINARY_DIR "/flat_in.obj -o " QW_BINARY_DIR
                                            "/flat_out.obj --faces 9 --provenance " QW_BINARY_DIR "/flat.json"),
                     0);
    file = fopen(QW_BINARY_DIR "/flat.json", "rb");
    assert_non_null(file);
    size_t size = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    assert_int_equal(strlen(text), size);
    qw_env *env = qw_env_create(NULL, 1);
    json_check check = {env, text, size, 0};
    if (qw_protect(env, parse_provenance, &check) != QW_OK) fail_msg("%s", qw_env_message(env));
    assert_true(check.corners >= 16 && check.corners % 4 == 0);
    qw_env_destroy(env);
}

static void the_tool_carries_attributes_over(void **state)
{
    (void)state;
    static const char *const endings[] = {"obj", "ply"};
    char arguments[512], path[256];
    write_box(QW_BINARY_DIR "/box_in.obj");
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/box_out.%s", QW_BINARY_DIR, endings[i]);
        snprintf(arguments, sizeof arguments, "%s/box_in.obj -o %s --faces 400 --provenance %s/box_out.qwp",
                 QW_BINARY_DIR, path, QW_BINARY_DIR);
        assert_int_equal(run_tool(arguments), 0);
        qw_mesh *mesh = load_file(path);
        qw_mesh_view view = qw_mesh_get(mesh);
        const qw_attribute *uv = named(mesh, "uv"), *colour = named(mesh, "color"), *material = named(mesh, "material");
        assert_true(uv && colour && material && view.face_count > 300);
        for (uint32_t v = 0; v < view.vertex_count; v++)
            assert_true(fabs((double)colour->values[3 * v] - view.positions[3 * v]) < 0.02);
        uint32_t off = 0, left = 0, switches = 0;
        for (uint32_t c = 0; c < uv->count; c++) {
            const double *p = view.positions + 3 * (size_t)view.corners[c];
            off += fabs((double)uv->values[2 * c] - p[0] - p[2] / 4) > 0.02;
        }
        for (uint32_t f = 0; f < view.face_count; f++) {
            left += material->labels[f] == material->labels[0];
            switches += f > 0 && material->labels[f] != material->labels[f - 1];
        }
        assert_int_equal(off, 0);
        assert_true(left > view.face_count * 2 / 5 && left < view.face_count * 3 / 5 && switches <= 3);
        FILE *file = fopen(QW_BINARY_DIR "/box_out.qwp", "rb");
        uint32_t head[3];
        assert_non_null(file);
        assert_int_equal(fread(head, 4, 3, file), 3);
        fseek(file, 0, SEEK_END);
        assert_memory_equal(head, "QWP1", 4);
        assert_true(head[1] == view.vertex_count && head[2] == 4 * view.face_count);
        assert_int_equal(ftell(file), 12 + 28 * ((long)head[1] + (long)head[2]));
        fclose(file);
        qw_mesh_destroy(mesh);
    }
}

/* The farthest from the plane between the materials that a vertex with quads of both lies. */
static double farthest_from_border(const char *path)
{
    qw_mesh *mesh = load_file(path);
    qw_mesh_view view = qw_mesh_get(mesh);
    const qw_attribute *material = named(mesh, "material");
    int8_t *seen = calloc(view.vertex_count, 1);
    double farthest = -1;
    for (uint32_t c = 0; c < 4 * view.face_count; c++) seen[view.corners[c]] |= (int8_t)(1 << material->labels[c / 4]);
    for (uint32_t v = 0; v < view.vertex_count; v++)
        if (seen[v] == 3) farthest = fmax(farthest, fabs(view.positions[3 * v] - 0.5));
    free(seen);
    qw_mesh_destroy(mesh);
    return farthest;
}

static void borders_are_kept_when_asked(void **state)
{
    (void)state;
    write_box(QW_BINARY_DIR "/box_in.obj");
    assert_int_equal(run_tool(QW_BINARY_DIR "/box_in.obj -o " QW_BINARY_DIR "/box_free.obj --faces 294"), 0);
    assert_int_equal(
        run_tool(QW_BINARY_DIR "/box_in.obj -o " QW_BINARY_DIR "/box_kept.obj --faces 294 --keep materials"), 0);
    assert_true(farthest_from_border(QW_BINARY_DIR "/box_free.obj") > 0.02);
    double kept = farthest_from_border(QW_BINARY_DIR "/box_kept.obj");
    assert_true(kept >= 0 && kept < 1e-5);
    assert_true(run_tool(QW_BINARY_DIR "/box_in.obj -o " QW_BINARY_DIR "/box_kept.obj --keep hats 2> " QW_BINARY_DIR
                                       "/said.txt") != 0);
    assert_true(run_tool(QW_BINARY_DIR "/box_bare.obj -o " QW_BINARY_DIR "/box_kept.obj --keep seams 2> " QW_BINARY_DIR
                                       "/said.txt") != 0);
}

static char *read_whole(const char *path, size_t *length)
{
    char *text = calloc(1, MOST_TEXT + 1);
    FILE *file = fopen(path, "rb");
    assert_true(text && file);
    *length = fread(text, 1, MOST_TEXT, file);
    fclose(file);
    return text;
}

static uint32_t marks_of(const char *text, const char *names)
{
    uint32_t edges = 0;
    qw_mesh *mesh = load_text(text);
    if (!names) edges = qw_mesh_get(mesh).marked_edge_count;
    else if (qw_mesh_mark(mesh, names, &edges) != QW_OK) fail_msg("%s", qw_mesh_message(mesh));
    qw_mesh_destroy(mesh);
    return edges;
}

#define PLY_HEAD  "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
#define PLY_FACES "element face %d\nproperty list uchar int vertex_indices\n"

/* Two squares side by side: the edge between them is a border where what either has differs, whether they share its
   vertices or each has its own. */
static void borders_of_vertices_of_their_own(void **state)
{
    (void)state;
    char text[1024];
    static const char
        *const shared = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\n",
               *const parted = "v 0 0 0\nv 1 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 1 1 -0\nv 2 0 0\n",
               *const of_shared = "f 1 2 5 4\n%s\nf 2 3 6 5\n", *const of_parted = "f 1 2 5 4\n%s\nf 3 8 6 7\n";
    for (int i = 0; i < 2; i++) {
        size_t used = (size_t)snprintf(text, sizeof text, "%susemtl a\ng x\ns 1\n", i ? parted : shared);
        static const char *const between[] = {"usemtl b", "g y", "s 2", "usemtl a"};
        static const uint32_t marks[][3] = {
            {1, 0, 1}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}; /* material, group, of the file */
        for (int k = 0; k < 4; k++) {
            char line[32];
            snprintf(line, sizeof line, "%s", between[k]);
            snprintf(text + used, sizeof text - used, i ? of_parted : of_shared, line);
            assert_int_equal(marks_of(text, "material"), marks[k][0]);
            assert_int_equal(marks_of(text, "group"), marks[k][1]);
            assert_int_equal(marks_of(text, NULL), marks[k][2]);
        }
    }
    /* PLY has texture coordinates by vertices */
    for (int same = 0; same < 2; same++) {
        snprintf(text, sizeof text,
                 PLY_HEAD
                 "property float s\nproperty float t\n" PLY_FACES
                 "end_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n1 0 0 %d 0\n2 0 0 1 0\n2 1 0 1 1\n1 1 0 %d "
                 "1\n4 0 1 2 3\n4 4 5 6 7\n",
                 8, 2, same, same);
        assert_int_equal(marks_of(text, "uv"), !same);
    }
    /* faces of a PLY have labels of any name */
    snprintf(text, sizeof text,
             PLY_HEAD PLY_FACES
             "property int part\nend_header\n0 0 0\n1 0 0\n2 0 0\n0 1 0\n1 1 0\n2 1 0\n4 0 1 4 3 7\n4 1 2 5 4 8\n",
             6, 2);
    assert_int_equal(marks_of(text, "part"), 1);
    /* where more than two lie on one another nothing says which belong together */
    assert_int_equal(marks_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 0 0\nv 1 -1 0\nv 0 0 0\nv 1 0 0\nv 1 0 1\n"
                              "usemtl a\nf 1 2 3\nusemtl b\nf 5 4 6\nusemtl c\nf 7 8 9\n",
                              "material"),
                     0);
}

/* A label of which no quad is left is named, and it is kept by its borders. */
static void lost_labels_are_named(void **state)
{
    (void)state;
    static const char *const head =
        "v 0 0 0\nv 8 0 0\nv 8 8 0\nv 0 8 0\nv 4 4 0\nv 4.2 4 0\nv 4.1 4.2 0\nusemtl skin\n"
        "f 1 2 5\nf 2 6 5\nf 2 3 6\nf 3 7 6\nf 3 4 7\nf 4 5 7\nf 4 1 5\nusemtl mouth\nf 5 6 7\n";
    FILE *file = fopen(QW_BINARY_DIR "/mouth.obj", "wb");
    assert_non_null(file);
    fputs(head, file);
    fclose(file);
    static const char *const flags[] = {"", "--keep materials", "--no-attributes"};
    for (int i = 0; i < 3; i++) {
        char arguments[512];
        snprintf(arguments, sizeof arguments, "%s/mouth.obj -o %s/mouth_out.obj --faces 30 --json %s/mouth.json %s",
                 QW_BINARY_DIR, QW_BINARY_DIR, QW_BINARY_DIR, flags[i]);
        assert_int_equal(run_tool(arguments), 0);
        size_t length;
        char *text = read_whole(QW_BINARY_DIR "/mouth.json", &length);
        assert_true(!strstr(text, "no quad is left of material \\\"mouth\\\"") == (i > 0));
        free(text);
    }
}

/* A label that a wrap hides is said to lie inside: no count of quads would hold it. */
static void hidden_labels_lie_inside(void **state)
{
    (void)state;
    FILE *file = fopen(QW_BINARY_DIR "/hidden.obj", "wb");
    assert_non_null(file);
    for (int box = 0; box < 2; box++) {
        double r = box ? 0.3 : 1;
        int b = 8 * box;
        for (int v = 0; v < 8; v++) fprintf(file, "v %g %g %g\n", v & 1 ? r : -r, v & 2 ? r : -r, v & 4 ? r : -r);
        fprintf(file, "usemtl %s\n", box ? "engine" : "hull");
        static const int sides[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                                        {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
        for (int f = 0; f < 6; f++)
            fprintf(file, "f %d %d %d %d\n", b + sides[f][0], b + sides[f][1], b + sides[f][2], b + sides[f][3]);
    }
    fclose(file);
    assert_int_equal(run_tool(QW_BINARY_DIR "/hidden.obj -o " QW_BINARY_DIR
                                            "/hidden_out.obj --faces 100 --wrap 0.05 --json " QW_BINARY_DIR
                                            "/hidden.json"),
                     0);
    size_t length;
    char *text = read_whole(QW_BINARY_DIR "/hidden.json", &length);
    assert_non_null(strstr(text, "no quad is left of material \\\"engine\\\"; it lies inside the wrap"));
    free(text);
}

/* A caller's own arrays are written and marked as those of a file are. */
static void wrapped_meshes_are_those_of_files(void **state)
{
    (void)state;
    static const char source[] = QW_BINARY_DIR "/wrapped_in.obj", expected[] = QW_BINARY_DIR "/wrapped_a.obj",
                      written[] = QW_BINARY_DIR "/wrapped_b.obj";
    char message[256];
    write_box(source);
    qw_mesh *file, *wrapped, *none;
    assert_int_equal(qw_load(source, NULL, &file), QW_OK);
    uint32_t count, edges[2];
    const qw_attribute *attributes = qw_mesh_attributes(file, &count);
    qw_mesh_view view = qw_mesh_get(file);
    assert_true(count > 1);
    assert_int_equal(qw_mesh_wrap(&view, attributes, count, qw_mesh_library(file), NULL, NULL, &wrapped), QW_OK);
    assert_int_equal(qw_mesh_save(file, expected, QW_FORMAT_AUTO), QW_OK);
    assert_int_equal(qw_mesh_save(wrapped, written, QW_FORMAT_AUTO), QW_OK);
    size_t lengths[2];
    char *a = read_whole(expected, &lengths[0]), *b = read_whole(written, &lengths[1]);
    assert_int_equal(lengths[0], lengths[1]);
    assert_memory_equal(a, b, lengths[0]);
    assert_non_null(strstr(a, "usemtl left"));
    free(a), free(b);
    assert_int_equal(qw_mesh_mark(file, "material", &edges[0]), QW_OK);
    assert_int_equal(qw_mesh_mark(wrapped, "material", &edges[1]), QW_OK);
    assert_true(edges[0] > 0 && edges[0] == edges[1]);
    assert_int_equal(qw_mesh_save(wrapped, "/no/such/folder/a.obj", QW_FORMAT_AUTO), QW_FILE_UNWRITABLE);
    assert_non_null(strstr(qw_mesh_message(wrapped), "/no/such/folder"));
    assert_int_equal(qw_mesh_save(wrapped, "", QW_FORMAT_OBJ), QW_ARGUMENT);
    assert_int_equal(qw_mesh_save(NULL, written, QW_FORMAT_OBJ), QW_ARGUMENT);
    qw_mesh_destroy(wrapped);

    qw_attribute wrong = attributes[0];
    wrong.count--;
    assert_int_equal(qw_mesh_wrap(&view, &wrong, 1, NULL, NULL, NULL, &none), QW_ARGUMENT);
    snprintf(message, sizeof message, "attribute %s has", wrong.name);
    assert_non_null(strstr(qw_mesh_message(none), message));
    assert_int_equal(qw_mesh_save(none, written, QW_FORMAT_OBJ), QW_ARGUMENT); /* nothing was wrapped */
    qw_mesh_destroy(none);
    assert_int_equal(qw_mesh_wrap(NULL, NULL, 0, NULL, NULL, NULL, &none), QW_ARGUMENT);
    qw_mesh_destroy(none);
    assert_int_equal(qw_mesh_wrap(&view, NULL, 0, NULL, NULL, NULL, NULL), QW_ARGUMENT);
    qw_mesh_destroy(file);
}

/* Without them the bytes are those of a file that has none. */
static void attributes_may_stay_behind(void **state)
{
    (void)state;
    write_box(QW_BINARY_DIR "/box_in.obj");
    assert_int_equal(
        run_tool(QW_BINARY_DIR "/box_in.obj -o " QW_BINARY_DIR "/box_bare.obj --faces 300 --no-attributes"), 0);
    static char text[MOST_TEXT];
    FILE *file = fopen(QW_BINARY_DIR "/box_bare.obj", "r");
    assert_non_null(file);
    size_t size = fread(text, 1, sizeof text - 1, file);
    text[size] = 0;
    fclose(file);
    assert_true(strncmp(text, "v ", 2) == 0 && size > 1000);
    assert_null(strstr(text, "vt"));
    assert_null(strstr(text, "/"));
    assert_null(strstr(text, "usemtl"));
}

QW_TEST_SUITE(attribute_files)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(obj_attributes_are_read),           cmocka_unit_test(broken_rows_are_left_out),
        cmocka_unit_test(ply_and_off_attributes_are_read),   cmocka_unit_test(the_tool_carries_attributes_over),
        cmocka_unit_test(attributes_may_stay_behind),        cmocka_unit_test(borders_are_kept_when_asked),
        cmocka_unit_test(wrapped_meshes_are_those_of_files), cmocka_unit_test(provenance_is_json),
        cmocka_unit_test(borders_of_vertices_of_their_own),  cmocka_unit_test(lost_labels_are_named),
        cmocka_unit_test(hidden_labels_lie_inside),          cmocka_unit_test(coordinates_of_vertices_are_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
