/* Boundaries that stay as they are, and regions that are remeshed alone: each result is looked at through positions
 * alone, as a caller who sews it back would. */
#include "suite.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- meshes by positions */

typedef struct place {
    double p[3];
    uint32_t vertex;
} place;

static int compare_places(const void *a, const void *b)
{
    const place *s = a, *t = b;
    int order = memcmp(s->p, t->p, sizeof s->p);
    return order ? order : s->vertex < t->vertex ? -1 : s->vertex > t->vertex;
}

static uint32_t size_of(const qw_mesh_view *m, uint32_t f)
{
    return m->face_sizes ? m->face_sizes[f] : m->uniform_face_size;
}

typedef struct edge {
    uint32_t from, to;
} edge;

static int compare_edges(const void *a, const void *b)
{
    const edge *s = a, *t = b;
    if (s->from != t->from) return s->from < t->from ? -1 : 1;
    return s->to != t->to ? s->to < t->to ? -1 : 1 : 0;
}

/* The boundary edges of a mesh, with their direction, in order. The caller's to free. */
static edge *rim_of(const qw_mesh_view *m, size_t *count)
{
    size_t corners = 0, c = 0, kept = 0;
    for (uint32_t f = 0; f < m->face_count; f++) corners += size_of(m, f);
    edge *all = malloc(corners * sizeof *all);
    for (uint32_t f = 0; f < m->face_count; c += size_of(m, f++))
        for (uint32_t i = 0; i < size_of(m, f); i++)
            all[c + i] = (edge){m->corners[c + i], m->corners[c + (i + 1) % size_of(m, f)]};
    qsort(all, corners, sizeof *all, compare_edges);
    edge *rim = malloc(corners * sizeof *rim);
    for (size_t i = 0; i < corners; i++) {
        edge back = {all[i].to, all[i].from};
        if (!bsearch(&back, all, corners, sizeof *all, compare_edges)) rim[kept++] = all[i];
    }
    free(all);
    *count = kept;
    return rim;
}

typedef struct rim_edge {
    double from[3], to[3];
} rim_edge;

static int compare_rim_edges(const void *a, const void *b) { return memcmp(a, b, sizeof(rim_edge)); }

/* The same as pairs of positions, in order. */
static rim_edge *rim_positions(const qw_mesh_view *m, size_t *count)
{
    edge *rim = rim_of(m, count);
    rim_edge *r = malloc(*count * sizeof *r + 1);
    for (size_t i = 0; i < *count; i++) {
        memcpy(r[i].from, m->positions + 3 * (size_t)rim[i].from, sizeof r->from);
        memcpy(r[i].to, m->positions + 3 * (size_t)rim[i].to, sizeof r->to);
    }
    qsort(r, *count, sizeof *r, compare_rim_edges);
    free(rim);
    return r;
}

/* To the bit: the same vertices, joined by the same edges in the same direction. */
static void assert_same_rim(const qw_mesh_view *a, const qw_mesh_view *b)
{
    size_t n, m;
    rim_edge *p = rim_positions(a, &n), *q = rim_positions(b, &m);
    assert_int_equal(n, m);
    assert_memory_equal(p, q, n * sizeof *p);
    free(p), free(q);
}

static qw_topology measured(const qw_mesh_view *m, qw_quality *quality)
{
    qw_topology t;
    qw_quality q;
    assert_int_equal(qw_measure(m, NULL, NULL, &t, quality ? quality : &q), QW_OK);
    return t;
}

static void assert_clean(const qw_topology *t)
{
    assert_int_equal(t->nonmanifold_edges + t->nonmanifold_vertices + t->inconsistent_edges + t->isolated_vertices, 0);
    assert_int_equal(t->degenerate_faces + t->duplicate_faces, 0);
}

/* ---- running */

static qw_context *context_with(const qw_mesh_view *view)
{
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, view), QW_OK);
    return context;
}

static qw_options options_for(int64_t faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces, options.fix_boundary = 1, options.threads = 1;
    return options;
}

static void run(qw_context *context, const qw_options *options)
{
    if (qw_run(context, options) != QW_OK) fail_msg("%s", qw_message(context));
}

/* ---- rims */

