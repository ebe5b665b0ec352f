/* Bands around closed curves: on surfaces of which the lines around are known, and in whole runs. */
#include "suite.h"
#include "quad_loops.h"
#include "shapes.h"
#include "unit_shapes.h"

#include "base/rosy.h"
#include "remesh/sizes/necks.h"
#include "remesh/sizes/nests.h"

#include <stdio.h>

enum { AROUND = 48, ALONG = 40 };

static float waist(float z) { return 1 + 0.3f * sinf(2 * z); }
static float cone(float z) { return 1.6f - 0.3f * z; }

/* A tube about z with this radius at each height, of length 4, with a ring marked half way up; its lines around are the
   parallels. */
static qw_trimesh tube_with_ring(qw_env *env, float (*radius)(float z), qw_vec3 ring[AROUND + 1])
{
    qw_trimesh m = unit_grid(env, AROUND, ALONG, true, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float a = 6.2831853f * m.position[v].x, z = 4 * m.position[v].y, r = radius(z);
        m.position[v] = qw_v3(r * cosf(a), r * sinf(a), z);
    }
    uint32_t first = AROUND * (ALONG / 2);
    for (uint32_t h = 0; h < 3 * m.face_count; h++) {
        uint32_t a = m.corner[h] - first, b = m.corner[qw_next(h)] - first;
        if (a < AROUND && b < AROUND) m.mark[h] = QW_MARKS;
    }
    for (uint32_t i = 0; i <= AROUND; i++) ring[i] = m.position[first + i % AROUND];
    return m;
}

static void directions_run_around(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_vec3 ring[AROUND + 1];
    qw_trimesh m = tube_with_ring(env, waist, ring);
    qw_nest nest = {.point = ring, .point_count = AROUND + 1, .rings = 4, .most_rings = 4};
    qw_nests nests = {1, &nest, false};
    float *size = QW_NEW(env, float, m.vertex_count);
    for (uint32_t v = 0; v < m.vertex_count; v++) size[v] = 0.4f;
    qw_fit_nests(env, &m, &nests, size);
    assert_true(nest.edge > 0.1f && nest.edge <= 0.4f);
    uint8_t *constraint = QW_NEW_ZERO(env, uint8_t, m.vertex_count);
    qw_vec3 *direction = QW_NEW_ZERO(env, qw_vec3, m.vertex_count);
    for (uint32_t i = 0; i < AROUND; i++) constraint[AROUND * (ALONG / 2) + i] = QW_VERTEX_CURVE;
    int64_t count = qw_direct_nests(env, &m, &nests, constraint, direction), found = 0;
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        qw_vec3 p = m.position[v];
        float off = fabsf(p.z - ring[0].z);
        if (qw_length2(direction[v]) == 0) {
            assert_true(off > 0.9f * nest.edge * 4); /* as wide as the rings need */
            continue;
        }
        qw_vec3 around = qw_normalize(qw_v3(-p.y, p.x, 0)); /* the way that the ring runs */
        assert_true(qw_dot(direction[v], around) > 0.995f);
        found += constraint[v] == QW_VERTEX_FREE;
    }
    assert_true(count == found && found > 2 * 4 * AROUND);
    for (uint32_t v = 1; v < m.vertex_count; v++) /* one size on each parallel */
        if (v % AROUND != 0 && qw_length2(direction[v]) > 0)
            assert_true(fabsf(size[v] / size[v - v % AROUND] - 1) < 0.05f);
    qw_env_destroy(env);
}

/* Near a limb's curve a small wanted size stays where lines get longer, and gives way where they get shorter; near a
   pocket's it gives way on both sides. */
