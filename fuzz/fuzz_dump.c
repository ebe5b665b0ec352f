/* Dumps with altered values behind checksums that agree: a refusal with a sentence, or a run that ends. The bytes
 * choose a surface, a stage after which a run of it is dumped, and what is altered: single numbers in single records,
 * by values at the limits, by small steps, by one another. So inputs are short, and need no dump of this version of the
 * library. */
#define _XOPEN_SOURCE 700 /* fileno, ftruncate, pwrite */
#include "run/dump.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SURFACES = 3, MOST_VERTICES = 16, MOST_TRIANGLES = 28, MOST_RECORDS = 400, MOST_SIZE = 1 << 20, EDIT = 6 };

typedef struct record {
    char name[QW_STATE_NAME];
    size_t at, size; /* of its own bytes */
    uint32_t width;  /* of its numbers: 1, 4 or 8 */
} record;

typedef struct dump {
    uint8_t *bytes;
    size_t size;
    uint32_t count;
    record record[MOST_RECORDS];
} dump;

static dump dumps[SURFACES][QW_STAGE_COUNT];
static FILE *file; /* what is resumed */
static char path[32];

static void must(int condition, const char *what)
{
    if (!condition) fprintf(stderr, "%s\n", what), abort();
}

/* ---- dumps to alter */

/* An open square with a bump, a tetrahedron beside a small one, and a box with an open end. */
static qw_mesh_view surface_of(int which)
{
    static const double square[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 1, 1, .5, 2, 1, 0, 0, 2, 0, 1, 2, 0, 2, 2, 0};
    static const uint32_t square_corners[] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 3, 4, 7, 3, 7, 6, 4, 5, 8, 4, 8, 7};
    static const double two[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0, 0, 3.1, 0, 0, 3, .1, 0, 3, 0, .1};
    static const uint32_t two_corners[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3, 4, 6, 5, 4, 5, 7, 5, 6, 7, 6, 4, 7};
    static const double box[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1, 2};
    static const uint32_t box_corners[] = {0, 2, 1, 0, 3, 2, 0, 1, 5, 0, 5, 4, 1, 2, 6,
                                           1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    qw_mesh_view v = {.size = sizeof v, .uniform_face_size = 3};
    if (which == 0) v.vertex_count = 9, v.face_count = 8, v.positions = square, v.corners = square_corners;
    if (which == 1) v.vertex_count = 8, v.face_count = 8, v.positions = two, v.corners = two_corners;
    if (which == 2) v.vertex_count = 8, v.face_count = 10, v.positions = box, v.corners = box_corners;
    return v;
}

static qw_options options_of(int which)
{
    qw_options o;
    qw_options_init(&o);
    o.faces = 12 + 6 * which;
    o.threads = 1;
    if (which == 1) o.adaptive = 0.5;
    if (which == 2) o.sharp_angle = 30;
    return o;
}

static void list_records(dump *d)
{
    for (size_t at = QW_STATE_HEADER; at < d->size; d->count++) {
        qw_state_record r;
        must(d->count < MOST_RECORDS, "too many records");
        memcpy(&r, d->bytes + at, sizeof r);
        size_t own = r.bytes_of == d->count ? r.count * r.element_size : 0;
        uint32_t width = r.element_size % 8 == 0 ? 8 : r.element_size % 4 == 0 ? 4 : 1;
        record *to = &d->record[d->count];
        *to = (record){.at = at + sizeof r, .size = own, .width = width};
        memcpy(to->name, r.name, sizeof r.name);
        at += sizeof r + own;
    }
}

static void make_dump(dump *d, qw_context *context)
{
    d->bytes = malloc(MOST_SIZE);
    must(d->bytes && ftruncate(fileno(file), 0) == 0 && lseek(fileno(file), 0, SEEK_SET) == 0, "no file to dump to");
    must(qw_dump(context, path) == QW_OK && lseek(fileno(file), 0, SEEK_SET) == 0, "a run is not dumped");
    d->size = (size_t)read(fileno(file), d->bytes, MOST_SIZE);
    must(d->size < MOST_SIZE, "a dump is too large");
    list_records(d);
}

static void make_dumps(void)
{
    file = tmpfile();
    must(file != NULL, "there is no temporary file");
    snprintf(path, sizeof path, "/dev/fd/%d", fileno(file));
    for (int s = 0; s < SURFACES; s++) {
        qw_context *context;
        qw_mesh_view view = surface_of(s);
        qw_options options = options_of(s);
        must(qw_create(NULL, &context) == QW_OK && qw_set_mesh(context, &view) == QW_OK, "a mesh is not taken");
        for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
            must(qw_run_until(context, &options, (qw_stage)stage) == QW_OK, "a run fails");
            make_dump(&dumps[s][stage], context);
        }
        qw_destroy(context);
    }
}

