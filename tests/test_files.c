/* The public functions over files and measures: ownership, messages, welding, and memory that runs out at every
 * allocation. */
#define _POSIX_C_SOURCE 200809L /* nanosleep */

#include "faults.h"
#include "suite.h"
#include "quadwright/quadwright.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static const char tetrahedron_obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
static const char mixed_obj[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0.5 0\nf 1 2 3 4\nf 2 5 3\n";
static const char two_facets_stl[] =
    "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex -0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";

static const double square[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
static const uint32_t square_corners[] = {0, 1, 2, 3};

static qw_mesh_view square_view(void)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = 4,
                          .face_count = 1,
                          .uniform_face_size = 4,
                          .positions = square,
                          .corners = square_corners};
}

static const char *temporary(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/test_files_%s", QW_BINARY_DIR, name);
    remove(path);
    return path;
}

static qw_mesh *loaded(const char *text)
{
    qw_mesh *mesh;
    assert_int_equal(qw_load_memory(text, strlen(text), NULL, &mesh), QW_OK);
    assert_string_equal(qw_mesh_message(mesh), "");
    return mesh;
}

static void uniform_and_mixed(void **state)
{
    (void)state;
    qw_mesh *mesh = loaded(tetrahedron_obj);
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(view.size, sizeof view);
    assert_int_equal(view.vertex_count, 4);
    assert_int_equal(view.face_count, 4);
    assert_int_equal(view.uniform_face_size, 3);
    assert_null(view.face_sizes);
    qw_mesh_destroy(mesh);

    mesh = loaded(mixed_obj);
    view = qw_mesh_get(mesh);
    assert_int_equal(view.face_count, 2);
    assert_non_null(view.face_sizes);
    assert_int_equal(view.face_sizes[0], 4);
    assert_int_equal(view.face_sizes[1], 3);
    assert_int_equal(view.corners[6], 2);
    qw_mesh_destroy(mesh);
}

static void separate_corners_are_welded(void **state)
{
    (void)state;
    qw_mesh *mesh = loaded(two_facets_stl);
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(view.vertex_count, 4); /* -0 and 0 are one place */
    assert_int_equal(view.face_count, 2);
    assert_int_equal(view.corners[0], view.corners[3]);
    assert_int_equal(view.corners[2], view.corners[4]);
    qw_mesh_destroy(mesh);
}

static void failures_have_sentences(void **state)
{
    (void)state;
    qw_mesh *mesh;
    assert_int_equal(qw_load("/no/such/file.obj", NULL, &mesh), QW_FILE_MISSING);
    assert_non_null(strstr(qw_mesh_message(mesh), "/no/such/file.obj"));
    assert_int_equal(qw_mesh_get(mesh).face_count, 0);
    qw_mesh_destroy(mesh);
    assert_int_equal(qw_load(QW_BINARY_DIR, NULL, &mesh), QW_FILE_IS_DIRECTORY);
    qw_mesh_destroy(mesh);
    assert_int_equal(qw_load(NULL, NULL, &mesh), QW_ARGUMENT);
    assert_true(strlen(qw_mesh_message(mesh)) > 0);
    qw_mesh_destroy(mesh);
    assert_int_equal(qw_load("x", NULL, NULL), QW_ARGUMENT);
    assert_int_equal(qw_load_memory("v 0 0 0\nf 1 2 3\n", 16, NULL, &mesh), QW_INDEX_RANGE);
    assert_true(strlen(qw_mesh_message(mesh)) > 0);
    qw_mesh_destroy(mesh);
    qw_mesh_destroy(NULL);
    assert_string_equal(qw_mesh_message(NULL), "out of memory");
    assert_int_equal(qw_mesh_get(NULL).vertex_count, 0);
}

/* Sizes that no memory has, up to the last that there is. */
static void sizes_near_the_end(void **state)
{
    (void)state;
    for (size_t back = 0; back < 200; back++)
        for (int half = 0; half < 2; half++) {
            qw_mesh *mesh;
            qw_status status = qw_load_memory("v 0 0 0\n", (SIZE_MAX >> half) - back, NULL, &mesh);
            assert_int_equal(status, QW_TOO_LARGE);
            assert_non_null(strstr(qw_mesh_message(mesh), "memory: "));
            qw_mesh_destroy(mesh);
        }
}