/* Rims much finer than the quads, as fine, and coarser; of one loop and of two whose numbers of edges are odd. */
static void a_rim_stays_to_the_bit(void **state)
{
    (void)state;
    shape shapes[] = {shape_disc(24), shape_disc(7), shape_annulus(7), shape_annulus(12), shape_disc(40)};
    static const int64_t faces[] = {120, 500, 2000};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++)
        for (size_t k = 0; k < sizeof faces / sizeof *faces; k++) {
            qw_mesh_view view = shape_view(&shapes[i]), quads;
            qw_topology before = measured(&view, NULL);
            qw_context *context = context_with(&view);
            qw_options options = options_for(faces[k]);
            run(context, &options);
            qw_get_mesh(context, &quads);
            assert_same_rim(&view, &quads);
            qw_quality quality;
            qw_topology after = measured(&quads, &quality);
            assert_clean(&after);
            assert_int_equal(after.quads, after.faces);
            assert_int_equal(after.euler, before.euler);
            assert_int_equal(after.boundary_loops, before.boundary_loops);
            assert_int_equal(quality.negative_corners, 0);
            assert_int_equal(qw_get_report(context)->rim_vertices, before.boundary_edges);
            assert_int_equal(qw_get_report(context)->kept_faces, 0);
            qw_destroy(context);
        }
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) shape_free(&shapes[i]);
}

/* An annulus whose outer rim has 41 edges, and whose inner rim 43: rows of quads between them give each loop its
 * parity. */
static shape uneven_annulus(uint32_t outer, uint32_t inner)
{
    shape s = {outer + inner, outer + inner, malloc(3 * (outer + inner) * sizeof(double)),
               malloc(3 * (outer + inner) * sizeof(uint32_t))};
    for (uint32_t v = 0; v < outer + inner; v++) {
        double a = 6.283185307179586 * (v < outer ? (double)v / outer : (double)(v - outer) / inner),
               r = v < outer ? 1 : 0.5;
        s.position[3 * v] = r * cos(a), s.position[3 * v + 1] = r * sin(a), s.position[3 * v + 2] = 0.1 * sin(2 * a);
    }
    for (uint32_t i = 0, j = 0, f = 0; f < outer + inner; f++) {
        uint32_t *c = s.corner + 3 * f;
        bool on = j >= inner || (i < outer && (double)(i + 1) / outer <= (double)(j + 1) / inner);
        c[0] = i % outer, c[1] = on ? (i + 1) % outer : outer + (j + 1) % inner, c[2] = outer + j % inner;
        if (on) i++;
        else j++;
    }
    return s;
}

static void odd_rims_of_one_component_go_together(void **state)
{
    (void)state;
    shape s = uneven_annulus(41, 43);
    qw_mesh_view view = shape_view(&s), quads;
    for (int64_t faces = 100; faces < 500; faces += 57) {
        qw_context *context = context_with(&view);
        qw_options options = options_for(faces);
        run(context, &options);
        qw_get_mesh(context, &quads);
        assert_same_rim(&view, &quads);
        qw_topology t = measured(&quads, NULL);
        assert_clean(&t);
        assert_int_equal(t.quads, t.faces);
        assert_int_equal(t.euler, 0);
        qw_destroy(context);
    }
    shape_free(&s);
}

