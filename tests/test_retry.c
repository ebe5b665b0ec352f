/* The next plan from the history of plans and verdicts, by tables of verdicts: no stage is run. */
#include "random.h"
#include "suite.h"
#include "base/constants.h"
#include "run/retry.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* What is seen after a stage of the current attempt, and what is to follow. */
typedef struct row {
    qw_stage stage;
    qw_verdict verdict;
    qw_retry cause;
    uint32_t best; /* an attempt, or QW_NO_ATTEMPT */
} row;

static const qw_request USUAL = {
    .faces_wanted = 1000, .faces_needed = 6, .is_closed = 1, .repairs = 1, .times_used = 1};

/* Plays the rows against a history that begins anew, and leaves it for the caller to look at. */
static qw_history play(qw_request request, const row *rows, size_t count)
{
    qw_history h;
    qw_history_begin(&h);
    h.request = request;
    for (size_t i = 0; i < count; i++) {
        qw_attempt *a = &h.attempt[h.current];
        a->verdict = rows[i].verdict, a->judged = (uint32_t)rows[i].stage + 1;
        qw_step step = qw_next_step(&h, rows[i].stage);
        if (step.cause != rows[i].cause || step.best != rows[i].best)
            fail_msg("row %zu: cause %d, best %u; expected %d, %u", i, (int)step.cause, step.best, (int)rows[i].cause,
                     rows[i].best);
        if (step.cause != QW_NO_RETRY) qw_history_go_back(&h, &step);
        else h.current = step.best;
    }
    return h;
}
#define PLAY(request, ...) play((request), (const row[]){__VA_ARGS__}, sizeof((const row[]){__VA_ARGS__}) / sizeof(row))
#define INVERSIONS(...) \
    QW_STAGE_INVERSIONS, { __VA_ARGS__ }
#define REPAIR(...) \
    QW_STAGE_REPAIR, { __VA_ARGS__ }
#define SIMPLIFY(...) \
    QW_STAGE_SIMPLIFY, { __VA_ARGS__ }
#define RELAX(...) \
    QW_STAGE_RELAX, { __VA_ARGS__ }

static const qw_plan *last_plan(const qw_history *h) { return &h->attempt[h->count - 1].plan; }

/* ---- nothing is wrong */

static void a_good_attempt_goes_on(void **state)
{
    (void)state;
    qw_history h = PLAY(USUAL, {INVERSIONS(.inverted = 0), QW_NO_RETRY, 0},
                        {REPAIR(.topology_lost = 0), QW_NO_RETRY, 0}, {SIMPLIFY(.faces = 1015), QW_NO_RETRY, 0},
                        {RELAX(.uncovered = 0), QW_NO_RETRY, 0});
    assert_int_equal(h.count, 1);
    const qw_plan *p = last_plan(&h);
    assert_true(p->size_factor == 1);
    assert_int_equal(qw_history_asked_by(&h), -1);
    assert_int_equal(qw_history_went_to(&h), QW_STAGE_COUNT);
}

/* A fold of a few triangles among millions is left to repairs: another attempt would take minutes. */
static void a_small_fold_of_millions_is_let_be(void **state)
{
    (void)state;
    qw_request millions = USUAL;
    millions.faces_wanted = 5e6;
    PLAY(millions, {INVERSIONS(.inverted = 40), QW_NO_RETRY, 0},
         {REPAIR(.inverted = 40, .topology_lost = 1, .places = 1), QW_NO_RETRY, 0});
    PLAY(millions, {REPAIR(.topology_lost = 1, .places = 4), QW_RETRY_TOPOLOGY, QW_NO_ATTEMPT});
}

/* ---- the topology */

