/* Relaxation by its certificates: gradients, systems that are solved, quads that are not flipped, places on surfaces
 * and on curves, equal bytes. */
#include "suite.h"
#include "unit_shapes.h"

#include "geometry/bvh.h"
#include "remesh/relax/diagonals.h"
#include "remesh/relax/relax.h"
#include "remesh/relax/relax_align.h"
#include "remesh/relax/relax_curves.h"
#include "remesh/relax/relax_energy.h"
#include "remesh/relax/relax_solve.h"

static const qw_relax_target even = {.evenness = QW_EVENNESS};

static void shake(qw_quadmesh *q, unit_rng *r, float by)
{
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        qw_vec3 *p = &q->position[v];
        if (q->kind[v] == QW_VERTEX_CORNER) continue;
        if (q->kind[v] == QW_VERTEX_FREE || p->y <= 0 || p->y >= 1) p->x = fminf(fmaxf(p->x + by * unit_real(r), 0), 1);
        if (q->kind[v] == QW_VERTEX_FREE || p->x <= 0 || p->x >= 1) p->y = fminf(fmaxf(p->y + by * unit_real(r), 0), 1);
    }
}

/* Smallest corner seen from above, over the mean area; the areas' deviation over their mean. */
static float worst_corner(const qw_quadmesh *q, const qw_vec3 *p, float sign)
{
    float least = INFINITY;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        qw_vec3 a = p[q->corner[h]];
        float z = qw_cross(qw_sub(p[q->corner[qw_quad_next(h)]], a), qw_sub(p[q->corner[qw_quad_prev(h)]], a)).z;
        least = fminf(least, sign * z * (float)q->face_count);
    }
    return least;
}

static double area_of(const qw_quadmesh *q, const qw_vec3 *p, uint32_t f)
{
    const uint32_t *c = q->corner + 4 * f;
    return 0.5 * (double)qw_length(qw_cross(qw_sub(p[c[2]], p[c[0]]), qw_sub(p[c[3]], p[c[1]])));
}

static double unevenness(const qw_quadmesh *q, const qw_vec3 *p)
{
    double sum = 0, squares = 0;
    for (uint32_t f = 0; f < q->face_count; f++)
        sum += area_of(q, p, f), squares += area_of(q, p, f) * area_of(q, p, f);
    double mean = sum / q->face_count;
    return sqrt(fmax(squares / q->face_count - mean * mean, 0)) / mean;
}

/* ---- parts */

/* Another quad in the other lanes: what becomes of one tells nothing of the next. */
static qw_plane_quads side_by_side(const qw_vec2 q[4], const qw_vec2 other[4], int lane)
{
    qw_plane_quads all;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < QW_LANES; k++)
            all.x[i][k] = k == lane ? q[i].x : other[i].x, all.y[i][k] = k == lane ? q[i].y : other[i].y;
    return all;
}

static float energy_in_lane(const qw_vec2 q[4], const qw_vec2 other[4], int lane, float wanted, float soft,
                            const qw_relax_weights *w, float *least)
{
    qw_plane_quads all = side_by_side(q, other, lane);
    qw_lanes smallest, energy = qw_quad_energy(&all, qw_lanes_of(wanted), qw_lanes_of(soft), w, &smallest);
    *least = smallest[lane];
    return energy[lane];
}

