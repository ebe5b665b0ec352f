/* Points without faces: XYZ, PTS and CSV, the vertices of an OBJ, and PCD of the Point Cloud Library.
 *
 * Lists have no rules: a line with a point begins with three numbers, between which stand blanks, commas, semicolons or
 * bars; a comma is a decimal point where semicolons or bars, or blanks alone, part the numbers. A first line that is
 * one number is a count; # begins a comment. Columns have the names that a line above the first point gives them; where
 * there is none, colours and normals are known by their values.
 *
 * PCD has a header of words: FIELDS names the values of a point, SIZE, TYPE (F, I, U) and COUNT say how they lie,
 * POINTS how many there are, and DATA, the last line, ascii or binary. binary_compressed is refused. Points with a
 * coordinate that is not finite are places where a scanner has seen nothing: they are left out. */
#include "io/build.h"
#include "io/fetch.h"
#include "io/formats.h"
#include "io/number.h"
#include "io/text.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { MOST_FIELDS = 64, LINE_BYTES = 24 };

/* Normals in so few digits that their length is off by this much are normals still. */
static const float ROUNDED = 0.02f;

/* ---- columns with a meaning */

typedef enum role { X, Y, Z, RED, GREEN, BLUE, NORMAL_X, NORMAL_Y, NORMAL_Z, ROLES } role;

/* What stands beside the coordinates of points. */
typedef struct columns {
    int of[ROLES];   /* the column with this meaning; -1: none */
    int width;       /* columns of a row */
    float *value;    /* float[rows][width]; NaN where there is no number */
    size_t capacity; /* floats */
    size_t rows;
    bool has_other_names; /* and none of the coordinates */
} columns;

/* What a column of that name holds; ROLES: nothing that is read. */
static role role_named(qw_word word)
{
    static const char *const names[][4] = {{"x", "east", "easting"},
                                           {"y", "north", "northing"},
                                           {"z", "height", "elevation", "altitude"},
                                           {"r", "red", "rf"},
                                           {"g", "green", "gf"},
                                           {"b", "blue", "bf"},
                                           {"nx", "normal_x", "normalx"},
                                           {"ny", "normal_y", "normaly"},
                                           {"nz", "normal_z", "normalz"}};
    for (int r = 0; r < ROLES; r++)
        for (int i = 0; i < 4 && names[r][i]; i++)
            if (qw_word_is_caseless(word, names[r][i])) return (role)r;
    return ROLES;
}

static void take_row(qw_env *env, columns *c, const double *value)
{
    size_t used = c->rows * (size_t)c->width;
    if (used + (size_t)c->width > c->capacity)
        c->value = qw_grow(env, c->value, &c->capacity, used + (size_t)c->width, sizeof *c->value);
    for (int i = 0; i < c->width; i++) c->value[used + (size_t)i] = (float)value[i];
    c->rows++;
}

/* The attribute of three columns, divided by `scale`. Normals that are missing are 0; without a colour nothing is kept.
 */
static void add_triple(qw_env *env, qw_soup *s, const columns *c, role first, float scale)
{
    bool is_normal = first == NORMAL_X;
    float *value = QW_NEW(env, float, 3 * c->rows);
    for (size_t i = 0; i < c->rows; i++)
        for (int k = 0; k < 3; k++) {
            float v = c->value[i * (size_t)c->width + (size_t)c->of[first + k]] / scale;
            if (!isfinite(v) && !is_normal) {
                qw_log(env, QW_LOG_WARNING, "point %zu has no colour: colours are not kept", i + 1);
                qw_free(env, value);
                return;
            }
            value[3 * i + (size_t)k] = isfinite(v) ? v : 0;
        }
    qw_attribute *a = qw_build_attribute(env, s, is_normal ? "normal" : "color", QW_PER_VERTEX,
                                         is_normal ? QW_NORMALS : QW_VALUES, 3);
    a->storage = scale == UINT8_MAX ? QW_UINT8 : QW_FLOAT32;
    a->values = value;
}

