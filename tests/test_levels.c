/* Whole runs whose quads are split, or fitted so that their limit surface lies on the input. */
#include "suite.h"

#include "shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

enum { FIT_TO_LIMIT = 1 };

static qw_options asking(int64_t faces, int64_t subdivide, int fit_to)
{
    qw_options o;
    qw_options_init(&o);
    o.faces = faces, o.subdivide = subdivide, o.fit_to = fit_to, o.threads = 2;
    return o;
}

static qw_context *run_of(const shape *s, const qw_options *o)
{
    qw_context *context;
    qw_mesh_view view = shape_view(s);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    if (qw_run(context, o) != QW_OK) fail_msg("%s", qw_message(context));
    return context;
}

static qw_mesh_view result_of(const qw_context *context)
{
    qw_mesh_view view;
    assert_int_equal(qw_get_mesh(context, &view), QW_OK);
    return view;
}

static qw_quality measured(const qw_mesh_view *mesh, const shape *against)
{
    qw_mesh_view surface = shape_view(against);
    qw_topology topology;
    qw_quality quality;
    assert_int_equal(qw_measure(mesh, &surface, NULL, &topology, &quality), QW_OK);
    assert_int_equal(quality.flipped_faces, 0);
    return quality;
}

static double distance_of(const qw_quality *q) { return q->chamfer * q->mean_edge; }

static void expect_topology(const qw_report *r)
{
    const qw_topology *t = &r->topology;
    assert_int_equal(t->quads, t->faces);
    assert_true(t->euler == r->euler && t->components == r->components && t->boundary_loops == r->boundary_loops);
    assert_int_equal(t->nonmanifold_edges + t->nonmanifold_vertices + t->degenerate_faces + t->duplicate_faces, 0);
    assert_int_equal(t->inconsistent_edges, 0);
}

/* ---- splitting */

static void expect_levels(const shape *s, int64_t faces, int64_t times, int fit_to)
{
    qw_options plain = asking(faces, 0, 0), split = asking(faces, times, fit_to);
    qw_context *once = run_of(s, &plain), *levels = run_of(s, &split);
    const qw_report *r = qw_get_report(levels);
    qw_mesh_view coarse, fine = result_of(levels), whole = result_of(once);
    assert_int_equal(qw_get_coarse(levels, &coarse), QW_OK);
    expect_topology(r);
    assert_int_equal(r->coarse_faces, coarse.face_count);
    assert_int_equal(fine.face_count, (int64_t)coarse.face_count << (2 * times));
    assert_int_equal(coarse.face_count, whole.face_count);
    assert_memory_equal(coarse.corners, whole.corners, 16 * (size_t)whole.face_count);
    if (fit_to == 0) assert_memory_equal(coarse.positions, whole.positions, 24 * (size_t)whole.vertex_count);
    for (uint32_t f = 0; f < coarse.face_count; f++) /* the first corner of the first quad of each stays its own */
        assert_int_equal(fine.corners[4 * ((size_t)f << (2 * times))], coarse.corners[4 * (size_t)f]);
    qw_quality q[2] = {measured(&whole, s), measured(&fine, s)};
    assert_true(distance_of(&q[1]) < 0.5 * distance_of(&q[0]));
    qw_provenance p;
    assert_int_equal(qw_get_provenance(levels, &p), QW_OK);
    assert_true(p.vertex_count == fine.vertex_count && p.corner_count == 4 * fine.face_count);
    assert_int_equal(p.lost_vertices + p.lost_corners, 0);
    qw_destroy(once), qw_destroy(levels);
}

static void quads_are_split_and_lie_nearer(void **state)
{
    (void)state;
    shape s = shape_double_torus(4);
    shape_smooth(&s, 6);
    expect_levels(&s, 300, 1, 0), expect_levels(&s, 150, 2, 0), expect_levels(&s, 150, 2, FIT_TO_LIMIT);
    shape_free(&s);
    s = shape_disc(30);
    expect_levels(&s, 60, 2, 0);
    shape_free(&s);
}

static bool is_strut(int x, int y, int z)
{
    int ends = (x % 3 == 0) + (y % 3 == 0) + (z % 3 == 0);
    return x >= 0 && y >= 0 && z >= 0 && x < 4 && y < 4 && z < 4 && ends >= 2;
}

