/* Sorting of plain integers: ascending, in place, without allocation, n log n at worst. Pack key and payload into one
 * number. */
#ifndef QW_BASE_SORT_H
#define QW_BASE_SORT_H

#include <stddef.h>
#include <stdint.h>

void qw_sort_u64(uint64_t *item, size_t count);

#endif
