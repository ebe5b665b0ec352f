#include "solve/queue.h"

#include <assert.h>

qw_queue qw_queue_create(qw_env *env, uint32_t node_count)
{
    assert(node_count < QW_NONE);
    qw_queue q = {.node_count = node_count};
    q.link = QW_NEW(env, qw_queue_link, (size_t)node_count + QW_QUEUE_BUCKETS);
    for (uint32_t v = 0; v < node_count; v++) q.link[v].next = QW_NONE;
    for (uint32_t h = node_count; h < node_count + QW_QUEUE_BUCKETS; h++)
        q.link[h] = (qw_queue_link){.next = h, .previous = h};
    return q;
}

static uint32_t bucket_of(const qw_queue *q, int64_t key)
{
    return key == q->last ? 0 : 64 - (uint32_t)__builtin_clzll((uint64_t)key ^ (uint64_t)q->last);
}

static void unlink_node(qw_queue *q, uint32_t node)
{
    qw_queue_link *l = &q->link[node];
    q->link[l->previous].next = l->next;
    q->link[l->next].previous = l->previous;
}

static void append(qw_queue *q, uint32_t node, int64_t key)
{
    uint32_t b = bucket_of(q, key), head = q->node_count + b, tail = q->link[head].previous;
    q->link[node] = (qw_queue_link){.key = key, .next = head, .previous = tail};
    q->link[tail].next = q->link[head].previous = node;
    q->filled |= (uint64_t)1 << b;
}

void qw_queue_put(qw_queue *q, uint32_t node, int64_t key)
{
    assert(key >= q->last);
    if (qw_queue_has(q, node)) unlink_node(q, node);
    append(q, node, key);
}

void qw_queue_remove(qw_queue *q, uint32_t node)
{
    assert(node < q->node_count);
    if (!qw_queue_has(q, node)) return;
    unlink_node(q, node);
    q->link[node].next = QW_NONE;
}

/* Makes the least key of bucket b the last one, which sends all of the bucket to lower ones. */
static void redistribute(qw_queue *q, uint32_t b)
{
    uint32_t head = q->node_count + b, next = q->link[head].next;
    int64_t least = INT64_MAX;
    for (uint32_t v = next; v != head; v = q->link[v].next)
        if (q->link[v].key < least) least = q->link[v].key;
    assert(b > 0 && least >= q->last);
    q->last = least;
    q->link[head].next = q->link[head].previous = head;
    q->filled &= ~((uint64_t)1 << b);
    for (uint32_t v = next; v != head; v = next) {
        next = q->link[v].next;
        append(q, v, q->link[v].key);
    }
}

uint32_t qw_queue_take(qw_queue *q)
{
    while (q->filled) {
        uint32_t b = (uint32_t)__builtin_ctzll(q->filled), head = q->node_count + b, node = q->link[head].next;
        if (node == head) {
            q->filled &= ~((uint64_t)1 << b);
        } else if (b > 0) {
            redistribute(q, b);
        } else {
            unlink_node(q, node);
            q->link[node].next = QW_NONE;
            return node;
        }
    }
    return QW_NONE;
}
