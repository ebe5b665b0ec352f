/* Dumps: after any stage, taken up in another context, the run ends with the same bytes; a damaged dump fails with a
 * sentence. */
#include "random.h"
#include "suite.h"
#include "shapes.h"
#include "run/dump.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

#define PATH       QW_BINARY_DIR "/test_state.qws"
#define OTHER_PATH QW_BINARY_DIR "/test_state_other.qws"

static qw_options options_for(int64_t faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    options.threads = 1;
    return options;
}

static qw_context *with_mesh(const shape *s)
{
    qw_context *context;
    qw_mesh_view view = shape_view(s);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    return context;
}

static void assert_same_mesh(const qw_context *a, const qw_context *b)
{
    qw_mesh_view x, y;
    assert_int_equal(qw_get_mesh(a, &x), QW_OK);
    assert_int_equal(qw_get_mesh(b, &y), QW_OK);
    assert_int_equal(x.vertex_count, y.vertex_count);
    assert_int_equal(x.face_count, y.face_count);
    assert_true(x.face_count > 0);
    assert_memory_equal(x.positions, y.positions, (size_t)x.vertex_count * 3 * sizeof(double));
    assert_memory_equal(x.corners, y.corners, (size_t)x.face_count * 4 * sizeof(uint32_t));
}

/* What does not depend on the clock. */
static void assert_same_report(const qw_report *a, const qw_report *b)
{
    qw_report x = *a, y = *b;
    x.seconds = y.seconds = 0, x.peak_bytes = y.peak_bytes = 0;
    memset(x.stages, 0, sizeof x.stages), memset(y.stages, 0, sizeof y.stages);
    assert_memory_equal(&x, &y, sizeof x);
}

/* ---- the same bytes */

static void every_stage(const shape *s, const qw_options *options)
{
    qw_context *direct = with_mesh(s), *dumped = with_mesh(s);
    assert_int_equal(qw_run(direct, options), QW_OK);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
        assert_int_equal(qw_run_until(dumped, options, (qw_stage)stage), QW_OK);
        assert_int_equal(qw_dump(dumped, PATH), QW_OK);
        qw_context *resumed;
        assert_int_equal(qw_create(NULL, &resumed), QW_OK);
        if (qw_resume(resumed, PATH) != QW_OK) fail_msg("stage %d: %s", stage, qw_message(resumed));
        assert_string_equal(qw_message(resumed), "");
        assert_int_equal(qw_run(resumed, options), QW_OK);
        assert_same_mesh(direct, resumed);
        assert_same_report(qw_get_report(direct), qw_get_report(resumed));
        qw_destroy(resumed);
    }
    assert_same_mesh(direct, dumped);
    qw_destroy(direct);
    qw_destroy(dumped);
}

static void solids_and_sheets(void **state)
{
    (void)state;
    static shape (*const makers[])(int) = {shape_torus, shape_moebius, shape_two_cubes, shape_plate};
    for (size_t i = 0; i < sizeof makers / sizeof *makers; i++) {
        shape s = makers[i](6);
        qw_options options = options_for(60 + 30 * (int64_t)i);
        every_stage(&s, &options);
        shape_free(&s);
    }
}

static void other_options(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options options = options_for(150);
    options.adaptive = 0.7, options.seed = 5, options.sharp_angle = 20.25;
    every_stage(&s, &options);
    options.repair = options.relax = 0, options.threads = 2;
    every_stage(&s, &options);
    shape_free(&s);
}

/* A resumed run knows the options it was dumped with: others make stale what they bear on, and no more. */
static void options_after_resuming(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options first = options_for(120), second = first;
    qw_context *dumped = with_mesh(&s), *resumed;
    assert_int_equal(qw_run(dumped, &first), QW_OK);
    assert_int_equal(qw_dump(dumped, PATH), QW_OK);
    for (int change = 0; change < 4; change++) {
        second = first;
        if (change == 0) second.relax = 0;
        if (change == 1) second.seed = 9;
        if (change == 2) second.flow = 0;
        if (change == 3) second.faces = 200;
        qw_context *fresh = with_mesh(&s);
        assert_int_equal(qw_run(fresh, &second), QW_OK);
        assert_int_equal(qw_create(NULL, &resumed), QW_OK);
        assert_int_equal(qw_resume(resumed, PATH), QW_OK);
        assert_int_equal(qw_run(resumed, &second), QW_OK);
        assert_same_mesh(fresh, resumed);
        qw_destroy(fresh);
        qw_destroy(resumed);
    }
    qw_destroy(dumped);
    shape_free(&s);
}

