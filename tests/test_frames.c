/* Where the turns of the field are laid: on the corners of the curves where their sectors ask for it, beside them where
 * not, and never more nor less of them. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/offsets/inversions.h"

static const double PI = 3.14159265358979;

static qw_offset_mesh framed(qw_env *env, const unit_fields *u, bool at_corners)
{
    qw_offset_input in = {&u->mesh,      u->normal,    NULL, u->orientation, u->size,
                          u->constraint, u->direction, NULL, true,           at_corners};
    return qw_integer_offsets(env, &in);
}

/* The angle of the lattice in quarters between the curves of a sector, by unrolling triangle after triangle; frames.c
 * counts turns, here are vectors. */
static int unrolled(const qw_offset_mesh *m, uint32_t first, uint32_t last)
{
    qw_int2 to = {0, 0};
    for (uint32_t h = first;;) {
        uint32_t e = m->edge[h], back = qw_prev(h), b = m->edge[back];
        if (h == first) {
            qw_int2 own = m->fixed[e] & QW_FIXED_Y ? (qw_int2){m->real[e].x < 0 ? -1 : 1, 0}
                                                   : (qw_int2){0, m->real[e].y < 0 ? -1 : 1};
            to = qw_turn(m->rot[h], own);
        }
        if (h == last) {
            qw_int2 own = m->fixed[b] & QW_FIXED_Y ? (qw_int2){m->real[b].x < 0 ? -1 : 1, 0}
                                                   : (qw_int2){0, m->real[b].y < 0 ? -1 : 1};
            qw_int2 end = qw_turn(m->rot[back] + 2u, own);
            for (int q = 0; q < 4; q++)
                if (qw_int2_is_zero(qw_int2_sub(qw_turn((unsigned)q, to), end))) return q;
            fail_msg("a curve edge lies on no axis");
        }
        uint32_t t = m->twin[back];
        to = qw_turn(m->rot[t] + 4u - (m->rot[back] + 2u) % 4u,
                     to); /* the same vector along `back`, seen from both triangles */
        h = t;
    }
}

typedef struct sector_counts {
    uint32_t sectors, right, lost; /* of those by an angle of clear quarters: as many as that, none */
} sector_counts;

static sector_counts count_sectors(qw_env *env, const qw_offset_mesh *m)
{
    sector_counts c = {0};
    uint32_t *outgoing = qw_offset_outgoing(env, m);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (m->constraint[v] != 2) continue;
        uint32_t h = outgoing[v]; /* at a boundary the first of all */
        while (!m->fixed[m->edge[h]] && m->twin[qw_prev(h)] != QW_NONE && m->twin[qw_prev(h)] != outgoing[v])
            h = m->twin[qw_prev(h)];
        if (!m->fixed[m->edge[h]]) continue;
        double angle = 0;
        for (uint32_t start = h, first = h; h != QW_NONE;) {
            qw_vec3 a = qw_normalize(qw_sub(m->position[m->corner[qw_next(h)]], m->position[v]));
            qw_vec3 b = qw_normalize(qw_sub(m->position[m->corner[qw_prev(h)]], m->position[v]));
            angle += acos(fmin(fmax((double)qw_dot(a, b), -1), 1));
            uint32_t next = m->twin[qw_prev(h)];
            if (m->fixed[m->edge[qw_prev(h)]]) {
                int want = (int)lrint(angle / (PI / 2)), have = unrolled(m, first, h);
                if (fabs(angle / (PI / 2) - want) < 0.2 && want > 0)
                    c.sectors++, c.right += have == want % 4, c.lost += have == 0 && want < 4;
                first = next, angle = 0;
            }
            h = next == start ? QW_NONE : next;
        }
    }
    return c;
}

