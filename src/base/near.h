/* Whether a word is a name misspelt. */
#pragma once

#include <stdbool.h>

/* More than the distance of any two names: where `best` of qw_is_near begins. */
enum { QW_NEVER_NEAR = 33 };
/* Bytes of NAME=VALUE as text, and of a value. */
enum { QW_SETTING_SIZE = 64 };

/* Whether typed is nearer to name than best and within a third of its length: insertions, deletions, substitutions and
   swaps; capitals are small letters, and - is _. Then best is that distance. */
bool qw_is_near(const char *typed, const char *name, unsigned *best);