static void lost_topology_is_refined_once(void **state)
{
    (void)state;
    qw_history h = PLAY(USUAL, {REPAIR(.topology_lost = 1, .places = 4), QW_RETRY_TOPOLOGY, QW_NO_ATTEMPT},
                        {REPAIR(.topology_lost = 1, .places = 4), QW_NO_RETRY, 1});
    assert_int_equal(last_plan(&h)->refinements, 4);
    assert_int_equal(qw_history_asked_by(&h), QW_STAGE_REPAIR);
    assert_int_equal(qw_history_went_to(&h), QW_STAGE_WORKING);
    PLAY(USUAL, {REPAIR(.topology_lost = 1), QW_NO_RETRY, 0}); /* no place for smaller quads */
    qw_request few = USUAL, bare = USUAL;
    few.faces_needed = 1001, bare.repairs = 0;
    PLAY(few, {REPAIR(.topology_lost = 1, .places = 4), QW_NO_RETRY, 0});
    /* sizes aim at what is needed then */
    few.faces_needed = 2000;
    PLAY(few, {SIMPLIFY(.faces = 2010), QW_NO_RETRY, 0});
    h = PLAY(few, {SIMPLIFY(.faces = 2420), QW_RETRY_FACE_COUNT, 0}, {SIMPLIFY(.faces = 2000), QW_NO_RETRY, 1});
    assert_true(fabs(last_plan(&h)->size_factor - 1.1) < 1e-9);
    PLAY(bare, {REPAIR(.topology_lost = 1, .places = 4), QW_NO_RETRY, 0});
}

/* ---- the count */

static void another_size_as_long_as_it_helps(void **state)
{
    (void)state;
    qw_history h = PLAY(USUAL, {SIMPLIFY(.faces = 1210), QW_RETRY_FACE_COUNT, 0},
                        {SIMPLIFY(.faces = 1100), QW_RETRY_FACE_COUNT, 1}, {SIMPLIFY(.faces = 1150), QW_NO_RETRY, 1});
    assert_true(h.attempt[1].plan.size_factor > 1.0999 && h.attempt[1].plan.size_factor < 1.1001);
    assert_int_equal(h.current, 1);
    h = PLAY(USUAL, {SIMPLIFY(.faces = 9000), QW_RETRY_FACE_COUNT, 0}, {SIMPLIFY(.faces = 10), QW_NO_RETRY, 0});
    assert_true(last_plan(&h)->size_factor == QW_MOST_SIZE_STEP);
    PLAY(USUAL, {SIMPLIFY(.faces = 0), QW_NO_RETRY, 0});
    qw_request few = USUAL;
    few.faces_wanted = 400;
    PLAY(few, {SIMPLIFY(.faces = 419), QW_NO_RETRY, 0});
    PLAY(few, {SIMPLIFY(.faces = 421), QW_RETRY_FACE_COUNT, 0});
}

static void sizes_are_bounded(void **state)
{
    (void)state;
    PLAY(USUAL, {SIMPLIFY(.faces = 1900), QW_RETRY_FACE_COUNT, 0}, {SIMPLIFY(.faces = 1800), QW_RETRY_FACE_COUNT, 1},
         {SIMPLIFY(.faces = 1700), QW_RETRY_FACE_COUNT, 2}, {SIMPLIFY(.faces = 1600), QW_RETRY_FACE_COUNT, 3},
         {SIMPLIFY(.faces = 1500), QW_NO_RETRY, 4});
    PLAY(USUAL, {SIMPLIFY(.faces = 1900, .topology_lost = 1), QW_RETRY_FACE_COUNT, 0},
         {SIMPLIFY(.faces = 1800, .topology_lost = 1), QW_RETRY_FACE_COUNT, 1},
         {SIMPLIFY(.faces = 1700, .topology_lost = 1), QW_NO_RETRY, 2});
}

/* ---- what is uncovered or flipped */

static void uncovered_parts_and_flipped_quads_are_refined(void **state)
{
    (void)state;
    qw_history h = PLAY(USUAL, {RELAX(.uncovered = 3, .places = 2), QW_RETRY_COVERAGE, 0},
                        {RELAX(.flipped = 2, .places = 1), QW_RETRY_COVERAGE, 1},
                        {RELAX(.flipped = 1), QW_NO_RETRY, 2});
    assert_int_equal(h.attempt[1].plan.refinements, 2);
    assert_int_equal(h.attempt[2].plan.refinements, 3);
    assert_int_equal(qw_history_asked_by(&h), QW_STAGE_RELAX);
}

/* The last need not be the best; the first of equal ones is. */
static void the_best_round_is_taken(void **state)
{
    (void)state;
    PLAY(USUAL, {RELAX(.uncovered = 3, .places = 1), QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 5, .places = 1), QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 1, .flipped = 2, .places = 1), QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 9, .places = 1), QW_NO_RETRY, 0});
    PLAY(USUAL, {RELAX(.flipped = 2, .places = 1), QW_RETRY_COVERAGE, 0}, {RELAX(.flipped = 5), QW_NO_RETRY, 0});
}