static void small_sizes_stay_where_limbs_widen(void **state)
{
    (void)state;
    static const float near = 0.3f, small = 0.05f;
    for (uint8_t kind = QW_LIMB; kind <= QW_POCKET; kind++) {
        qw_env *env = qw_env_create(NULL, 2);
        qw_vec3 ring[AROUND + 1];
        qw_trimesh m = tube_with_ring(env, cone, ring);
        qw_nest nest = {.point = ring, .point_count = AROUND + 1, .kind = kind, .rings = 4, .most_rings = 4};
        qw_nests nests = {1, &nest, false};
        float *size = QW_NEW(env, float, m.vertex_count);
        for (uint32_t v = 0; v < m.vertex_count; v++) size[v] = v % AROUND == 5 ? small : 0.4f;
        qw_fit_nests(env, &m, &nests, size);
        uint32_t stay = 0, give_way = 0;
        for (uint32_t v = 5; v < m.vertex_count; v += AROUND) {
            float above = m.position[v].z - ring[0].z;
            if (above == 0 || fabsf(above) > near) continue;
            bool stays = kind == QW_LIMB && above < 0;
            assert_true(stays ? size[v] == small : size[v] > small);
            stays ? stay++ : give_way++;
        }
        assert_true(give_way > 0 && (stay > 0) == (kind == QW_LIMB));
        qw_env_destroy(env);
    }
}

/* ---- necks */

/* A ball with rods, each half an ellipsoid that stands on it. */
static qw_trimesh ball_with_rods(qw_env *env, int rods, float height)
{
    static const float d[][3] = {{0, 0, 1}, {1, 0, 0}, {-0.6f, 0.8f, 0}, {0, -1, 0}, {-0.6f, 0, -0.8f}};
    const float width = 0.2f;
    qw_trimesh m = unit_sphere(env, 6);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        for (int i = 0; i < rods; i++) {
            qw_vec3 at = qw_v3(d[i][0], d[i][1], d[i][2]);
            float angle = acosf(fmaxf(fminf(qw_dot(m.position[v], at), 1), -1)), t = angle / width;
            if (t < 1) m.position[v] = qw_madd(m.position[v], height * sqrtf(1 - t * t), at);
        }
    return m;
}

static void necks_are_found(void **state)
{
    (void)state;
    static const struct {
        int rods;
        float height, size;
        double strength;
        uint32_t necks;
    } rows[] = {{0, 0, 0.1f, 1, 0},       /* a ball has none */
                {5, 0.6f, 0.1f, 1, 5},    /* one a rod */
                {5, -0.6f, 0.1f, 1, 5},   /* one a pit */
                {5, 0.6f, 0.1f, 0.3, 0},  /* which are not that long */
                {5, 0.6f, 1.2f, 1, 0},    /* no six quads fit around */
                {5, 0.05f, 0.05f, 1, 0}}; /* hardly bumps */
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        qw_env *env = qw_env_create(NULL, 2);
        qw_trimesh m = ball_with_rods(env, rows[i].rods, rows[i].height);
        qw_necks necks = qw_find_necks(env, &m, (double)rows[i].size, NULL, 0, false, rows[i].strength);
        if (necks.count != rows[i].necks) fail_msg("row %zu: %u necks", i, necks.count);
        for (uint32_t k = 0; k < necks.count; k++) {
            qw_vec3 middle = qw_v3(0, 0, 0);
            for (uint32_t v = necks.begin[k]; v + 1 < necks.begin[k + 1]; v++) middle = qw_add(middle, necks.point[v]);
            float off = qw_length(middle) / (float)(necks.begin[k + 1] - necks.begin[k] - 1);
            assert_true(off > 0.5f && off < 1.5f); /* it goes around a rod */
            assert_int_equal(necks.kind[k], rows[i].height < 0);
        }
        qw_env_destroy(env);
    }
}

/* ---- whole runs */

/* A ball with bumps, and with a socket on the side of +z in which the polar angle is less than SOCKET. */
static const double SOCKET = 0.5;

static void place_on_head(double p[3])
{
    double x = p[0], y = p[1], z = p[2], bumps = 0.04 * sin(5 * x) * cos(4 * y) * cos(3 * z), angle = acos(z),
           t = angle / SOCKET, r = 1 + bumps - (t < 1 ? 0.35 * (1 - t * t) * (1 - t * t) : 0);
    p[0] = r * x, p[1] = 1.2 * r * y, p[2] = r * z;
}

/* The edges of the loop that goes straight on from h through vertices of four edges, where it closes and winds once
   around the axis within the angle; else 0. */
