/* The readers and writers of the single formats. Readers fail, or return a soup in the caller's scope. */
#ifndef QW_IO_FORMATS_H
#define QW_IO_FORMATS_H

#include "io/file.h"
#include "io/soup.h"

/* bytes.at[bytes.size] is 0 for all of them. */
qw_soup qw_read_obj(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_ply(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_off(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_stl_text(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_stl_binary(qw_env *env, const char *name, qw_bytes bytes);

/* Do the contents look like it? The first sure sign counts, so the order of the questions matters: see read.c. */
bool qw_is_stl_binary(qw_bytes bytes);      /* of exactly the announced length */
bool qw_is_stl_binary_bent(qw_bytes bytes); /* cut or continued, but with a sound first triangle */
bool qw_is_stl_text(qw_env *env, qw_bytes bytes);
bool qw_is_ply(qw_bytes bytes);
bool qw_is_off(qw_env *env, qw_bytes bytes);
bool qw_is_off_bare(qw_env *env, qw_bytes bytes); /* without its first word: three counts */
bool qw_is_obj(qw_env *env, qw_bytes bytes);

/* Numbers of either byte order at any address. */
static inline uint64_t qw_fetch_bits(const char *at, int size, bool big)
{
    const unsigned char *p = (const unsigned char *)at;
    uint64_t bits = 0;
    for (int i = 0; i < size; i++) bits |= (uint64_t)p[i] << 8 * (big ? size - 1 - i : i);
    return bits;
}

double qw_fetch_float(const char *at, bool big);

#endif