/* Struts of a few quads: what is split lies beside them, and its vertices go to the surface across them. */
static void split_quads_are_not_flipped(void **state)
{
    (void)state;
    static const struct {
        int smoothed, faces;
    } runs[] = {{2, 80}, {2, 140}, {6, 60}, {6, 80}};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        shape s = shape_of_cells(4, 4, 4, 3, is_strut);
        shape_smooth(&s, runs[i].smoothed);
        qw_options o = asking(runs[i].faces, 1, 0);
        qw_context *context = run_of(&s, &o);
        qw_mesh_view fine = result_of(context);
        measured(&fine, &s);
        qw_destroy(context);
        shape_free(&s);
    }
}

/* Quads that are mended for solvers keep the order of the levels: only what is not split yet gets other edges. */
static void mended_levels_are_nested(void **state)
{
    (void)state;
    shape s = shape_hand(3);
    qw_options o = asking(80, 1, 0);
    o.jacobian_min = 0.3;
    qw_context *context = run_of(&s, &o);
    qw_mesh_view coarse, fine = result_of(context);
    assert_int_equal(qw_get_coarse(context, &coarse), QW_OK);
    assert_int_equal(fine.face_count, 4 * coarse.face_count);
    for (size_t c = 0; c < 4 * (size_t)coarse.face_count; c++) assert_int_equal(fine.corners[4 * c], coarse.corners[c]);
    qw_destroy(context);
    shape_free(&s);
}

/* The sharp edges of a cube stay straight and its sides plane, however often it is split. */
static void sharp_edges_stay(void **state)
{
    (void)state;
    shape s = shape_cube(8);
    for (int fit_to = 0; fit_to < 2; fit_to++) {
        qw_options o = asking(54, 2, fit_to);
        qw_context *context = run_of(&s, &o);
        qw_mesh_view m = result_of(context);
        uint32_t on_edges = 0;
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            int on = 0;
            for (int k = 0; k < 3; k++) {
                double x = m.positions[3 * (size_t)v + (size_t)k];
                on += fabs(x) < 1e-6 || fabs(x - 1) < 1e-6;
            }
            assert_true(on >= 1);
            on_edges += on >= 2;
        }
        assert_true(on_edges >= 12 * 4 * 2);
        qw_destroy(context);
    }
    shape_free(&s);
}

static void boundaries_that_stay_are_not_split(void **state)
{
    (void)state;
    shape s = shape_disc(20);
    qw_mesh_view view = shape_view(&s);
    qw_options o = asking(100, 1, 0);
    o.fix_boundary = 1;
    qw_result *result;
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OPTION);
    assert_non_null(strstr(qw_result_message(result), "subdivide"));
    qw_result_destroy(result);
    o.subdivide = 0, o.fit_to = FIT_TO_LIMIT; /* but their inside is fitted, and the rim stays bit for bit */
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
    assert_true(qw_result_report(result)->rim_vertices > 0);
    qw_mesh_view m = qw_result_mesh(result);
    uint32_t found = 0;
    for (uint32_t v = 0; v < m.vertex_count; v++)
        for (uint32_t u = 0; u < view.vertex_count; u++)
            found += memcmp(m.positions + 3 * (size_t)v, view.positions + 3 * (size_t)u, 24) == 0;
    assert_true(found >= qw_result_report(result)->rim_vertices);
    qw_result_destroy(result);
    shape_free(&s);
}

/* Each vertex has its reflection about x = 0, bit for bit, and vertices at the plane lie on it. */
static void symmetric_results_stay_so(void **state)
{
    (void)state;
    shape s = shape_double_torus(4);
    shape_smooth(&s, 6);
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * (size_t)v] -= 2.5;
    for (int fit_to = 0; fit_to < 2; fit_to++) {
        qw_options o = asking(200, 1, fit_to);
        o.symmetry = 2; /* x */
        qw_context *context = run_of(&s, &o);
        const qw_report *r = qw_get_report(context);
        qw_mesh_view m = result_of(context);
        expect_topology(r);
        assert_true(r->symmetric);
        uint32_t alone = 0, at_plane = 0;
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            const double *p = m.positions + 3 * (size_t)v;
            double mirrored[3] = {2 * r->plane_offset * r->plane_x - p[0] + 0.0, p[1], p[2]};
            bool found = false;
            for (uint32_t u = 0; u < m.vertex_count && !found; u++) {
                double there[3] = {m.positions[3 * (size_t)u] + 0.0, m.positions[3 * (size_t)u + 1],
                                   m.positions[3 * (size_t)u + 2]};
                found = memcmp(there, mirrored, sizeof there) == 0;
            }
            alone += !found, at_plane += p[0] == r->plane_offset * r->plane_x;
        }
        assert_int_equal(alone, 0);
        assert_true(at_plane > 0);
        measured(&m, &s);
        qw_destroy(context);
    }
    shape_free(&s);
}

