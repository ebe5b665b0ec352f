/* Any bytes as a file of guides: either guides with finite points, or a sentence. @ and a digit are a number from a
 * table of those at the ends, # a line that is often right. */
#define _GNU_SOURCE /* memfd_create */
#include "io/guides_file.h"

#include "quadwright/quadwright.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static const char *const ends[10] = {"1e39",       "-1e308", "1e999", "nan", "1e-320", "-0", "18446744073709551617",
                                     "2147483648", "-1",     "0"};
static const char *const lines[4] = {"v 0 0 1\n", "l 1 2 1\n", "g rings 6\n", "o direction\n"};

typedef struct trial {
    qw_env *env;
    int file;
} trial;

static void read_guides(void *user)
{
    trial *t = user;
    char path[32];
    uint32_t count;
    snprintf(path, sizeof path, "/dev/fd/%d", t->file);
    qw_guide *guide = qw_read_guides(t->env, path, &count);
    for (uint32_t i = 0; i < count; i++)
        for (size_t k = 0; k < 3 * (size_t)guide[i].point_count; k++)
            if (!isfinite(guide[i].points[k])) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    trial t = {qw_env_create(&host, 1), memfd_create("guides", 0)};
    if (!t.env || t.file < 0) abort();
    for (size_t i = 0; i < size; i++) {
        bool is_end = bytes[i] == '@' && i + 1 < size && bytes[i + 1] >= '0' && bytes[i + 1] <= '9';
        bool is_line = bytes[i] == '#' && i + 1 < size;
        char one[2] = {(char)bytes[i], 0};
        const char *text = is_end ? ends[bytes[i + 1] - '0'] : is_line ? lines[bytes[i + 1] % 4] : one;
        size_t length = text[0] ? strlen(text) : 1;
        if (write(t.file, text, length) != (ssize_t)length) abort();
        i += is_end || is_line;
    }
    qw_status status = qw_protect(t.env, read_guides, &t);
    if (status == QW_INTERNAL || (status != QW_OK && !qw_env_message(t.env)[0])) abort();
    qw_env_destroy(t.env);
    close(t.file);
    return 0;
}
