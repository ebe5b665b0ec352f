/* Geomview's Object File Format, text and binary, in Geomview's form (big-endian) and in those that others write.
 *
 *     [ST][C][N]OFF [BINARY]      ST: texture coordinates, C: colours, N: normals, at each vertex after x y z
 *     vertices faces edges        all on one line, perhaps the first; the edges are not looked at
 *     x y z ...                   a line each; what follows is passed over
 *     n i1 ... in [colour]        a line each
 *
 * The first word may be missing. 4OFF (x y z w) and nOFF (other dimensions) are refused. Lines count: letting a face
 * run on into the next line, as some readers do, would turn a missing index into a face that nobody made.
 */
#include "io/build.h"
#include "io/fetch.h"
#include "io/formats.h"
#include "io/number.h"
#include "io/text.h"

#include <inttypes.h>
#include <math.h>

enum {
    LEAST_VERTEX_TEXT = 6, /* "0 0 0" and a newline */
    LEAST_FACE_TEXT = 2,   /* "0" and a newline */
    LEAST_FACE_BINARY = 8, /* no corners, no colours */
    LEAST_FACE_BARE = 4,   /* the same without a count of colours */
    MAX_COLOURS = 256      /* of one face in a binary file; there are 4 at most in real ones */
};

typedef struct header {
    bool texture, colour, normal, four, any, binary;
    int64_t vertices, faces;
} header;

/* The first word, as in "STCNOFF". */
static bool parse_magic(qw_word word, header *h)
{
    const char *p = word.at, *end = word.at + word.size;
    *h = (header){0};
    if (end - p >= 2 && memcmp(p, "ST", 2) == 0) h->texture = true, p += 2;
    if (p < end && *p == 'C') h->colour = true, p++;
    if (p < end && *p == 'N') h->normal = true, p++;
    if (p < end && *p == '4') h->four = true, p++;
    if (p < end && *p == 'n') h->any = true, p++;
    if (qw_word_is_caseless((qw_word){p, (size_t)(end - p)}, "off")) return true;
    *h = (header){0};
    return false;
}

/* Before anything is allocated: the elements, of so many bytes at least, must fit what is left of the file. */
static void check_counts(const qw_text *t, const header *h, uint64_t vertex_bytes, uint64_t face_bytes, size_t left)
{
    if (h->vertices < 0 || h->faces < 0) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "a count in the header is negative");
    qw_build_check_count(t->env, t->name, (uint64_t)h->vertices, "vertices");
    qw_build_check_count(t->env, t->name, (uint64_t)h->faces, "faces");
    if ((uint64_t)h->vertices * vertex_bytes + (uint64_t)h->faces * face_bytes > left)
        qw_text_fail(t, QW_FORMAT_TRUNCATED, -1,
                     "the header announces %" PRId64 " vertices and %" PRId64
                     " faces, which the %zu bytes after it cannot hold",
                     h->vertices, h->faces, left);
}

/* Which kind of OFF file it is and, of text, how many vertices and faces it has. */
static header read_header(qw_text *t)
{
    header h = {0};
    qw_text_find_line(t);
    qw_text before = *t;
    if (!parse_magic(qw_text_word(t), &h)) *t = before;
    if (h.four || h.any)
        qw_text_fail(t, QW_UNSUPPORTED, -1, "OFF files with other than three coordinates (4OFF, nOFF) are not read");
    before = *t;
    if (qw_word_is_caseless(qw_text_word(t), "binary")) {
        h.binary = true;
        return h;
    }
    *t = before;
    qw_text_find_line(t);
    h.vertices = qw_text_integer(t, "the number of vertices");
    h.faces = qw_text_integer(t, "the number of faces");
    if (!qw_text_line_ends(t)) qw_text_integer(t, "the number of edges");
    if (!qw_text_line_ends(t)) qw_text_expected(t, "nothing more");
    check_counts(t, &h, LEAST_VERTEX_TEXT, LEAST_FACE_TEXT,
                 (size_t)(t->end - t->at) + 1); /* the last newline may be missing */
    return h;
}

static void find_element(qw_text *t, const char *kind, int64_t index, int64_t count)
{
    if (!qw_text_find_line(t))
        qw_text_fail(t, QW_FORMAT_TRUNCATED, index, "the file ends before %s %" PRId64 " of %" PRId64, kind, index,
                     count);
}

/* The colours of vertices in text: behind the coordinates and the normal, if there is one; three or four numbers, from
 * 0 to 1 or whole ones from 0 to 255. */
typedef struct off_colours {
    float *value; /* float[vertices][4]; NULL: none */
    bool are_bytes, have_alpha, are_broken;
} off_colours;

/* The rest of a vertex's line: a normal, which is skipped, and a colour of three or four numbers. */
static void take_colour(qw_text *t, const header *h, off_colours *c, int64_t v)
{
    double value[7];
    int skip = h->normal ? 3 : 0, count = 0;
    while (count < skip + 4 && !qw_text_line_ends(t)) {
        const char *at = t->at;
        if (!qw_number_read(&t->at, &value[count]) || !isfinite((float)value[count])) break;
        while (at < t->at && *at != '.') at++;
        c->are_bytes |= count >= skip && at == t->at && value[count] > 1;
        count++;
    }
    if (count < skip + 3) c->are_broken = true;
    if (count == skip + 4) c->have_alpha = true;
    for (int k = 0; k < 4; k++) c->value[4 * v + k] = k < count - skip ? (float)value[skip + k] : 1;
}