/* ---- the limit */

static void limits_come_nearer(void **state)
{
    (void)state;
    shape s = shape_double_torus(4);
    shape_smooth(&s, 6);
    double off[2];
    for (int fit_to = 0; fit_to < 2; fit_to++) {
        qw_options o = asking(300, 0, fit_to);
        qw_context *context = run_of(&s, &o);
        qw_mesh_view m = result_of(context);
        qw_mesh *limit;
        expect_topology(qw_get_report(context));
        measured(&m, &s);
        assert_int_equal(qw_limit(&m, 3, NULL, &limit), QW_OK);
        qw_mesh_view surface = qw_mesh_get(limit);
        qw_quality q = measured(&surface, &s);
        off[fit_to] = distance_of(&q);
        qw_mesh_destroy(limit);
        qw_destroy(context);
    }
    assert_true(off[1] < 0.35 * off[0]);
    shape_free(&s);
}

/* Creases and corners go with the result, into OBJ and back. */
static void creases_are_written(void **state)
{
    (void)state;
    shape s = shape_cube(8);
    qw_options o = asking(150, 0, FIT_TO_LIMIT);
    qw_context *context = run_of(&s, &o);
    qw_mesh_view m = result_of(context);
    uint32_t corners = 0;
    for (uint32_t i = 0; i < m.marked_edge_count; i++) corners += m.marked_edges[2 * i] == m.marked_edges[2 * i + 1];
    assert_int_equal(corners, 8);
    assert_int_equal(m.marked_edge_count - corners, 12 * 5);
    assert_int_equal(qw_save_mesh(context, "levels_creases.obj", QW_FORMAT_AUTO), QW_OK);
    qw_mesh *loaded, *limit;
    assert_int_equal(qw_load("levels_creases.obj", NULL, &loaded), QW_OK);
    qw_mesh_view back = qw_mesh_get(loaded);
    assert_int_equal(back.marked_edge_count, m.marked_edge_count);
    assert_memory_equal(back.marked_edges, m.marked_edges, 8 * (size_t)m.marked_edge_count);
    assert_int_equal(qw_limit(&back, 2, NULL, &limit), QW_OK);
    qw_mesh_view surface = qw_mesh_get(limit);
    qw_quality q = measured(&surface, &s);
    assert_true(q.hausdorff * q.mean_edge < 1e-5);
    qw_mesh_destroy(limit), qw_mesh_destroy(loaded);
    qw_destroy(context);
    remove("levels_creases.obj");
    shape_free(&s);
}

/* A closed shell is one solid, of as many faces as there are quads. */
static void patches_are_written(void **state)
{
    (void)state;
    shape s = shape_double_torus(3);
    qw_options o = asking(120, 0, FIT_TO_LIMIT);
    qw_context *context = run_of(&s, &o);
    assert_int_equal(qw_save_patches(context, "levels.step"), QW_OK);
    FILE *file = fopen("levels.step", "r");
    static char line[1 << 16];
    uint32_t faces = 0, solids = 0, ends = 0;
    while (fgets(line, sizeof line, file)) {
        faces += strstr(line, "=ADVANCED_FACE(") != NULL, solids += strstr(line, "=MANIFOLD_SOLID_BREP(") != NULL;
        ends += strcmp(line, "END-ISO-10303-21;\n") == 0;
    }
    fclose(file);
    assert_int_equal(faces, result_of(context).face_count);
    assert_true(solids == 1 && ends == 1);
    qw_destroy(context);
    remove("levels.step");
    shape_free(&s);
}

/* Two cubes, one of which has a hollow. */
static bool is_hollow(int x, int y, int z) { return x < 3 ? x != 1 || y != 1 || z != 1 : x == 4; }

