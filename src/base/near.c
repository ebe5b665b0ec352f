#include "base/near.h"

#include <string.h>

enum { LONGEST_NAME = QW_NEVER_NEAR - 1 };

static unsigned least3(unsigned a, unsigned b, unsigned c) { return a < b ? (a < c ? a : c) : (b < c ? b : c); }

static char plain(char c) { return c >= 'A' && c <= 'Z' ? (char)(c + 32) : c == '-' ? '_' : c; }

/* Levenshtein's distance, one row of the table at a time. */
static unsigned edit_distance(const char *a, const char *b)
{
    size_t n = strlen(a), m = strlen(b);
    unsigned row[LONGEST_NAME + 1];
    if (n > LONGEST_NAME || m > LONGEST_NAME) return LONGEST_NAME;
    for (size_t j = 0; j <= m; j++) row[j] = (unsigned)j;
    for (size_t i = 1; i <= n; i++) {
        unsigned diagonal = row[0];
        row[0] = (unsigned)i;
        for (size_t j = 1; j <= m; j++) {
            bool is_same = plain(a[i - 1]) == plain(b[j - 1]);
            unsigned next = least3(diagonal + !is_same, row[j] + 1, row[j - 1] + 1);
            diagonal = row[j];
            row[j] = next;
        }
    }
    return row[m];
}

bool qw_is_near(const char *typed, const char *name, unsigned *best)
{
    unsigned distance = edit_distance(typed, name);
    if (distance >= *best || distance > (strlen(name) + 2) / 3) return false;
    *best = distance;
    return true;
}