/* Colours are shares, bytes, or words of 16 bits, which the largest of them tells. */
static float scale_of(const columns *c)
{
    float most = 0;
    for (size_t i = 0; i < c->rows; i++)
        for (int k = 0; k < 3; k++) most = fmaxf(most, c->value[i * (size_t)c->width + (size_t)c->of[RED + k]]);
    return most <= 1 ? 1 : most <= UINT8_MAX ? UINT8_MAX : UINT16_MAX;
}

static bool has_triple(const columns *c, role first)
{
    return c->of[first] >= 0 && c->of[first + 1] >= 0 && c->of[first + 2] >= 0;
}

static void add_columns(qw_env *env, qw_soup *s, columns *c)
{
    assert(c->rows == s->vertex_count);
    if (has_triple(c, RED)) add_triple(env, s, c, RED, scale_of(c));
    if (has_triple(c, NORMAL_X)) add_triple(env, s, c, NORMAL_X, 1);
    qw_free(env, c->value);
}

/* ---- lists */

typedef struct list {
    qw_text text;
    columns columns;
    bool is_uneven;       /* points have different numbers of columns */
    bool is_comma_number; /* commas of this line are decimal points */
} list;

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static bool begins_number(qw_word cell)
{
    if (cell.size > 1 && (*cell.at == '-' || *cell.at == '+')) cell.at++;
    return cell.size > 0 && (is_digit(*cell.at) || *cell.at == '.');
}

static bool is_separator(const list *l, char c) { return strchr(";|", c) ? c != 0 : c == ',' && !l->is_comma_number; }

/* What stands before the next blank or separator, of which one is passed over; empty where nothing stands there. */
static qw_word take_cell(list *l)
{
    qw_text *t = &l->text;
    qw_text_blanks(t);
    qw_word cell = {t->at, 0};
    while (*t->at && !strchr(" \t\v\f\r\n", *t->at) && *t->at != t->comment && !is_separator(l, *t->at)) t->at++;
    cell.size = (size_t)(t->at - cell.at);
    if (cell.size == 0 && !is_separator(l, *t->at) && t->at < t->end && !qw_text_line_ends(t)) t->at++; /* a zero */
    qw_text_blanks(t);
    if (is_separator(l, *t->at)) t->at++;
    if (cell.size > 1 && *cell.at == '"' && cell.at[cell.size - 1] == '"') cell.at++, cell.size -= 2;
    return cell;
}

static bool read_number(const list *l, qw_word cell, double *value)
{
    char copy[QW_QUOTE_SIZE + QW_ZEROS] = {0};
    if (l->is_comma_number && cell.size <= QW_QUOTE_SIZE) {
        for (size_t i = 0; i < cell.size; i++) copy[i] = cell.at[i] == ',' ? '.' : cell.at[i];
        cell.at = copy;
    }
    const char *at = cell.at;
    return begins_number(cell) && qw_number_read(&at, value) && at == cell.at + cell.size;
}

/* Whether commas of this line stand in numbers, as in 1,5, or between them. */
static void begin_line(list *l)
{
    const qw_text *t = &l->text;
    const char *newline = memchr(t->at, t->newline, (size_t)(t->end - t->at)), *end = newline ? newline : t->end;
    bool is_parted = false, is_decimal = true; /* every comma of the line stands in a number of its own */
    int blanks = 0, points = 0;                /* points: of the cell */
    for (const char *c = t->at; c < end; c++) {
        bool is_blank = strchr(" \t\r", *c) != NULL;
        is_parted |= *c == ';' || *c == '|';
        points = is_blank ? 0 : points + (*c == ',' || *c == '.');
        blanks += is_blank && c + 1 < end && !strchr(" \t\r", c[1]);
        is_decimal &= *c != ',' || (points == 1 && c > t->at && c + 1 < end && is_digit(c[-1]) && is_digit(c[1]));
    }
    l->is_comma_number = is_parted || (is_decimal && blanks >= 2);
}

/* Whether the line has numbers where the coordinates are: the cursor is left where it is. */
static bool has_point(const list *l)
{
    list ahead = *l;
    int found = 0;
    for (int i = 0; i < MOST_FIELDS && !qw_text_line_ends(&ahead.text); i++) {
        qw_word cell = take_cell(&ahead);
        for (int k = 0; k < 3; k++) found += l->columns.of[k] == i && begins_number(cell);
    }
    return found == 3;
}