static void saved_bytes_come_back(void **state)
{
    (void)state;
    static const char *const names[] = {"a.obj", "a.ply", "a.off"};
    double positions[] = {0.1, 1.0 / 3.0, 1e-310, 1e300, -0.0, 2, 3, 3.141592653589793, 5, 6, 7, 8};
    qw_mesh_view view = square_view();
    view.positions = positions;
    for (int i = 0; i < 3; i++) {
        const char *path = temporary(names[i]);
        char message[256] = "unset";
        assert_int_equal(qw_save(&view, path, QW_FORMAT_AUTO, message, sizeof message), QW_OK);
        assert_string_equal(message, "");
        qw_mesh *mesh;
        assert_int_equal(qw_load(path, NULL, &mesh), QW_OK);
        qw_mesh_view back = qw_mesh_get(mesh);
        assert_int_equal(back.vertex_count, 4);
        assert_int_equal(back.face_count, 1);
        for (int k = 0; k < 12; k++) assert_true(back.positions[k] == positions[k]);
        assert_memory_equal(back.corners, square_corners, sizeof square_corners);
        qw_mesh_destroy(mesh);
        remove(path);
    }
}

static void refused(const qw_mesh_view *view, const char *path, qw_status expected, const char *says)
{
    char message[256];
    assert_int_equal(qw_save(view, path, QW_FORMAT_AUTO, message, sizeof message), expected);
    assert_non_null(strstr(message, says));
    if (path) assert_int_not_equal(access(path, F_OK), 0);
}

static void what_cannot_be_saved(void **state)
{
    (void)state;
    const char *path = temporary("b.obj");
    qw_mesh_view view = square_view();
    view.size--;
    refused(&view, path, QW_ARGUMENT, "size stamp");
    refused(NULL, path, QW_ARGUMENT, "no mesh");
    view = square_view();
    view.vertex_count = 3;
    refused(&view, path, QW_INDEX_RANGE, "face 0");
    view = square_view();
    view.uniform_face_size = 2;
    refused(&view, path, QW_ARGUMENT, "2 corners");
    view = square_view();
    double positions[12];
    memcpy(positions, square, sizeof positions);
    positions[10] = NAN;
    view.positions = positions;
    refused(&view, path, QW_NOT_FINITE, "vertex 3");
    view.positions = NULL;
    refused(&view, path, QW_ARGUMENT, "no positions");
    static const uint32_t huge[] = {4000000000u, 4000000000u};
    view = square_view();
    view.face_count = 2;
    view.face_sizes = huge;
    refused(&view, path, QW_TOO_LARGE, "corners");
    view = square_view();
    refused(&view, "/no/such/folder/b.obj", QW_FILE_UNWRITABLE, "/no/such/folder/b.obj");
    refused(&view, temporary("b.xyz"), QW_FORMAT_UNKNOWN, "b.xyz");
    refused(&view, NULL, QW_ARGUMENT, "path");
    for (int format = -1; format <= 99; format += 100)
        assert_int_equal(qw_save(&view, temporary("b.obj"), (qw_format)format, NULL, 0), QW_ARGUMENT);
    assert_int_equal(qw_save(&view, "/no/such/folder/b.obj", QW_FORMAT_OBJ, NULL, 0), QW_FILE_UNWRITABLE);
}

static int count_call(void *user, qw_stage stage, double fraction)
{
    (void)stage, (void)fraction;
    ++*(int *)user;
    return 0;
}

static void check_same_mesh(const char *path, const qw_mesh_view *expected)
{
    qw_mesh *mesh;
    assert_int_equal(qw_load(path, NULL, &mesh), QW_OK);
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(view.vertex_count, expected->vertex_count);
    assert_int_equal(view.face_count, expected->face_count);
    assert_memory_equal(view.positions, expected->positions, 3 * sizeof(double) * view.vertex_count);
    assert_memory_equal(view.corners, expected->corners, 4 * sizeof(uint32_t) * view.face_count);
    qw_mesh_destroy(mesh);
}