/* ---- altering */

static uint64_t changed(uint64_t was, uint64_t other, uint32_t width, uint8_t how, uint8_t raw)
{
    static const uint64_t words[] = {0,          1,          3,          100,
                                     0x7fffffff, 0x80000000, 0xfffffffe, 0xffffffff, /* and as floats: */
                                     0x7fc00000, 0x7f800000, 0x7f7fffff, 0xbf800000,
                                     0x00000001, 0x461c3ffe, 0x358637bd, 0x3f800000};
    static const double reals[] = {0, -1, 1e-300, 1e300, INFINITY, NAN, 0.5, 2};
    uint64_t bits = 0;
    switch (how % 8) {
    case 0: return was + 1;
    case 1: return was - 1;
    case 2: return was ^ UINT64_C(1) << raw % (8 * width);
    case 3: return other;
    case 4: return raw;
    case 5: {
        float f;
        memcpy(&f, &was, sizeof f);
        f *= ldexpf(1, (int)(raw % 32) - 16);
        memcpy(&bits, &f, sizeof f);
        return width == 4 ? bits : was << 1;
    }
    case 6: memcpy(&bits, &reals[raw % 8], sizeof bits); return width == 8 ? bits : words[raw % 16];
    default: return words[raw % 16];
    }
}

static void sign(uint8_t *bytes, const record *r)
{
    qw_state_record head;
    memcpy(&head, bytes + r->at - sizeof head, sizeof head);
    head.sum = qw_state_sum(&head, bytes + r->at, r->size);
    memcpy(bytes + r->at - sizeof head, &head, sizeof head);
}

/* edit: record, element (2), how, raw, other element. */
static void alter(uint8_t *bytes, const dump *d, const uint8_t *edit)
{
    uint32_t number = (uint32_t)(edit[0] | edit[5] >> 7 << 8) % d->count;
    const record *r = &d->record[number];
    if (r->size == 0 || strcmp(r->name, "options") == 0) return;
    size_t elements = r->size / r->width, i = (size_t)(edit[1] | edit[2] << 8) % elements,
           k = (i + edit[5] % 128) % elements;
    uint64_t was = 0, other = 0;
    memcpy(&was, bytes + r->at + i * r->width, r->width);
    memcpy(&other, bytes + r->at + k * r->width, r->width);
    uint64_t is = changed(was, other, r->width, edit[3], edit[4]);
    memcpy(bytes + r->at + i * r->width, &is, r->width);
    if (getenv("QW_FUZZ_SAY")) /* names what is altered */
        fprintf(stderr, "%s[%zu of %zu, %u bytes]: %llx to %llx\n", r->name, i, elements, r->width,
                (unsigned long long)was, (unsigned long long)is);
    sign(bytes, r);
}

/* ---- what must come of it */

static void check_mesh(qw_context *context)
{
    qw_mesh_view mesh;
    must(qw_get_mesh(context, &mesh) == QW_OK, "a finished run has no mesh");
    for (size_t i = 0; i < 4 * (size_t)mesh.face_count; i++)
        must(mesh.corners[i] < mesh.vertex_count, "a corner is out of range");
    for (size_t i = 0; i < 3 * (size_t)mesh.vertex_count; i++)
        must(isfinite(mesh.positions[i]), "a position is not finite");
}

static void resume(const uint8_t *bytes, size_t size, const qw_options *options)
{
    qw_context *context;
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    must(ftruncate(fileno(file), 0) == 0 && pwrite(fileno(file), bytes, size, 0) == (ssize_t)size &&
             lseek(fileno(file), 0, SEEK_SET) == 0,
         "the dump is not written");
    must(qw_create(&host, &context) == QW_OK, "there is no context");
    qw_status status = qw_resume(context, path);
    must(status != QW_INTERNAL && status != QW_MEMORY, qw_message(context));
    if (status == QW_OK) {
        status = qw_run(context, options);
        must(status != QW_MEMORY, qw_message(context));
        if (status == QW_OK) check_mesh(context);
    }
    must(status == QW_OK || qw_message(context)[0], "a failure has no sentence");
    qw_destroy(context);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!file) make_dumps();
    if (size < 2 + EDIT) return 0;
    int surface = data[0] % SURFACES;
    const dump *d = &dumps[surface][data[1] % QW_STAGE_COUNT];
    qw_options options = options_of(surface);
    uint8_t *bytes = malloc(d->size);
    must(bytes != NULL, "no memory");
    memcpy(bytes, d->bytes, d->size);
    for (size_t at = 2; at + EDIT <= size && at < 2 + 4 * EDIT; at += EDIT) alter(bytes, d, data + at);
    resume(bytes, d->size, &options);
    free(bytes);
    return 0;
}