static void gradient_is_slope(void **state)
{
    (void)state;
    unit_rng r = {5};
    qw_vec2 unit[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, other[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int round = 0; round < 400; round++) {
        qw_relax_weights w = {0.1f + fabsf(unit_real(&r)), 0.1f + fabsf(unit_real(&r)), 0.1f + fabsf(unit_real(&r))};
        qw_vec2 q[4];
        float by = round % 2 ? 0.9f : 0.3f; /* many of the first are flipped */
        for (int i = 0; i < 4; i++) q[i] = (qw_vec2){unit[i].x + by * unit_real(&r), unit[i].y + by * unit_real(&r)};
        float gradient[8], matrix[8][8], least, soft = 0.5f, wanted = 1.3f;
        int lane = round % QW_LANES;
        float energy = energy_in_lane(q, other, lane, wanted, soft, &w, &least);
        qw_plane_quads all = side_by_side(q, other, lane);
        qw_relax_model model;
        qw_lanes modelled = qw_quad_energy_model(&all, qw_lanes_of(wanted), qw_lanes_of(soft), &w, &model);
        assert_true(fabsf(modelled[lane] - energy) <= 1e-4f * (1 + energy));
        for (int i = 0; i < 8; i++) gradient[i] = model.gradient[i][lane];
        for (int i = 0; i < 8; i++)
            for (int j = 0; j < 8; j++) matrix[i][j] = model.matrix[i][j][lane];
        float along[8], value = 0, slope = 0, scale = 0;
        for (int i = 0; i < 8; i++)
            along[i] = unit_real(&r), slope += gradient[i] * along[i], scale += gradient[i] * gradient[i];
        for (int i = 0; i < 8; i++)
            for (int j = 0; j < 8; j++) {
                assert_true(fabsf(matrix[i][j] - matrix[j][i]) <= 1e-4f * (1 + fabsf(matrix[i][j])));
                value += along[i] * matrix[i][j] * along[j];
            }
        assert_true(value > -1e-3f);
        float h = 2e-3f, side[2];
        for (int s = 0; s < 2; s++) {
            qw_vec2 moved[4];
            float by_step = s ? h : -h;
            for (int i = 0; i < 4; i++)
                moved[i] = (qw_vec2){q[i].x + by_step * along[2 * i], q[i].y + by_step * along[2 * i + 1]};
            side[s] = energy_in_lane(moved, other, lane, wanted, soft, &w, &least);
        }
        assert_true(fabsf((side[1] - side[0]) / (2 * h) - slope) < 0.02f * (sqrtf(scale) + 1));
        memcpy(other, q, sizeof other);
    }
    qw_vec2 square[4] = {{3, 1}, {3, 3}, {1, 3}, {1, 1}};
    float least;
    assert_true(energy_in_lane(square, other, 2, 4, 1e-3f, &(qw_relax_weights){1, 1, 1}, &least) < 1e-5f);
    assert_true(fabsf(least - 1) < 1e-5f);
}

static qw_relax_system system_of(qw_env *env, const qw_quadmesh *q)
{
    uint32_t n = q->vertex_count, sides = 4 * q->face_count;
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2), *around = QW_NEW(env, uint32_t, sides);
    for (uint32_t h = 0; h < sides; h++) begin[q->corner[h] + 2]++;
    for (uint32_t v = 0; v < n; v++) begin[v + 2] += begin[v + 1];
    for (uint32_t h = 0; h < sides; h++) around[begin[q->corner[h] + 1]++] = h;
    return qw_relax_system_create(env, q, begin, around);
}

static void solves_its_system(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    unit_rng r = {11};
    qw_quadmesh q = unit_sheet(env, 37, 41);
    uint32_t n = q.vertex_count, faces = q.face_count;
    qw_relax_model *models = qw_alloc_zero(env, faces / QW_LANES + 1, sizeof *models);
    for (uint32_t f = 0; f < faces; f++) {
        qw_relax_model *m = &models[f / QW_LANES];
        for (int k = 0; k < 5; k++) {
            float d[8];
            for (int i = 0; i < 8; i++) d[i] = unit_real(&r);
            for (int i = 0; i < 64; i++) m->matrix[i / 8][i % 8][f % QW_LANES] += d[i / 8] * d[i % 8];
        }
        for (int i = 0; i < 8; i++) m->gradient[i][f % QW_LANES] = unit_real(&r);
    }
    qw_relax_system s = system_of(env, &q);
    qw_vec3(*axis)[2] = qw_alloc(env, n, sizeof *axis);
    for (uint32_t v = 0; v < n; v++) axis[v][0] = qw_v3(1, 0, 0), axis[v][1] = qw_v3(0, 1, 0);
    qw_relax_system_fill(env, &s, models, axis, 0);
    uint32_t steps = qw_relax_system_solve(env, &s, 1e-4f, 2000);
    assert_true(steps > 3 && steps < 2000);
    float *left = QW_NEW_ZERO(env, float, 2 * (size_t)n), most = 0;
    for (uint32_t f = 0; f < faces; f++)
        for (uint32_t i = 0; i < 8; i++) {
            float *to = &left[2 * q.corner[4 * f + i / 2] + i % 2];
            *to += models[f / QW_LANES].gradient[i][f % QW_LANES];
            for (uint32_t j = 0; j < 8; j++) {
                qw_vec2 x = s.x[q.corner[4 * f + j / 2]];
                *to += models[f / QW_LANES].matrix[i][j][f % QW_LANES] * (j % 2 ? x.y : x.x);
            }
        }
    for (uint32_t i = 0; i < 2 * n; i++) most = fmaxf(most, fabsf(left[i]));
    assert_true(most < 0.02f);
    qw_env_destroy(env);
}