/* Quads alone have no odd rim: one triangle of the input stays. */
static void an_odd_rim_keeps_a_triangle(void **state)
{
    (void)state;
    shape s = uneven_annulus(41, 20), tiny = shape_one_triangle(1);
    s.position = realloc(s.position, 3 * (size_t)(s.vertex_count + 1) * sizeof(double));
    s.corner = realloc(s.corner, 3 * (size_t)(s.face_count + 20) * sizeof(uint32_t));
    for (uint32_t i = 0; i < 20; i++) { /* the hole is closed */
        uint32_t *c = s.corner + 3 * s.face_count++;
        c[0] = 41 + i, c[1] = 41 + (i + 1) % 20, c[2] = s.vertex_count;
    }
    s.position[3 * s.vertex_count] = s.position[3 * s.vertex_count + 1] = s.position[3 * s.vertex_count + 2] = 0;
    s.vertex_count++;
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    qw_options options = options_for(200);
    run(context, &options);
    qw_get_mesh(context, &quads);
    assert_same_rim(&view, &quads);
    qw_topology t = measured(&quads, NULL);
    assert_clean(&t);
    assert_int_equal(t.triangles, 1);
    assert_int_equal(t.quads, t.faces - 1);
    assert_int_equal(t.euler, 1);
    assert_int_equal(qw_get_report(context)->kept_faces, 1);
    uint32_t beside[3], alone = s.face_count; /* a component that is one triangle stays, beside others */
    s.corner = realloc(s.corner, 3 * (size_t)(s.face_count + 1) * sizeof(uint32_t));
    s.position = realloc(s.position, 3 * (size_t)(s.vertex_count + 3) * sizeof(double));
    for (uint32_t i = 0; i < 3; i++) {
        double *p = s.position + 3 * (size_t)(s.vertex_count + i);
        p[0] = 3 + (i == 1), p[1] = i == 2, p[2] = 0, beside[i] = s.vertex_count + i;
    }
    memcpy(s.corner + 3 * (size_t)alone, beside, 3 * sizeof *beside);
    s.vertex_count += 3, s.face_count++;
    view = shape_view(&s);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    run(context, &options);
    qw_get_mesh(context, &quads);
    assert_same_rim(&view, &quads);
    assert_int_equal(measured(&quads, NULL).triangles, 2);
    view = shape_view(&tiny);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "cannot stay as it is: it has 3 edges"));
    options.fix_boundary = 0;
    run(context, &options);
    qw_destroy(context);
    shape_free(&s), shape_free(&tiny);
}

/* A closed surface has no rim, and nothing changes. */
static void without_a_rim_nothing_changes(void **state)
{
    (void)state;
    shape s = shape_torus(10);
    qw_mesh_view view = shape_view(&s), a, b;
    qw_context *fixed = context_with(&view), *plain = context_with(&view);
    qw_options options = options_for(300);
    run(fixed, &options);
    options.fix_boundary = 0;
    run(plain, &options);
    qw_get_mesh(fixed, &a), qw_get_mesh(plain, &b);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_memory_equal(a.positions, b.positions, 3 * a.vertex_count * sizeof *a.positions);
    qw_destroy(fixed), qw_destroy(plain);
    shape_free(&s);
}

/* A bent plate with slots about as wide as a quad, whose rims are finer: without room no quad around a slot's end keeps
 * its corners. */
static shape plate_with_slots(void)
{
    enum { N = 80 };
    shape s = {0, 0, malloc((N + 1) * (N + 1) * 3 * sizeof(double)), malloc(2 * N * N * 3 * sizeof(uint32_t))};
    uint32_t *number = malloc((N + 1) * (N + 1) * sizeof *number);
    memset(number, 0xff, (N + 1) * (N + 1) * sizeof *number);
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t j = 0; j < N; j++) {
            double x = i % 20 + 0.5 - 10, y = j + 0.5 < 55 ? 0 : j + 0.5 - 55;
            if (j > 8 && x * x + y * y < 9) continue;
            uint32_t v[4] = {i * (N + 1) + j, (i + 1) * (N + 1) + j, (i + 1) * (N + 1) + j + 1, i * (N + 1) + j + 1};
            for (int k = 0; k < 4; k++)
                if (number[v[k]] == UINT32_MAX) {
                    double *p = s.position + 3 * (size_t)s.vertex_count, a = 0.03 * (double)(v[k] % (N + 1));
                    p[0] = v[k] / (N + 1), p[1] = 33 * sin(a), p[2] = 33 * cos(a), number[v[k]] = s.vertex_count++;
                }
            shape_square(&s, number[v[0]], number[v[1]], number[v[2]], number[v[3]], (i + j) & 1);
        }
    free(number);
    return s;
}

static void slots_keep_their_corners(void **state)
{
    (void)state;
    shape s = plate_with_slots();
    qw_mesh_view view = shape_view(&s), quads;
    qw_topology before = measured(&view, NULL);
    for (int64_t faces = 200; faces <= 3200; faces *= 2) {
        qw_context *context = context_with(&view);
        qw_options options = options_for(faces);
        run(context, &options);
        qw_get_mesh(context, &quads);
        assert_same_rim(&view, &quads);
        qw_quality quality;
        qw_topology t = measured(&quads, &quality);
        assert_clean(&t);
        const qw_report *report = qw_get_report(context);
        assert_int_equal(quality.negative_corners, 0);
        bool is_more = t.faces > 1.1 * (double)faces;
        assert_int_equal(is_more, report->warning_count > 0 && strstr(report->warnings[0], "vertices that stay"));
        assert_true(t.faces > 0.9 * (double)faces && (!is_more || t.faces < 2.5 * before.boundary_edges));
        qw_destroy(context);
    }
    shape_free(&s);
}