static void rounds_are_bounded(void **state)
{
    (void)state;
    qw_request few = USUAL, large = USUAL, needed = USUAL, bare = USUAL;
    few.faces_wanted = 200, large.faces_wanted = 10000, needed.faces_needed = 1001, bare.repairs = 0;
    const qw_verdict bad = {.uncovered = 30, .places = 1};
    PLAY(few, {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0},
         {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0},
         {QW_STAGE_RELAX, bad, QW_NO_RETRY, 0});
    PLAY(large, {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0},
         {QW_STAGE_RELAX, bad, QW_NO_RETRY, 0});
    PLAY(large, {QW_STAGE_RELAX, bad, QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 5, .places = 1), QW_NO_RETRY, 1}); /* less than a protrusion has */
    PLAY(USUAL, {RELAX(.uncovered = 30, .places = 1, .working_vertices = 20000), QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 5, .places = 1, .working_vertices = 20000), QW_NO_RETRY, 1});
    PLAY(USUAL, {RELAX(.uncovered = 0.2, .places = 1, .protrusions = 1), QW_NO_RETRY, 0}); /* a tip */
    PLAY(USUAL, {RELAX(.uncovered = 0.2, .places = 1), QW_RETRY_COVERAGE, 0});
    PLAY(USUAL, {RELAX(.uncovered = 30), QW_NO_RETRY, 0}); /* no place for smaller quads */
    const qw_verdict rebuilt = {.flipped = 30, .places = 1, .topology_lost = 1},
                     less = {.flipped = 24, .places = 1, .topology_lost = 1};
    PLAY(USUAL, {QW_STAGE_RELAX, rebuilt, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, less, QW_NO_RETRY, 1}); /* in vain */
    PLAY(USUAL, {QW_STAGE_RELAX, rebuilt, QW_RETRY_COVERAGE, 0},
         {RELAX(.flipped = 17, .places = 1, .topology_lost = 1), QW_RETRY_COVERAGE, 1});
    PLAY(USUAL, {QW_STAGE_RELAX, rebuilt, QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 29, .places = 1, .topology_lost = 1), QW_RETRY_COVERAGE, 1});
    PLAY(few, {RELAX(.uncovered = 40, .flipped = 20, .places = 1, .topology_lost = 1), QW_NO_RETRY, 0}); /* hopeless */
    PLAY(few, {RELAX(.uncovered = 40, .flipped = 20, .places = 1), QW_RETRY_COVERAGE, 0});
    PLAY(needed, {QW_STAGE_RELAX, bad, QW_NO_RETRY, 0});
    PLAY(bare, {QW_STAGE_RELAX, bad, QW_NO_RETRY, 0});
}

/* Where cones leave the quads no room a round that does not help much is the last, nothing goes back for lost topology,
   and sizes are tried as often as where components are rebuilt. */
static void crowds_of_cones_end_early(void **state)
{
    (void)state;
    const qw_verdict tight = {.uncovered = 20, .places = 1, .lacks_room = 1},
                     little = {.uncovered = 14, .places = 1, .lacks_room = 1},
                     much = {.uncovered = 10, .places = 1, .lacks_room = 1}, roomy = {.uncovered = 14, .places = 1};
    PLAY(USUAL, {QW_STAGE_RELAX, tight, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, little, QW_NO_RETRY, 1});
    PLAY(USUAL, {QW_STAGE_RELAX, tight, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, much, QW_RETRY_COVERAGE, 1});
    PLAY(USUAL, {QW_STAGE_RELAX, tight, QW_RETRY_COVERAGE, 0}, {QW_STAGE_RELAX, roomy, QW_RETRY_COVERAGE, 1});
    PLAY(USUAL, {REPAIR(.topology_lost = 1, .places = 4, .lacks_room = 1), QW_NO_RETRY, 0});
    PLAY(USUAL, {SIMPLIFY(.faces = 1900, .lacks_room = 1), QW_RETRY_FACE_COUNT, 0},
         {SIMPLIFY(.faces = 1800, .lacks_room = 1), QW_RETRY_FACE_COUNT, 1},
         {SIMPLIFY(.faces = 1700, .lacks_room = 1), QW_NO_RETRY, 2});
    PLAY(USUAL, {SIMPLIFY(.faces = 1900, .lacks_room = 2), QW_RETRY_FACE_COUNT, 0},
         {SIMPLIFY(.faces = 1800, .lacks_room = 2), QW_NO_RETRY, 1});
    PLAY(USUAL, {RELAX(.uncovered = 2, .places = 1, .lacks_room = 2), QW_NO_RETRY, 0});
}

