/* Insertion sort for the short runs that meshes are full of (sides at one vertex); quicksort for the others, and heap
 * sort for parts of theirs that split badly: no input is quadratic, nothing recurses, and a worker may call it. */
#include "base/sort.h"

#include <assert.h>
#include <stdbool.h>

enum { MOST_PARTS = 64 };

static void insertion_sort(uint64_t *item, size_t count)
{
    for (size_t i = 1; i < count; i++) {
        uint64_t x = item[i];
        size_t j = i;
        for (; j > 0 && item[j - 1] > x; j--) item[j] = item[j - 1];
        item[j] = x;
    }
}

/* Puts x where the hole at `root` is, below larger children. */
static void sift_down(uint64_t *item, size_t root, size_t count, uint64_t x)
{
    for (;;) {
        size_t child = 2 * root + 1;
        if (child >= count) break;
        if (child + 1 < count && item[child + 1] > item[child]) child++;
        if (item[child] <= x) break;
        item[root] = item[child];
        root = child;
    }
    item[root] = x;
}

static void heap_sort(uint64_t *item, size_t count)
{
    for (size_t i = count / 2; i-- > 0;) sift_down(item, i, count, item[i]);
    for (size_t i = count - 1; i > 0; i--) {
        uint64_t last = item[i];
        item[i] = item[0];
        sift_down(item, 0, i, last);
    }
}

static uint64_t middle_of(uint64_t a, uint64_t b, uint64_t c)
{
    uint64_t low = a < b ? a : b, high = a < b ? b : a;
    return c < low ? low : c > high ? high : c;
}

/* Splits a run in two, none empty, of which no item of the first is larger than one of the second; returns how many the
   first has (Hoare 1961). */
static size_t split(uint64_t *item, size_t count)
{
    uint64_t pivot = middle_of(item[0], item[count / 2], item[count - 1]);
    size_t i = 0, j = count - 1;
    for (;; i++, j--) {
        while (item[i] < pivot) i++;
        while (item[j] > pivot) j--;
        if (i >= j) return j + 1 < count ? j + 1 : j;
        uint64_t x = item[i];
        item[i] = item[j], item[j] = x;
    }
}

void qw_sort_u64(uint64_t *item, size_t count)
{
    struct {
        uint64_t *item;
        size_t count;
        int splits; /* that may follow before heap sort takes over */
    } part[MOST_PARTS];
    int held = 0, splits = 0;
    for (size_t n = count; n > 1; n /= 2) splits += 2;
    for (;;) {
        while (count > QW_SHORT_RUN && splits > 0) { /* the larger half waits: at most one for each halving */
            size_t first = split(item, count), rest = count - first;
            bool is_left = first < rest;
            splits--;
            assert(held < MOST_PARTS);
            part[held].item = is_left ? item + first : item, part[held].count = is_left ? rest : first;
            part[held++].splits = splits;
            item = is_left ? item : item + first, count = is_left ? first : rest;
        }
        if (count > QW_SHORT_RUN) heap_sort(item, count);
        else insertion_sort(item, count);
        if (held == 0) return;
        held--, item = part[held].item, count = part[held].count, splits = part[held].splits;
    }
}

size_t qw_sort_once(uint64_t *item, size_t count)
{
    size_t kept = 0;
    qw_sort_u64(item, count);
    for (size_t i = 0; i < count; i++)
        if (i == 0 || item[i] != item[i - 1]) item[kept++] = item[i];
    return kept;
}
