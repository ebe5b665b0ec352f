/* Wavefront OBJ: one statement a line. Vertices and faces are taken, and what marks edges: lines, and the borders
 * between smoothing groups and between materials; or the creases and corners of OpenSubdiv's tags where there are some,
 * which say it all. Texture coordinates, normals, colours and the names of objects,
 * groups, materials and smoothing groups become attributes (obj_attributes.c). Everything else is passed over, as new
 * programs keep inventing statements. Faces and lines may name vertices that come later in the file, so the check of
 * those waits for the end.
 */
#include "base/sort.h"
#include "io/outlines.h"
#include "io/build.h"
#include "io/digits.h"
#include "io/formats.h"
#include "io/obj_attributes.h"
#include "io/text.h"

#include <inttypes.h>

/* A guess at bytes a vertex and a face, low enough for most files and cheap where it is wrong. */
enum { BYTES_A_VERTEX = 64, BYTES_A_FACE = 48, CORNERS_A_FACE = 3 };

/* Faces from first_face on with the same smoothing group and material, and all other names. */
typedef struct obj_run {
    uint32_t first_face;
    uint64_t label;
    int32_t name[QW_OBJ_NAMES];
} obj_run;

/* Vertices, and the faces and marks that follow them up to the next vertex. */
typedef struct obj_block {
    uint32_t first_vertex, first_face;
    size_t first_mark;
} obj_block;

typedef struct obj {
    qw_text text;
    qw_builder build;
    int64_t face_number; /* of all f statements, counted from 0 */
    /* the largest index seen that was beyond the vertices read till then, and where */
    int64_t farthest, farthest_face;
    size_t farthest_line;
    uint64_t smoothing, material; /* hashes of the names in force */
    obj_run *run;
    size_t run_count, run_capacity;
    obj_block *block;
    size_t block_count, block_capacity;
    uint32_t *mark; /* uint32_t[mark_count][2] */
    size_t mark_count, mark_capacity;
    uint32_t *crease; /* uint32_t[crease_count][2]: as tags of OpenSubdiv's say; a corner twice */
    size_t crease_count, crease_capacity;
    qw_obj_extras extras;
    int32_t name[QW_OBJ_NAMES]; /* in force */
} obj;

static void begin_block(obj *o)
{
    const qw_soup *s = &o->build.soup;
    o->block = qw_grow(o->build.env, o->block, &o->block_capacity, o->block_count + 1, sizeof *o->block);
    o->block[o->block_count++] = (obj_block){s->vertex_count, s->face_count, o->mark_count};
}

static void read_vertex(obj *o)
{
    double p[3];
    if (o->block_count == 0 || o->block[o->block_count - 1].first_face != o->build.soup.face_count) begin_block(o);
    for (int i = 0; i < 3; i++) p[i] = qw_text_number(&o->text, "a coordinate");
    if (!qw_is_finite3(p))
        qw_text_fail(&o->text, QW_NOT_FINITE, o->build.soup.vertex_count,
                     "vertex %" PRIu32 " has a coordinate that is NaN or infinite", o->build.soup.vertex_count + 1);
    qw_build_vertex(&o->build, p); /* a weight or a colour may follow */
    if (*o->text.at != o->text.newline) qw_obj_take_colour(&o->extras, &o->text, o->build.soup.vertex_count - 1);
}

static _Noreturn void fail_index(const qw_text *t, int64_t face, int64_t index, int64_t vertex_count)
{
    if (index == 0)
        qw_text_fail(t, QW_INDEX_RANGE, face,
                     "face %" PRId64 " names vertex 0, but vertices are counted from 1 (or back from -1)", face + 1);
    qw_text_fail(t, QW_INDEX_RANGE, face, "face %" PRId64 " names vertex %" PRId64 ", but there are only %" PRId64 "%s",
                 face + 1, index, vertex_count, index < 0 ? " before it" : "");
}

/* One index of a corner, as in 12/3/-4. at is past it; false where there is none. */
static inline bool read_index(const char **at, int64_t *index)
{
    const char *p = *at;
    bool negative = *p == '-';
    if (*p == '-' || *p == '+') p++;
    uint64_t value;
    uint32_t digits = qw_digits(p, &value);
    if (digits == 0) return false;
    p += digits;
    for (; (unsigned char)(*p - '0') < 10; p++)
        if (value <= UINT32_MAX) value = value * 10 + (uint64_t)(*p - '0');
    *index = negative ? -(int64_t)value : (int64_t)value;
    *at = p;
    return true;
}

