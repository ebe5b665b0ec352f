/* How messages show a path: the same on every system. */
#include "base/printable.h"
#include "io/file.h"

#include <string.h>

enum { LONGEST_NAME = 240 }; /* bytes of a path in a message, so that the sentence after it is not cut */

const char *qw_path_for_messages(qw_env *env, const char *path, const char *standard)
{
    if (strcmp(path, "-") == 0) return standard;
    if (strlen(path) <= LONGEST_NAME && qw_is_printable(path)) return path;
    size_t room = 4 * strlen(path) + 1;
    char *name = qw_alloc(env, room, 1);
    size_t size = qw_printable(name, room, path);
    if (size <= LONGEST_NAME) return name;
    char *tail = name + size - (LONGEST_NAME - 3);
    while (((unsigned char)*tail & 0xc0) == 0x80) tail++; /* not in the middle of a character */
    memmove(name + 3, tail, strlen(tail) + 1);
    memcpy(name, "...", 3);
    return name;
}