/* Takes the names of columns from the line where it has those of the coordinates; a comment begins with x. */
static void take_names(const list *l, columns *c)
{
    list ahead = *l;
    columns named = *c;
    ahead.text.comment = 0;
    qw_text_blanks(&ahead.text);
    bool is_comment = *ahead.text.at == '#' || *ahead.text.at == '/';
    while (*ahead.text.at == '#' || *ahead.text.at == '/') ahead.text.at++;
    for (int r = 0; r < ROLES; r++) named.of[r] = -1;
    int cells = 0;
    for (; cells < MOST_FIELDS && !qw_text_line_ends(&ahead.text); cells++) {
        role r = role_named(take_cell(&ahead));
        if (r < ROLES && named.of[r] < 0) named.of[r] = cells;
    }
    bool has_all = named.of[X] >= 0 && named.of[Y] >= 0 && named.of[Z] >= 0;
    if (has_all && (!is_comment || named.of[X] == 0)) *c = named;
    c->has_other_names = !has_all && !is_comment && cells > 2;
}

/* The point of a line, by the columns of the header; the rest of its numbers for normals and colours. */
static void take_point(list *l, qw_builder *b)
{
    columns *c = &l->columns;
    double row[MOST_FIELDS], p[3];
    int count = 0;
    const qw_text *t = &l->text;
    while (count < MOST_FIELDS && !qw_text_line_ends(&l->text)) {
        qw_word cell = take_cell(l);
        bool is_number = read_number(l, cell, &row[count]), is_axis = false;
        for (int k = 0; k < 3; k++) is_axis |= c->of[k] == count;
        if (is_axis && !is_number)
            qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "\"%s\" stands where a coordinate should be",
                         qw_quote_word(cell).text);
        if (!is_number) row[count] = NAN;
        count++;
    }
    for (int k = 0; k < 3; k++) p[k] = row[c->of[k]];
    if (!qw_is_finite3(p)) qw_text_fail(t, QW_NOT_FINITE, -1, "a coordinate is NaN or infinite");
    if (b->soup.vertex_count == 0) c->width = count;
    l->is_uneven |= count != c->width;
    while (count < c->width) row[count++] = NAN;
    qw_build_vertex(b, p);
    take_row(l->text.env, c, row);
}

/* What the columns of three from `first` on could be: X: neither colours nor normals. */
static role role_of_values(const columns *c, int first)
{
    bool is_share = true, is_byte = true, is_unit = true;
    size_t lengths = 0;
    for (size_t i = 0; i < c->rows; i++) {
        const float *v = c->value + i * (size_t)c->width + first;
        float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int k = 0; k < 3; k++) {
            is_share &= v[k] >= 0 && v[k] <= 1;
            is_byte &= v[k] >= 0 && v[k] <= UINT8_MAX && v[k] == floorf(v[k]);
        }
        is_unit &= fabsf(length - 1) < ROUNDED || length == 0;
        lengths += length > 0;
    }
    return is_unit && lengths > 0 && !(is_byte && is_share) ? NORMAL_X : is_share || is_byte ? RED : X;
}

/* Columns without names: an intensity may stand before colours (PTS), or an opacity, which is the same everywhere,
   behind them. */
static void name_columns(columns *c)
{
    int at = 3;
    if (c->width % 3 == 1 && c->width > 6) {
        bool is_constant = true;
        for (size_t i = 1; i < c->rows; i++)
            is_constant &= c->value[(i + 1) * (size_t)c->width - 1] == c->value[(size_t)c->width - 1];
        at += !is_constant;
    }
    for (; at + 3 <= c->width; at += 3) {
        role r = role_of_values(c, at);
        if (r == X || c->of[r] >= 0) continue;
        for (int k = 0; k < 3; k++) c->of[r + (role)k] = at + k;
    }
}