/* Two components of which the best versions were put together: without repair there are none, and what was judged with
   it counts no more. */
static void no_repair_after_resuming(void **state)
{
    (void)state;
    shape s = shape_torus(4), two = {2 * s.vertex_count, 2 * s.face_count, NULL, NULL};
    size_t places = 3 * (size_t)s.vertex_count, corners = 3 * (size_t)s.face_count;
    two.position = malloc(2 * places * sizeof *two.position), two.corner = malloc(2 * corners * sizeof *two.corner);
    for (size_t i = 0; i < 2 * places; i++)
        two.position[i] = i < places ? s.position[i] : s.position[i - places] / 2 + (i % 3 == 0 ? 5 : 0);
    for (size_t i = 0; i < 2 * corners; i++)
        two.corner[i] = i < corners ? s.corner[i] : s.corner[i - corners] + s.vertex_count;
    for (int64_t faces = 2; faces <= 17; faces++) {
        qw_options first = options_for(faces), second = first;
        second.repair = 0;
        qw_context *dumped = with_mesh(&two), *resumed;
        assert_int_equal(qw_run_until(dumped, &first, QW_STAGE_RELAX), QW_OK);
        assert_int_equal(qw_dump(dumped, PATH), QW_OK);
        assert_int_equal(qw_create(NULL, &resumed), QW_OK);
        assert_int_equal(qw_resume(resumed, PATH), QW_OK);
        if (qw_run(resumed, &second) != QW_OK) fail_msg("%lld: %s", (long long)faces, qw_message(resumed));
        qw_destroy(resumed), qw_destroy(dumped);
    }
    qw_options few = options_for(1); /* nothing may be left of so few without repair: that is no result */
    few.repair = 0;
    qw_context *context = with_mesh(&two);
    qw_mesh_view quads = {0};
    qw_status status = qw_run(context, &few);
    if (status == QW_OK) assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    assert_true(status == QW_INTERNAL || quads.face_count > 0);
    qw_destroy(context);
    shape_free(&s), shape_free(&two);
}

/* A resumed state is worth as much as the one it came from: it is dumped to the same bytes. */
static void dumped_again(void **state)
{
    (void)state;
    shape s = shape_disc(8);
    qw_options options = options_for(80);
    qw_context *context = with_mesh(&s), *resumed;
    for (int stage = 0; stage < QW_STAGE_COUNT; stage += 3) {
        assert_int_equal(qw_run_until(context, &options, (qw_stage)stage), QW_OK);
        assert_int_equal(qw_dump(context, PATH), QW_OK);
        assert_int_equal(qw_create(NULL, &resumed), QW_OK);
        assert_int_equal(qw_resume(resumed, PATH), QW_OK);
        assert_int_equal(qw_dump(resumed, OTHER_PATH), QW_OK);
        assert_int_equal(system("cmp -s " PATH " " OTHER_PATH), 0);
        qw_destroy(resumed);
    }
    qw_destroy(context);
    shape_free(&s);
    remove(OTHER_PATH);
}

/* ---- refusals */

static void calls_out_of_place(void **state)
{
    (void)state;
    shape s = shape_cube(2);
    qw_options options = options_for(30);
    qw_context *context;
    assert_int_equal(qw_dump(NULL, PATH), QW_ARGUMENT);
    assert_int_equal(qw_resume(NULL, PATH), QW_ARGUMENT);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_dump(context, PATH), QW_NOT_READY);
    assert_true(strlen(qw_message(context)) > 0);
    assert_int_equal(qw_resume(context, NULL), QW_ARGUMENT);
    assert_int_equal(qw_resume(context, "/no/such/dump"), QW_FILE_MISSING);
    assert_non_null(strstr(qw_message(context), "/no/such/dump"));
    assert_int_equal(qw_resume(context, QW_BINARY_DIR), QW_FILE_IS_DIRECTORY);
    qw_mesh_view view = shape_view(&s);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK); /* failures have left it empty and useful */
    assert_int_equal(qw_dump(context, PATH), QW_NOT_READY);
    assert_int_equal(qw_run_until(context, &options, QW_STAGE_WORKING), QW_OK);
    assert_int_equal(qw_dump(context, NULL), QW_ARGUMENT);
    assert_int_equal(qw_dump(context, ""), QW_ARGUMENT);
    assert_int_equal(qw_dump(context, "/no/such/folder/dump"), QW_FILE_UNWRITABLE);
    assert_int_equal(qw_dump(context, PATH), QW_OK);
    assert_int_equal(qw_resume(context, PATH), QW_ARGUMENT); /* it has a mesh, and keeps it */
    assert_int_equal(qw_run(context, &options), QW_OK);
    qw_destroy(context);
    shape_free(&s);
}