static uint32_t ring_from(const qw_mesh_view *q, const uint32_t *twin, uint32_t h, double most_angle, uint8_t *seen)
{
    uint32_t at = h, count = 0;
    double turn = 0;
    bool is_near = true;
    do {
        const double *a = q->positions + 3 * (size_t)q->corners[at],
                     *b = q->positions + 3 * (size_t)q->corners[next_of(at)];
        turn += remainder(atan2(b[1], b[0]) - atan2(a[1], a[0]), 6.283185307179586);
        is_near &= atan2(hypot(a[0], a[1]), a[2]) < most_angle;
        seen[at] = 1, count++;
        uint32_t out = next_of(at); /* leaves the head */
        if (valence_at_head(twin, out) != 4) return 0;
        at = next_of(twin[out]);
    } while (at != h && count < 4 * q->face_count);
    return at == h && is_near && fabs(fabs(turn) - 6.283185307179586) < 1e-6 ? count : 0;
}

/* Rings around the socket; *edges: of the one that has the most. */
static uint32_t count_rings(const qw_mesh_view *q, double most_angle, uint32_t *edges)
{
    uint32_t *twin = twins_of(q), rings = 0;
    uint8_t *seen = calloc(4 * (size_t)q->face_count, 1);
    *edges = 0;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (seen[h]) continue;
        uint32_t count = ring_from(q, twin, h, most_angle, seen);
        if (count > *edges) *edges = count;
        rings += count > 0;
    }
    free(twin), free(seen);
    return rings / 2; /* each walked both ways */
}

enum { DRAWN = 12 };

/* An oval around z on the unit sphere, of this mean angle, longer along x by that share. */
static void draw_oval(double mean, double longer, double p[DRAWN][3])
{
    for (int i = 0; i < DRAWN; i++) {
        double a = 6.283185307179586 * i / DRAWN, angle = mean * (1 + longer * cos(2 * a));
        p[i][0] = sin(angle) * cos(a), p[i][1] = sin(angle) * sin(a), p[i][2] = cos(angle);
    }
}

/* A context with the surface, and options to run it with. */
static qw_context *context_with(const shape *s, int64_t faces, qw_options *options)
{
    qw_mesh_view view = shape_view(s);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    qw_options_init(options);
    options->faces = faces, options->symmetry = 0;
    return context;
}

/* Runs with a loop of so many rings on each side; returns how many there are within the angle. */
static uint32_t rings_with_loop(qw_context *context, const qw_options *options, double p[DRAWN][3], uint32_t rings,
                                double most_angle, uint32_t *edges)
{
    qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 1, DRAWN, p[0], rings};
    qw_mesh_view quads;
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_OK);
    if (qw_run(context, options) != QW_OK) fail_msg("%s", qw_message(context));
    qw_get_mesh(context, &quads);
    return count_rings(&quads, most_angle, edges);
}

static void one_guide_gives_rings(void **state)
{
    (void)state;
    shape s = shape_sphere(24);
    for (uint32_t v = 0; v < s.vertex_count; v++) place_on_head(s.position + 3 * (size_t)v);
    double p[DRAWN][3];
    draw_oval(0.3, 0.2, p);
    for (int i = 0; i < DRAWN; i++) place_on_head(p[i]);
    qw_options options;
    qw_context *context = context_with(&s, 4000, &options);
    for (int symmetric = 0; symmetric < 2; symmetric++)
        for (uint32_t rings = 2; rings <= 4; rings++) {
            options.symmetry = symmetric ? 3 : 0; /* y; none */
            uint32_t edges, found = rings_with_loop(context, &options, p, rings, 1, &edges);
            printf("%u rings asked for: %u of up to %u edges, %d\n", rings, found, edges, symmetric);
            assert_true(found >= 2 * rings - 1 && edges >= 6);
        }
    qw_destroy(context);
    shape_free(&s);
}