/* A cavity is one of the solid around it, not a solid of its own. */
static void cavities_are_voids(void **state)
{
    (void)state;
    shape s = shape_of_cells(5, 3, 3, 3, is_hollow);
    qw_options o = asking(300, 0, FIT_TO_LIMIT);
    qw_context *context = run_of(&s, &o);
    assert_int_equal(qw_save_patches(context, "voids.step"), QW_OK);
    FILE *file = fopen("voids.step", "r");
    static char line[1 << 16];
    uint32_t shells = 0, voids = 0, hollow = 0, solids = 0;
    while (fgets(line, sizeof line, file)) {
        shells += strstr(line, "=CLOSED_SHELL(") != NULL, voids += strstr(line, "=ORIENTED_CLOSED_SHELL(") != NULL;
        hollow += strstr(line, "=BREP_WITH_VOIDS(") != NULL, solids += strstr(line, "=MANIFOLD_SOLID_BREP(") != NULL;
    }
    fclose(file);
    assert_true(shells == 3 && voids == 1 && hollow == 1 && solids == 1);
    qw_destroy(context);
    remove("voids.step");
    shape_free(&s);
}

static uint32_t count_in(const char *path, const char *what)
{
    FILE *file = fopen(path, "r");
    static char line[1 << 16];
    uint32_t count = 0;
    while (fgets(line, sizeof line, file)) count += strstr(line, what) != NULL;
    fclose(file);
    return count;
}

/* A frame with two square holes: its fourteen sides are planes, two of them with a loop around each hole. */
static void planes_are_written(void **state)
{
    (void)state;
    shape s = shape_double_frame(4);
    qw_options o = asking(600, 0, FIT_TO_LIMIT);
    qw_context *context = run_of(&s, &o);
    assert_int_equal(qw_save_patches_from(context, "levels_planes.step", QW_PATCHES_OF_BLOCKS), QW_OK);
    assert_int_equal(count_in("levels_planes.step", "=PLANE("), 14);
    assert_int_equal(count_in("levels_planes.step", "=ADVANCED_FACE("), 14);
    assert_int_equal(count_in("levels_planes.step", "=FACE_OUTER_BOUND("), 14);
    assert_int_equal(count_in("levels_planes.step", "=FACE_BOUND("), 4);
    qw_destroy(context);
    remove("levels_planes.step");
    shape_free(&s);
}

/* ---- contexts */

/* In one context, with other threads, and from a dump: the bytes of a fresh run. */
static void bytes_are_those_of_a_fresh_run(void **state)
{
    (void)state;
    shape s = shape_double_torus(3);
    qw_options o = asking(120, 2, FIT_TO_LIMIT), other = asking(120, 1, 0);
    qw_context *fresh = run_of(&s, &o), *again = run_of(&s, &other), *resumed;
    o.threads = 1;
    assert_int_equal(qw_run(again, &o), QW_OK);
    assert_int_equal(qw_dump(again, "levels_dump.qws"), QW_OK);
    assert_int_equal(qw_create(NULL, &resumed), QW_OK);
    if (qw_resume(resumed, "levels_dump.qws") != QW_OK) fail_msg("%s", qw_message(resumed));
    assert_int_equal(qw_run(resumed, &o), QW_OK);
    qw_mesh_view m = result_of(fresh), n = result_of(again), k = result_of(resumed), coarse[2];
    assert_true(m.vertex_count == n.vertex_count && m.vertex_count == k.vertex_count);
    assert_memory_equal(m.positions, n.positions, 24 * (size_t)m.vertex_count);
    assert_memory_equal(m.positions, k.positions, 24 * (size_t)m.vertex_count);
    assert_int_equal(qw_get_coarse(fresh, &coarse[0]), QW_OK),
        assert_int_equal(qw_get_coarse(resumed, &coarse[1]), QW_OK);
    assert_memory_equal(coarse[0].positions, coarse[1].positions, 24 * (size_t)coarse[0].vertex_count);
    o.subdivide = 0, o.fit_to = 0, o.threads = 2; /* and back */
    qw_context *plain = run_of(&s, &o);
    assert_int_equal(qw_run(resumed, &o), QW_OK);
    m = result_of(plain), k = result_of(resumed);
    assert_memory_equal(m.positions, k.positions, 24 * (size_t)m.vertex_count);
    qw_destroy(fresh), qw_destroy(again), qw_destroy(resumed), qw_destroy(plain);
    remove("levels_dump.qws");
    shape_free(&s);
}