/* ---- sewing by hand */

/* Faces of a torus on one side of a slanting plane. */
static bool is_inside(const shape *s, uint32_t f)
{
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        const double *p = s->position + 3 * (size_t)s->corner[3 * f + (uint32_t)i];
        sum += p[0] + 0.3 * p[1] - 0.4 * p[2];
    }
    return sum > 0.9;
}

/* The inside remeshed alone, and sewn to the outside where positions are the same to the bit. */
static void a_region_is_sewn_back(void **state)
{
    (void)state;
    shape s = shape_torus(14);
    shape cut = {s.vertex_count, 0, s.position, malloc(3 * (size_t)s.face_count * sizeof(uint32_t))};
    for (uint32_t f = 0; f < s.face_count; f++)
        if (is_inside(&s, f)) memcpy(cut.corner + 3 * (size_t)cut.face_count++, s.corner + 3 * (size_t)f, 12);
    qw_mesh_view view = shape_view(&cut), quads;
    qw_context *context = context_with(&view);
    qw_options options = options_for(150);
    run(context, &options);
    qw_get_mesh(context, &quads);
    uint32_t outside = s.face_count - cut.face_count, vertices = s.vertex_count + quads.vertex_count, corners = 0;
    double *position = malloc(3 * (size_t)vertices * sizeof *position);
    uint32_t *size = malloc((outside + quads.face_count) * sizeof *size),
             *corner = malloc((3 * (size_t)outside + 4 * (size_t)quads.face_count) * sizeof *corner), faces = 0;
    memcpy(position, s.position, 3 * (size_t)s.vertex_count * sizeof *position);
    memcpy(position + 3 * (size_t)s.vertex_count, quads.positions, 3 * (size_t)quads.vertex_count * sizeof *position);
    for (uint32_t f = 0; f < s.face_count; f++) {
        if (is_inside(&s, f)) continue;
        memcpy(corner + corners, s.corner + 3 * (size_t)f, 12), corners += 3, size[faces++] = 3;
    }
    for (uint32_t f = 0, c = 0; f < quads.face_count; c += size_of(&quads, f++)) {
        size[faces] = size_of(&quads, f);
        for (uint32_t i = 0; i < size[faces]; i++) corner[corners++] = s.vertex_count + quads.corners[c + i];
        faces++;
    }
    place *places = malloc(vertices * sizeof *places); /* sewn by sorting */
    uint32_t *to = malloc(vertices * sizeof *to);
    for (uint32_t v = 0; v < vertices; v++) {
        memcpy(places[v].p, position + 3 * (size_t)v, sizeof places->p);
        places[v].vertex = v;
    }
    qsort(places, vertices, sizeof *places, compare_places);
    for (uint32_t i = 0; i < vertices; i++)
        to[places[i].vertex] = i > 0 && memcmp(places[i].p, places[i - 1].p, sizeof places->p) == 0
                                   ? to[places[i - 1].vertex]
                                   : places[i].vertex;
    for (uint32_t c = 0; c < corners; c++) corner[c] = to[corner[c]];
    qw_mesh_view sewn = {sizeof sewn, vertices, faces, 0, position, size, corner, NULL, 0};
    qw_topology t = measured(&sewn, NULL);
    t.isolated_vertices = 0; /* those of the old inside, and those that were sewn */
    assert_clean(&t);
    assert_int_equal(t.boundary_edges, 0);
    assert_int_equal(t.components, 1);
    size_t open;
    free(rim_of(&sewn, &open));
    assert_int_equal(open, 0);
    uint32_t used = 0;
    uint8_t *seen = calloc(vertices, 1);
    for (uint32_t c = 0; c < corners; c++) used += !seen[corner[c]], seen[corner[c]] = 1;
    assert_int_equal((int64_t)used - corners / 2 + faces, 0); /* still a torus */
    qw_destroy(context);
    free(position), free(size), free(corner), free(places), free(to), free(seen), free(cut.corner);
    shape_free(&s);
}

/* ---- regions */

static uint8_t *inside_of(const shape *s)
{
    uint8_t *inside = malloc(s->face_count);
    for (uint32_t f = 0; f < s->face_count; f++) inside[f] = is_inside(s, f);
    return inside;
}

