/* Compression as PNG wants it: a zlib stream (RFC 1950, 1951), in parts that are compressed on the run's threads. The
 * same bytes at any number of threads. */
#pragma once

#include "io/pen.h"

/* Fills `size` bytes from `at` of what is compressed. Called for parts in any order, on any thread. */
typedef void (*qw_deflate_source)(void *user, size_t at, size_t size, uint8_t *to);

/* put is called with the pieces of the stream, in order. */
typedef void (*qw_deflate_sink)(void *user, const void *bytes, size_t size);

void qw_deflate(qw_env *env, size_t size, qw_deflate_source source, qw_deflate_sink sink, void *user);
