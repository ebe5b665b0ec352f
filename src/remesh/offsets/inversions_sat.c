/* Eq. (4) by satisfiability (paper, Section 3.4): neighbourhoods of the triangles that are inverted, larger and
 * larger. */
#include "remesh/offsets/neighbourhood.h"

#include <assert.h>

/* Where so many of the largest neighbourhoods have no answer, or all together have so many conflicts, the offsets are
   beyond repair, as in parts far thinner than a quad, and the search ends: such components are rebuilt. */
enum { CONFLICTS = 2000, MOST_FAILURES = 64, MOST_CONFLICTS = 8 * CONFLICTS };

/* Radii of the neighbourhoods, in rings around the inverted triangle, tried in turn. The last finds an answer for
   one in twenty triangles for which the others found none, and takes half of the time. */
static const uint32_t radii[] = {1, 2, 4, 7};
static size_t radius_count(qw_sat_effort effort)
{
    return sizeof radii / sizeof *radii - (effort == QW_SAT_NEAR ? 1 : 0);
}

/* Asks the solver for steps of the vertices around an inverted triangle after which none is inverted, and takes
 * them. last: where there are none, the neighbourhood's triangles are marked as given up. */
static bool solve_around(qw_env *env, qw_offset_mesh *m, qw_neighbourhood *n, uint32_t seed, uint32_t radius, bool last,
                         uint8_t *given_up, qw_inversion_counts *counts)
{
    assert(seed < m->face_count && given_up && counts);
    qw_scope_begin(env);
    qw_neighbourhood_grow(env, n, seed, radius);
    qw_sat *sat = qw_sat_begin(env);
    qw_neighbourhood_forbid_inversions(n, sat);
    bool solved = qw_sat_solve(sat, CONFLICTS) == QW_SAT_YES;
    counts->sat_calls++;
    counts->sat_solved += solved;
    counts->sat_conflicts += qw_sat_conflicts(sat);
    if (solved) qw_take_steps(n, sat, m);
    if (!solved && last)
        for (uint32_t k = 0; k < n->face_count; k++) given_up[n->face[k]] = 1;
    qw_neighbourhood_forget(n);
    qw_scope_end(env);
    return solved;
}

void qw_remove_inversions_sat(qw_env *env, qw_offset_mesh *m, qw_sat_effort effort, qw_inversion_counts *counts)
{
    assert(m->d && m->twin && counts);
    if (!qw_sat_available() || counts->inverted_after == 0) return;
    qw_scope_begin(env);
    qw_neighbourhood n = qw_neighbourhood_make(env, m);
    uint8_t *given_up =
        QW_NEW_ZERO(env, uint8_t, m->face_count); /* was in a neighbourhood of the largest radius that has no answer */
    size_t count = radius_count(effort);
    uint32_t failures = 0;
    int64_t most = counts->sat_conflicts + MOST_CONFLICTS;
    for (uint32_t f = 0; f < m->face_count && failures < MOST_FAILURES && counts->sat_conflicts < most; f++)
        for (size_t r = 0; r < count && !given_up[f] && qw_offset_det(m, f) < 0; r++) {
            qw_progress(env, (double)f / m->face_count);
            bool solved = solve_around(env, m, &n, f, radii[r], r + 1 == count, given_up, counts);
            failures += !solved && r + 1 == count;
        }
    counts->inverted_after = 0;
    for (uint32_t f = 0; f < m->face_count; f++) counts->inverted_after += qw_offset_det(m, f) < 0;
    qw_scope_end(env);
}
