/* libFuzzer entry for the readers of all formats. Seeds: tests/data/io.
     clang -g -O1 -fsanitize=fuzzer,address,undefined -Iinclude -Isrc fuzz/fuzz_read.c src/io/[a-z]*.c src/base/[a-z]*.c
   -lm -lpthread */
#include "io/soup.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

typedef struct input {
    qw_env *env;
    const uint8_t *bytes;
    size_t size;
    qw_soup soup;
} input;

static void read_input(void *user)
{
    input *i = user;
    i->soup = qw_read_memory(i->env, i->bytes, i->size, "fuzz");
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    qw_host host = {.memory_limit = 100 * size +
                                    (1 << 16)}; /* no announced count may ask for more than the bytes allow */
    input i = {.env = qw_env_create(&host, 1), .bytes = bytes, .size = size};
    if (!i.env) return 0;
    qw_status status = qw_protect(i.env, read_input, &i);
    bool shares = size >= 4 &&
                  (memcmp(bytes, "glTF", 4) == 0 || memchr(bytes, '{', size)); /* a mesh shown twice is two */
    if ((status == QW_MEMORY && !shares) || status == QW_INTERNAL) abort();
    if (status == QW_OK) {
        const qw_soup *s = &i.soup;
        if (s->face_count == 0) abort();
        for (uint32_t c = 0; c < s->face_begin[s->face_count]; c++)
            if (s->corner[c] >= s->vertex_count) abort();
        for (size_t k = 0; k < 3 * (size_t)s->vertex_count; k++)
            if (s->position[k] - s->position[k] != 0) abort();
    } else if (qw_env_bytes(i.env) != 0) {
        abort();
    }
    qw_env_destroy(i.env);
    return 0;
}