/* Springs along the sides of a sheet whose border is held: with coarser grids a wave as long as the sheet takes 23 and
 * 55 iterations, of which the blocks on the diagonal alone take 47 and 194. */
static void long_waves(void **state)
{
    (void)state;
    uint32_t steps[2];
    for (uint32_t large = 0; large < 2; large++) {
        qw_env *env = qw_env_create(NULL, 2);
        uint32_t side = large ? 160 : 40;
        qw_quadmesh q = unit_sheet(env, side, side);
        uint32_t n = q.vertex_count, faces = q.face_count;
        qw_relax_model *models = qw_alloc_zero(env, faces / QW_LANES + 1, sizeof *models);
        for (uint32_t f = 0; f < faces; f++)
            for (uint32_t i = 0; i < 8; i++) {
                qw_relax_model *m = &models[f / QW_LANES];
                if (q.kind[q.corner[4 * f + i / 2]] != 0) continue;
                m->gradient[i][f % QW_LANES] = -1;
                m->matrix[i][i][f % QW_LANES] = 2;
                for (uint32_t turn = 2; turn <= 6; turn += 4)
                    if (q.kind[q.corner[4 * f + (i + turn) % 8 / 2]] == 0)
                        m->matrix[i][(i + turn) % 8][f % QW_LANES] = -1;
            }
        qw_vec3(*axis)[2] = qw_alloc_zero(env, n, sizeof *axis);
        for (uint32_t v = 0; v < n; v++)
            if (q.kind[v] == 0) axis[v][0] = qw_v3(1, 0, 0), axis[v][1] = qw_v3(0, 1, 0);
        qw_relax_system s = system_of(env, &q);
        qw_relax_system_fill(env, &s, models, axis, 0);
        steps[large] = qw_relax_system_solve(env, &s, 1e-3f, 2000);
        /* -laplace u = 1 on a square has 0.0737 of the side's square in its middle; here springs of 2 and a load of 4 a
         * vertex make it twice that */
        float middle = s.x[(side / 2) * (side + 1) + side / 2].x / (float)(side * side);
        assert_true(fabsf(middle - 4 * 0.07367f / 2) < 0.003f);
        qw_env_destroy(env);
    }
    assert_true(steps[1] < 80 && steps[1] < 3 * steps[0]);
}

/* ---- the whole */

static void untangles_a_plate(void **state)
{
    (void)state;
    unit_rng r = {29};
    for (int round = 0; round < 10; round++) {
        qw_env *env = qw_env_create(NULL, 1 + (uint32_t)round % 3);
        qw_trimesh plate = unit_grid(env, 24, 24, false, false);
        qw_quadmesh q = unit_sheet(env, 14, 14);
        shake(&q, &r, round % 2 ? 0.07f : 0.05f); /* up to an edge: a third to a half of the quads are flipped */
        assert_true(worst_corner(&q, q.position, 1) < 0);
        qw_vec3 *p = qw_relax_quads(env, &q, &plate, &even);
        assert_true(worst_corner(&q, p, 1) > 0.5f);
        assert_true(unevenness(&q, p) < 0.1);
        for (uint32_t v = 0; v < q.vertex_count; v++) {
            assert_true(fabsf(p[v].z) < 1e-6f);
            if (q.kind[v] == QW_VERTEX_CORNER) assert_memory_equal(&p[v], &q.position[v], sizeof *p);
            if (q.kind[v] != QW_VERTEX_CURVE) continue;
            bool on_x = q.position[v].x <= 0 || q.position[v].x >= 1;
            assert_true(on_x ? p[v].x == q.position[v].x : p[v].y == q.position[v].y);
        }
        qw_env_destroy(env);
    }
}