/* Of what is done the host hears no more, however long ago it was told so. */
static void a_context_saves_its_mesh(void **state)
{
    (void)state;
    int calls = 0;
    const qw_host host = {.progress = count_call, .progress_user = &calls};
    const char *path = temporary("c.ply");
    qw_context *context;
    qw_options options;
    qw_options_init(&options);
    options.faces = 1500, options.threads = 2;
    qw_mesh_view view = square_view();
    assert_int_equal(qw_create(&host, &context), QW_OK);
    assert_int_equal(qw_save_mesh(context, path, QW_FORMAT_AUTO), QW_NOT_READY);
    assert_non_null(strstr(qw_message(context), "no mesh to save"));
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    for (int run = 0; run < 2; run++) { /* the second does nothing */
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_int_equal(qw_get_mesh(context, &view), QW_OK);
        int before = calls;
        nanosleep(&(struct timespec){.tv_nsec = 30000000}, NULL);
        assert_int_equal(qw_save_mesh(context, path, QW_FORMAT_AUTO), QW_OK);
        assert_int_equal(calls, before);
        check_same_mesh(path, &view);
    }
    remove(path);
    assert_int_equal(qw_save_mesh(context, "/no/such/folder/c.obj", QW_FORMAT_AUTO), QW_FILE_UNWRITABLE);
    assert_non_null(strstr(qw_message(context), "/no/such/folder/c.obj"));
    assert_int_equal(qw_save_mesh(context, "", QW_FORMAT_AUTO), QW_ARGUMENT);
    assert_int_equal(qw_save_mesh(context, NULL, QW_FORMAT_AUTO), QW_ARGUMENT);
    assert_int_equal(qw_save_mesh(NULL, path, QW_FORMAT_AUTO), QW_ARGUMENT);
    qw_destroy(context);
}

static void measures(void **state)
{
    (void)state;
    qw_mesh_view view = square_view();
    qw_topology topology;
    qw_quality quality;
    assert_int_equal(qw_measure(&view, NULL, NULL, &topology, &quality), QW_OK);
    assert_int_equal(topology.quads, 1);
    assert_int_equal(topology.boundary_loops, 1);
    assert_true(quality.angle_rms < 1e-9 && quality.chamfer < 0);
    assert_int_equal(qw_measure(&view, &view, NULL, &topology, &quality), QW_OK);
    assert_true(quality.chamfer >= 0 && quality.chamfer < 1e-6);
    assert_int_equal(qw_measure(&view, NULL, NULL, NULL, &quality), QW_ARGUMENT);
    assert_int_equal(qw_measure(NULL, NULL, NULL, &topology, &quality), QW_ARGUMENT);
    view.vertex_count = 2;
    assert_int_equal(qw_measure(&view, NULL, NULL, &topology, &quality), QW_INDEX_RANGE);
}

/* ---- memory that runs out */

static void allocation_faults(void **state)
{
    (void)state;
    static const char *const texts[] = {tetrahedron_obj, mixed_obj, two_facets_stl};
    for (int t = 0; t < 3; t++) {
        bool finished = false;
        for (long n = 0; !finished; n++) {
            assert_true(n < 5000);
            faults f = {.allocations = n, .reports = FAULTS_NONE};
            const qw_host host = faults_host(&f);
            qw_mesh *mesh;
            qw_status status = qw_load_memory(texts[t], strlen(texts[t]), &host, &mesh);
            finished = f.allocations >= 0;
            assert_int_equal(status, finished ? QW_OK : QW_MEMORY);
            if (!finished) assert_true(strlen(qw_mesh_message(mesh)) > 0);
            qw_mesh_destroy(mesh);
            assert_int_equal(f.blocks, 0);
            assert_int_equal(f.held, 0);
        }
    }
}

static void measure_faults(void **state)
{
    (void)state;
    qw_mesh *mesh = loaded(tetrahedron_obj);
    qw_mesh_view quad = square_view(), view = qw_mesh_get(mesh);
    bool finished = false;
    for (long n = 0; !finished; n++) {
        assert_true(n < 5000);
        faults f = {.allocations = n, .reports = FAULTS_NONE};
        const qw_host host = faults_host(&f);
        qw_topology topology;
        qw_quality quality;
        qw_status status = qw_measure(&quad, &view, &host, &topology, &quality);
        finished = f.allocations >= 0;
        assert_int_equal(status, finished ? QW_OK : QW_MEMORY);
        assert_int_equal(f.blocks, 0);
        assert_int_equal(f.held, 0);
    }
    qw_mesh_destroy(mesh);
}

QW_TEST_SUITE(files)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uniform_and_mixed),        cmocka_unit_test(separate_corners_are_welded),
        cmocka_unit_test(failures_have_sentences),  cmocka_unit_test(sizes_near_the_end),
        cmocka_unit_test(saved_bytes_come_back),    cmocka_unit_test(what_cannot_be_saved),
        cmocka_unit_test(a_context_saves_its_mesh), cmocka_unit_test(measures),
        cmocka_unit_test(allocation_faults),        cmocka_unit_test(measure_faults),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
