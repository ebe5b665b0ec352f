/* Wavefront OBJ: one statement a line. Only vertices and faces are taken; everything else is passed over, as new programs keep
 * inventing statements. Faces may name vertices that come later in the file, so the check of those waits for the end.
 */
#include "io/build.h"
#include "io/formats.h"
#include "io/text.h"

#include <inttypes.h>

/* A guess at bytes a vertex and a face, low enough for most files and cheap where it is wrong. */
enum { BYTES_A_VERTEX = 64, BYTES_A_FACE = 48, CORNERS_A_FACE = 3 };

typedef struct obj {
    qw_text text;
    qw_builder build;
    int64_t face_number; /* of all f statements, counted from 0 */
    /* the largest index seen that was beyond the vertices read till then, and where */
    int64_t farthest, farthest_face;
    size_t farthest_line;
} obj;

static qw_text open_text(qw_env *env, const char *name, qw_bytes bytes)
{
    qw_text t = qw_text_open(env, name, bytes.at, bytes.size);
    t.comment = '#';
    t.continues = true;
    return t;
}

static void read_vertex(obj *o)
{
    double p[3];
    for (int i = 0; i < 3; i++) p[i] = qw_text_number(&o->text, "a coordinate");
    if (!qw_is_finite3(p))
        qw_text_fail(&o->text, QW_NOT_FINITE, o->build.soup.vertex_count, "vertex %" PRIu32 " has a coordinate that is NaN or infinite",
                     o->build.soup.vertex_count + 1);
    qw_build_vertex(&o->build, p); /* a weight or a colour may follow */
}

static _Noreturn void fail_index(const qw_text *t, int64_t face, int64_t index, int64_t vertex_count)
{
    if (index == 0)
        qw_text_fail(t, QW_INDEX_RANGE, face, "face %" PRId64 " names vertex 0, but vertices are counted from 1 (or back from -1)", face + 1);
    qw_text_fail(t, QW_INDEX_RANGE, face, "face %" PRId64 " names vertex %" PRId64 ", but there are only %" PRId64 "%s", face + 1, index,
                 vertex_count, index < 0 ? " before it" : "");
}

/* One index of a corner, as in 12/3/-4. at is past it; false where there is none. */
static inline bool read_index(const char **at, int64_t *index)
{
    const char *p = *at;
    bool negative = *p == '-';
    if (*p == '-' || *p == '+') p++;
    const char *begin = p;
    int64_t value = 0;
    for (; (unsigned char)(*p - '0') < 10; p++)
        if (value <= UINT32_MAX) value = value * 10 + (*p - '0');
    if (p == begin) return false;
    *index = negative ? -value : value;
    *at = p;
    return true;
}

/* v, v/vt, v//vn or v/vt/vn. */
static bool read_corner(qw_text *t, int64_t *index)
{
    const char *p = t->at;
    int64_t ignored;
    if (!read_index(&p, index)) return false;
    for (int i = 0; i < 2 && *p == '/'; i++) {
        p++;
        read_index(&p, &ignored);
    }
    const char *before = t->at;
    t->at = p;
    qw_text_blanks(t);
    if (t->at > p || qw_text_line_ends(t)) return true;
    t->at = before;
    return false;
}

static void read_face(obj *o)
{
    qw_text *t = &o->text;
    int64_t vertex_count = o->build.soup.vertex_count;
    while (!qw_text_line_ends(t)) {
        int64_t index;
        if (!read_corner(t, &index)) qw_text_expected(t, "a corner of a face (v, v/vt, v//vn or v/vt/vn)");
        int64_t vertex = index > 0 ? index - 1 : vertex_count + index;
        if (index == 0 || vertex < 0) fail_index(t, o->face_number, index, vertex_count);
        if (vertex >= vertex_count && index > o->farthest) {
            o->farthest = index;
            o->farthest_face = o->face_number;
            o->farthest_line = t->line;
        }
        qw_build_corner(&o->build, (uint32_t)vertex);
    }
    qw_build_face(&o->build);
    o->face_number++;
}

/* The line begins with the word of `size` letters at at. */
static inline bool is_statement(const qw_text *t, const char *word, size_t size)
{
    if (strncmp(t->at, word, size) != 0) return false;
    char c = t->at[size];
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\\' || c == 0;
}

qw_soup qw_read_obj(qw_env *env, const char *name, qw_bytes bytes)
{
    size_t faces = bytes.size / BYTES_A_FACE;
    obj o = {.text = open_text(env, name, bytes),
             .build = qw_build_begin(env, name, bytes.size / BYTES_A_VERTEX, faces, CORNERS_A_FACE * faces)};
    qw_text *t = &o.text;
    while (t->at < t->end) {
        qw_text_blanks(t);
        if (is_statement(t, "v", 1)) {
            t->at++;
            read_vertex(&o);
        } else if (is_statement(t, "f", 1) || is_statement(t, "fo", 2)) { /* fo: the same in old files */
            t->at += t->at[1] == 'o' ? 2 : 1;
            read_face(&o);
        }
        qw_text_next_line(t);
    }
    if (o.farthest > o.build.soup.vertex_count) {
        t->line = o.farthest_line;
        fail_index(t, o.farthest_face, o.farthest, o.build.soup.vertex_count);
    }
    return qw_build_finish(&o.build);
}

bool qw_is_obj(qw_env *env, qw_bytes bytes)
{
    static const char *const known[] = {"v", "vt", "vn", "vp", "f", "fo", "l", "p", "g", "o", "s", "mtllib", "usemtl", "usemap"};
    qw_text t = open_text(env, "", bytes);
    bool first = true;
    while (qw_text_find_line(&t)) {
        qw_word word = qw_text_word(&t);
        for (size_t i = 0; i < sizeof known / sizeof *known && first; i++)
            if (qw_word_is(word, known[i])) return true;
        first = false;
        /* after statements of its own kind, the first vertex or face decides */
        char c = word.size == 1 && (*word.at == 'v' || *word.at == 'f') && !qw_text_line_ends(&t) ? *t.at : 0;
        if ((c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.') return true;
        qw_text_next_line(&t);
    }
    return false;
}