/* ---- levels of detail */

static char *text_of(const char *path)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *text = calloc(1, 1 << 22);
    assert_true(fread(text, 1, (1 << 22) - 1, file) > 0);
    fclose(file);
    return text;
}

static bool has_text(const char *bytes, size_t size, const char *wanted)
{
    size_t length = strlen(wanted);
    for (size_t i = 0; i + length <= size; i++)
        if (memcmp(bytes + i, wanted, length) == 0) return true;
    return false;
}

/* Each level has the bytes of a fresh run, though what depends on the surface alone is done once; one file holds all.
 */
static void levels_share_a_context_and_a_file(void **state)
{
    (void)state;
    static const int64_t counts[3] = {400, 150, 110};
    shape s = shape_double_torus(4);
    qw_options o = asking(counts[0], 0, 0);
    qw_context *context = run_of(&s, &o);
    double cleaning = qw_get_report(context)->stages[QW_STAGE_CLEAN].seconds;
    qw_mesh *level[3], *loaded;
    for (int i = 0; i < 3; i++) {
        o.faces = counts[i];
        assert_int_equal(qw_run(context, &o), QW_OK);
        assert_true(qw_get_report(context)->stages[QW_STAGE_CLEAN].seconds == cleaning);
        assert_int_equal(qw_take_level(context, NULL, 0, &level[i]), QW_OK);
    }
    qw_destroy(context);
    for (int i = 0; i < 3; i++) {
        o.faces = counts[i];
        qw_context *fresh = run_of(&s, &o);
        qw_mesh_view m = result_of(fresh), n = qw_mesh_get(level[i]);
        assert_true(m.vertex_count == n.vertex_count && m.face_count == n.face_count);
        assert_memory_equal(m.positions, n.positions, 24 * (size_t)m.vertex_count);
        assert_memory_equal(m.corners, n.corners, 16 * (size_t)m.face_count);
        qw_destroy(fresh);
    }
    const qw_mesh *const all[3] = {level[0], level[1], level[2]};
    char message[256];
    assert_int_equal(qw_save_levels(all, 3, NULL, "levels.obj", QW_FORMAT_AUTO, message, sizeof message),
                     QW_UNSUPPORTED);
    assert_int_equal(qw_save_levels(all, 3, NULL, "levels.glb", QW_FORMAT_AUTO, message, sizeof message), QW_OK);
    char *bytes = text_of("levels.glb");
    assert_true(has_text(bytes, 4096, "\"MSFT_lod\":{\"ids\":[1,2]}"));
    free(bytes);
    assert_int_equal(qw_load("levels.glb", NULL, &loaded), QW_OK);
    assert_int_equal(qw_mesh_get(loaded).face_count, qw_mesh_get(level[0]).face_count); /* the scene shows the first */
    qw_mesh_destroy(loaded);
    for (int i = 0; i < 3; i++) qw_mesh_destroy(level[i]);
    remove("levels.glb");
    shape_free(&s);
}