/* v, v/vt, v//vn or v/vt/vn. more: int64_t[2], vt and vn, 0 where there is none; NULL: not asked for. */
static bool read_corner(qw_text *t, int64_t *index, int64_t *more)
{
    const char *p = t->at;
    if (!read_index(&p, index)) return false;
    if (more) more[0] = more[1] = 0;
    for (int i = 0; i < 2 && *p == '/'; i++) {
        int64_t ignored = 0;
        p++;
        read_index(&p, more ? &more[i] : &ignored);
    }
    const char *before = t->at;
    t->at = p;
    qw_text_blanks(t);
    if (t->at > p || qw_text_line_ends(t)) return true;
    t->at = before;
    return false;
}

static void add_mark(obj *o, uint32_t a, uint32_t b)
{
    qw_build_check_count(o->build.env, o->build.name, o->mark_count + 1, "marked edges");
    o->mark = qw_grow(o->build.env, o->mark, &o->mark_capacity, o->mark_count + 1, 2 * sizeof *o->mark);
    o->mark[2 * o->mark_count] = a, o->mark[2 * o->mark_count + 1] = b;
    o->mark_count++;
}

/* What a line says only adds marks: where it can't be read the rest of it is passed over. */
static void read_line(obj *o)
{
    qw_text *t = &o->text;
    int64_t before = -1;
    while (!qw_text_line_ends(t)) {
        int64_t index;
        if (!read_corner(t, &index, NULL)) return;
        int64_t vertex = index > 0 ? index - 1 : o->build.soup.vertex_count + index;
        if (index == 0 || vertex < 0 || vertex > UINT32_MAX) return;
        if (before >= 0 && before != vertex) add_mark(o, (uint32_t)before, (uint32_t)vertex);
        before = vertex;
    }
}

/* "t crease 2/1/0 A B SHARPNESS", "t corner 1/1/0 A SHARPNESS": vertices are counted from 0. Other tags, and what can't
   be read, are passed over. */
static void read_tag(obj *o)
{
    qw_text *t = &o->text;
    int64_t number[2];
    qw_word word = qw_text_word(t);
    bool is_crease = word.size == 6 && memcmp(word.at, "crease", 6) == 0;
    if (!is_crease && (word.size != 6 || memcmp(word.at, "corner", 6) != 0)) return;
    qw_text_blanks(t);
    if (strncmp(t->at, is_crease ? "2/1/0" : "1/1/0", 5) != 0) return;
    t->at += 5;
    for (int i = 0; i < 1 + is_crease; i++) {
        qw_text_blanks(t);
        if (!read_index(&t->at, &number[i]) || number[i] < 0 || number[i] > UINT32_MAX) return;
    }
    if (!is_crease) number[1] = number[0];
    qw_build_check_count(o->build.env, o->build.name, o->crease_count + 1, "creases");
    o->crease = qw_grow(o->build.env, o->crease, &o->crease_capacity, o->crease_count + 1, 2 * sizeof *o->crease);
    for (int i = 0; i < 2; i++) o->crease[2 * o->crease_count + (size_t)i] = (uint32_t)number[i];
    o->crease_count++;
}

/* The name that a statement ends with: all that is left of the line, as names may hold blanks, '#' and backslashes. */
static qw_word rest_of_line(qw_text *t)
{
    t->comment = 0;
    bool empty = qw_text_line_ends(t);
    t->comment = '#';
    if (empty) return (qw_word){t->at, 0};
    const char *end = memchr(t->at, t->newline, (size_t)(t->end - t->at));
    qw_word word = {t->at, (size_t)((end ? end : t->end) - t->at)};
    while (word.size > 0 && strchr(" \t\v\f\r", word.at[word.size - 1])) word.size--;
    t->at += word.size;
    return word;
}

