/* A cursor over text in lines: words and numbers within a line, blanks skipped, and failures that name path and line.
   Zeros follow the text, so that no loop needs to look for the end. */
#pragma once

#include "io/file.h"

#include <string.h>

typedef struct qw_text {
    qw_env *env;
    const char *name; /* of the file, for messages */
    const char *at, *end;
    size_t line;    /* of at, counted from 1 */
    char newline;   /* '\n', or '\r' in files of old Macs; then "\r\n" is a blank and a newline */
    char comment;   /* begins a comment that ends with the line; 0: there are none */
    bool continues; /* a backslash before a newline is a blank */
} qw_text;

typedef struct qw_word { /* not terminated; empty at the end of the line */
    const char *at;
    size_t size;
} qw_word;

/* comment: the letter after which the rest of a line is none of it; 0: there is no such letter. */
qw_text qw_text_open(qw_env *env, const char *name, qw_bytes bytes, char comment);

/* "PATH, line 12: ..." */
_Noreturn void qw_text_fail(const qw_text *t, qw_status status, int64_t element, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* Says that `wanted` ("a number") is missing, or what stands in its place; FORMAT_TRUNCATED at the end of the text. */
_Noreturn void qw_text_expected(qw_text *t, const char *wanted);

/* Past blanks, but not past the end of the line. */
static inline void qw_text_blanks(qw_text *t)
{
    for (;; t->at++) {
        char c = *t->at;
        if (c == ' ' || c == '\t' || c == '\v' || c == '\f' || (c == '\r' && t->newline != '\r')) continue;
        if (c != '\\' || !t->continues) return;
        const char *next = t->at + 1;
        if (*next == '\r' && t->newline != '\r') next++;
        if (*next != t->newline) return;
        t->at = next;
        t->line++;
    }
}

/* True where nothing but blanks and a comment is left of the line; at is then at the newline, the comment or the end.
 */
static inline bool qw_text_line_ends(qw_text *t)
{
    qw_text_blanks(t);
    char c = *t->at;
    return c == t->newline || t->at >= t->end || (c == t->comment && c != 0);
}

/* To the beginning of the next line, which a backslash at the end of this one puts off unless it is in a comment: a
   path that ends in one must not swallow the line below. */
void qw_text_next_line(qw_text *t);
/* To the next line that is not blank, perhaps this one, unless at its end. False at the end of the text. */
bool qw_text_find_line(qw_text *t);

/* What is left in this line is one word, up to a blank or comment. */
qw_word qw_text_word(qw_text *t);
bool qw_word_is(qw_word word, const char *text);           /* to the letter */
bool qw_word_is_caseless(qw_word word, const char *lower); /* text in lower case */

/* A number that ends where a word may end. `wanted` is for the message: "a coordinate". */
double qw_text_number(qw_text *t, const char *wanted);
/* A whole number; what is beyond 2^53 comes back as something beyond 2^53. */
int64_t qw_text_integer(qw_text *t, const char *wanted);

/* A copy of at most QW_QUOTE_SIZE - 1 bytes that is safe to print; what does not fit ends in "...". */
enum { QW_QUOTE_SIZE = 40 };
typedef struct qw_quote {
    char text[QW_QUOTE_SIZE];
} qw_quote;
qw_quote qw_quote_word(qw_word word);