/* Ovals on a plain ball: inside, where lines get shorter, there are as many rings as were asked for, but for one. */
static void ovals_have_rings_inside(void **state)
{
    (void)state;
    enum { RINGS = 4 };
    shape s = shape_sphere(32);
    qw_options options;
    qw_context *context = context_with(&s, 3000, &options);
    for (int run = 0; run < 18; run++) {
        int tenths = run % 3, symmetry = run / 6;
        double p[DRAWN][3], longer = 0.1 * tenths, mean = run % 6 < 3 ? 0.45 : 0.64;
        draw_oval(mean, longer, p);
        options.symmetry = symmetry ? symmetry + 1 : 0; /* none; x, across the longer axis; y, along it */
        uint32_t edges, found = rings_with_loop(context, &options, p, RINGS, 0.98 * mean * (1 + longer), &edges);
        printf("%.2f, longer by %d tenths, %d: %u rings inside\n", mean, tenths, symmetry, found);
        assert_true(found >= RINGS - 1 && edges >= 6);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* Of two loops that a person draws on both sides of a plane, which are never quite alike, one stands for both. */
static void loops_on_both_sides_are_one(void **state)
{
    (void)state;
    shape s = shape_sphere(32);
    qw_options options;
    qw_context *context = context_with(&s, 3000, &options);
    options.symmetry = 4; /* z */
    for (int run = 0; run < 4; run++) {
        double p[2][DRAWN][3];
        for (int side = 0; side < 2; side++) draw_oval(0.45 + 0.01 * run * side, 0.1, p[side]);
        for (int i = 0; i < DRAWN; i++) p[1][i][2] *= -1;
        const qw_guide guides[2] = {{sizeof *guides, QW_GUIDE_LOOP, 1, DRAWN, p[0][0], 4},
                                    {sizeof *guides, QW_GUIDE_LOOP, 1, DRAWN, p[1][0], 4}};
        qw_mesh_view quads;
        assert_int_equal(qw_set_guides(context, guides, 2), QW_OK);
        if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
        qw_get_mesh(context, &quads);
        uint32_t edges, found = count_rings(&quads, 1, &edges);
        printf("loops that differ by %d hundredths: %u rings\n", run, found);
        assert_int_equal(qw_get_report(context)->nests, 1);
        assert_true(found >= 7);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* A ball with a bulb sunk into it, whose rim is narrower than what lies inside. */
static shape ball_with_socket(void)
{
    static const double rim = 0.4, bulb = 0.55;
    const double neck = asin(sin(rim) / bulb); /* where the sphere of the bulb meets the rim */
    shape s = shape_sphere(32);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, angle = acos(p[2]), out = hypot(p[0], p[1]);
        if (angle >= rim) continue;
        double around = neck + (3.14159265358979 - neck) * (1 - angle / rim), r = bulb * sin(around);
        for (int k = 0; k < 2; k++) p[k] *= out > 0 ? r / out : 0;
        p[2] = cos(rim) - bulb * (cos(neck) - cos(around));
    }
    return s;
}

/* With the option alone a socket has rings too, and the report counts it. */
static void a_socket_gets_rings_by_itself(void **state)
{
    (void)state;
    shape s = ball_with_socket();
    qw_mesh_view quads;
    qw_options options;
    qw_context *context = context_with(&s, 3000, &options);
    options.rings = 1;
    for (int halved = 0; halved < 2; halved++) { /* the plane y = 0 cuts the socket */
        options.symmetry = halved ? QW_SYMMETRY_Y : QW_SYMMETRY_NONE;
        if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
        assert_int_equal(qw_get_report(context)->symmetric, halved);
        assert_int_equal(qw_get_report(context)->nests, 1);
        qw_get_mesh(context, &quads);
        uint32_t edges, found = count_rings(&quads, 1, &edges);
        printf("a socket, %d: %u rings of up to %u edges\n", halved, found, edges);
        assert_true(found >= 3);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* Dents that are too flat to be sockets have rings by default where a plane makes them twins, else none, as noise has
   dents too. */
static void dents_with_a_twin_get_rings(void **state)
{
    (void)state;
    shape s = shape_sphere(48);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, off = acos(fmin(fabs(p[2]), 1)) / 0.25,
               r = 1 - 0.4 * exp(-off * off) + 0.06 * sin(5 * p[0]) * cos(4 * p[1]);
        p[0] *= r, p[1] *= 1.2 * r, p[2] *= r;
    }
    qw_mesh_view quads;
    qw_options options;
    qw_context *context = context_with(&s, 6000, &options);
    for (int twins = 0; twins < 2; twins++) {
        options.symmetry = twins ? QW_SYMMETRY_Z : QW_SYMMETRY_NONE;
        if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
        qw_get_mesh(context, &quads);
        uint32_t edges, found = count_rings(&quads, 0.6, &edges);
        int nests = (int)qw_get_report(context)->nests;
        printf("dents, %d: %u rings of up to %u edges, %d nests\n", twins, found, edges, nests);
        assert_true(twins ? nests == 1 && found >= 4 : nests == 0);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* A symmetric file of tests/data/regress has no nests. */
static void no_rings_in(const char *path)
{
    qw_mesh *mesh;
    qw_context *context;
    qw_options options;
    qw_options_init(&options);
    options.faces = 1500, options.symmetry = QW_SYMMETRY_X;
    assert_int_equal(qw_load(path, NULL, &mesh), QW_OK);
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    qw_mesh_destroy(mesh);
    if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
    assert_int_equal(qw_get_report(context)->symmetric, 1);
    assert_int_equal(qw_get_report(context)->nests, 0);
    qw_destroy(context);
}

/* Pits in a plate, with sharp edges between their slanted walls and their floors, are no dents: their quads are not to
   be laid in rings across the edges. */
static void sharp_pits_are_no_dents(void **state)
{
    (void)state;
    no_rings_in(QW_TEST_DATA "/regress/pits.obj");
}

/* A jagged hem has many corners, which rings would smooth away, however short its teeth are. */
static void jagged_hems_are_no_openings(void **state)
{
    (void)state;
    no_rings_in(QW_TEST_DATA "/regress/jagged_sleeve.obj");
}

/* A ball open in an almond around z, whose boundary turns sharply at both ends. */
static void at_mouth(double u, double v, double p[3])
{
    double a = 6.283185307179586 * u, x = cos(a) / 0.5, y = fabs(sin(a)) / 0.27,
           open = fmin(2 / (y + sqrt(y * y + 4 * x * x)), 0.5), polar = open + (3.141592653589793 - open) * v,
           out = v < 1 ? sin(polar) : 0;
    p[0] = out * cos(a), p[1] = 1.1 * out * sin(a) + 0.3 * out * out * sin(a) * sin(a), p[2] = 1.2 * cos(polar);
}

/* Closed rows around the boundary, as long as no irregular vertex lies in them. */
static uint32_t rows_around(const qw_mesh_view *q)
{
    uint32_t n = q->vertex_count, rows = 0, *valence = calloc(n, sizeof *valence), *twin = twins_of(q);
    uint8_t *is_in = calloc(q->face_count, 1), *is_rim = calloc(n, 1);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        valence[q->corners[h]]++;
        if (twin[h] == UINT32_MAX) is_rim[q->corners[h]] = is_rim[q->corners[next_of(h)]] = 1;
    }
    for (bool is_row = true; is_row && rows < 20; rows += is_row) {
        uint8_t *next = calloc(n, 1);
        uint32_t faces = 0;
        for (uint32_t v = 0; v < n; v++) is_row &= !is_rim[v] || valence[v] == (rows == 0 ? 2 : 4);
        for (uint32_t f = 0; f < q->face_count; f++) {
            const uint32_t *c = q->corners + 4 * (size_t)f;
            if (is_in[f] || !(is_rim[c[0]] || is_rim[c[1]] || is_rim[c[2]] || is_rim[c[3]])) continue;
            is_in[f] = 1, faces++;
            for (int i = 0; i < 4; i++) next[c[i]] |= !is_rim[c[i]];
        }
        is_row &= faces > 0;
        free(is_rim), is_rim = next;
    }
    free(valence), free(twin), free(is_in), free(is_rim);
    return rows;
}

/* A mouth that is cut out has rows around it where both sides are alike, without option or guide; and none by itself
   without rings, as its boundary has corners then. */
static void openings_have_rings(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){96, 48, true, false, false, at_mouth});
    for (int64_t faces = 1000; faces < 6000; faces *= 2)
        for (int rings = 0; rings < 2; rings++) {
            qw_options options;
            qw_context *context = context_with(&s, faces, &options);
            options.symmetry = QW_SYMMETRY_AUTO, options.rings = 0.5 * rings;
            qw_mesh_view quads;
            if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
            qw_get_mesh(context, &quads);
            uint32_t rows = rows_around(&quads);
            printf("a mouth, %d quads, %d: %u rows, %d nests\n", (int)faces, rings, rows,
                   (int)qw_get_report(context)->nests);
            assert_int_equal(qw_get_report(context)->symmetric, 1);
            assert_true(rings ? rows >= 2 : rows == 0);
            qw_destroy(context);
        }
    shape_free(&s);
}

/* A loop drawn on the boundary itself, as who selects its edges does, or just beside it, where there is no room for a
   row: the opening has the rings of both sides. */
static void loops_on_rims_give_rings(void **state)
{
    (void)state;
    enum { POINTS = 48, RINGS = 2 };
    shape s = shape_of_sheet(&(shape_sheet){96, 48, true, false, false, at_mouth});
    for (int beside = 0; beside < 4; beside++) {
        qw_options options;
        qw_context *context = context_with(&s, 2000, &options);
        options.symmetry = beside % 2 ? QW_SYMMETRY_X : QW_SYMMETRY_NONE;
        double p[POINTS][3];
        for (int i = 0; i < POINTS; i++) at_mouth((i + 0.5) / POINTS, 0.002 * beside, p[i]);
        const qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 1, POINTS, p[0], RINGS};
        assert_int_equal(qw_set_guides(context, &guide, 1), QW_OK);
        qw_mesh_view quads;
        if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
        qw_get_mesh(context, &quads);
        uint32_t rows = rows_around(&quads);
        printf("a mouth's rim, %d: %u rows\n", beside, rows);
        assert_true(rows >= 2 * RINGS - 1 && qw_get_report(context)->guide_edges > 0);
        qw_destroy(context);
    }
    shape_free(&s);
}

/* A ball with a mouth: a bag behind lips that meet in a sharp fold at both corners, where the way along the surface
   from one lip to the other is far longer than through the air. */
static double lips; /* half of their height; below 0: the surface is inside out */

static void at_lips(double u, double v, double p[3])
{
    static const double inside = 0.4, deep = 0.9;
    double a = (lips > 0 ? -1 : 1) * 6.283185307179586 * u, x = cos(a) / 0.5, y = fabs(sin(a) / lips),
           rim = 2 / (y + sqrt(y * y + 4 * x * x)), out = v > 0 && v < 1 ? sin(rim) : 0, z = cos(rim);
    if (v >= inside) {
        double polar = rim + (3.141592653589793 - rim) * (v - inside) / (1 - inside);
        out *= sin(polar) / sin(rim), z = cos(polar);
    } else {
        double t = 1 - v / inside;
        out *= 1 - t * t * t * t, z += (1 - deep - z) * t;
    }
    p[0] = out * cos(a), p[1] = 1.1 * out * sin(a), p[2] = 1.2 * z;
}

static void lips_have_rings(void **state)
{
    (void)state;
    static const double heights[] = {0.1, 0.15, 0.2, 0.27, 0.35, -0.2};
    for (int i = 0; i < 6; i++)
        for (int halved = 0; halved < 2; halved++) {
            lips = heights[i];
            shape s = shape_of_sheet(&(shape_sheet){96, 64, true, false, false, at_lips});
            qw_options options;
            qw_context *context = context_with(&s, 2000, &options);
            options.symmetry = halved ? QW_SYMMETRY_X : QW_SYMMETRY_NONE;
            qw_stage last = i % 3 == 2 ? QW_STAGE_ASSEMBLE : QW_STAGE_WORKING; /* which finds them */
            if (qw_run_until(context, &options, last) != QW_OK) fail_msg("%s", qw_message(context));
            printf("lips of %g, %d: %d nests\n", lips, halved, (int)qw_get_report(context)->nests);
            assert_int_equal(qw_get_report(context)->nests, 1);
            qw_destroy(context);
            shape_free(&s);
        }
}

QW_TEST_SUITE(nests)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_run_around),
        cmocka_unit_test(small_sizes_stay_where_limbs_widen),
        cmocka_unit_test(necks_are_found),
        cmocka_unit_test(one_guide_gives_rings),
        cmocka_unit_test(ovals_have_rings_inside),
        cmocka_unit_test(loops_on_both_sides_are_one),
        cmocka_unit_test(a_socket_gets_rings_by_itself),
        cmocka_unit_test(dents_with_a_twin_get_rings),
        cmocka_unit_test(sharp_pits_are_no_dents),
        cmocka_unit_test(openings_have_rings),
        cmocka_unit_test(lips_have_rings),
        cmocka_unit_test(jagged_hems_are_no_openings),
        cmocka_unit_test(loops_on_rims_give_rings),
    };
    return cmocka_run_group_tests_name("nests", tests, NULL, NULL);
}