/* Where thousands of components need much of a large count: no round for flipped quads, one other size. */
static void crowds_of_components_end_early(void **state)
{
    (void)state;
    qw_request leaves = USUAL, few = USUAL;
    leaves.faces_wanted = few.faces_wanted = 60000, leaves.components = 6700;
    few.faces_needed = 40000; /* one with many holes */
    const qw_verdict flipped = {.flipped = 60, .places = 9}, bare = {.uncovered = 60, .places = 9};
    PLAY(leaves, {QW_STAGE_RELAX, flipped, QW_NO_RETRY, 0});
    PLAY(leaves, {QW_STAGE_RELAX, bare, QW_RETRY_COVERAGE, 0});
    PLAY(few, {QW_STAGE_RELAX, flipped, QW_RETRY_COVERAGE, 0});
    PLAY(leaves, {SIMPLIFY(.faces = 90000, .topology_lost = 1), QW_RETRY_FACE_COUNT, 0},
         {SIMPLIFY(.faces = 80000, .topology_lost = 1), QW_NO_RETRY, 1});
    PLAY(leaves, {SIMPLIFY(.faces = 90000), QW_RETRY_FACE_COUNT, 0},
         {SIMPLIFY(.faces = 80000), QW_RETRY_FACE_COUNT, 1});
}

/* Where room for protrusions left long quads or not all of them, they grow out of fewer quads, once; the attempt that
   leaves less is taken, and later rounds keep the quads for them. */
static void protrusions_grow_out_of_fewer_quads(void **state)
{
    (void)state;
    const qw_verdict bad = {.lacking = 200, .misshapen = 60};
    qw_history h = PLAY(USUAL, {QW_STAGE_RELAX, bad, QW_RETRY_PROTRUSIONS, 0},
                        {RELAX(.misshapen = 10), QW_NO_RETRY, 1});
    assert_true(last_plan(&h)->reserve == 200 && last_plan(&h)->size_factor == 1);
    PLAY(USUAL, {QW_STAGE_RELAX, bad, QW_RETRY_PROTRUSIONS, 0}, {RELAX(.misshapen = 60), QW_NO_RETRY, 0});
    h = PLAY(USUAL, {QW_STAGE_RELAX, bad, QW_RETRY_PROTRUSIONS, 0},
             {RELAX(.lacking = 20, .misshapen = 50, .flipped = 4, .places = 1), QW_RETRY_COVERAGE, 1},
             {RELAX(.misshapen = 50), QW_NO_RETRY, 2});
    assert_true(last_plan(&h)->reserve == 200 && last_plan(&h)->refinements == 1);
    /* the first attempt has fewest faults with misshapen quads, but was given up for the second before they counted */
    PLAY(USUAL, {RELAX(.uncovered = 20, .misshapen = 5, .places = 1), QW_RETRY_COVERAGE, 0},
         {RELAX(.uncovered = 10, .lacking = 200, .misshapen = 60), QW_RETRY_PROTRUSIONS, 1},
         {RELAX(.misshapen = 90), QW_NO_RETRY, 1});
    h = PLAY(USUAL, {RELAX(.lacking = 700, .misshapen = 60), QW_RETRY_PROTRUSIONS, 0});
    assert_true(last_plan(&h)->reserve == 400);
    PLAY(USUAL, {RELAX(.lacking = 200, .misshapen = 20), QW_NO_RETRY, 0}); /* hardly any */
    PLAY(USUAL, {RELAX(.misshapen = 60), QW_NO_RETRY, 0});                 /* not for lack of room */
    PLAY(USUAL, {RELAX(.lacking = 9, .misshapen = 1000), QW_NO_RETRY, 0}); /* the count is off */
    qw_request needed = USUAL, bare = USUAL;
    needed.faces_needed = 900, bare.repairs = 0;
    PLAY(needed, {QW_STAGE_RELAX, bad, QW_NO_RETRY, 0});
    PLAY(bare, {QW_STAGE_RELAX, bad, QW_NO_RETRY, 0});
}

