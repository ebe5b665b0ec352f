#include "base/near.h"

#include <string.h>

static unsigned least3(unsigned a, unsigned b, unsigned c) { return a < b ? (a < c ? a : c) : (b < c ? b : c); }

static char plain(char c) { return c >= 'A' && c <= 'Z' ? (char)(c + 32) : c == '-' ? '_' : c; }

static bool is_same(char a, char b) { return plain(a) == plain(b); }

/* Levenshtein's distance, where neighbours that have changed places count once (Damerau). */
static unsigned edit_distance(const char *a, const char *b)
{
    size_t n = strlen(a), m = strlen(b);
    unsigned of[QW_NEVER_NEAR][QW_NEVER_NEAR];
    if (n >= QW_NEVER_NEAR || m >= QW_NEVER_NEAR) return QW_NEVER_NEAR - 1;
    for (size_t i = 0; i <= n; i++)
        for (size_t j = 0; j <= m; j++) {
            if (i == 0 || j == 0) {
                of[i][j] = (unsigned)(i + j);
                continue;
            }
            of[i][j] = least3(of[i - 1][j - 1] + !is_same(a[i - 1], b[j - 1]), of[i - 1][j] + 1, of[i][j - 1] + 1);
            bool is_swapped = i > 1 && j > 1 && is_same(a[i - 1], b[j - 2]) && is_same(a[i - 2], b[j - 1]);
            if (is_swapped && of[i][j] > of[i - 2][j - 2] + 1) of[i][j] = of[i - 2][j - 2] + 1;
        }
    return of[n][m];
}

bool qw_is_near(const char *typed, const char *name, unsigned *best)
{
    unsigned distance = edit_distance(typed, name);
    if (distance >= *best || distance > (strlen(name) + 2) / 3) return false;
    *best = distance;
    return true;
}
