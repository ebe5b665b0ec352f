/* Points without faces: XYZ, the vertices of an OBJ, and PCD of the Point Cloud Library.
 *
 * XYZ has no rules: a line with a point begins with three numbers, and what follows them (colours, normals,
 * intensities) is passed over; a first line that is one number is a count; # begins a comment.
 *
 * PCD has a header of words: FIELDS names the values of a point, SIZE, TYPE (F, I, U) and COUNT say how they lie,
 * POINTS how many there are, and DATA, the last line, ascii or binary. binary_compressed is refused. Points with a
 * coordinate that is not finite are places where a scanner has seen nothing: they are left out. */
#include "io/build.h"
#include "io/fetch.h"
#include "io/formats.h"
#include "io/text.h"

#include <string.h>

enum { MOST_FIELDS = 64, LINE_BYTES = 24 };

/* ---- XYZ */

static bool begins_number(const char *at)
{
    if (*at == '-' || *at == '+') at++;
    return (*at >= '0' && *at <= '9') || *at == '.';
}

/* Whether the line goes on with three numbers: the cursor is left where it is. */
static bool has_point(const qw_text *t)
{
    qw_text ahead = *t;
    for (int k = 0; k < 3; k++) {
        qw_text_blanks(&ahead);
        if (*ahead.at == ',' && k > 0) ahead.at++, qw_text_blanks(&ahead);
        if (!begins_number(ahead.at)) return false;
        while (*ahead.at && !strchr(" \t\r\n,", *ahead.at)) ahead.at++;
    }
    return true;
}

qw_soup qw_read_xyz(qw_env *env, const char *name, qw_bytes bytes)
{
    qw_builder b = qw_build_begin(env, name, bytes.size / LINE_BYTES, 0, 0);
    qw_text t = qw_text_open(env, name, bytes.at, bytes.size);
    t.comment = '#';
    while (t.at < t.end) {
        qw_text_blanks(&t);
        if (t.at[0] == 'v' && (t.at[1] == ' ' || t.at[1] == '\t')) t.at++;
        if (t.at[0] == 'f' && (t.at[1] == ' ' || t.at[1] == '\t'))
            qw_text_fail(&t, QW_FORMAT_UNKNOWN, -1, "the file has faces: it is no file of points");
        if (has_point(&t)) {
            double p[3];
            for (int k = 0; k < 3; k++) {
                qw_text_blanks(&t);
                if (*t.at == ',') t.at++;
                p[k] = qw_text_number(&t, "a coordinate");
            }
            if (!qw_is_finite3(p)) qw_text_fail(&t, QW_NOT_FINITE, -1, "a coordinate is NaN or infinite");
            qw_build_vertex(&b, p);
        }
        qw_text_next_line(&t);
    }
    if (b.soup.vertex_count == 0) qw_fail(env, QW_FORMAT_UNKNOWN, -1, "%s: no line begins with three numbers", name);
    return qw_build_finish_points(&b);
}

/* ---- PCD */

typedef struct pcd {
    qw_env *env;
    qw_text text;
    int fields, axis[3]; /* axis: field of x, y, z; -1: none */
    int64_t size[MOST_FIELDS], count[MOST_FIELDS], points;
    char type[MOST_FIELDS];
    bool is_binary;
} pcd;

bool qw_is_pcd(qw_bytes bytes) { return strncmp(bytes.at, "# .PCD", 6) == 0 || strncmp(bytes.at, "VERSION ", 8) == 0; }

static void read_fields(pcd *p)
{
    static const char *const axes[] = {"x", "y", "z"};
    for (int k = 0; k < 3; k++) p->axis[k] = -1; /* of a line FIELDS before this one */
    for (p->fields = 0; !qw_text_line_ends(&p->text); p->fields++) {
        qw_word word = qw_text_word(&p->text);
        if (p->fields == MOST_FIELDS) qw_text_fail(&p->text, QW_TOO_LARGE, -1, "there are too many fields");
        for (int k = 0; k < 3; k++)
            if (qw_word_is(word, axes[k])) p->axis[k] = p->fields;
        p->size[p->fields] = 4, p->count[p->fields] = 1, p->type[p->fields] = 'F';
    }
}

