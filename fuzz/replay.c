/* Stands in for libFuzzer where there is none: hands each file of the named files and folders to the target, once whole and once
 * cut at each of a few places. */
#define _POSIX_C_SOURCE 200809L
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

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
        uint8_t *part = malloc(size * cut / CUTS + 1); /* of its own size, so that a sanitizer sees a read past the end */
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

int main(int argc, char **argv)
{
    int files = 0;
    for (int i = 1; i < argc; i++) files += replay(argv[i]);
    printf("%d files\n", files);
    return files == 0;
}