/* What comes in without a flipped quad stays so, however uneven, and is evened. */
static void evens_what_is_not_inverted(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh plate = unit_grid(env, 24, 24, false, false);
    qw_quadmesh q = unit_sheet(env, 30, 30);
    for (uint32_t v = 0; v < q.vertex_count; v++) {
        qw_vec3 *p = &q.position[v];
        p->x = p->x * (0.4f + 0.6f * p->x), p->y = p->y * (1.5f - 0.5f * p->y);
    }
    double before = unevenness(&q, q.position);
    qw_vec3 *p = qw_relax_quads(env, &q, &plate, &even);
    assert_true(before > 0.4);
    assert_true(unevenness(&q, p) < 0.05);
    assert_true(worst_corner(&q, p, 1) > 0.8f);
    qw_env_destroy(env);
}

/* A size that doubles from left to right is followed. */
static void follows_a_size(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh plate = unit_grid(env, 24, 24, false, false);
    float *size = QW_NEW(env, float, plate.vertex_count);
    for (uint32_t v = 0; v < plate.vertex_count; v++) size[v] = 1 + plate.position[v].x;
    qw_quadmesh q = unit_sheet(env, 16, 16);
    qw_vec3 *p = qw_relax_quads(env, &q, &plate, &(qw_relax_target){.mesh = &plate, .size = size, .evenness = 0.9f});
    double left = 0, right = 0;
    for (uint32_t y = 0; y < 16; y++) left += area_of(&q, p, 16 * y), right += area_of(&q, p, 16 * y + 15);
    assert_true(right > 2.5 * left);
    assert_true(worst_corner(&q, p, 1) > 0.2f);
    qw_vec3 *same = qw_relax_quads(env, &q, &plate, &even);
    assert_true(unevenness(&q, same) < 1e-3);
    qw_env_destroy(env);
}

/* Vertices that are held stay where they are, the others even out between them. */
static void held_vertices_stay(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh plate = unit_grid(env, 24, 24, false, false);
    qw_quadmesh q = unit_sheet(env, 20, 20);
    uint8_t *held = QW_NEW_ZERO(env, uint8_t, q.vertex_count);
    for (uint32_t v = 0; v < q.vertex_count; v++) {
        qw_vec3 *p = &q.position[v];
        p->x = p->x * (0.4f + 0.6f * p->x), held[v] = p->y > 0.5f;
    }
    qw_vec3 *p = qw_relax_quads(env, &q, &plate, &(qw_relax_target){.evenness = QW_EVENNESS, .held = held});
    float most = 0;
    for (uint32_t v = 0; v < q.vertex_count; v++) {
        float way = qw_distance(p[v], q.position[v]);
        if (held[v]) assert_true(way < 1e-6f);
        most = fmaxf(most, way);
    }
    assert_true(most > 0.02f);
    qw_env_destroy(env);
}

/* A plate's directions are its sides on the left and its diagonals on the right; a sheet of quads is looked up where it
   lies, then where it has slid to the other half. */