/* ---- damage */

typedef struct bytes {
    char *at;
    size_t size;
} bytes;

static bytes slurp(const char *path)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    bytes b = {.size = (size_t)ftell(file)};
    rewind(file);
    b.at = malloc(b.size);
    assert_int_equal(fread(b.at, 1, b.size, file), b.size);
    fclose(file);
    return b;
}

static void spill(const char *path, const void *at, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(at, 1, size, file), size);
    fclose(file);
}

/* A dump of a small run after so many stages. */
static bytes small_dump(int stages)
{
    shape s = shape_disc(3);
    qw_options options = options_for(12);
    qw_context *context = with_mesh(&s);
    assert_int_equal(qw_run_until(context, &options, (qw_stage)(stages - 1)), QW_OK);
    assert_int_equal(qw_dump(context, PATH), QW_OK);
    qw_destroy(context);
    shape_free(&s);
    return slurp(PATH);
}

static qw_status resume_bytes(const void *at, size_t size, char *message)
{
    spill(PATH, at, size);
    qw_context *context;
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    assert_int_equal(qw_create(&host, &context), QW_OK);
    qw_status status = qw_resume(context, PATH);
    snprintf(message, 512, "%s", qw_message(context));
    qw_mesh_view mesh;
    if (status != QW_OK) {
        qw_options options = options_for(12);
        assert_true(strlen(message) > 0);
        assert_int_equal(qw_run(context, &options), QW_NOT_READY);
        assert_int_equal(qw_get_mesh(context, &mesh), QW_NOT_READY);
    }
    qw_destroy(context);
    return status;
}

static void cut_short(void **state)
{
    (void)state;
    char message[512];
    bytes b = small_dump(QW_STAGE_COUNT);
    assert_int_equal(resume_bytes(b.at, 0, message), QW_FILE_EMPTY);
    for (size_t size = 1; size < b.size; size += size < 1000 ? 1 : 1 + size / 97) {
        qw_status status = resume_bytes(b.at, size, message);
        if (status != QW_FORMAT_TRUNCATED)
            fail_msg("cut at %zu of %zu: %s: %s", size, b.size, qw_status_name(status), message);
    }
    char *longer = calloc(1, b.size + 1);
    memcpy(longer, b.at, b.size);
    assert_int_equal(resume_bytes(longer, b.size + 1, message), QW_FORMAT_SYNTAX);
    free(longer);
    free(b.at);
}

static void flipped_bits(void **state)
{
    (void)state;
    char message[512];
    uint64_t seed = 12345;
    bytes b = small_dump(QW_STAGE_COUNT);
    for (int i = 0; i < 700; i++) {
        size_t byte = i < 200 ? (size_t)i : random_bits(&seed) % b.size;
        char before = b.at[byte];
        b.at[byte] = (char)(before ^ (1 << random_bits(&seed) % 8));
        qw_status status = resume_bytes(b.at, b.size, message);
        if (status != QW_FORMAT_SYNTAX && status != QW_FORMAT_UNKNOWN && status != QW_FORMAT_TRUNCATED)
            fail_msg("byte %zu: %s: %s", byte, qw_status_name(status), message);
        b.at[byte] = before;
    }
    free(b.at);
}

/* ---- forgery: elements changed and the sums made to agree */

static qw_state_record record_at(const bytes *b, size_t at)
{
    qw_state_record r;
    memcpy(&r, b->at + at, sizeof r);
    return r;
}

static size_t own_bytes(const qw_state_record *r, uint32_t number)
{
    return r->bytes_of == number ? r->count * r->element_size : 0;
}

static void sign(bytes *b, size_t at, uint32_t number)
{
    qw_state_record r = record_at(b, at);
    r.sum = qw_state_sum(&r, b->at + at + sizeof r, own_bytes(&r, number));
    memcpy(b->at + at, &r, sizeof r);
}

