#include "io/json_read.h"

#include "io/number.h"
#include "io/pen.h"

#include <string.h>

enum { DEEPEST = 256 }; /* arrays and objects in one another; glTF needs a dozen */

typedef struct parser {
    qw_json_doc doc;
    size_t capacity;
    uint32_t at, size;
    uint32_t open[DEEPEST]; /* tokens of the arrays and objects around `at` */
    int depth;
} parser;

static _Noreturn void fail(const parser *p, const char *what)
{
    qw_fail(p->doc.env, p->at < p->size ? QW_FORMAT_SYNTAX : QW_FORMAT_TRUNCATED, p->at, "%s: byte %u of its JSON: %s",
            p->doc.name, p->at, what);
}

static char peek(const parser *p) { return p->at < p->size ? p->doc.text[p->at] : 0; }

static void skip_blanks(parser *p)
{
    while (p->at < p->size && strchr(" \t\r\n", p->doc.text[p->at]) && p->doc.text[p->at]) p->at++;
}

static uint32_t add(parser *p, qw_json_kind kind, uint32_t begin)
{
    qw_json_doc *d = &p->doc;
    d->token = qw_grow(d->env, d->token, &p->capacity, d->count + (size_t)1, sizeof *d->token);
    d->token[d->count] = (qw_json_token){.kind = kind, .begin = begin, .end = begin, .next = d->count + 1};
    return d->count++;
}

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static bool is_hex(char c) { return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); }

/* A token of the string at p->at, which is checked and not yet decoded. */
static void take_string(parser *p)
{
    uint32_t t = add(p, QW_JSON_STRING, p->at + 1);
    for (p->at++;; p->at++) {
        char c = peek(p);
        if (c == '"') break;
        if (p->at >= p->size) fail(p, "the text ends in a string");
        if ((unsigned char)c < ' ') fail(p, "there is a control character in a string");
        if (c != '\\') continue;
        p->at++;
        if (peek(p) == 'u') {
            for (int i = 0; i < 4; i++, p->at++)
                if (p->at + 1 >= p->size || !is_hex(p->doc.text[p->at + 1]))
                    fail(p, "\\u is not followed by four digits");
        } else if (p->at >= p->size || !strchr("\"\\/bfnrt", peek(p)) || !peek(p)) {
            fail(p, "a backslash is not followed by what can be escaped");
        }
    }
    p->doc.token[t].end = p->at++;
}

static void take_digits(parser *p)
{
    if (!is_digit(peek(p))) fail(p, "a digit was expected");
    while (is_digit(peek(p))) p->at++;
}

/* A token of the number at p->at. */
static void take_number(parser *p)
{
    uint32_t t = add(p, QW_JSON_NUMBER, p->at);
    if (peek(p) == '-') p->at++;
    if (peek(p) == '0') p->at++;
    else take_digits(p);
    if (peek(p) == '.') p->at++, take_digits(p);
    if (peek(p) == 'e' || peek(p) == 'E') {
        p->at++;
        if (peek(p) == '+' || peek(p) == '-') p->at++;
        take_digits(p);
    }
    p->doc.token[t].end = p->at;
}

/* A token of null, false or true. */
static void take_word(parser *p)
{
    static const char *const words[] = {"null", "false", "true"};
    for (int i = 0; i < 3; i++) {
        uint32_t length = (uint32_t)strlen(words[i]);
        if (p->size - p->at < length || memcmp(p->doc.text + p->at, words[i], length) != 0) continue;
        uint32_t t = add(p, (qw_json_kind)(QW_JSON_NULL + i), p->at);
        p->doc.token[t].end = p->at += length;
        return;
    }
    fail(p, p->at < p->size ? "a value was expected" : "the text ends where a value was expected");
}

static void open_bracket(parser *p, qw_json_kind kind)
{
    if (p->depth == DEEPEST) fail(p, "arrays and objects are nested more than 256 deep");
    p->open[p->depth++] = add(p, kind, p->at++);
}

static void close_bracket(parser *p)
{
    qw_json_token *t = &p->doc.token[p->open[--p->depth]];
    t->end = ++p->at;
    t->next = p->doc.count;
}

static void take_key(parser *p)
{
    skip_blanks(p);
    if (peek(p) != '"') fail(p, "the name of a member was expected");
    take_string(p);
    skip_blanks(p);
    if (peek(p) != ':') fail(p, "a colon was expected");
    p->at++;
}

/* Past a comma or past brackets that close here. False at the end of the document. */
static bool go_on(parser *p)
{
    while (p->depth > 0) {
        qw_json_token *t = &p->doc.token[p->open[p->depth - 1]];
        bool object = t->kind == QW_JSON_OBJECT;
        t->count++;
        skip_blanks(p);
        if (peek(p) == ',') {
            p->at++;
            if (object) take_key(p);
            return true;
        }
        if (peek(p) != (object ? '}' : ']'))
            fail(p, object ? "a comma or } was expected" : "a comma or ] was expected");
        close_bracket(p);
    }
    return false;
}