/* The rest keeps its triangles, with the same corners in the same order, behind the quads. */
static void a_region_is_joined_to_the_rest(void **state)
{
    (void)state;
    shape s = shape_torus(14);
    uint8_t *inside = inside_of(&s);
    qw_mesh_view view = shape_view(&s), whole;
    qw_context *context = context_with(&view);
    qw_options options = options_for(150);
    options.fix_boundary = 0; /* the region implies it */
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_OK);
    run(context, &options);
    qw_get_mesh(context, &whole);
    qw_topology t = measured(&whole, NULL);
    assert_clean(&t);
    assert_int_equal(t.boundary_edges, 0);
    assert_int_equal(t.euler, 0);
    assert_int_equal(t.components, 1);
    assert_in_range(t.quads, 100, 300);
    qw_provenance provenance;
    assert_int_equal(qw_get_provenance(context, &provenance), QW_OK);
    uint32_t last = 0, outside = 0;
    for (uint32_t f = 0; f < s.face_count; f++) outside += !inside[f];
    assert_in_range(t.triangles, outside, outside + 1);
    for (uint32_t f = (uint32_t)t.quads, c = 4 * f; f < whole.face_count; f++) {
        assert_int_equal(whole.face_sizes[f], 3);
        uint32_t of = provenance.corners[c].face;
        assert_true(of > last || (of == 0 && last == 0));
        outside -= !inside[of], last = of;
        for (int i = 0; i < 3; i++, c++)
            assert_memory_equal(whole.positions + 3 * (size_t)whole.corners[c],
                                s.position + 3 * (size_t)s.corner[3 * of + (uint32_t)i], 3 * sizeof(double));
    }
    assert_int_equal(outside, 0);
    assert_int_equal(qw_get_report(context)->kept_faces, t.triangles);
    assert_int_equal(qw_set_region(context, NULL, 0), QW_OK); /* and away again */
    run(context, &options);
    qw_get_mesh(context, &whole);
    t = measured(&whole, NULL);
    assert_int_equal(t.quads, t.faces);
    qw_destroy(context);
    free(inside), shape_free(&s);
}

/* Beside teeth of a rim quads were flipped. Where they are, the teeth stay triangles, and a note says how many. */
static void teeth_stay_where_quads_would_be_flipped(void **state)
{
    (void)state;
    qw_mesh *file;
    assert_int_equal(qw_load(QW_TEST_DATA "/regress/ragged_region.ply", NULL, &file), QW_OK);
    qw_mesh_view view = qw_mesh_get(file), whole;
    uint8_t *inside = calloc(view.face_count, 1);
    assert_int_equal(qw_mesh_region(file, "part=1", inside), QW_OK);
    qw_context *context = context_with(&view);
    qw_options options = options_for(40);
    options.fix_boundary = 0;
    assert_int_equal(qw_set_region(context, inside, view.face_count), QW_OK);
    run(context, &options);
    qw_get_mesh(context, &whole);
    qw_topology t;
    qw_quality quality;
    assert_int_equal(qw_measure(&whole, &view, NULL, &t, &quality), QW_OK);
    assert_int_equal(quality.flipped_faces, 0);
    const qw_report *r = qw_get_report(context);
    bool is_said = false;
    for (int64_t i = 0; i < r->warning_count; i++) is_said |= strstr(r->warnings[i], "two edges on the rim") != NULL;
    assert_true(is_said && t.euler == 1 && t.triangles == r->kept_faces);
    qw_destroy(context), qw_mesh_destroy(file);
    free(inside);
}

static void describe_attributes(const shape *s, const float *height, const float *uv, const int32_t *label,
                                qw_attribute in[3])
{
    in[0] = (qw_attribute){.size = sizeof *in,
                           .name = "height",
                           .domain = QW_PER_VERTEX,
                           .kind = QW_VALUES,
                           .components = 1,
                           .count = s->vertex_count,
                           .values = height};
    in[1] = (qw_attribute){.size = sizeof *in,
                           .name = "uv",
                           .domain = QW_PER_CORNER,
                           .kind = QW_UVS,
                           .components = 2,
                           .count = 3 * s->face_count,
                           .values = uv};
    in[2] = (qw_attribute){.size = sizeof *in,
                           .name = "part",
                           .domain = QW_PER_FACE,
                           .kind = QW_LABELS,
                           .components = 1,
                           .count = s->face_count,
                           .labels = label};
}

