/* `quadwright batch`: many models, a process each. batch.c runs them, batch_list.c finds them, batch_picture.c draws
 * them, batch_page.c shows what came of them. */
#pragma once

#include "base/hash.h"
#include "args.h"

typedef struct batch_model {
    char *name;    /* relative and unique: the path below the folder, or as listed without what leads out of the output
                      folder */
    char *input;   /* path */
    char *output;  /* path of the quads, below the output folder */
    char *record;  /* path of its line of JSON, there whole or not at all */
    bool was_done; /* by an earlier run */
} batch_model;

typedef struct batch_list {
    batch_model *model; /* batch_model[count], by name */
    size_t count, capacity;
    char **other; /* char *[others]: files of the folder that are no models, by name */
    size_t others, other_capacity;
} batch_list;

/* The models that the arguments name, of this shard only. The exit code; complains where it is not 0. */
int batch_find(const qw_arguments *a, batch_list *list);
void batch_free(batch_list *list);

/* What a result depends on, as records hold it: of the options and the program, and with them of the input and the
   files that it names or that steer it. */
enum { BATCH_KEY_SIZE = 32 };
void batch_settings_key(const qw_arguments *a, char key[BATCH_KEY_SIZE]);
void batch_key(const qw_arguments *a, const batch_model *m, char key[BATCH_KEY_SIZE]);
/* The value of the first member of that name in a record, without quotes; "" where there is none. */
void batch_member(const char *record, const char *name, char *value, size_t size);
/* Refuses to replace results that were made with other options, unless a->force; the exit code. */
int batch_require_same_options(const qw_arguments *a, const batch_list *list);

/* Takes the output folder, or the shard's share of it, for this process alone, until it ends, however it ends; the exit
   code. Complains where another batch is at work there. */
int batch_lock(const qw_arguments *a);

/* Makes the folders above a file; false where that cannot be done. */
bool batch_make_folders(const char *path);
/* The whole file, NUL terminated, malloc'ed; NULL where there is none. size may be NULL. */
char *batch_read(const char *path, size_t *size);

/* A picture is a help to the eye: where it cannot be drawn the page shows none. */
void batch_picture_path(const qw_arguments *a, const batch_model *m, char *path, size_t size); /* "": too long */
void batch_draw(const qw_arguments *a, const batch_model *m, const qw_mesh_view *input, const qw_mesh_view *quads);

/* Which of the records are of failures is read from them. Writes report.jsonl and summary.html into the output folder;
   the exit code. */
int batch_report(const qw_arguments *a, const batch_list *list, size_t *failed);
