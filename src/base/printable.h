/* Texts that others wrote, such as names of files, as they can be shown: valid UTF-8 without control characters. */
#pragma once

/* Bytes of a path, as a link holds it and as it is shown. */
enum { QW_PATH_SIZE = 4096 };

#include <stdbool.h>
#include <stddef.h>

/* Bytes of the UTF-8 character at text, 1 to 4; 0 where the bytes there are none. text is NUL terminated. */
size_t qw_utf8_size(const char *text);
/* Whether the character of so many bytes is a control character: below 0x20, DEL, or U+0080 to U+009F, which terminals
   obey too. */
bool qw_is_control(const char *text, size_t size);
/* Whether nothing in text needs to be written otherwise. */
bool qw_is_printable(const char *text);
/* Copies text with each byte of a control character, or of what is no UTF-8, as \xNN; what does not fit is cut between
   characters. size is at least 1. Returns the bytes written but for the final NUL. */
size_t qw_printable(char *to, size_t size, const char *text);
