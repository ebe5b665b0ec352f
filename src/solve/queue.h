/* A priority queue of nodes with integer keys that only rises: no key put in is below the last one taken out (a radix
 * heap: Ahuja, Mehlhorn, Orlin and Tarjan 1990). Lists are linked through the nodes, so it never allocates; equal keys
 * come out first in, first out.
 *
 * Bucket b > 0 holds the keys whose highest bit that differs from `last` is bit b - 1; bucket 0 those equal to it.
 */
#pragma once

#include "base/env.h"

enum {
    QW_QUEUE_BUCKETS = 64,
    QW_QUEUE_UNIT = 1 << 20 /* steps of a key to a unit of what is a real number */
};

typedef struct qw_queue_link {
    int64_t key;
    uint32_t next, previous; /* next is QW_NONE for a node that is not queued */
} qw_queue_link;

typedef struct qw_queue {
    uint32_t node_count;
    qw_queue_link *link; /* qw_queue_link[node_count + QW_QUEUE_BUCKETS], the ring heads of the buckets last */
    int64_t last;        /* the last key taken out */
    uint64_t filled;     /* bit b: bucket b may hold something */
} qw_queue;

qw_queue qw_queue_create(qw_env *env, uint32_t node_count); /* in the current scope; last is 0 */
/* Puts the node in, or moves it. key >= last. */
void qw_queue_put(qw_queue *queue, uint32_t node, int64_t key);
void qw_queue_remove(qw_queue *queue, uint32_t node); /* queued or not */
uint32_t qw_queue_take(qw_queue *queue);              /* QW_NONE when empty; its key is `last` */

static inline bool qw_queue_has(const qw_queue *queue, uint32_t node) { return queue->link[node].next != QW_NONE; }