static void add_colours(qw_env *env, qw_soup *s, off_colours *c)
{
    if (!c->value || c->are_broken) return;
    uint32_t n = c->have_alpha ? 4 : 3;
    qw_attribute *a = qw_build_attribute(env, s, "color", QW_PER_VERTEX, QW_VALUES, n);
    for (size_t v = 0; v < s->vertex_count; v++)
        for (size_t k = 0; k < n; k++) c->value[n * v + k] = c->value[4 * v + k] / (c->are_bytes ? 255 : 1);
    a->values = c->value, a->storage = QW_UINT8;
}

/* The vertices of a text file, with colours where the header has them. */
static void read_vertices(qw_text *t, qw_builder *b, const header *h, off_colours *c)
{
    if (h->colour) c->value = QW_NEW(t->env, float, 4 * (size_t)h->vertices);
    for (int64_t v = 0; v < h->vertices; v++) {
        double p[3];
        find_element(t, "vertex", v, h->vertices);
        for (int i = 0; i < 3; i++) p[i] = qw_text_number(t, "a coordinate");
        if (!qw_is_finite3(p))
            qw_text_fail(t, QW_NOT_FINITE, v, "vertex %" PRId64 " has a coordinate that is NaN or infinite", v);
        qw_build_vertex(b, p);
        if (h->colour) take_colour(t, h, c, v);
        qw_text_next_line(t);
    }
}

/* The faces of a text file; fails at corners that are no vertices. */
static void read_faces(qw_text *t, qw_builder *b, const header *h)
{
    for (int64_t f = 0; f < h->faces; f++) {
        find_element(t, "face", f, h->faces);
        int64_t corners = qw_text_integer(t, "the number of corners of a face");
        if (corners < 0) qw_text_fail(t, QW_FORMAT_SYNTAX, f, "face %" PRId64 " has %" PRId64 " corners", f, corners);
        for (int64_t i = 0; i < corners; i++) {
            int64_t v = qw_text_integer(t, "an index of a vertex");
            if (v < 0 || v >= h->vertices)
                qw_text_fail(t, QW_INDEX_RANGE, f,
                             "face %" PRId64 " names vertex %" PRId64 ", but there are only %" PRId64
                             ", counted from 0",
                             f, v, h->vertices);
            qw_build_corner(b, (uint32_t)v);
        }
        qw_build_face(b);
        qw_text_next_line(t);
    }
}

/* ---- binary */

typedef struct binary {
    qw_env *env;
    const char *name, *begin, *at, *end;
    bool big;     /* byte order: Geomview's is big-endian, PMP and others write that of their machine */
    bool colours; /* a count of colour values follows each face, as Geomview has it; PMP leaves it out */
} binary;

static void need(const binary *s, size_t bytes, const char *kind, int64_t index)
{
    if (bytes > (size_t)(s->end - s->at))
        qw_fail(s->env, QW_FORMAT_TRUNCATED, index, "%s, byte %zu: the file ends in %s %" PRId64, s->name,
                (size_t)(s->at - s->begin), kind, index);
}

static int64_t next_integer(binary *s)
{
    int64_t value = (int32_t)qw_fetch_bits(s->at, 4, s->big);
    s->at += 4;
    return value;
}

/* Reads face f of a binary OFF file with its colour, which is left out. */
static void read_binary_face(binary *s, qw_builder *b, int64_t f)
{
    int64_t vertex_count = b->soup.vertex_count;
    need(s, 4, "face", f);
    int64_t corners = next_integer(s);
    if (corners < 0)
        qw_fail(s->env, QW_FORMAT_SYNTAX, f, "%s, byte %zu: face %" PRId64 " has %" PRId64 " corners", s->name,
                (size_t)(s->at - 4 - s->begin), f, corners);
    need(s, (size_t)corners * 4 + (s->colours ? 4 : 0), "face", f);
    for (int64_t i = 0; i < corners; i++) {
        int64_t v = next_integer(s);
        if (v < 0 || v >= vertex_count)
            qw_fail(s->env, QW_INDEX_RANGE, f,
                    "%s, byte %zu: face %" PRId64 " names vertex %" PRId64 ", but there are only %" PRId64
                    ", counted from 0",
                    s->name, (size_t)(s->at - 4 - s->begin), f, v, vertex_count);
        qw_build_corner(b, (uint32_t)v);
    }
    int64_t colours = s->colours ? next_integer(s) : 0;
    if (colours < 0 || colours > MAX_COLOURS)
        qw_fail(s->env, QW_FORMAT_SYNTAX, f, "%s, byte %zu: face %" PRId64 " has %" PRId64 " colour values", s->name,
                (size_t)(s->at - 4 - s->begin), f, colours);
    need(s, (size_t)colours * 4, "face", f);
    s->at += colours * 4;
    qw_build_face(b);
}

