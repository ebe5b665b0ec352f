/* Stands in for libFuzzer where there is none, or where its watching costs more than it finds: hands each file of the
 * named files and folders to the target, once whole and once cut at each of a few places. With --random COUNT SEED LAST
 * before them it instead makes COUNT inputs of pieces of those files and of changed bytes (where none are named: of any
 * bytes), and leaves each in the file LAST while it runs, so that one that crashes is found there. */
#define _POSIX_C_SOURCE 200809L
#include <dirent.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { PATH_SIZE = 4096, CUTS = 16, LARGEST = 1 << 20 };

static int replay_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file) return 0;
    uint8_t *data = malloc(LARGEST);
    size_t size = data ? fread(data, 1, LARGEST, file) : 0;
    fclose(file);
    for (size_t cut = 0; cut <= CUTS && data; cut++) {
        uint8_t *part =
            malloc(size * cut / CUTS + 1); /* of its own size, so that a sanitizer sees a read past the end */
        if (part) memcpy(part, data, size * cut / CUTS), LLVMFuzzerTestOneInput(part, size * cut / CUTS);
        free(part);
    }
    free(data);
    return 1;
}

static int replay(const char *path)
{
    struct stat info;
    if (stat(path, &info) != 0) return 0;
    if (!S_ISDIR(info.st_mode)) return replay_file(path);
    int files = 0;
    DIR *folder = opendir(path);
    for (struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
        char inner[PATH_SIZE];
        snprintf(inner, sizeof inner, "%s/%s", path, entry->d_name);
        if (entry->d_name[0] != '.' && stat(inner, &info) == 0 && S_ISREG(info.st_mode)) files += replay_file(inner);
    }
    if (folder) closedir(folder);
    return files;
}

/* ---- random inputs */

enum { MOST_SEEDS = 1024, SEED_SIZE = 4096, MOST_CHANGES = 8, ANY_SIZE = 64 /* bytes of an input made of any */ };

typedef struct seeds {
    size_t count;
    struct {
        uint8_t *bytes;
        size_t size;
    } seed[MOST_SEEDS];
} seeds;

static uint32_t scatter(uint64_t *state, size_t below)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((*state >> 33) % below);
}

static void gather_file(seeds *s, const char *path)
{
    FILE *file = s->count < MOST_SEEDS ? fopen(path, "rb") : NULL;
    if (!file) return;
    uint8_t *bytes = malloc(SEED_SIZE);
    size_t size = bytes ? fread(bytes, 1, SEED_SIZE, file) : 0;
    fclose(file);
    if (size > 0) s->seed[s->count].bytes = bytes, s->seed[s->count++].size = size;
    else free(bytes);
}

static void gather(seeds *s, const char *path)
{
    DIR *folder = opendir(path);
    if (!folder) gather_file(s, path);
    for (struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
        char inner[PATH_SIZE];
        snprintf(inner, sizeof inner, "%s/%s", path, entry->d_name);
        if (entry->d_name[0] != '.') gather_file(s, inner);
    }
    if (folder) closedir(folder);
}

/* The head of one seed and the tail of another, with a few bytes changed, or with its end cut off. */
static size_t mix(const seeds *s, uint64_t *state, uint8_t *to)
{
    uint32_t a = scatter(state, s->count), b = scatter(state, s->count);
    size_t size = s->seed[a].size, other = s->seed[b].size, from = scatter(state, size + 1);
    memcpy(to, s->seed[a].bytes, size);
    if (scatter(state, 2) && from < other) {
        memcpy(to + from, s->seed[b].bytes + from, other - from);
        size = other;
    }
    if (scatter(state, 8) == 0) size = scatter(state, size) + 1u;
    for (uint32_t i = scatter(state, MOST_CHANGES); i > 0; i--) {
        uint8_t *at = to + scatter(state, size);
        *at = (uint8_t)(scatter(state, 2) ? *at ^ 1u << scatter(state, 8) : scatter(state, 256));
    }
    return size;
}

static size_t make_any(uint64_t *state, uint8_t *to)
{
    for (size_t i = 0; i < ANY_SIZE; i++) to[i] = (uint8_t)scatter(state, 256);
    return ANY_SIZE;
}

/* The file stays open, as one that is made anew each time waits for the disk longer than many an input takes. */
static bool leave(FILE *file, const uint8_t *bytes, size_t size)
{
    rewind(file);
    return fwrite(bytes, 1, size, file) == size && fflush(file) == 0 && ftruncate(fileno(file), (off_t)size) == 0;
}

static int run_random(long count, uint64_t state, const char *last, const seeds *s)
{
    FILE *file = fopen(last, "wb");
    if (!file) return 1;
    for (long i = 0; i < count; i++) {
        uint8_t *bytes = malloc(SEED_SIZE);
        if (!bytes) return 1;
        size_t size = s->count > 0 ? mix(s, &state, bytes) : make_any(&state, bytes);
        if (!leave(file, bytes, size)) return 1;
        LLVMFuzzerTestOneInput(bytes, size);
        free(bytes);
    }
    fclose(file);
    printf("%ld inputs\n", count);
    return remove(last) != 0;
}

int main(int argc, char **argv)
{
    int files = 0;
    if (argc > 4 && !strcmp(argv[1], "--random")) {
        static seeds s;
        for (int i = 5; i < argc; i++) gather(&s, argv[i]);
        return run_random(atol(argv[2]), (uint64_t)atol(argv[3]), argv[4], &s);
    }
    for (int i = 1; i < argc; i++) files += replay(argv[i]);
    printf("%d files\n", files);
    return files == 0;
}
