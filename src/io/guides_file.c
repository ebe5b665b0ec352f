#include "io/guides_file.h"

#include "io/file.h"
#include "io/text.h"

#include <math.h>

static const char DIRECTION[] = "direction", RINGS[] = "rings";

typedef struct polyline {
    qw_guide_kind kind;
    uint32_t rings;
    size_t begin, end; /* of its numbers of vertices */
    size_t line;       /* of the file */
} polyline;

typedef struct reading {
    qw_env *env;
    qw_text text;
    double *vertex; /* double[vertices][3] */
    size_t vertices, vertex_capacity;
    uint32_t *number; /* uint32_t[numbers]: vertices of all polylines */
    size_t numbers, number_capacity;
    polyline *line;
    size_t lines, line_capacity;
    qw_guide_kind kind;
    uint32_t rings;
} reading;

static void read_vertex(reading *r)
{
    r->vertex = qw_grow(r->env, r->vertex, &r->vertex_capacity, r->vertices + 1, 3 * sizeof *r->vertex);
    for (size_t k = 0; k < 3; k++) {
        double x = qw_text_number(&r->text, "a coordinate");
        if (!isfinite(x))
            qw_text_fail(&r->text, QW_NOT_FINITE, (int64_t)r->vertices, "a coordinate of a guide is NaN or infinite");
        r->vertex[3 * r->vertices + k] = x;
    }
    r->vertices++;
}

/* v or v/vt, counted from 1, or back from the last vertex. */
static uint32_t vertex_named(reading *r, qw_word word)
{
    int64_t number = 0;
    size_t at = 0;
    bool negative = word.at[0] == '-';
    for (at = negative; at < word.size && word.at[at] >= '0' && word.at[at] <= '9'; at++)
        if (number <= UINT32_MAX) number = 10 * number + (word.at[at] - '0');
    if (at == negative || (at < word.size && word.at[at] != '/'))
        qw_text_fail(&r->text, QW_FORMAT_SYNTAX, -1, "\"%s\" stands where the number of a vertex should be",
                     qw_quote_word(word).text);
    int64_t vertex = negative ? (int64_t)r->vertices - number : number - 1;
    if (vertex < 0 || vertex >= INT32_MAX || number == 0)
        qw_text_fail(&r->text, QW_INDEX_RANGE, -1, "a line names vertex %s, which does not exist",
                     qw_quote_word(word).text);
    return (uint32_t)vertex;
}

/* Vertices may follow the lines that name them: numbers are checked at the end, those from behind at once. */
static void read_polyline(reading *r)
{
    qw_text *t = &r->text;
    r->line = qw_grow(r->env, r->line, &r->line_capacity, r->lines + 1, sizeof *r->line);
    polyline *p = &r->line[r->lines++];
    *p = (polyline){r->kind, r->rings, r->numbers, r->numbers, t->line};
    while (!qw_text_line_ends(t)) {
        qw_word word = qw_text_word(t);
        uint32_t vertex = vertex_named(r, word);
        r->number = qw_grow(r->env, r->number, &r->number_capacity, r->numbers + 1, sizeof *r->number);
        r->number[r->numbers++] = vertex;
    }
    p->end = r->numbers;
    if (p->end - p->begin < 2) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "a line needs two vertices and more");
}

static bool begins_with(qw_word word, const char *text)
{
    size_t size = strlen(text);
    return word.size >= size && memcmp(word.at, text, size) == 0;
}

/* Of "rings 6", "rings_6" or "rings6", of which the word is the first, 6; 0 where no number follows. */
static uint32_t rings_named(reading *r, qw_word word)
{
    const size_t letters = sizeof RINGS - 1;
    qw_word number = {word.at + letters, word.size - letters};
    while (number.size > 0 && (*number.at == '_' || *number.at == '-')) number.at++, number.size--;
    if (number.size == 0) number = qw_text_word(&r->text);
    uint32_t rings = 0;
    for (size_t i = 0; i < number.size; i++) {
        if (number.at[i] < '0' || number.at[i] > '9') return 0;
        if (rings <= QW_MOST_RINGS) rings = 10 * rings + (uint32_t)(number.at[i] - '0');
    }
    return rings;
}

static void read_name(reading *r)
{
    qw_word word = qw_text_word(&r->text);
    r->kind = begins_with(word, DIRECTION) ? QW_GUIDE_DIRECTION : QW_GUIDE_LOOP;
    r->rings = begins_with(word, RINGS) ? rings_named(r, word) : 0;
}

static void read_statements(reading *r)
{
    qw_text *t = &r->text;
    for (; qw_text_find_line(t); qw_text_next_line(t)) {
        qw_word word = qw_text_word(t);
        t->continues = qw_word_is(word, "l");
        if (qw_word_is(word, "v")) read_vertex(r);
        else if (qw_word_is(word, "l")) read_polyline(r);
        else if (qw_word_is(word, "g") || qw_word_is(word, "o")) read_name(r);
    }
}

/* The points of a polyline, closed where its last vertex is the first. */
static qw_guide guide_of(reading *r, const polyline *p)
{
    size_t n = p->end - p->begin;
    bool closed = n > 3 && r->number[p->begin] == r->number[p->end - 1];
    double *points = QW_NEW(r->env, double, 3 * n);
    for (size_t i = 0; i < n; i++) {
        uint32_t v = r->number[p->begin + i];
        if (v >= r->vertices) {
            r->text.line = p->line;
            qw_text_fail(&r->text, QW_INDEX_RANGE, -1, "a line names vertex %u, but there are %zu", v + 1, r->vertices);
        }
        memcpy(points + 3 * i, r->vertex + 3 * (size_t)v, 3 * sizeof *points);
    }
    return (qw_guide){sizeof(qw_guide), p->kind, closed, (uint32_t)(n - closed), points, p->rings};
}

qw_guide *qw_read_guides(qw_env *env, const char *path, uint32_t *count)
{
    const char *name = qw_path_for_messages(env, path, "standard input");
    qw_bytes bytes = qw_file_read(env, path, name);
    if (bytes.size == 0) qw_fail(env, QW_FILE_EMPTY, -1, "%s: the file is empty", name);
    reading r = {.env = env, .text = qw_text_open(env, name, bytes, '#'), .kind = QW_GUIDE_LOOP};
    read_statements(&r);
    if (r.lines == 0) qw_fail(env, QW_FORMAT_SYNTAX, -1, "%s: there is no line (l) in the file of guides", name);
    if (r.lines > INT32_MAX || r.numbers > INT32_MAX)
        qw_fail(env, QW_TOO_LARGE, -1, "%s: there are too many guides", name);
    qw_guide *guides = QW_NEW(env, qw_guide, r.lines);
    for (size_t i = 0; i < r.lines; i++) guides[i] = guide_of(&r, &r.line[i]);
    *count = (uint32_t)r.lines;
    qw_free(env, r.vertex), qw_free(env, r.number), qw_free(env, r.line), qw_free(env, (void *)bytes.at);
    return guides;
}