static void begin_run(obj *o)
{
    uint64_t label = o->smoothing * 0x9e3779b97f4a7c15u ^ o->material;
    const obj_run *last = o->run_count > 0 ? &o->run[o->run_count - 1] : NULL;
    if (last && last->label == label && memcmp(last->name, o->name, sizeof o->name) == 0) return;
    o->run = qw_grow(o->build.env, o->run, &o->run_capacity, o->run_count + 1, sizeof *o->run);
    obj_run run = {o->build.soup.face_count, label, {0}};
    memcpy(run.name, o->name, sizeof run.name);
    o->run[o->run_count++] = run;
}

/* uint64_t[faces]: the label of each. */
static uint64_t *labels_of_faces(const obj *o)
{
    const qw_soup *s = &o->build.soup;
    uint64_t *label = QW_NEW(o->build.env, uint64_t, s->face_count);
    for (uint32_t r = 0; r < o->run_count; r++) {
        uint32_t end = r + 1 < o->run_count ? o->run[r + 1].first_face : s->face_count;
        for (uint32_t f = o->run[r].first_face; f < end; f++) label[f] = o->run[r].label;
    }
    return label;
}

/* uint8_t[vertices]: whether faces of different labels meet at the place of each. label: uint64_t[faces]. */
static uint8_t *find_border_vertices(const obj *o, const uint64_t *label, const uint32_t *place)
{
    qw_env *env = o->build.env;
    const qw_soup *s = &o->build.soup;
    uint64_t *first = QW_NEW(env, uint64_t, s->vertex_count);
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, s->vertex_count);
    for (uint32_t f = 0; f < s->face_count; f++)
        for (uint32_t c = s->face_begin[f]; c < s->face_begin[f + 1]; c++) {
            uint32_t v = place[s->corner[c]];
            if (!seen[v]) seen[v] = 1, first[v] = label[f];
            else if (first[v] != label[f]) seen[v] = 2;
        }
    for (uint32_t v = s->vertex_count; v-- > 0;) seen[v] = seen[place[v]] == 2; /* of places, which come first, last */
    qw_free(env, first);
    return seen;
}

/* ---- objects that count from 1 */

/* Some programs write one object after another, each with its own vertices and faces numbered from 1, where OBJ counts
 * on. Then the last vertex of every object is used under that reading, and none but those of the first few under the
 * other. */
static bool counts_from_one(const obj *o)
{
    const qw_soup *s = &o->build.soup;
    for (size_t i = 0; i < o->block_count; i++) {
        const obj_block *b = &o->block[i], *next = i + 1 < o->block_count ? b + 1 : NULL;
        uint32_t vertices = (next ? next->first_vertex : s->vertex_count) - b->first_vertex, used = 0;
        uint32_t end = s->face_begin[next ? next->first_face : s->face_count];
        for (uint32_t c = s->face_begin[b->first_face]; c < end; c++) {
            if (s->corner[c] >= vertices) return false;
            if (s->corner[c] >= used) used = s->corner[c] + 1;
        }
        if (used < 3 || used != vertices) return false;
    }
    return o->block_count > 1;
}

/* Makes vertices that are counted within their objects those of the file. */
static void count_on(obj *o)
{
    qw_soup *s = &o->build.soup;
    for (size_t i = 1; i < o->block_count; i++) {
        const obj_block *b = &o->block[i], *next = i + 1 < o->block_count ? b + 1 : NULL;
        uint32_t end = s->face_begin[next ? next->first_face : s->face_count];
        size_t last_mark = next ? next->first_mark : o->mark_count;
        for (uint32_t c = s->face_begin[b->first_face]; c < end; c++) s->corner[c] += b->first_vertex;
        for (size_t m = 2 * b->first_mark; m < 2 * last_mark; m++) o->mark[m] += b->first_vertex;
    }
    qw_log(o->build.env, QW_LOG_WARNING,
           "%s: each of its %zu objects numbers its vertices from 1, where OBJ counts on: read as it seems meant",
           o->build.name, o->block_count);
}

/* ---- marks */

static bool labels_differ(const void *user, const qw_side *x, const qw_side *y)
{
    const uint64_t *label = user;
    return label[x->face] != label[y->face];
}

