/* Insertion sort for the short runs that meshes are full of (sides at one vertex), heap sort for the others: no input
 * is quadratic, nothing recurses, and a worker may call it. */
#include "base/sort.h"

enum { SHORT_RUN = 24 };

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

void qw_sort_u64(uint64_t *item, size_t count)
{
    if (count <= SHORT_RUN) {
        insertion_sort(item, count);
        return;
    }
    for (size_t i = count / 2; i-- > 0;) sift_down(item, i, count, item[i]);
    for (size_t i = count - 1; i > 0; i--) {
        uint64_t last = item[i];
        item[i] = item[0];
        sift_down(item, 0, i, last);
    }
}