static void read_counts(pcd *p, int64_t *to, int64_t most)
{
    for (int i = 0; i < p->fields; i++) {
        to[i] = qw_text_integer(&p->text, "a count");
        if (to[i] < 1 || to[i] > most) qw_text_fail(&p->text, QW_FORMAT_SYNTAX, i, "a size or count is out of bounds");
    }
}

/* Up to the line DATA; leaves the cursor at the data. */
static void read_pcd_header(pcd *p)
{
    qw_text *t = &p->text;
    for (;;) {
        if (!qw_text_find_line(t)) qw_text_fail(t, QW_FORMAT_TRUNCATED, -1, "the header has no line DATA");
        qw_word word = qw_text_word(t);
        if (qw_word_is(word, "FIELDS")) read_fields(p);
        else if (qw_word_is(word, "SIZE")) read_counts(p, p->size, 8);
        else if (qw_word_is(word, "COUNT")) read_counts(p, p->count, 4096);
        else if (qw_word_is(word, "TYPE"))
            for (int i = 0; i < p->fields; i++) {
                word = qw_text_word(t);
                p->type[i] = word.size == 1 ? *word.at : '?';
            }
        else if (qw_word_is(word, "POINTS")) p->points = qw_text_integer(t, "a count");
        else if (qw_word_is(word, "DATA")) break;
        qw_text_next_line(t);
    }
    qw_word how = qw_text_word(t);
    p->is_binary = qw_word_is(how, "binary");
    if (!p->is_binary && !qw_word_is(how, "ascii"))
        qw_text_fail(t, QW_UNSUPPORTED, -1, "DATA is neither ascii nor binary: save it uncompressed");
    qw_text_next_line(t);
    for (int k = 0; k < 3; k++)
        if (p->axis[k] < 0 || p->count[p->axis[k]] != 1)
            qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the fields x, y and z are not all there");
    if (p->points < 0) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the number of points is negative");
}

static double value_of(const pcd *p, const char *at, int field)
{
    int size = (int)p->size[field];
    uint64_t bits = qw_fetch_bits(at, size, false);
    double value;
    if (p->type[field] == 'F' && size == 4) return qw_fetch_float(at, false);
    if (p->type[field] != 'F' || size != 8)
        qw_text_fail(&p->text, QW_UNSUPPORTED, field, "coordinates must be floats of 4 or 8 bytes");
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void read_binary_points(pcd *p, qw_builder *b)
{
    int64_t offset[MOST_FIELDS], stride = 0;
    for (int i = 0; i < p->fields; i++) offset[i] = stride, stride += p->size[i] * p->count[i];
    if (stride == 0 || p->points > (p->text.end - p->text.at) / stride)
        qw_text_fail(&p->text, QW_FORMAT_TRUNCATED, -1, "the file ends before its points do");
    for (int64_t i = 0; i < p->points; i++, p->text.at += stride) {
        double at[3];
        for (int k = 0; k < 3; k++) at[k] = value_of(p, p->text.at + offset[p->axis[k]], p->axis[k]);
        if (qw_is_finite3(at)) qw_build_vertex(b, at);
    }
}

static void read_text_points(pcd *p, qw_builder *b)
{
    for (int64_t i = 0; i < p->points; i++) {
        double at[3] = {0, 0, 0};
        if (!qw_text_find_line(&p->text))
            qw_text_fail(&p->text, QW_FORMAT_TRUNCATED, i, "the file ends before its points do");
        for (int f = 0; f < p->fields; f++)
            for (int64_t c = 0; c < p->count[f]; c++) {
                int axis = f == p->axis[0] ? 0 : f == p->axis[1] ? 1 : f == p->axis[2] ? 2 : -1;
                if (axis >= 0) at[axis] = qw_text_number(&p->text, "a coordinate");
                else (void)qw_text_word(&p->text);
            }
        if (qw_is_finite3(at)) qw_build_vertex(b, at);
        qw_text_next_line(&p->text);
    }
}

qw_soup qw_read_pcd(qw_env *env, const char *name, qw_bytes bytes)
{
    pcd p = {.env = env, .text = qw_text_open(env, name, bytes.at, bytes.size), .axis = {-1, -1, -1}};
    p.text.comment = '#';
    read_pcd_header(&p);
    qw_builder b = qw_build_begin(env, name, 16, 0, 0);
    if (p.is_binary) read_binary_points(&p, &b);
    else read_text_points(&p, &b);
    return qw_build_finish_points(&b);
}