qw_soup qw_read_xyz(qw_env *env, const char *name, qw_bytes bytes)
{
    qw_builder b = qw_build_begin(env, name, bytes.size / LINE_BYTES, 0, 0);
    list l = {.text = qw_text_open(env, name, bytes, 0), .columns.of = {0, 1, 2, -1, -1, -1, -1, -1, -1}};
    qw_text *t = &l.text;
    t->comment = '#';
    for (; t->at < t->end; qw_text_next_line(t)) {
        qw_text_blanks(t);
        if (t->at[0] == 'v' && (t->at[1] == ' ' || t->at[1] == '\t')) t->at++;
        if (t->at[0] == 'f' && (t->at[1] == ' ' || t->at[1] == '\t'))
            qw_text_fail(t, QW_FORMAT_UNKNOWN, -1, "the file has faces: it is no file of points");
        begin_line(&l);
        if (has_point(&l)) take_point(&l, &b);
        else if (b.soup.vertex_count == 0) take_names(&l, &l.columns);
    }
    if (b.soup.vertex_count == 0) qw_fail(env, QW_FORMAT_UNKNOWN, -1, "%s: no line begins with three numbers", name);
    qw_soup soup = qw_build_finish_points(&b);
    columns *c = &l.columns;
    if (c->has_other_names)
        qw_log(env, QW_LOG_WARNING, "%s: no columns are named x, y and z: the first three are taken", name);
    bool has_names = false;
    for (int r = RED; r < ROLES; r++) has_names |= c->of[r] >= c->width ? (c->of[r] = -1, false) : c->of[r] >= 0;
    if (!has_names && l.is_uneven)
        qw_log(env, QW_LOG_WARNING, "%s: points have different numbers of columns: only coordinates are kept", name);
    else if (!has_names) name_columns(c);
    add_columns(env, &soup, c);
    return soup;
}

/* ---- PCD */

typedef struct pcd {
    qw_env *env;
    qw_text text;
    int fields, of[ROLES]; /* the field with this meaning; -1: none */
    int packed;            /* the field of colours in one word, rgb or rgba; -1: none */
    int64_t size[MOST_FIELDS], count[MOST_FIELDS], points;
    char type[MOST_FIELDS];
    bool is_binary;
    qw_word left_out; /* the first field that has no meaning here; of size 0: none */
} pcd;

bool qw_is_pcd(qw_bytes bytes) { return strncmp(bytes.at, "# .PCD", 6) == 0 || strncmp(bytes.at, "VERSION ", 8) == 0; }