/* Past the corners of a face; false where there are none. Without colours a face has three or more, and they hold: else
   a file of Geomview's form that was cut could pass for one without. */
static bool pass_corners(binary *s, int64_t vertices)
{
    if (s->end - s->at < 4) return false;
    int64_t corners = next_integer(s);
    if (corners < (s->colours ? 0 : 3) || corners > (s->end - s->at) / 4) return false;
    for (int64_t i = 0; i < corners; i++) {
        int64_t v = next_integer(s);
        if (!s->colours && (v < 0 || v >= vertices)) return false;
    }
    return true;
}

static bool pass_colours(binary *s)
{
    if (s->end - s->at < 4) return false;
    int64_t colours = next_integer(s);
    if (colours < 0 || colours > (s->end - s->at) / 4) return false;
    s->at += 4 * colours;
    return true;
}

/* Whether a file of this form would end where the bytes do. */
static bool fits(binary s, size_t stride)
{
    int64_t vertices = next_integer(&s), faces = next_integer(&s);
    s.at += 4;
    uint64_t left = (uint64_t)(s.end - s.at);
    if (vertices < 0 || faces < 0 || (uint64_t)vertices > left / stride) return false;
    s.at += (uint64_t)vertices * stride;
    for (int64_t f = 0; f < faces; f++)
        if (!pass_corners(&s, vertices) || (s.colours && !pass_colours(&s))) return false;
    return s.at == s.end;
}

/* The first form that fits the size; Geomview's own where none does, as what is wrong is best said of it. */
static binary find_form(binary s, size_t stride)
{
    for (int form = 0; form < 4; form++) {
        s.big = form % 2 == 0, s.colours = form < 2;
        if (fits(s, stride)) return s;
    }
    s.big = s.colours = true;
    return s;
}

/* The surface of a binary file, of whichever of the forms in use its length and counts fit. */
static qw_soup read_binary(qw_text *t, qw_bytes bytes, header h)
{
    qw_text_next_line(t);
    size_t stride = 4 * (size_t)(3 + (h.normal ? 3 : 0) + (h.colour ? 4 : 0) + (h.texture ? 2 : 0));
    binary s = {.env = t->env, .name = t->name, .begin = bytes.at, .at = t->at, .end = t->end};
    need(&s, 12, "the header, at word", 0);
    s = find_form(s, stride);
    h.vertices = next_integer(&s);
    h.faces = next_integer(&s);
    s.at += 4;
    check_counts(t, &h, stride, s.colours ? LEAST_FACE_BINARY : LEAST_FACE_BARE, (size_t)(s.end - s.at));
    qw_builder b = qw_build_begin(t->env, t->name, (size_t)h.vertices, (size_t)h.faces, (size_t)h.faces * 3);
    for (int64_t v = 0; v < h.vertices; v++, s.at += stride) {
        double p[3];
        for (int i = 0; i < 3; i++) p[i] = qw_fetch_float(s.at + 4 * i, s.big);
        if (!qw_is_finite3(p))
            qw_fail(t->env, QW_NOT_FINITE, v,
                    "%s, byte %zu: vertex %" PRId64 " has a coordinate that is NaN or infinite", t->name,
                    (size_t)(s.at - s.begin), v);
        qw_build_vertex(&b, p);
    }
    for (int64_t f = 0; f < h.faces; f++) read_binary_face(&s, &b, f);
    if (s.at < s.end) qw_build_warn_rest(&b, (size_t)(s.end - s.at));
    return qw_build_finish(&b);
}

qw_soup qw_read_off(qw_env *env, const char *name, qw_bytes bytes)
{
    qw_text t = qw_text_open(env, name, bytes, '#');
    header h = read_header(&t);
    if (h.binary) return read_binary(&t, bytes, h);
    qw_builder b = qw_build_begin(env, name, (size_t)h.vertices, (size_t)h.faces, (size_t)h.faces * 3);
    qw_text_next_line(&t);
    off_colours c = {0};
    read_vertices(&t, &b, &h, &c);
    read_faces(&t, &b, &h);
    if (qw_text_find_line(&t)) qw_build_warn_rest(&b, (size_t)(t.end - t.at));
    qw_soup soup = qw_build_finish(&b);
    add_colours(env, &soup, &c);
    return soup;
}

bool qw_is_off(qw_env *env, qw_bytes bytes)
{
    qw_text t = qw_text_open(env, "", bytes, '#');
    header h;
    return qw_text_find_line(&t) && parse_magic(qw_text_word(&t), &h);
}

bool qw_is_off_bare(qw_env *env, qw_bytes bytes)
{
    qw_text t = qw_text_open(env, "", bytes, '#');
    if (!qw_text_find_line(&t)) return false;
    for (int i = 0; i < 3; i++) {
        qw_word word = qw_text_word(&t);
        if (word.size == 0) return false;
        for (size_t k = 0; k < word.size; k++)
            if (word.at[k] < '0' || word.at[k] > '9') return false;
    }
    return qw_text_line_ends(&t);
}
