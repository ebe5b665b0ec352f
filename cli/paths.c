/* What can be said of the paths on the command line before any work is done. */
#include "commands.h"

#include "io/file.h"

#include <stdio.h>
#include <string.h>

enum { MOST_PATHS = QW_STAGE_COUNT + QW_MOST_INPUTS + 8 };

typedef struct named_path {
    const char *path, *what; /* what: the switch, for messages */
    bool is_mesh; /* the result, which may take the place of the mesh that it was made of if --force says so */
} named_path;

typedef struct path_check {
    qw_env *env;
    named_path output[MOST_PATHS], input[MOST_PATHS];
    int outputs, inputs;
    bool force;
} path_check;

static void add(named_path *list, int *count, const char *path, const char *what, bool is_mesh)
{
    if (path) list[(*count)++] = (named_path){path, what, is_mesh};
}

/* Lists all files that the command would write and read, with the switch that names each. */
static void gather(path_check *c, const qw_arguments *a)
{
    bool remesh = a->command == QW_COMMAND_REMESH || a->command == QW_COMMAND_ASSET;
    add(c->output, &c->outputs, a->output, "-o", remesh);
    if (remesh) add(c->output, &c->outputs, a->json, "--json", false);
    if (remesh) add(c->output, &c->outputs, a->provenance, "--provenance", false);
    if (remesh) add(c->output, &c->outputs, a->patches, "--patches", false);
    if (remesh) add(c->output, &c->outputs, a->coarse, "--coarse", false);
    if (remesh) add(c->output, &c->outputs, a->field_out, "--field-out", false);
    if (remesh) add(c->input, &c->inputs, a->field_in, "--field-in", false);
    if (remesh) add(c->input, &c->inputs, a->guides, "--guides", false);
    for (int s = 0; s < QW_STAGE_COUNT; s++) add(c->output, &c->outputs, a->dump[s], "--dump-stage", false);
    add(c->input, &c->inputs, a->against, "--against", false);
    if (remesh) add(c->input, &c->inputs, a->density, "--density", false); /* a file, or a name that is none */
    add(c->input, &c->inputs, a->from_stage, "--from-stage", false);
    for (int i = 0; i < a->input_count; i++) add(c->input, &c->inputs, a->inputs[i], "the input", remesh);
}

static const char *as_input(const char *path) { return strcmp(path, "-") == 0 ? "/dev/stdin" : path; }

static bool clash(const path_check *c, const named_path *a, const named_path *b)
{
    return (strcmp(a->path, "-") == 0 && strcmp(b->path, "-") == 0) || qw_file_is_same(c->env, a->path, b->path);
}

static void require_spared(const path_check *c, const named_path *out, const named_path *in, const char *name)
{
    bool may = out->is_mesh && in->is_mesh;
    if ((may && c->force) || !qw_file_is_same(c->env, out->path, as_input(in->path))) return;
    qw_fail(c->env, QW_ARGUMENT, -1, "%s would write over %s, %s%s", out->what, in->what, name,
            may ? "; --force allows it" : "");
}

/* Fails where an output cannot be written, two outputs are one file, or one would overwrite an input. */
static void check_paths(void *user)
{
    path_check *c = user;
    for (int i = 0; i < c->outputs; i++) {
        const named_path *out = &c->output[i];
        const char *name = qw_path_for_messages(c->env, out->path, "standard output");
        qw_file_require_writable(c->env, out->path);
        for (int j = 0; j < i; j++)
            if (clash(c, out, &c->output[j]))
                qw_fail(c->env, QW_ARGUMENT, -1, "%s and %s would both write %s", c->output[j].what, out->what, name);
        for (int j = 0; j < c->inputs; j++) require_spared(c, out, &c->input[j], name);
    }
}

int qw_check_paths_or_complain(const qw_arguments *a)
{
    path_check c = {.env = qw_env_create(NULL, 1), .force = a->force};
    gather(&c, a);
    qw_status status = c.env ? qw_protect(c.env, check_paths, &c) : QW_MEMORY;
    int code = status == QW_OK ? 0 : qw_complain(status, c.env ? qw_env_message(c.env) : NULL);
    qw_env_destroy(c.env);
    return code;
}