/* The levels of a mesh whose file has materials and images keep these, once. */
static void levels_keep_what_a_file_looks_like(void **state)
{
    (void)state;
    shape s = shape_sphere(8);
    qw_options o = asking(100, 0, 0);
    qw_mesh *source, *level[2];
    qw_asset_options maps;
    qw_asset_report report;
    const qw_attribute *carried;
    const qw_image *images;
    uint32_t count, given;
    qw_attribute uv;
    qw_context *context = run_of(&s, &o);
    qw_mesh_view view = shape_view(&s);
    qw_asset_options_init(&maps);
    maps.texture = 64;
    assert_int_equal(qw_mesh_wrap(&view, NULL, 0, NULL, NULL, NULL, &source), QW_OK);
    assert_int_equal(qw_unwrap(context, &maps, NULL, &uv, &report), QW_OK);
    assert_int_equal(qw_bake(context, source, 1u << QW_MAP_NORMAL, &images, &count, &report), QW_OK);
    assert_int_equal(qw_save_asset(context, &uv, 1, "clothed.glb", QW_FORMAT_AUTO), QW_OK);
    qw_destroy(context), qw_mesh_destroy(source);
    assert_int_equal(qw_load("clothed.glb", NULL, &source), QW_OK);
    view = qw_mesh_get(source);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    for (int i = 0; i < 2; i++) {
        o.faces = i ? 40 : 80;
        assert_int_equal(qw_run(context, &o), QW_OK);
        const qw_attribute *attributes = qw_mesh_attributes(source, &given);
        qw_transfer_report told = {.size = sizeof told};
        assert_int_equal(qw_transfer(context, attributes, given, 0, &carried, &told), QW_OK);
        assert_int_equal(qw_take_level(context, carried, given, &level[i]), QW_OK);
    }
    const qw_mesh *const both[2] = {level[0], level[1]};
    assert_int_equal(qw_save_levels(both, 2, source, "levels.glb", QW_FORMAT_AUTO, NULL, 0), QW_OK);
    char *bytes = text_of("levels.glb");
    assert_true(has_text(bytes, 4096, "\"images\":[{\"name\":\"normal\",\"bufferView\":0"));
    assert_true(has_text(bytes, 4096, "\"normalTexture\":{\"index\":0}") && has_text(bytes, 4096, "\"material\":0"));
    assert_true(has_text(bytes, 4096, "\"TEXCOORD_0\"") && has_text(bytes, 4096, "\"MSFT_lod\":{\"ids\":[1]}"));
    free(bytes);
    for (int i = 0; i < 2; i++) qw_mesh_destroy(level[i]);
    qw_destroy(context), qw_mesh_destroy(source);
    remove("levels.glb"), remove("clothed.glb");
    shape_free(&s);
}

/* ---- for simulation */

/* Fields of INP hold 20 characters, and CalculiX refuses longer ones. */
static void fields_of_inp_are_short(void **state)
{
    (void)state;
    static const double at[12] = {-1.5000000000000002e-8, 0, 0, 1, -2.2250738585072014e-308, 0, 1, 1, 0, 0, 1, 1.0 / 3};
    static const uint32_t corner[4] = {0, 1, 2, 3};
    const qw_mesh_view view = {.size = sizeof view,
                               .vertex_count = 4,
                               .face_count = 1,
                               .uniform_face_size = 4,
                               .positions = at,
                               .corners = corner};
    qw_mesh *mesh;
    assert_int_equal(qw_mesh_wrap(&view, NULL, 0, NULL, NULL, NULL, &mesh), QW_OK);
    assert_int_equal(qw_mesh_save(mesh, "levels.inp", QW_FORMAT_INP), QW_OK);
    char *text = text_of("levels.inp");
    assert_non_null(strstr(text, "\n1, -1.500000000000E-08, 0, 0\n"));
    for (const char *field = strstr(text, "*NODE"); *field;
         field += strcspn(field, ",\n") + (field[strcspn(field, ",\n")] != 0))
        if (*field == ' ') assert_true(strcspn(field + 1, ",\n") <= 20);
    free(text);
    qw_mesh_destroy(mesh);
    remove("levels.inp");
}

static void elements_are_written(void **state)
{
    (void)state;
    static const struct {
        const char *path, *has[4];
    } files[] = {
        {"levels.msh", {"$MeshFormat\n4.1 0 8", "\"boundary_1\"", "\n2 1 16 ", "$EndElements"}},
        {"levels.vtu", {"<VTKFile", "\n23\n", "line_set", "</VTKFile>"}},
        {"levels.inp", {"*NODE", "TYPE=S8R", "*NSET, NSET=boundary_1", "\n1, "}},
        {"levels.bdf", {"GRID*", "CQUAD8", "PLOTEL", "ENDDATA"}},
    };
    static const char *const first_order[4] = {"\n2 1 3 ", "\n9\n", "TYPE=S4", "CQUAD4"};
    shape s = shape_disc(16);
    qw_options o = asking(60, 1, 0);
    qw_context *context = run_of(&s, &o);
    for (int i = 0; i < 4; i++) {
        qw_format format = (qw_format)(QW_FORMAT_MSH + i);
        assert_int_equal(qw_save_second_order(context, NULL, 0, files[i].path, format), QW_OK);
        char *text = text_of(files[i].path);
        for (int k = 0; k < 4; k++)
            if (!strstr(text, files[i].has[k])) fail_msg("%s lacks %s", files[i].path, files[i].has[k]);
        free(text);
        assert_int_equal(qw_save_mesh(context, files[i].path, QW_FORMAT_AUTO), QW_OK);
        text = text_of(files[i].path);
        if (!strstr(text, first_order[i])) fail_msg("%s lacks %s", files[i].path, first_order[i]);
        free(text);
        remove(files[i].path);
    }
    assert_int_equal(qw_save_second_order(context, NULL, 0, "levels.obj", QW_FORMAT_OBJ), QW_ARGUMENT);
    o.subdivide = 0;
    assert_int_equal(qw_run(context, &o), QW_OK);
    assert_int_equal(qw_save_second_order(context, NULL, 0, "levels.msh", QW_FORMAT_MSH), QW_ARGUMENT);
    qw_destroy(context);
    shape_free(&s);
}

