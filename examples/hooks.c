/* The host's own memory and threads: a counting allocator with a limit, and tasks dealt out in an order of the host's
 * choosing. The result does not depend on the order. */
#include <quadwright/quadwright.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double positions[][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
static const uint32_t corners[][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

typedef struct ledger {
    size_t held, peak, blocks;
} ledger;

static void *count_memory(void *user, void *block, size_t old_size, size_t new_size)
{
    ledger *l = user;
    void *fresh = NULL;
    if (new_size == 0) {
        free(block);
    } else {
        fresh = realloc(block, new_size);
        if (!fresh) return NULL;
    }
    l->held += new_size - old_size;
    l->blocks += (new_size != 0 && !block) - (new_size == 0 && block);
    if (l->held > l->peak) l->peak = l->held;
    return fresh;
}

/* A host would hand the tasks to its own workers. Backwards is as good as any order. */
static void backwards(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    (void)user;
    while (count-- > 0) task(task_user, count);
}

static void say(void *user, qw_log_level level, const char *message)
{
    (void)user;
    if (level == QW_LOG_WARNING) printf("note: %s\n", message);
}

static qw_status remesh(const qw_host *host, qw_result **result)
{
    qw_mesh_view octahedron = {.size = sizeof octahedron,
                               .vertex_count = 6,
                               .face_count = 8,
                               .uniform_face_size = 3,
                               .positions = positions[0],
                               .corners = corners[0]};
    qw_options options;
    qw_options_init(&options);
    options.faces = 400;
    return qw_remesh(&octahedron, &options, host, result);
}

int main(void)
{
    ledger memory = {0};
    qw_host host = {.resize = count_memory,
                    .resize_user = &memory,
                    .parallel = backwards,
                    .log = say,
                    .memory_limit = (size_t)1 << 30};
    qw_result *ours, *plain;
    if (remesh(&host, &ours) != QW_OK || remesh(NULL, &plain) != QW_OK) {
        fprintf(stderr, "%s\n", qw_result_message(ours));
        return 1;
    }
    qw_mesh_view a = qw_result_mesh(ours), b = qw_result_mesh(plain);
    int same = a.vertex_count == b.vertex_count && memcmp(a.positions, b.positions, 24 * (size_t)a.vertex_count) == 0;
    printf("%u quads, %.1f MB at most, %s\n", a.face_count, (double)memory.peak / 1e6,
           same ? "the same either way" : "DIFFERENT");
    qw_result_destroy(ours);
    qw_result_destroy(plain);

    host.memory_limit = 100000;
    qw_status status = remesh(&host, &ours);
    printf("with 100 kB: %s\n", qw_result_message(ours));
    qw_result_destroy(ours);
    printf("%zu blocks are left\n", memory.blocks);
    return !(same && status == QW_MEMORY && memory.blocks == 0);
}
