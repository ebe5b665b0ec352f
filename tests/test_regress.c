/* Every file of tests/data/regress, each the smallest input of a bug that was mended: it is loaded and remeshed as it
 * is, and must keep its topology in quads or fail with a sentence. */
#define _POSIX_C_SOURCE 200809L
#include "suite.h"
#include "quadwright/quadwright.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* MOST_WORKING: triangles of the working mesh; an attempt at so many takes about a second. */
enum { FACES = 200, NAME_SIZE = 256, MAX_FILES = 256, MOST_WORKING = 25000 };

static void keep_topology(const qw_result *result)
{
    const qw_report *report = qw_result_report(result);
    qw_mesh_view quads = qw_result_mesh(result);
    qw_topology out;
    qw_quality quality;
    assert_true(quads.face_count > 0);
    assert_true(report->working_triangles < MOST_WORKING);
    assert_int_equal(quads.uniform_face_size, 4);
    assert_int_equal(qw_measure(&quads, NULL, NULL, &out, &quality), QW_OK);
    assert_int_equal(out.quads, out.faces);
    assert_int_equal(out.degenerate_faces, 0);
    assert_int_equal(out.duplicate_faces, 0);
    assert_int_equal(out.nonmanifold_edges, 0);
    assert_int_equal(out.nonmanifold_vertices, 0);
    assert_int_equal(out.components, report->components);
    assert_int_equal(out.boundary_loops, report->boundary_loops);
    assert_int_equal(out.euler, report->euler);
    if (report->boundary_loops == 0)
        assert_true(out.faces >= 6 * out.components); /* fewer have vertices of two edges */
}

static void remesh(const qw_mesh_view *view)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = FACES;
    qw_result *result;
    qw_status status = qw_remesh(view, &options, NULL, &result);
    if (status == QW_OK) keep_topology(result);
    else assert_string_not_equal(qw_result_message(result), "");
    assert_int_not_equal(status, QW_INTERNAL);
    qw_result_destroy(result);
}

static void replays(void **state)
{
    const char *name = *state;
    char path[sizeof QW_TEST_DATA + NAME_SIZE + 16];
    snprintf(path, sizeof path, "%s/regress/%s", QW_TEST_DATA, name);
    qw_mesh *mesh;
    if (qw_load(path, NULL, &mesh) == QW_OK) {
        qw_mesh_view view = qw_mesh_get(mesh);
        remesh(&view);
    } else {
        assert_string_not_equal(qw_mesh_message(mesh), "");
    }
    qw_mesh_destroy(mesh);
}

QW_TEST_SUITE(regress)
{
    static char names[MAX_FILES][NAME_SIZE];
    static struct CMUnitTest tests[MAX_FILES];
    size_t count = 0;
    DIR *folder = opendir(QW_TEST_DATA "/regress");
    for (struct dirent *entry; folder && count < MAX_FILES && (entry = readdir(folder)) != NULL;) {
        if (entry->d_name[0] == '.') continue;
        snprintf(names[count], NAME_SIZE, "%s", entry->d_name);
        tests[count] = (struct CMUnitTest){.name = names[count], .test_func = replays, .initial_state = names[count]};
        count++;
    }
    if (folder) closedir(folder);
    if (count == 0) return fputs("there is nothing in " QW_TEST_DATA "/regress\n", stderr), 1;
    return cmocka_run_group_tests(tests, NULL, NULL); /* entries without a name are passed over */
}