/* Labels, and values of vertices and corners, of the rest are those that it had; a quad's lies between those around. */
/* How many vertices of the input that no face inside has are in the result, with all their digits; *all: of how many.
 */
static uint32_t count_far(const shape *s, const uint8_t *inside, const qw_mesh_view *m, uint32_t *all)
{
    uint8_t *touched = calloc(s->vertex_count, 1);
    uint32_t found = 0;
    *all = 0;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) touched[s->corner[h]] |= inside[h / 3];
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        if (touched[v]) continue;
        bool is_there = false;
        for (uint32_t u = 0; u < m->vertex_count && !is_there; u++)
            is_there = !memcmp(m->positions + 3 * (size_t)u, s->position + 3 * (size_t)v, 3 * sizeof(double));
        found += is_there, (*all)++;
    }
    free(touched);
    return found;
}

/* A rim of many vertices takes many quads where it stays, which is said first; cut anew, the region has
   what was asked for, the whole is as closed as it was, and vertices away from the rim keep all their digits. */
static void a_rim_is_cut_anew(void **state)
{
    (void)state;
    shape s = shape_cube(16);
    uint8_t *inside = calloc(s.face_count, 1);
    memset(inside, 1, s.face_count / 6); /* one side */
    qw_mesh_view view = shape_view(&s), m;
    for (int32_t rim = 0; rim < 2; rim++) {
        qw_context *context;
        qw_options options;
        qw_options_init(&options);
        options.faces = 30, options.region_rim = rim;
        assert_int_equal(qw_create(NULL, &context), QW_OK);
        assert_int_equal(qw_set_mesh(context, &view), QW_OK);
        assert_int_equal(qw_set_region(context, inside, s.face_count), QW_OK);
        if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
        assert_int_equal(qw_get_mesh(context, &m), QW_OK);
        const qw_report *r = qw_get_report(context);
        qw_topology t;
        qw_quality q;
        uint32_t all, far = count_far(&s, inside, &m, &all);
        assert_int_equal(qw_measure(&m, NULL, NULL, &t, &q), QW_OK);
        assert_int_equal(far, all);
        assert_int_equal(t.euler, 2), assert_int_equal(t.boundary_loops, 0), assert_int_equal(t.components, 1);
        assert_int_equal(t.nonmanifold_edges + t.nonmanifold_vertices + t.degenerate_faces + t.inconsistent_edges, 0);
        int64_t quads = (int64_t)m.face_count - r->kept_faces;
        bool is_right = rim ? quads <= 40
                            : quads > 100 && r->warning_count > 0 &&
                                  strstr(r->warnings[0], "quads at the least") != NULL;
        if (!is_right) fail_msg("%d quads, %s", (int)quads, r->warning_count ? r->warnings[0] : "nothing said");
        qw_destroy(context);
    }
    free(inside), shape_free(&s);
}