static void lines_are_those_of_the_place(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh plate = unit_grid(env, 24, 24, false, false);
    const float half = sqrtf(0.5f);
    qw_vec3 *direction = QW_NEW(env, qw_vec3, plate.vertex_count);
    for (uint32_t v = 0; v < plate.vertex_count; v++)
        direction[v] = plate.position[v].x < 0.5f ? qw_v3(0, -1, 0) : qw_v3(half, half, 0);
    qw_quadmesh q = unit_sheet(env, 4, 4);
    qw_vec3 *p = QW_NEW(env, qw_vec3, q.vertex_count);
    float *share = QW_NEW(env, float, q.face_count);
    for (uint32_t f = 0; f < q.face_count; f++) share[f] = 0.5f;
    qw_relax_lines lines = qw_begin_relax_lines(env, &q, &plate, qw_bvh_build(env, &plate), direction, 18, share);
    for (int moved = 0; moved < 2; moved++) {
        for (uint32_t v = 0; v < q.vertex_count; v++) {
            p[v] = q.position[v];
            p[v].x = 0.4f * p[v].x + 0.6f * (float)moved;
        }
        qw_find_relax_lines(env, &lines, p);
        for (uint32_t f = 0; f < q.face_count; f++) {
            qw_vec3 a = lines.along[f], b = lines.across[f];
            assert_true(fabsf(qw_length(a) - 3) < 1e-5f && fabsf(qw_length(b) - 3) < 1e-5f);
            assert_true(fabsf(qw_dot(a, b)) < 1e-5f);
            if (moved) assert_true(fabsf(fabsf(a.x) - 3 * half) < 1e-5f && fabsf(fabsf(a.y) - 3 * half) < 1e-5f);
            else assert_true(fabsf(fabsf(a.x) - 3) < 1e-5f || fabsf(fabsf(a.y) - 3) < 1e-5f);
        }
    }
    qw_env_destroy(env);
}

/* Two sharp lines closer than an edge: vertices that start nearer to the wrong one still end on their own. */
static void keeps_to_its_curve(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh plate = unit_grid(env, 40, 40, false, false);
    for (uint32_t h = 0; h < 3 * plate.face_count; h++) {
        qw_vec3 a = plate.position[plate.corner[h]], b = plate.position[plate.corner[qw_next(h)]];
        plate.mark[h] = a.x == b.x && (fabsf(a.x - 0.5f) < 1e-4f || fabsf(a.x - 0.525f) < 1e-4f) ? QW_MARK_FEATURE : 0;
    }
    qw_quadmesh q = unit_sheet(env, 10, 10);
    for (uint32_t y = 0; y <= 10; y++) {
        uint32_t v = 11 * y + 5;
        q.kind[v] = y % 10 ? QW_VERTEX_CURVE : QW_VERTEX_CORNER;
        if (y == 3 || y == 4 || y == 8) q.position[v].x = 0.52f;
        if (y < 10) q.mark[4 * (10 * y + 5) + 3] = q.mark[4 * (10 * y + 4) + 1] = QW_MARK_FEATURE;
    }
    qw_vec3 *p = qw_relax_quads(env, &q, &plate, &even);
    for (uint32_t y = 0; y <= 10; y++) assert_true(fabsf(p[11 * y + 5].x - 0.5f) < 1e-6f);
    qw_env_destroy(env);
}

/* Two sides of a wall a tenth of an edge thick, the lower one facing down. */
static void keeps_to_its_side(void **state)
{
    (void)state;
    unit_rng r = {31};
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh top = unit_grid(env, 20, 20, false, false),
               both = unit_mesh(env, 2 * top.vertex_count, 2 * top.face_count);
    for (uint32_t v = 0; v < both.vertex_count; v++) {
        both.position[v] = top.position[v % top.vertex_count];
        if (v >= top.vertex_count) both.position[v].z = -0.01f;
    }
    for (uint32_t f = 0; f < top.face_count; f++) {
        const uint32_t *c = top.corner + 3 * f;
        uint32_t n = top.vertex_count;
        unit_face(&both, f, c[0], c[1], c[2]);
        unit_face(&both, top.face_count + f, c[0] + n, c[2] + n, c[1] + n);
    }
    qw_trimesh_link(env, &both);
    for (int side = 0; side < 2; side++) {
        qw_quadmesh q = unit_sheet(env, 10, 10);
        shake(&q, &r, 0.05f);
        for (uint32_t v = 0; v < q.vertex_count; v++)
            q.position[v].z = side ? -0.004f : -0.006f; /* nearer to the other side */
        for (uint32_t f = 0; f < q.face_count && side; f++) {
            uint32_t *c = q.corner + 4 * f, *t = q.twin + 4 * f, c1 = c[1], t0 = t[0], t1 = t[1];
            c[1] = c[3], c[3] = c1;
            t[0] = t[3], t[3] = t0, t[1] = t[2], t[2] = t1;
        }
        for (uint32_t h = 0; h < 4 * q.face_count && side; h++)
            if (q.twin[h] != QW_NONE) q.twin[h] = (q.twin[h] & ~3u) | (3 - (q.twin[h] & 3u));
        qw_quadmesh_validate(env, &q);
        qw_vec3 *p = qw_relax_quads(env, &q, &both, &even);
        for (uint32_t v = 0; v < q.vertex_count; v++)
            if (q.kind[v] == QW_VERTEX_FREE) assert_true(fabsf(p[v].z - (side ? -0.01f : 0)) < 1e-6f);
        assert_true(worst_corner(&q, p, side ? -1 : 1) > 0.1f);
    }
    qw_env_destroy(env);
}

