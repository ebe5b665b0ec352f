/* Any bytes as a picture: PNG, JPEG, WebP, BMP or TGA. Either its pixels, of the size that its head says, or a sentence
 * why it cannot be read. A first byte below 4 puts the head of a format before the rest, which random bytes seldom
 * find.
 */
#include "io/pictures/picture.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { LONGEST_HEAD = 30 };
static const struct {
    char bytes[LONGEST_HEAD + 1];
    size_t size;
} head[4] = {{"RIFF\xff\xff\0\0WEBPVP8L\xff\xff\0\0\x2f", 21},
             {"RIFF\xff\xff\0\0WEBPVP8 \xff\xff\0\0\x10\x02\0\x9d\x01\x2a", 26},
             {"RIFF\xff\xff\0\0WEBPVP8X\x0a\0\0\0\x10\0\0\0\x07\0\0\x07\0\0", 30},
             {"\xff\xd8\xff", 3}};

typedef struct trial {
    qw_env *env;
    char *text;
    size_t size;
} trial;

static void read_picture(void *user)
{
    trial *t = user;
    const char *why = NULL;
    qw_picture p = qw_read_picture(t->env, (qw_bytes){t->text, t->size}, &why);
    if (!p.pixels && (!why || !why[0])) abort();
    const unsigned char *at = p.pixels;
    size_t last = (size_t)p.width * p.height * p.channels * p.bits / 8;
    if (p.pixels) free(memcpy(malloc(last), at, last));
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)16 << 20};
    trial t = {.env = qw_env_create(&host, 1), .text = malloc(size + LONGEST_HEAD)};
    if (!t.env || !t.text) abort();
    bool has_head = size > 0 && bytes[0] < 4;
    if (has_head) memcpy(t.text, head[bytes[0]].bytes, t.size = head[bytes[0]].size), bytes++, size--;
    if (size > 0) memcpy(t.text + t.size, bytes, size);
    t.size += size;
    qw_status status = qw_protect(t.env, read_picture, &t);
    if (status == QW_INTERNAL || (status != QW_OK && !qw_env_message(t.env)[0])) abort();
    qw_env_destroy(t.env);
    free(t.text);
    return 0;
}