/* A round begins with the size that the last one found, and may look for it again. */
static void a_round_looks_for_its_own_size(void **state)
{
    (void)state;
    qw_history h =
        PLAY(USUAL, {SIMPLIFY(.faces = 1210), QW_RETRY_FACE_COUNT, 0}, {SIMPLIFY(.faces = 1000), QW_NO_RETRY, 1},
             {RELAX(.flipped = 4, .places = 1), QW_RETRY_COVERAGE, 1},
             {SIMPLIFY(.faces = 1300), QW_RETRY_FACE_COUNT, 2}, {SIMPLIFY(.faces = 1250), QW_RETRY_FACE_COUNT, 3},
             {SIMPLIFY(.faces = 1260), QW_NO_RETRY, 3}, {RELAX(.flipped = 5), QW_NO_RETRY, 1});
    assert_true(h.attempt[2].plan.size_factor == h.attempt[1].plan.size_factor);
}

/* ---- the bounds, the table, the document */

static uint32_t random_below(uint64_t *seed, uint32_t limit) { return (uint32_t)(random_bits(seed) >> 20) % limit; }

static qw_verdict random_verdict(uint64_t *seed)
{
    return (qw_verdict){.inverted = random_below(seed, 4),
                        .topology_lost = random_below(seed, 2),
                        .faces = 100 * (1 + random_below(seed, 30)),
                        .uncovered = random_below(seed, 20),
                        .flipped = random_below(seed, 20),
                        .lacking = random_below(seed, 3) ? 0 : random_below(seed, 300),
                        .misshapen = random_below(seed, 100),
                        .places = random_below(seed, 200),
                        .sides_apart = random_below(seed, 2),
                        .count_off = random_below(seed, 2),
                        .rims_flipped = random_below(seed, 4) == 0};
}

/* More quads for the core each time, no fewer than there were; then another plane where that is allowed. */
static void sides_apart_ask_for_room_and_planes(void **state)
{
    (void)state;
    qw_request request = USUAL;
    qw_history h;
    double asked[5] = {0};
    for (uint32_t planes = 0; planes < 2; planes++) {
        request.planes = planes;
        qw_history_begin(&h);
        h.request = request;
        for (int i = 0; i < 4; i++) {
            h.attempt[0].verdict = (qw_verdict){.faces = 1200, .sides_apart = 1}, h.attempt[0].judged = QW_STAGE_COUNT;
            qw_step step = qw_next_step(&h, QW_STAGE_ASSEMBLE);
            assert_int_equal(step.cause, QW_RETRY_NO_ROOM);
            asked[i + 1] = step.plan.core_faces;
            assert_true(asked[i + 1] > asked[i] && asked[1] == 1224);
            qw_history_go_back(&h, &step);
            assert_int_equal(h.earlier, i + 1);
        }
        h.attempt[0].verdict = (qw_verdict){.faces = 1200, .sides_apart = 1}, h.attempt[0].judged = QW_STAGE_COUNT;
        qw_step step = qw_next_step(&h, QW_STAGE_ASSEMBLE);
        assert_int_equal(step.cause, planes ? QW_RETRY_PLANE : QW_NO_RETRY);
        if (planes) assert_true(step.plan.plane == 1 && step.plan.room == 0 && step.plan.core_faces == 0);
        assert_int_equal(qw_history_asked_by(&h), QW_STAGE_ASSEMBLE);
        assert_int_equal(qw_history_went_to(&h), QW_STAGE_WORKING);
    }
    PLAY(request, {QW_STAGE_ASSEMBLE, {.count_off = 1}, QW_RETRY_PLANE, QW_NO_ATTEMPT},
         {QW_STAGE_ASSEMBLE, {.count_off = 0}, QW_NO_RETRY, 0});
}

/* Whatever is seen, every run ends; each row of the table comes up, as often as it says in its loop at most, after its
   stage; and whoever is to be kept or taken is an attempt that was judged there. */