static void same_at_any_thread_count(void **state)
{
    (void)state;
    const uint32_t threads[] = {1, 2, 3, 8};
    qw_vec3 *first = NULL;
    uint32_t count = 0;
    for (int i = 0; i < 4; i++) {
        qw_env *env = qw_env_create(NULL, threads[i]);
        unit_rng r = {37};
        qw_trimesh plate = unit_grid(env, 60, 60, false, false);
        for (uint32_t v = 0; v < plate.vertex_count; v++)
            plate.position[v].z = 0.1f * sinf(6 * plate.position[v].x) * cosf(5 * plate.position[v].y);
        qw_quadmesh q = unit_sheet(env, 50, 50);
        shake(&q, &r, 0.02f);
        for (uint32_t v = 0; v < q.vertex_count; v++)
            q.position[v].z = 0.1f * sinf(6 * q.position[v].x) * cosf(5 * q.position[v].y);
        qw_vec3 *p = qw_relax_quads(env, &q, &plate, &even);
        const qw_bvh *tree = qw_bvh_build(env, &plate);
        for (uint32_t v = 0; v < q.vertex_count; v++) {
            qw_hit hit = qw_bvh_nearest(tree, p[v], qw_v3(0, 0, 0), -1, 1, QW_NONE);
            assert_true(hit.face != QW_NONE && hit.distance2 < 1e-10f);
        }
        if (!first) {
            count = q.vertex_count, first = malloc(count * sizeof *first);
            memcpy(first, p, count * sizeof *first);
        }
        assert_memory_equal(first, p, count * sizeof *first);
        qw_env_destroy(env);
    }
    free(first);
}

/* ---- folds */

typedef float height(float x, float y);
static float ridge_up(float x, float y) { return 0.05f * fabsf(x - y); }
static float ridge_down(float x, float y) { return 0.05f * fabsf(x + y - 1); }

/* The unit square under a height, cut as finely as n, along the ridge where there is one. */
static qw_trimesh roof(qw_env *env, uint32_t n, height *z, bool along_up)
{
    qw_trimesh m = unit_mesh(env, (n + 1) * (n + 1), 2 * n * n);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float x = (float)(v % (n + 1)) / (float)n, y = (float)(v / (n + 1)) / (float)n;
        m.position[v] = qw_v3(x, y, z(x, y));
    }
    for (uint32_t f = 0; f < n * n; f++) {
        uint32_t a = f / n * (n + 1) + f % n, b = a + 1, c = a + n + 2, d = a + n + 1;
        unit_face(&m, 2 * f, a, b, along_up ? c : d);
        unit_face(&m, 2 * f + 1, along_up ? a : b, c, d);
    }
    qw_trimesh_link(env, &m);
    return m;
}