/* Known figures of single quads: a square, a rectangle of 1 by 3, a rhombus of 30 degrees, a square with one corner up.
 */
static void shapes_of_elements_are_measured(void **state)
{
    (void)state;
    static const double known[4][4] = {{1, 0, 1, 0}, {1, 0, 2, 0}, {0.5, 0, 2, 0}, {0, 0, 0, 0}};
    for (int i = 0; i < 4; i++) {
        double x = i == 1 ? 3 : 1, shift = i == 2 ? sqrt(0.75) : 0, height = i == 2 ? 0.5 : 1, up = i == 3;
        const double position[12] = {0, 0, 0, x, 0, 0, x + shift, height, up, shift, height, 0};
        const uint32_t corner[4] = {0, 1, 2, 3};
        qw_mesh_view m = {.size = sizeof m, .vertex_count = 4, .face_count = 1, .uniform_face_size = 4};
        m.positions = position, m.corners = corner;
        qw_topology t;
        qw_quality q;
        assert_int_equal(qw_measure(&m, NULL, NULL, &t, &q), QW_OK);
        if (i < 3) {
            assert_true(fabs(q.min_scaled_jacobian - known[i][0]) < 1e-12 && q.low_jacobian == known[i][1]);
            assert_true(fabs(q.mean_scaled_jacobian - known[i][0]) < 1e-12);
            assert_true(fabs(q.max_aspect - known[i][2]) < 1e-12 && q.mean_aspect == q.max_aspect);
            assert_true(fabs(q.max_warp - known[i][3]) < 1e-12);
        } else {
            assert_true(q.max_warp > 0.2 && q.max_warp < 1);
        }
    }
}

/* What cannot be split is refused before quads are made. */
static void too_many_are_refused_at_once(void **state)
{
    (void)state;
    shape s = shape_disc(16);
    qw_options o = asking(20000000, 6, 0);
    qw_mesh_view view = shape_view(&s);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run_until(context, &o, QW_STAGE_CORE), QW_TOO_LARGE);
    o.faces = 100, o.fix_boundary = 1;
    assert_int_equal(qw_run_until(context, &o, QW_STAGE_CORE), QW_OPTION);
    o.fix_boundary = 0;
    assert_int_equal(qw_run_until(context, &o, QW_STAGE_CORE), QW_OK);
    qw_destroy(context);
    shape_free(&s);
}

QW_TEST_SUITE(levels)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(split_quads_are_not_flipped),
        cmocka_unit_test(quads_are_split_and_lie_nearer),
        cmocka_unit_test(mended_levels_are_nested),
        cmocka_unit_test(sharp_edges_stay),
        cmocka_unit_test(boundaries_that_stay_are_not_split),
        cmocka_unit_test(too_many_are_refused_at_once),
        cmocka_unit_test(symmetric_results_stay_so),
        cmocka_unit_test(limits_come_nearer),
        cmocka_unit_test(creases_are_written),
        cmocka_unit_test(patches_are_written),
        cmocka_unit_test(cavities_are_voids),
        cmocka_unit_test(planes_are_written),
        cmocka_unit_test(bytes_are_those_of_a_fresh_run),
        cmocka_unit_test(levels_share_a_context_and_a_file),
        cmocka_unit_test(levels_keep_what_a_file_looks_like),
        cmocka_unit_test(fields_of_inp_are_short),
        cmocka_unit_test(elements_are_written),
        cmocka_unit_test(shapes_of_elements_are_measured),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