static void the_rows_are_all_the_causes(void **state)
{
    (void)state;
    static const qw_stage judged[] = {QW_STAGE_INVERSIONS, QW_STAGE_REPAIR, QW_STAGE_SIMPLIFY, QW_STAGE_RELAX,
                                      QW_STAGE_ASSEMBLE};
    uint32_t seen[QW_RETRIES] = {0}, most = 0;
    uint64_t seed = 4711;
    for (int run = 0; run < 20000; run++) {
        qw_history h;
        qw_history_begin(&h);
        h.request = USUAL;
        h.request.faces_wanted = random_below(&seed, 2) ? 1000 : 100;
        uint32_t since[QW_RETRIES] = {0};
        uint32_t at_plane = 0;
        h.request.planes = random_below(&seed, 2);
        for (int at = 0; at < 5; at++) {
            qw_attempt *a = &h.attempt[h.current];
            a->verdict = random_verdict(&seed), a->judged = (uint32_t)judged[at] + 1;
            qw_step step = qw_next_step(&h, judged[at]);
            assert_true(step.best == QW_NO_ATTEMPT || h.attempt[step.best].judged > (uint32_t)judged[at]);
            if (step.cause == QW_NO_RETRY) {
                h.current = step.best;
                continue;
            }
            const qw_retry_row *r = &qw_retry_rows[step.cause];
            assert_int_equal(r->after, judged[at]);
            seen[step.cause]++;
            if (qw_begins_anew(r)) { /* bounded by the plan: no candidate is kept */
                assert_int_equal(step.best, QW_NO_ATTEMPT);
                at_plane = step.cause == QW_RETRY_NO_ROOM ? at_plane + 1 : 0;
                assert_true(at_plane <= r->most && step.plan.plane <= qw_retry_rows[QW_RETRY_PLANE].most);
                assert_true(step.plan.plane == 0 || h.request.planes);
                assert_true(step.plan.keeps_teeth == 1 || !h.attempt[0].plan.keeps_teeth);
                memset(since, 0, sizeof since);
                qw_history_go_back(&h, &step);
                assert_true(h.count == 1 && h.earlier > 0 && h.attempt[0].plan.plane == step.plan.plane);
                at = -1;
                continue;
            }
            for (int i = 0; i < QW_RETRIES; i++) /* what goes back further begins the counts anew */
                if (qw_retry_rows[i].back > r->back) since[i] = 0;
            assert_true(++since[step.cause] <= r->most);
            assert_true(h.count < QW_MAX_ATTEMPTS);
            qw_history_go_back(&h, &step);
            if (h.count > most) most = h.count;
            while (at >= 0 && judged[at] > r->back) at--;
        }
    }
    for (int i = 0; i < QW_RETRIES; i++)
        if (seen[i] == 0) fail_msg("the row %s never comes up", qw_retry_rows[i].name);
    print_message("%u attempts at most\n", most);
}

/* docs/dev/pipeline.md shows every row, with its stages, its bound and its sentence, and no other. */
static void the_document_shows_the_table(void **state)
{
    (void)state;
    FILE *file = fopen(QW_SOURCE_DIR "/docs/dev/pipeline.md", "rb");
    assert_non_null(file);
    char *text = calloc(1, 1 << 20), line[1024];
    assert_true(fread(text, 1, (1 << 20) - 1, file) > 0);
    fclose(file);
    for (int i = 0; i < QW_RETRIES; i++) {
        const qw_retry_row *r = &qw_retry_rows[i];
        snprintf(line, sizeof line, "| `%s` | %s | %s | %u | %s |\n", r->name, qw_stage_title(r->after),
                 qw_stage_title(r->back), r->most, r->sentence);
        print_message("%s", line);
        if (!strstr(text, line)) fail_msg("docs/dev/pipeline.md lacks the row\n%s", line);
    }
    size_t rows = 0;
    for (const char *at = text; (at = strstr(at, "\n| `")); at++) rows++;
    assert_int_equal(rows, QW_RETRIES);
    free(text);
}

QW_TEST_SUITE(retry)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_attempt_goes_on),
        cmocka_unit_test(a_small_fold_of_millions_is_let_be),
        cmocka_unit_test(lost_topology_is_refined_once),
        cmocka_unit_test(another_size_as_long_as_it_helps),
        cmocka_unit_test(sizes_are_bounded),
        cmocka_unit_test(uncovered_parts_and_flipped_quads_are_refined),
        cmocka_unit_test(the_best_round_is_taken),
        cmocka_unit_test(rounds_are_bounded),
        cmocka_unit_test(crowds_of_cones_end_early),
        cmocka_unit_test(crowds_of_components_end_early),
        cmocka_unit_test(protrusions_grow_out_of_fewer_quads),
        cmocka_unit_test(a_round_looks_for_its_own_size),
        cmocka_unit_test(sides_apart_ask_for_room_and_planes),
        cmocka_unit_test(the_rows_are_all_the_causes),
        cmocka_unit_test(the_document_shows_the_table),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
