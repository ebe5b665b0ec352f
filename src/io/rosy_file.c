#include "io/rosy_file.h"

#include "io/file.h"
#include "io/number.h"
#include "io/text.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>

enum { DIRECTIONS = 4, LEAST_ELEMENT = 5 /* bytes: "0 0 0" */, LINE_SIZE = 4 * QW_NUMBER_SIZE };

static const char PER_FACE[] = "# per face", PER_VERTEX[] = "# per vertex";

static bool says(const char *at, const char *end, const char *what, size_t size)
{
    return (size_t)(end - at) >= size && memcmp(at, what, size) == 0;
}

/* Looks for the comments that say what the elements are. */
static void find_domain(const qw_text *t, qw_rosy *r)
{
    for (const char *at = t->at; (at = memchr(at, '#', (size_t)(t->end - at))) != NULL; at++) {
        r->per_face = r->per_face || says(at, t->end, PER_FACE, sizeof PER_FACE - 1);
        r->per_vertex = r->per_vertex || says(at, t->end, PER_VERTEX, sizeof PER_VERTEX - 1);
    }
    if (r->per_face && r->per_vertex)
        qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the field is said to go by faces and by vertices; it goes by one");
}

static int64_t read_count(qw_text *t, const char *wanted)
{
    if (!qw_text_find_line(t)) qw_text_expected(t, wanted);
    return qw_text_integer(t, wanted);
}

/* The number of elements; fails unless there are four directions each and the file is long enough. */
static void read_header(qw_text *t, qw_rosy *r)
{
    int64_t count = read_count(t, "the number of elements"), directions = read_count(t, "the number of directions, 4,");
    if (directions != DIRECTIONS)
        qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the field has %lld directions an element; a cross field has 4",
                     (long long)directions);
    if (count < 1 || count > INT32_MAX)
        qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "%lld is no number of elements", (long long)count);
    if ((uint64_t)count * LEAST_ELEMENT > (uint64_t)(t->end - t->at))
        qw_text_fail(t, QW_FORMAT_TRUNCATED, -1, "the file is too short for the %lld elements that it announces",
                     (long long)count);
    r->count = (uint32_t)count;
}

qw_rosy qw_read_rosy(qw_env *env, const char *path)
{
    qw_rosy r = {0};
    const char *name = qw_path_for_messages(env, path, "standard input");
    qw_bytes bytes = qw_file_read(env, path, name);
    qw_text t = qw_text_open(env, name, bytes, '#');
    if (bytes.size == 0) qw_fail(env, QW_FILE_EMPTY, -1, "%s: the file is empty", name);
    find_domain(&t, &r);
    read_header(&t, &r);
    r.direction = QW_NEW(env, float, 3 * (size_t)r.count);
    for (uint32_t e = 0; e < r.count; e++)
        for (size_t k = 0; k < 3; k++) {
            if (!qw_text_find_line(&t)) qw_text_expected(&t, "a direction (x y z)");
            double x = qw_text_number(&t, "a direction (x y z)");
            if (!isfinite((float)x))
                qw_text_fail(&t, QW_NOT_FINITE, e, "the direction of element %u is NaN or infinite", e);
            r.direction[3 * (size_t)e + k] = (float)x;
        }
    if (qw_text_find_line(&t))
        qw_text_fail(&t, QW_FORMAT_SYNTAX, -1, "the file goes on after the %u elements that it announces", r.count);
    qw_free(env, (void *)bytes.at);
    return r;
}

void qw_write_rosy(qw_env *env, const char *path, qw_domain domain, const float *direction, uint32_t count)
{
    assert(domain == QW_PER_VERTEX || domain == QW_PER_FACE);
    char line[LINE_SIZE];
    qw_scope_begin(env);
    qw_file *file = qw_file_begin(env, path);
    qw_file_put(file, line, (size_t)snprintf(line, sizeof line, "%u\n%d\n", count, DIRECTIONS));
    for (size_t e = 0; e < count; e++) {
        size_t size = 0;
        for (size_t k = 0; k < 3; k++) {
            size += qw_number_print(line + size, (double)direction[3 * e + k]);
            line[size++] = k < 2 ? ' ' : '\n';
        }
        qw_file_put(file, line, size);
    }
    const char *last = domain == QW_PER_FACE ? PER_FACE : PER_VERTEX;
    qw_file_put(file, line, (size_t)snprintf(line, sizeof line, "%s\n", last));
    qw_file_finish(file);
    qw_scope_end(env);
}