static void forge(bytes *b, size_t at, uint32_t number, uint64_t *seed)
{
    static const uint32_t words[] = {0,          1,          3,          5,          100,        0x7fffffff, 0x80000000,
                                     0xfffffffe, 0xffffffff, 0x7fc00000, 0x7f800000, 0x7f7fffff, 0xbf800000};
    qw_state_record r = record_at(b, at);
    size_t size = own_bytes(&r, number);
    uint32_t word = words[random_bits(seed) % (sizeof words / sizeof *words)];
    size_t width = r.element_size == 1 || size < 4 ? 1 : 4;
    if (size == 0) return;
    memcpy(b->at + at + sizeof r + random_bits(seed) % (size / width) * width, &word, width);
    sign(b, at, number);
}

/* Ends with a failure and a sentence, or with a mesh whose indices hold. */
static void try_forgery(const bytes *b)
{
    spill(PATH, b->at, b->size);
    qw_context *context;
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    qw_options options = options_for(12);
    assert_int_equal(qw_create(&host, &context), QW_OK);
    qw_status status = qw_resume(context, PATH);
    if (status != QW_OK) assert_true(strlen(qw_message(context)) > 0);
    if (status == QW_OK && qw_run(context, &options) == QW_OK) {
        qw_mesh_view mesh;
        assert_int_equal(qw_get_mesh(context, &mesh), QW_OK);
        for (size_t i = 0; i < 4 * (size_t)mesh.face_count; i++) assert_true(mesh.corners[i] < mesh.vertex_count);
    }
    qw_destroy(context);
}

static void forged_elements(void **state)
{
    (void)state;
    uint64_t seed = 777;
    for (int stages = 1; stages <= QW_STAGE_COUNT; stages++) {
        bytes whole = small_dump(stages);
        uint32_t number = 0;
        for (size_t at = QW_STATE_HEADER; at < whole.size; number++) {
            qw_state_record r = record_at(&whole, at);
            bytes forged = {malloc(whole.size), whole.size};
            memcpy(forged.at, whole.at, whole.size);
            forge(&forged, at, number, &seed);
            try_forgery(&forged);
            free(forged.at);
            at += sizeof r + own_bytes(&r, number);
        }
        free(whole.at);
    }
}

/* The dump with another value in the record at `at`. */
static bool is_refused(const bytes *whole, size_t at, uint32_t number, const void *value, size_t size)
{
    bytes forged = {malloc(whole->size), whole->size};
    memcpy(forged.at, whole->at, whole->size);
    memcpy(forged.at + at + sizeof(qw_state_record), value, size);
    sign(&forged, at, number);
    spill(PATH, forged.at, forged.size);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    bool refused = qw_resume(context, PATH) != QW_OK;
    if (!refused) print_message("record %u is taken with another value\n", number);
    qw_destroy(context);
    free(forged.at);
    return refused;
}

/* Single numbers that no run makes and that would spoil one: refused whatever the file's sums say. */
static void forged_sizes(void **state)
{
    (void)state;
    static const char *const names[] = {"run.whole.hidden", "run.whole.clean.wrapped"};
    static const double values[] = {-1, NAN, INFINITY};
    qw_history forged;
    memset(&forged, 0xff, sizeof forged); /* more attempts than there can be */
    bytes whole = small_dump(QW_STAGE_WORKING + 1);
    uint32_t number = 0, refused = 0;
    for (size_t at = QW_STATE_HEADER; at < whole.size; number++) {
        qw_state_record r = record_at(&whole, at);
        for (size_t n = 0; n < sizeof names / sizeof *names; n++)
            for (size_t v = 0; v < 3 && strcmp(r.name, names[n]) == 0; v++)
                refused += is_refused(&whole, at, number, &values[v], sizeof values[v]);
        if (strcmp(r.name, "history") == 0) refused += is_refused(&whole, at, number, &forged, sizeof forged);
        at += sizeof r + own_bytes(&r, number);
    }
    free(whole.at);
    assert_int_equal(refused, 7);
}

QW_TEST_SUITE(state)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(solids_and_sheets),
        cmocka_unit_test(other_options),
        cmocka_unit_test(options_after_resuming),
        cmocka_unit_test(no_repair_after_resuming),
        cmocka_unit_test(dumped_again),
        cmocka_unit_test(calls_out_of_place),
        cmocka_unit_test(cut_short),
        cmocka_unit_test(flipped_bits),
        cmocka_unit_test(forged_elements),
        cmocka_unit_test(forged_sizes),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    remove(PATH);
    return failed;
}