static void a_region_keeps_attributes(void **state)
{
    (void)state;
    shape s = shape_torus(14);
    uint8_t *inside = inside_of(&s);
    float *height = malloc(s.vertex_count * sizeof *height), *uv = malloc(6 * (size_t)s.face_count * sizeof *uv);
    int32_t *label = malloc(s.face_count * sizeof *label);
    for (uint32_t v = 0; v < s.vertex_count; v++) height[v] = (float)s.position[3 * v + 2];
    for (uint32_t h = 0; h < 3 * s.face_count; h++)
        for (uint32_t k = 0; k < 2; k++) uv[2 * h + k] = (float)s.position[3 * s.corner[h] + k];
    for (uint32_t f = 0; f < s.face_count; f++) label[f] = inside[f] ? 7 : (int32_t)(f % 3);
    qw_attribute in[3];
    describe_attributes(&s, height, uv, label, in);
    qw_mesh_view view = shape_view(&s), whole;
    qw_context *context = context_with(&view);
    qw_options options = options_for(200);
    options.fit = 0; /* places on the surface are compared */
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_OK);
    run(context, &options);
    qw_get_mesh(context, &whole);
    const qw_attribute *out;
    qw_provenance provenance;
    assert_int_equal(qw_transfer(context, in, 3, 0, &out, NULL), QW_OK);
    assert_int_equal(qw_get_provenance(context, &provenance), QW_OK);
    uint32_t corners = 0;
    for (uint32_t f = 0; f < whole.face_count; f++) corners += size_of(&whole, f);
    assert_int_equal(out[0].count, whole.vertex_count);
    assert_int_equal(out[1].count, corners);
    assert_int_equal(out[2].count, whole.face_count);
    assert_int_equal(provenance.vertex_count, whole.vertex_count);
    assert_int_equal(provenance.corner_count, corners);
    for (uint32_t v = 0; v < whole.vertex_count; v++)
        assert_true(fabs((double)out[0].values[v] - whole.positions[3 * v + 2]) < 0.03);
    for (uint32_t c = 0; c < corners; c++)
        for (uint32_t k = 0; k < 2; k++)
            assert_true(fabs((double)out[1].values[2 * c + k] - whole.positions[3 * whole.corners[c] + k]) < 0.03);
    uint32_t c = 0;
    for (uint32_t f = 0; f < whole.face_count; c += size_of(&whole, f++)) {
        uint32_t from = provenance.corners[c].face;
        assert_int_equal(out[2].labels[f], label[from]);
        if (size_of(&whole, f) == 4) assert_int_equal(out[2].labels[f], 7);
    }
    qw_destroy(context);
    free(inside), free(height), free(uv), free(label), shape_free(&s);
}

/* Taken up from a dump at each stage, a run gives the same bytes. */
static void a_dump_holds_a_region(void **state)
{
    (void)state;
    static const qw_stage stages[] = {QW_STAGE_CLEAN, QW_STAGE_WORKING, QW_STAGE_RELAX, QW_STAGE_FINISH};
    shape s = shape_torus(10);
    uint8_t *inside = inside_of(&s);
    qw_mesh_view view = shape_view(&s), a, b;
    qw_context *first = context_with(&view);
    qw_options options = options_for(100);
    assert_int_equal(qw_set_region(first, inside, s.face_count), QW_OK);
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
        qw_context *second;
        assert_int_equal(qw_run_until(first, &options, stages[i]), QW_OK);
        assert_int_equal(qw_dump(first, QW_BINARY_DIR "/region.qws"), QW_OK);
        assert_int_equal(qw_create(NULL, &second), QW_OK);
        if (qw_resume(second, QW_BINARY_DIR "/region.qws") != QW_OK) fail_msg("%s", qw_message(second));
        run(second, &options);
        qw_context *fresh = context_with(&view);
        assert_int_equal(qw_set_region(fresh, inside, s.face_count), QW_OK);
        run(fresh, &options);
        qw_get_mesh(fresh, &a), qw_get_mesh(second, &b);
        assert_int_equal(a.vertex_count, b.vertex_count);
        assert_int_equal(a.face_count, b.face_count);
        assert_non_null(b.face_sizes);
        assert_memory_equal(a.positions, b.positions, 3 * a.vertex_count * sizeof *a.positions);
        qw_destroy(second), qw_destroy(fresh);
    }
    qw_destroy(first);
    free(inside), shape_free(&s);
}

static void wrong_regions_are_refused(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_mesh_view view = shape_view(&s);
    uint8_t *inside = calloc(s.face_count, 1);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_NOT_READY);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_set_region(context, inside, s.face_count - 1), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "but the mesh has 576"));
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "no face is in the region"));
    inside[5] = 2;
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "face 5 is 2 in the region"));
    assert_int_equal(qw_set_region(context, NULL, 3), QW_ARGUMENT);
    memset(inside, 1, s.face_count / 2);
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_OK);
    qw_destroy(context);
    free(inside), shape_free(&s);
}