/* The line FIELDS of a PCD file: which field is which coordinate, normal or colour. */
static void read_fields(pcd *p)
{
    for (int r = 0; r < ROLES; r++) p->of[r] = -1; /* of a line FIELDS before this one */
    p->packed = -1, p->left_out.size = 0;
    for (p->fields = 0; !qw_text_line_ends(&p->text); p->fields++) {
        qw_word word = qw_text_word(&p->text);
        if (p->fields == MOST_FIELDS) qw_text_fail(&p->text, QW_TOO_LARGE, -1, "there are too many fields");
        role r = role_named(word);
        if (r < ROLES) p->of[r] = p->fields;
        bool is_packed = qw_word_is(word, "rgb") || qw_word_is(word, "rgba");
        if (is_packed) p->packed = p->fields;
        else if (r == ROLES && !qw_word_is(word, "_") && p->left_out.size == 0) p->left_out = word;
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
        if (p->of[k] < 0 || p->count[p->of[k]] != 1)
            qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the fields x, y and z are not all there");
    if (p->points < 0) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the number of points is negative");
}

/* A field of a binary point as a number; NaN for a type that there is not. */
static double value_of(const pcd *p, const char *at, int field)
{
    int size = (int)p->size[field], shift = 64 - 8 * size;
    uint64_t bits = qw_fetch_bits(at, size, false);
    double value;
    if (p->type[field] == 'U') return (double)bits;
    if (p->type[field] == 'I') return (double)((int64_t)(bits << shift) >> shift);
    if (p->type[field] == 'F' && size == 4) return qw_fetch_float(at, false);
    if (p->type[field] != 'F' || size != 8) return NAN;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* A row of the nine roles. bits: of the colour in one word. */
static void add_point(const pcd *p, qw_builder *b, columns *c, double *row, uint32_t bits)
{
    for (int k = 0; k < 3 && p->packed >= 0; k++) row[RED + k] = (bits >> (16 - 8 * k)) & UINT8_MAX;
    if (!qw_is_finite3(row)) return;
    qw_build_vertex(b, row);
    take_row(p->env, c, row);
}

/* The points of a binary PCD file, one record each. */
static void read_binary_points(pcd *p, qw_builder *b, columns *c)
{
    int64_t offset[MOST_FIELDS], stride = 0;
    for (int i = 0; i < p->fields; i++) offset[i] = stride, stride += p->size[i] * p->count[i];
    if (stride == 0 || p->points > (p->text.end - p->text.at) / stride)
        qw_text_fail(&p->text, QW_FORMAT_TRUNCATED, -1, "the file ends before its points do");
    for (int k = 0; k < 3; k++)
        if (p->type[p->of[k]] != 'F' || (p->size[p->of[k]] != 4 && p->size[p->of[k]] != 8))
            qw_text_fail(&p->text, QW_UNSUPPORTED, p->of[k], "coordinates must be floats of 4 or 8 bytes");
    for (int64_t i = 0; i < p->points; i++, p->text.at += stride) {
        double row[ROLES] = {0};
        for (int r = 0; r < ROLES; r++)
            if (p->of[r] >= 0) row[r] = value_of(p, p->text.at + offset[p->of[r]], p->of[r]);
        uint64_t bits = p->packed >= 0 ? qw_fetch_bits(p->text.at + offset[p->packed], 4, false) : 0;
        add_point(p, b, c, row, (uint32_t)bits);
    }
}

/* The bits of a colour in text: a float that has them, or a whole number that is them. */
static uint32_t packed_bits(const pcd *p, double value)
{
    float single = (float)value;
    uint32_t bits = 0;
    if (p->type[p->packed] == 'F') memcpy(&bits, &single, sizeof bits);
    else if (value >= INT32_MIN && value <= UINT32_MAX) bits = (uint32_t)(int64_t)value;
    return bits;
}

/* The points of a text PCD file, one line each. */
static void read_text_points(pcd *p, qw_builder *b, columns *c)
{
    for (int64_t i = 0; i < p->points; i++) {
        double row[ROLES] = {0};
        uint32_t bits = 0;
        if (!qw_text_find_line(&p->text))
            qw_text_fail(&p->text, QW_FORMAT_TRUNCATED, i, "the file ends before its points do");
        for (int f = 0; f < p->fields; f++)
            for (int64_t n = 0; n < p->count[f]; n++) {
                int r = 0;
                while (r < ROLES && p->of[r] != f) r++;
                if (r < ROLES) row[r] = qw_text_number(&p->text, r < 3 ? "a coordinate" : "a number");
                else if (f == p->packed) bits = packed_bits(p, qw_text_number(&p->text, "a colour"));
                else (void)qw_text_word(&p->text);
            }
        add_point(p, b, c, row, bits);
        qw_text_next_line(&p->text);
    }
}

/* Fields of several values, or of sizes that numbers do not have, are no colours and normals. */
static void drop_odd_fields(pcd *p)
{
    for (int r = RED; r < ROLES; r++)
        if (p->of[r] >= 0 && p->count[p->of[r]] != 1) p->of[r] = -1;
    if (p->packed >= 0 && (p->count[p->packed] != 1 || p->size[p->packed] != 4)) p->packed = -1;
}

qw_soup qw_read_pcd(qw_env *env, const char *name, qw_bytes bytes)
{
    pcd p = {.env = env, .text = qw_text_open(env, name, bytes, '#'), .packed = -1};
    columns c = {.of = {X, Y, Z, RED, GREEN, BLUE, NORMAL_X, NORMAL_Y, NORMAL_Z}, .width = ROLES};
    for (int r = 0; r < ROLES; r++) p.of[r] = -1;
    read_pcd_header(&p);
    drop_odd_fields(&p);
    if (p.left_out.size > 0)
        qw_log(env, QW_LOG_WARNING, "the field %s of the points is left out: colours and normals are kept",
               qw_quote_word(p.left_out).text);
    for (int r = RED; r < ROLES; r++)
        if (p.of[r] < 0 && (p.packed < 0 || r > BLUE)) c.of[r] = -1;
    qw_builder b = qw_build_begin(env, name, 16, 0, 0);
    if (p.is_binary) read_binary_points(&p, &b, &c);
    else read_text_points(&p, &b, &c);
    qw_soup soup = qw_build_finish_points(&b);
    add_columns(env, &soup, &c);
    return soup;
}