/* A value, or as much of it as there is before the first value within. False where it is not complete. */
static bool take_value(parser *p)
{
    skip_blanks(p);
    char c = peek(p);
    if (c == '{' || c == '[') {
        open_bracket(p, c == '{' ? QW_JSON_OBJECT : QW_JSON_ARRAY);
        skip_blanks(p);
        if (peek(p) != (c == '{' ? '}' : ']')) {
            if (c == '{') take_key(p);
            return false;
        }
        close_bracket(p);
    } else if (c == '"') {
        take_string(p);
    } else if (c == '-' || is_digit(c)) {
        take_number(p);
    } else {
        take_word(p);
    }
    return true;
}

qw_json_doc qw_json_parse(qw_env *env, const char *name, const char *text, size_t size)
{
    if (size >= UINT32_MAX)
        qw_fail(env, QW_TOO_LARGE, -1, "%s: its JSON has %zu bytes; 4294967294 can be read", name, size);
    parser p = {.doc = {.env = env, .name = name, .text = text}, .size = (uint32_t)size};
    if (size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) p.at = 3;
    while (!take_value(&p) || go_on(&p)) continue;
    skip_blanks(&p);
    while (p.at < p.size && text[p.at] == 0) p.at++; /* some writers fill up with zeros */
    if (p.at < p.size) fail(&p, "something follows the document");
    return p.doc;
}

/* ---- values */

bool qw_json_reads(const qw_json_doc *doc, uint32_t token, const char *text)
{
    if (!qw_json_has_kind(doc, token, QW_JSON_STRING)) return false;
    const qw_json_token *t = &doc->token[token];
    return strlen(text) == t->end - t->begin && memcmp(doc->text + t->begin, text, t->end - t->begin) == 0;
}

uint32_t qw_json_member(const qw_json_doc *doc, uint32_t object, const char *name)
{
    if (!qw_json_has_kind(doc, object, QW_JSON_OBJECT)) return QW_NONE;
    uint32_t key = object + 1;
    for (uint32_t i = 0; i < doc->token[object].count; i++, key = doc->token[key + 1].next)
        if (qw_json_reads(doc, key, name)) return key + 1;
    return QW_NONE;
}

bool qw_json_number(const qw_json_doc *doc, uint32_t token, double *value)
{
    if (!qw_json_has_kind(doc, token, QW_JSON_NUMBER)) return false;
    const char *at = doc->text + doc->token[token].begin;
    return qw_number_read(&at, value);
}

static uint32_t hex_at(const char *at)
{
    uint32_t value = 0;
    for (int i = 0; i < 4; i++) {
        uint32_t c = (unsigned char)at[i];
        value = value << 4 | (c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10);
    }
    return value;
}

static char *put_utf8(char *at, uint32_t c)
{
    if (c == 0) return at;
    if (c < 0x80) return *at++ = (char)c, at;
    int more = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
    static const unsigned char lead[] = {0, 0xc0, 0xe0, 0xf0};
    *at++ = (char)(lead[more] | c >> 6 * more);
    while (more-- > 0) *at++ = (char)(0x80 | (c >> 6 * more & 0x3f));
    return at;
}

/* Six bytes "\uXXXX", or twelve for two that are one character. An odd half becomes U+FFFD. */
static const char *take_unicode(const char *in, const char *end, char **out)
{
    uint32_t c = hex_at(in + 2);
    in += 6;
    if (c >= 0xd800 && c < 0xdc00 && end - in >= 6 && in[0] == '\\' && in[1] == 'u') {
        uint32_t low = hex_at(in + 2);
        if (low >= 0xdc00 && low < 0xe000) c = 0x10000 + ((c - 0xd800) << 10) + (low - 0xdc00), in += 6;
    }
    if (c >= 0xd800 && c < 0xe000) c = 0xfffd;
    *out = put_utf8(*out, c);
    return in;
}

char *qw_json_bytes(const qw_json_doc *doc, uint32_t token)
{
    if (!qw_json_has_kind(doc, token, QW_JSON_STRING)) return NULL;
    const char *in = doc->text + doc->token[token].begin, *end = doc->text + doc->token[token].end;
    char *text = qw_alloc(doc->env, (size_t)(end - in) + 1, 1),
         *out = text; /* escapes are longer than what they mean */
    while (in < end) {
        if (*in != '\\') {
            *out++ = *in++;
        } else if (in[1] == 'u') {
            in = take_unicode(in, end, &out);
        } else {
            static const char from[] = "\"\\/bfnrt", to[] = "\"\\/\b\f\n\r\t";
            *out++ = to[strchr(from, in[1]) - from];
            in += 2;
        }
    }
    *out = 0;
    return text;
}

char *qw_json_string(const qw_json_doc *doc, uint32_t token)
{
    char *text = qw_json_bytes(doc, token);
    if (!text) return NULL;
    qw_pen pen = {.env = doc->env};
    qw_pen_utf8(&pen, text, strlen(text) + 1);
    qw_free(doc->env, text);
    return pen.at;
}
