/* JSON as a flat list of tokens over its text: nothing is copied, numbers stay as they were written, and no depth of
 * nesting costs stack. The text is that of files, and may be hostile: what is not JSON fails with QW_FORMAT_SYNTAX and
 * a sentence that names the byte. */
#pragma once

#include "base/env.h"

typedef enum qw_json_kind {
    QW_JSON_NULL,
    QW_JSON_FALSE,
    QW_JSON_TRUE,
    QW_JSON_NUMBER,
    QW_JSON_STRING,
    QW_JSON_ARRAY,
    QW_JSON_OBJECT
} qw_json_kind;

typedef struct qw_json_token {
    uint32_t begin, end; /* bytes of the text; of strings without the quotes */
    uint32_t next;       /* the token after all that this one holds */
    uint32_t count;      /* items of an array, members of an object */
    qw_json_kind kind;
} qw_json_token;

/* Token 0 is the document. What an array holds begins at the token after it, each item at `next` of the one before; an
   object holds a string and a value in turn. */
typedef struct qw_json_doc {
    qw_env *env;
    const char *name; /* of the file, for messages */
    const char *text; /* char[size], followed by QW_ZEROS zeros or by what is no part of a number */
    qw_json_token *token;
    uint32_t count;
} qw_json_doc;

/* Tokens are in the caller's scope; the text must stay. Nothing may follow the document but blanks and zeros. */
qw_json_doc qw_json_parse(qw_env *env, const char *name, const char *text, size_t size);

/* The value of a member; QW_NONE where the object has none, or `object` is QW_NONE or no object. The first counts. */
uint32_t qw_json_member(const qw_json_doc *doc, uint32_t object, const char *name);
static inline bool qw_json_has_kind(const qw_json_doc *doc, uint32_t token, qw_json_kind kind)
{
    return token != QW_NONE && doc->token[token].kind == kind;
}
/* Whether a string reads so; what has escapes reads like no name. */
bool qw_json_reads(const qw_json_doc *doc, uint32_t token, const char *text);
/* False where the token is QW_NONE or no number. */
bool qw_json_number(const qw_json_doc *doc, uint32_t token, double *value);
/* The text of a string with its escapes resolved; zeros in it are left out. NULL where it is none. In the caller's
   scope. qw_json_string: as UTF-8, bytes that are none taken for letters of Latin-1; qw_json_bytes: as they are, for
   names of files. */
char *qw_json_string(const qw_json_doc *doc, uint32_t token);
char *qw_json_bytes(const qw_json_doc *doc, uint32_t token);
/* The bytes of a value as they are in the text, quotes and brackets and all. */
static inline uint32_t qw_json_begin_of(const qw_json_doc *doc, uint32_t token)
{
    return doc->token[token].begin - (doc->token[token].kind == QW_JSON_STRING);
}
static inline uint32_t qw_json_end_of(const qw_json_doc *doc, uint32_t token)
{
    return doc->token[token].end + (doc->token[token].kind == QW_JSON_STRING);
}