/* Marks the edges between faces of different runs. */
static void mark_borders(obj *o)
{
    qw_env *env = o->build.env;
    const qw_soup *s = &o->build.soup;
    if (o->run_count < 2) return;
    uint32_t edges, *place = qw_find_places(env, s->position, s->vertex_count, NULL);
    uint64_t *label = labels_of_faces(o);
    uint8_t *only = find_border_vertices(o, label, place);
    const qw_outlines of = {s->vertex_count, s->face_count, s->position, s->face_begin, s->corner};
    uint32_t *edge = qw_find_borders(env, &of, place, only, labels_differ, label, &edges);
    for (size_t i = 0; i < edges; i++) add_mark(o, edge[2 * i], edge[2 * i + 1]);
    qw_free(env, edge), qw_free(env, only), qw_free(env, label), qw_free(env, place);
}

/* Hands over the marks between vertices that there are. */
static void finish_marks(obj *o, qw_soup *soup)
{
    if (o->crease_count > 0) {
        qw_free(o->build.env, o->mark);
        o->mark = o->crease, o->mark_count = o->crease_count;
    }
    for (size_t i = 0; i < o->mark_count; i++) {
        const uint32_t *m = o->mark + 2 * i;
        if (m[0] >= soup->vertex_count || m[1] >= soup->vertex_count) continue;
        memmove(o->mark + 2 * (size_t)soup->mark_count++, m, 2 * sizeof *m);
    }
    if (soup->mark_count > 0) soup->mark = qw_resize(o->build.env, o->mark, soup->mark_count, 2 * sizeof *o->mark);
    else qw_free(o->build.env, o->mark);
    qw_free(o->build.env, o->run);
}

/* Takes corners that are a blank and the number of a vertex read before, as nearly all are, as long as they are; the
 * rest of the line is left. */
static void read_plain_corners(obj *o)
{
    const char *at = o->text.at;
    while (*at == ' ') {
        uint64_t index;
        uint32_t digits = qw_digits(at + 1, &index);
        char next = at[1 + digits];
        if (digits == QW_DIGITS_AT_ONCE || (next != ' ' && next != '\n') || index - 1 >= o->build.soup.vertex_count)
            break;
        qw_build_corner(&o->build, (uint32_t)index - 1);
        at += 1 + digits;
    }
    o->text.at = at;
}

/* The corners of an "f" line, counted from the end where below 0. Indices beyond the vertices so far are checked
   at the end of the file. */
