#include "io/text.h"

#include "io/number.h"

#include <stdarg.h>
#include <stdio.h>

enum { MESSAGE_SIZE = 256 };

qw_text qw_text_open(qw_env *env, const char *name, qw_bytes bytes, char comment)
{
    qw_text t = {.env = env, .name = name, .at = bytes.at, .end = bytes.at + bytes.size};
    t.line = 1, t.newline = '\n', t.comment = comment;
    if (bytes.size >= 3 && memcmp(bytes.at, "\xef\xbb\xbf", 3) == 0) t.at += 3; /* byte order mark */
    size_t first = strcspn(t.at, "\r\n");
    if (t.at[first] == '\r' && t.at[first + 1] != '\n') t.newline = '\r';
    return t;
}

void qw_text_fail(const qw_text *t, qw_status status, int64_t element, const char *format, ...)
{
    char text[MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    qw_fail(t->env, status, element, "%s, line %zu: %s", t->name, t->line, text);
}

void qw_text_expected(qw_text *t, const char *wanted)
{
    bool ends = qw_text_line_ends(t);
    if (t->at >= t->end) qw_text_fail(t, QW_FORMAT_TRUNCATED, -1, "the file ends where %s should be", wanted);
    if (ends) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the line ends where %s should be", wanted);
    qw_quote found = qw_quote_word(qw_text_word(t));
    /* a cut can leave a word that means nothing */
    if (t->at >= t->end)
        qw_text_fail(t, QW_FORMAT_TRUNCATED, -1, "the file ends with \"%s\" where %s should be", found.text, wanted);
    qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "\"%s\" stands where %s should be", found.text, wanted);
}

void qw_text_next_line(qw_text *t)
{
    if (*t->at == t->newline && t->at < t->end) { /* nothing was left of the line */
        t->at++, t->line++;
        return;
    }
    for (bool more = true; more;) {
        const char *newline = memchr(t->at, t->newline, (size_t)(t->end - t->at));
        if (!newline) {
            t->at = t->end;
            return;
        }
        const char *last = newline;
        if (last > t->at && last[-1] == '\r') last--;
        more = t->continues && last > t->at && last[-1] == '\\' && !memchr(t->at, t->comment, (size_t)(last - t->at));
        t->at = newline + 1;
        t->line++;
    }
}

bool qw_text_find_line(qw_text *t)
{
    while (qw_text_line_ends(t)) {
        if (t->at >= t->end) return false;
        qw_text_next_line(t);
    }
    return true;
}

/* Whether a word ends here: at white space, a comment, a line that is continued, or the end of the text. */
static bool ends_word(const qw_text *t, const char *at)
{
    switch (*at) {
    case ' ':
    case '\t':
    case '\v':
    case '\f':
    case '\r':
    case '\n': return true;
    case '\\': return t->continues && (at[1] == t->newline || at[1] == '\r');
    case 0: return at >= t->end;
    default: return *at == t->comment;
    }
}

qw_word qw_text_word(qw_text *t)
{
    qw_word word = {t->at, 0};
    if (qw_text_line_ends(t)) return word;
    word.at = t->at;
    while (!ends_word(t, t->at)) t->at++;
    word.size = (size_t)(t->at - word.at);
    return word;
}

bool qw_word_is(qw_word word, const char *text)
{
    return word.size == strlen(text) && memcmp(word.at, text, word.size) == 0;
}

bool qw_word_is_caseless(qw_word word, const char *lower)
{
    if (word.size != strlen(lower)) return false;
    for (size_t i = 0; i < word.size; i++) {
        char c = word.at[i];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != lower[i]) return false;
    }
    return true;
}

double qw_text_number(qw_text *t, const char *wanted)
{
    qw_text_blanks(t);
    const char *p = t->at;
    double value;
    if (!qw_number_read(&p, &value) || !ends_word(t, p)) qw_text_expected(t, wanted);
    t->at = p;
    return value;
}

int64_t qw_text_integer(qw_text *t, const char *wanted)
{
    qw_text_blanks(t);
    const char *p = t->at;
    bool negative = *p == '-';
    if (*p == '-' || *p == '+') p++;
    const char *begin = p;
    int64_t value = 0;
    for (; *p >= '0' && *p <= '9'; p++)
        if (value < (int64_t)1 << 53) value = value * 10 + (*p - '0');
    if (p == begin || !ends_word(t, p)) qw_text_expected(t, wanted);
    t->at = p;
    return negative ? -value : value;
}

qw_quote qw_quote_word(qw_word word)
{
    qw_quote q;
    size_t size = word.size < QW_QUOTE_SIZE ? word.size : QW_QUOTE_SIZE - 1;
    for (size_t i = 0; i < size; i++) q.text[i] = word.at[i] >= ' ' && word.at[i] < 0x7f ? word.at[i] : '?';
    if (size < word.size) memcpy(q.text + size - 3, "...", 3);
    q.text[size] = 0;
    return q;
}