static void labels_name_regions(void **state)
{
    (void)state;
    static const char text[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\ng left\nusemtl red\nf 1 2 3 4\n"
                               "g right side\nf 2 5 6 3\n";
    qw_mesh *mesh;
    uint8_t inside[2];
    assert_int_equal(qw_load_memory(text, sizeof text - 1, NULL, &mesh), QW_OK);
    assert_int_equal(qw_mesh_region(mesh, "left", inside), QW_OK);
    assert_true(inside[0] == 1 && inside[1] == 0);
    assert_int_equal(qw_mesh_region(mesh, "group=right side", inside), QW_OK);
    assert_true(inside[0] == 0 && inside[1] == 1);
    assert_int_equal(qw_mesh_region(mesh, "material=red", inside), QW_OK);
    assert_true(inside[0] == 1 && inside[1] == 1);
    assert_int_equal(qw_mesh_region(mesh, "material=left", inside), QW_ARGUMENT);
    assert_non_null(strstr(qw_mesh_message(mesh), "no face has the label \"material=left\"; the labels are "));
    assert_non_null(strstr(qw_mesh_message(mesh), "group=left"));
    qw_mesh_destroy(mesh);
    static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                              "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
                              "property int part\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 4\n3 0 2 3 9\n";
    assert_int_equal(qw_load_memory(ply, sizeof ply - 1, NULL, &mesh), QW_OK);
    assert_int_equal(qw_mesh_region(mesh, "part=9", inside), QW_OK);
    assert_true(inside[0] == 0 && inside[1] == 1);
    assert_int_equal(qw_mesh_region(mesh, "part=5", inside), QW_ARGUMENT);
    qw_mesh_destroy(mesh);
}

/* Sheets with vertices of their own on an edge that they share by place: two of them are sewn there, in a region as
   without one, and all that lies around comes along; the third stays apart. With a rim that stays and cut anew. */
static void sheets_that_share_an_edge_by_place(void **state)
{
    (void)state;
    enum { N = 10, SHEETS = 3, VERTICES = (N + 1) * (N + 1) };
    static double position[3 * SHEETS * VERTICES];
    static uint32_t corner[6 * SHEETS * N * N];
    static uint8_t inside[2 * SHEETS * N * N];
    qw_mesh_view view = {.size = sizeof view, .uniform_face_size = 3, .positions = position, .corners = corner}, m;
    for (uint32_t s = 0; s < SHEETS; s++)
        for (uint32_t v = 0; v < VERTICES; v++) {
            double u = v % (N + 1) / (double)N, *p = position + 3 * (size_t)view.vertex_count++;
            p[0] = s == 0   ? u - 1
                   : s == 1 ? u
                            : 0,
            p[1] = v / (N + 1) / (double)N, p[2] = s == 2 ? u : u * (1 - u) / 10;
        }
    for (uint32_t s = 0; s < SHEETS; s++)
        for (uint32_t c = 0; c < N * N; c++) {
            uint32_t a = s * VERTICES + c / N * (N + 1) + c % N, d = a + N + 1;
            const uint32_t two[6] = {a, a + 1, d + 1, a, d + 1, d};
            bool is_in = fabs(position[3 * a]) < 0.45 && position[3 * a + 2] < 0.45;
            memcpy(corner + 3 * (size_t)view.face_count, two, sizeof two);
            inside[view.face_count] = inside[view.face_count + 1] = is_in;
            view.face_count += 2;
        }
    for (int32_t rim = 0; rim < 2; rim++) {
        qw_context *context = context_with(&view);
        qw_options options = options_for(60);
        options.fix_boundary = 0, options.region_rim = rim;
        assert_int_equal(qw_set_region(context, inside, view.face_count), QW_OK);
        run(context, &options);
        assert_int_equal(qw_get_mesh(context, &m), QW_OK);
        qw_topology t = measured(&m, NULL);
        assert_clean(&t);
        assert_int_equal(t.components, 2), assert_int_equal(t.boundary_loops, 2), assert_int_equal(t.euler, 2);
        qw_destroy(context);
    }
}

QW_TEST_SUITE(rims)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rim_stays_to_the_bit),
        cmocka_unit_test(odd_rims_of_one_component_go_together),
        cmocka_unit_test(an_odd_rim_keeps_a_triangle),
        cmocka_unit_test(without_a_rim_nothing_changes),
        cmocka_unit_test(a_region_is_sewn_back),
        cmocka_unit_test(a_region_is_joined_to_the_rest),
        cmocka_unit_test(teeth_stay_where_quads_would_be_flipped),
        cmocka_unit_test(a_region_keeps_attributes),
        cmocka_unit_test(a_dump_holds_a_region),
        cmocka_unit_test(slots_keep_their_corners),
        cmocka_unit_test(wrong_regions_are_refused),
        cmocka_unit_test(labels_name_regions),
        cmocka_unit_test(a_rim_is_cut_anew),
        cmocka_unit_test(sheets_that_share_an_edge_by_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