/* The corners of a box are cones and its only ones; laid beside them there are as many. */
static void corners_of_a_box(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_fields u = unit_solve(env, unit_cube(env, 3), 0.2f, true);
    qw_offset_mesh at = framed(env, &u, true), beside = framed(env, &u, false);
    for (uint32_t v = 0; v < at.vertex_count; v++) {
        assert_int_equal(at.index[v], u.constraint[v] == QW_VERTEX_CORNER);
        if (u.constraint[v] == QW_VERTEX_CORNER) assert_int_equal(beside.index[v], 0);
    }
    assert_int_equal(qw_offset_count(&at).index_sum, 8);
    assert_int_equal(qw_offset_count(&beside).index_sum, 8);
    sector_counts a = count_sectors(env, &at), b = count_sectors(env, &beside);
    assert_int_equal(a.sectors, 24);
    assert_int_equal(a.right, 24);
    assert_true(b.right < 24);
    qw_env_destroy(env);
}

/* On a low comb, whose corners are box corners and corners of the notches, no sector is lost. */
static void corners_of_a_comb(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_slab(env, 9, 2, "##########.#.#.#.#");
    for (int l = 0; l < 2; l++) m = unit_quarter(env, &m);
    unit_fields u = unit_solve(env, m, 0.3f, true);
    qw_offset_mesh at = framed(env, &u, true), beside = framed(env, &u, false);
    sector_counts a = count_sectors(env, &at), b = count_sectors(env, &beside);
    assert_true(a.sectors > 90 && a.sectors == b.sectors);
    assert_int_equal(a.right, a.sectors);
    assert_true(b.right < b.sectors);
    assert_int_equal(qw_offset_count(&at).index_sum, 8);
    qw_env_destroy(env);
}

/* Whatever the crosses are: as much turn in all, a vertex can be moved just where nothing was laid, and no fewer
 * sectors are right. */
static void wild_fields(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {23};
    uint32_t more = 0;
    for (int round = 0; round < 40; round++) {
        qw_scope_begin(env);
        bool open = round % 4 == 3;
        qw_trimesh m = open             ? unit_grid(env, 6, 5, false, false)
                       : round % 4 == 1 ? unit_slab(env, 5, 3, "######.#.######")
                                        : unit_slab(env, 3, 2, "####.#");
        for (int l = 0; l < 1 + round % 2; l++) m = unit_quarter(env, &m);
        for (uint32_t h = 0; h < 3 * m.face_count && open;
             h++) { /* two lines across, so that there are corners inside */
            qw_vec3 p = m.position[m.corner[h]], q = m.position[m.corner[qw_next(h)]];
            if ((p.x == q.x && fabsf(p.x - m.position[m.vertex_count / 2].x) < 1e-6f) ||
                (p.y == q.y && fabsf(p.y - m.position[m.vertex_count / 2].y) < 1e-6f))
                m.mark[h] = QW_MARK_FEATURE;
        }
        unit_fields u = unit_solve(env, m, 0.4f, true);
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            qw_vec3 any = unit_direction(&r);
            if (u.constraint[v] == 0) u.orientation[v] = qw_normalize(qw_reject(any, u.normal[v]));
        }
        qw_offset_mesh at = framed(env, &u, true), beside = framed(env, &u, false);
        qw_offset_validate(env, &at);
        assert_int_equal(qw_offset_count(&at).index_sum, qw_offset_count(&beside).index_sum);
        uint32_t *outgoing = qw_offset_outgoing(env, &at);
        qw_star star = {0};
        for (uint32_t v = 0; v < at.vertex_count; v++) {
            qw_star_at(env, &at, outgoing[v], &star);
            bool inner = true;
            for (uint32_t i = 0; i < star.count; i++)
                inner &= at.twin[star.out[i]] != QW_NONE && at.twin[qw_prev(star.out[i])] != QW_NONE;
            if (inner) assert_int_equal(star.movable, at.index[v] % 4 == 0);
        }
        sector_counts a = count_sectors(env, &at), b = count_sectors(env, &beside);
        assert_true(a.lost <= b.lost);
        more += a.right > b.right;
        qw_scope_end(env);
    }
    assert_true(more > 20);
    qw_env_destroy(env);
}

QW_TEST_SUITE(frames)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(corners_of_a_box), cmocka_unit_test(corners_of_a_comb),
                                       cmocka_unit_test(wild_fields)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