static uint8_t *is_cut_across(qw_env *env, const qw_quadmesh *q, const qw_trimesh *surface, bool with_places)
{
    uint8_t *turn = QW_NEW(env, uint8_t, q->face_count);
    uint32_t *place = QW_NEW(env, uint32_t, q->vertex_count), *outgoing = qw_trimesh_outgoing(env, surface);
    qw_bvh *tree = qw_bvh_build(env, surface);
    for (uint32_t v = 0; v < q->vertex_count; v++)
        place[v] = with_places ? qw_bvh_nearest(tree, q->position[v], qw_v3(0, 0, 0), -1, INFINITY, QW_NONE).face
                               : QW_NONE;
    qw_choose_diagonals(env, q, surface, outgoing, tree, place, turn);
    return turn;
}

/* Over a ridge that crosses quads from corner to corner they are folded along it; plane ones stay as they are. */
static void diagonals_follow_ridges(void **state)
{
    (void)state;
    for (int down = 0; down < 2; down++)
        for (int with_places = 0; with_places < 2; with_places++) {
            qw_env *env = qw_env_create(NULL, 2);
            height *z = down ? ridge_down : ridge_up;
            qw_trimesh surface = roof(env, 40, z, !down);
            qw_quadmesh q = unit_sheet(env, 10, 10);
            for (uint32_t v = 0; v < q.vertex_count; v++) q.position[v].z = z(q.position[v].x, q.position[v].y);
            uint8_t *turn = is_cut_across(env, &q, &surface, with_places);
            for (uint32_t f = 0; f < q.face_count; f++) assert_int_equal(turn[f], down && f % 10 + f / 10 == 9);
            unit_rng r = {11};
            for (uint32_t h = 0; h < 4 * q.face_count; h++) q.mark[h] = unit_real(&r) > 0.5f;
            qw_quadmesh t = qw_turn_quads(env, &q, turn);
            qw_quadmesh_validate(env, &t);
            for (uint32_t f = 0; f < q.face_count; f++)
                for (uint32_t i = 0; i < 4; i++) {
                    uint32_t from = 4 * f + (i + turn[f]) % 4;
                    assert_int_equal(t.corner[4 * f + i], q.corner[from]);
                    assert_int_equal(t.twin[4 * f + i] == QW_NONE, q.twin[from] == QW_NONE);
                    assert_int_equal(t.mark[4 * f + i], q.mark[from]);
                }
            uint8_t *again = is_cut_across(env, &t, &surface, with_places);
            for (uint32_t f = 0; f < q.face_count; f++) assert_int_equal(again[f], 0);
            qw_env_destroy(env);
        }
}

/* A quad with a corner that is straight or points inward is cut through that corner: the other cut leaves a triangle of
 * no area, or turns it over. */
static void diagonals_go_through_inward_corners(void **state)
{
    (void)state;
    static const float share[] = {1, 1.4f}; /* of the way to the middle */
    for (uint32_t i = 0; i < 8; i++) {
        qw_env *env = qw_env_create(NULL, 1);
        qw_trimesh surface = unit_grid(env, 8, 8, false, false);
        qw_quadmesh q = unit_sheet(env, 1, 1);
        qw_vec3 *p = &q.position[q.corner[i % 4]];
        *p = qw_lerp(*p, qw_v3(0.5f, 0.5f, 0), share[i / 4]);
        assert_int_equal(is_cut_across(env, &q, &surface, true)[0], i % 2);
        qw_env_destroy(env);
    }
}

QW_TEST_SUITE(relax)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gradient_is_slope),
        cmocka_unit_test(solves_its_system),
        cmocka_unit_test(long_waves),
        cmocka_unit_test(untangles_a_plate),
        cmocka_unit_test(evens_what_is_not_inverted),
        cmocka_unit_test(follows_a_size),
        cmocka_unit_test(held_vertices_stay),
        cmocka_unit_test(lines_are_those_of_the_place),
        cmocka_unit_test(keeps_to_its_curve),
        cmocka_unit_test(keeps_to_its_side),
        cmocka_unit_test(same_at_any_thread_count),
        cmocka_unit_test(diagonals_follow_ridges),
        cmocka_unit_test(diagonals_go_through_inward_corners),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