static void read_face(obj *o)
{
    qw_text *t = &o->text;
    begin_run(o);
    int64_t vertex_count = o->build.soup.vertex_count;
    if (!o->extras.corner) read_plain_corners(o);
    while (!qw_text_line_ends(t)) {
        int64_t index, more[2];
        if (!read_corner(t, &index, more)) qw_text_expected(t, "a corner of a face (v, v/vt, v//vn or v/vt/vn)");
        int64_t vertex = index > 0 ? index - 1 : vertex_count + index;
        if (index == 0 || vertex < 0) fail_index(t, o->face_number, index, vertex_count);
        if (vertex >= vertex_count && index > o->farthest) {
            o->farthest = index;
            o->farthest_face = o->face_number;
            o->farthest_line = t->line;
        }
        if (more[0] | more[1] || o->extras.corner) qw_obj_take_corner(&o->extras, o->build.corner_count, more);
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

/* The statements in which a backslash at the end lets the line go on: lists of numbers. */
static bool has_numbers(const qw_text *t)
{
    return is_statement(t, "v", 1) || is_statement(t, "f", 1) || is_statement(t, "fo", 2) || is_statement(t, "l", 1);
}

/* Names, and what corners name beside their vertices. */
static void read_other(obj *o)
{
    static const struct {
        const char *word;
        size_t size;
    } statements[QW_OBJ_NAMES] = {{"o", 1}, {"g", 1}, {"usemtl", 6}, {"s", 1}};
    qw_text *t = &o->text;
    for (int i = 0; i < QW_OBJ_NAMES; i++) {
        if (!is_statement(t, statements[i].word, statements[i].size)) continue;
        t->at += statements[i].size;
        qw_word word = rest_of_line(t);
        o->name[i] = qw_name_number(o->build.env, &o->extras.names[i], word.at, word.size);
        if (i == QW_OBJ_MATERIAL) o->material = qw_hash_bytes(QW_HASH_BYTES, word.at, word.size);
        if (i == QW_OBJ_SMOOTHING) o->smoothing = qw_hash_bytes(QW_HASH_BYTES, word.at, word.size);
        return;
    }
    if (is_statement(t, "vt", 2) || is_statement(t, "vn", 2)) {
        int which = t->at[1] == 'n';
        t->at += 2;
        qw_obj_take_row(&o->extras, t, which);
    } else if (is_statement(t, "mtllib", 6)) {
        t->at += 6;
        qw_obj_take_library(&o->extras, rest_of_line(t));
    }
}

/* The labels of the faces, and what the extras hold. */
static void finish_attributes(obj *o, qw_soup *soup, bool is_counted_on)
{
    static const char *const titles[QW_OBJ_NAMES] = {"object", "group", "material", "smoothing"};
    qw_env *env = o->build.env;
    qw_obj_finish(&o->extras, soup, is_counted_on);
    for (int i = 0; i < QW_OBJ_NAMES; i++) {
        if (o->extras.names[i].count == 0) continue;
        int32_t *label = QW_NEW(env, int32_t, soup->face_count);
        for (size_t r = 0; r < o->run_count; r++) {
            uint32_t end = r + 1 < o->run_count ? o->run[r + 1].first_face : soup->face_count;
            for (uint32_t f = o->run[r].first_face; f < end; f++) label[f] = o->run[r].name[i];
        }
        qw_attribute *a = qw_build_attribute(env, soup, titles[i], QW_PER_FACE, QW_LABELS, 1);
        a->labels = label, a->label_count = (uint32_t)o->extras.names[i].count, a->storage = QW_INT32;
        a->label_names = qw_finish_names(env, &o->extras.names[i]);
    }
}

qw_soup qw_read_obj(qw_env *env, const char *name, qw_bytes bytes)
{
    size_t faces = bytes.size / BYTES_A_FACE;
    obj o = {.text = qw_text_open(env, name, bytes, '#'),
             .build = qw_build_begin(env, name, bytes.size / BYTES_A_VERTEX, faces, CORNERS_A_FACE * faces)};
    qw_text *t = &o.text;
    memset(o.name, 0xff, sizeof o.name); /* -1: none yet */
    o.extras.env = env;
    while (t->at < t->end) {
        t->continues = false;
        qw_text_blanks(t);
        t->continues = has_numbers(t); /* a name may end in a backslash: there the line does not go on */
        if (is_statement(t, "v", 1)) {
            t->at++;
            read_vertex(&o);
        } else if (is_statement(t, "f", 1) || is_statement(t, "fo", 2)) { /* fo: the same in old files */
            t->at += t->at[1] == 'o' ? 2 : 1;
            read_face(&o);
        } else if (is_statement(t, "l", 1)) {
            t->at++;
            read_line(&o);
        } else if (is_statement(t, "t", 1)) {
            t->at++;
            read_tag(&o);
        } else {
            read_other(&o);
        }
        qw_text_next_line(t);
    }
    if (o.farthest > o.build.soup.vertex_count) {
        t->line = o.farthest_line;
        fail_index(t, o.farthest_face, o.farthest, o.build.soup.vertex_count);
    }
    bool is_counted_on = counts_from_one(&o);
    if (is_counted_on) count_on(&o);
    qw_free(env, o.block);
    mark_borders(&o);
    qw_soup soup = qw_build_finish(&o.build);
    finish_attributes(&o, &soup, is_counted_on);
    finish_marks(&o, &soup);
    return soup;
}

bool qw_is_obj(qw_env *env, qw_bytes bytes)
{
    static const char *const known[] = {"v", "vt", "vn", "vp", "f",      "fo",     "l",
                                        "p", "g",  "o",  "s",  "mtllib", "usemtl", "usemap"};
    qw_text t = qw_text_open(env, "", bytes, '#');
    bool first = true;
    while (qw_text_find_line(&t)) {
        t.continues = has_numbers(&t);
        qw_word word = qw_text_word(&t);
        for (size_t i = 0; i < sizeof known / sizeof *known && first; i++)
            if (qw_word_is(word, known[i])) return true;
        first = false;
        /* after statements of its own kind, the first vertex or face decides */
        char c = word.size == 1 && (*word.at == 'v' || *word.at == 'f') && !qw_text_line_ends(&t) ? *t.at : 0;
        if ((c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.') return true;
        qw_text_next_line(&t);
        t.continues = false;
    }
    return false;
}
