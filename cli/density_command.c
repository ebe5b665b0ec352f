#include "density_command.h"

#include "io/file.h"
#include "io/text.h"
#include "base/elementary.h"

#include <stdio.h>
#include <string.h>

/* Of white; black is 1. */
static const double WHITE = 8;
/* Shares of red, green and blue in grey: Rec. 709. */
static const double SHARES[3] = {0.2126, 0.7152, 0.0722};

typedef struct reading {
    qw_env *env;
    const qw_attribute *property; /* NULL: the file */
    const char *path;
    uint32_t count; /* vertices */
    qw_density *density;
} reading;

static const qw_attribute *vertex_property(const qw_mesh *mesh, const char *name)
{
    uint32_t count = 0;
    const qw_attribute *a = qw_mesh_attributes(mesh, &count);
    for (uint32_t i = 0; i < count; i++)
        if (a[i].domain == QW_PER_VERTEX && a[i].values && strcmp(a[i].name, name) == 0) return &a[i];
    return NULL;
}

static bool is_color(const qw_attribute *a) { return strcmp(a->name, "color") == 0 && a->components >= 3; }

static double density_of(const qw_attribute *a, uint32_t v)
{
    const float *at = a->values + (size_t)v * a->components;
    if (!is_color(a)) return (double)at[0];
    double grey = 0;
    for (int i = 0; i < 3; i++) grey += SHARES[i] * (double)at[i];
    return qw_pow(WHITE, grey);
}

static void take_property(void *user)
{
    reading *r = user;
    r->density = QW_NEW(r->env, qw_density, r->count);
    for (uint32_t v = 0; v < r->count; v++) r->density[v] = (qw_density)density_of(r->property, v);
}

/* The density of each vertex from a file of numbers, a line each; fails where there are more or fewer than
   vertices. */
static void read_numbers(void *user)
{
    reading *r = user;
    const char *name = qw_path_for_messages(r->env, r->path, "standard input");
    qw_bytes bytes = qw_file_read(r->env, r->path, name);
    qw_text t = qw_text_open(r->env, name, bytes, 0);
    r->density = QW_NEW(r->env, qw_density, r->count);
    uint32_t count = 0;
    for (; qw_text_find_line(&t); count++) {
        double number = qw_text_number(&t, "a density");
        if (count < r->count) r->density[count] = (qw_density)number;
    }
    if (count != r->count)
        qw_fail(r->env, QW_ARGUMENT, -1, "%s has %u densities for %u vertices", name, count, r->count);
}

/* The density of each vertex: a vertex property of the mesh where one has that name, else a file. */
static qw_status read_density(reading *r, const qw_mesh *mesh, const char *from, char *message, size_t size)
{
    r->property = vertex_property(mesh, from), r->path = from, r->count = qw_mesh_get(mesh).vertex_count;
    if (r->property && !is_color(r->property) && r->property->components != 1) {
        snprintf(message, size, "--density: the vertex property \"%.40s\" has %u numbers a vertex, not one", from,
                 r->property->components);
        return QW_ARGUMENT;
    }
    qw_status status = qw_protect(r->env, r->property ? take_property : read_numbers, r);
    if (status == QW_FILE_MISSING)
        snprintf(message, size, "--density: the mesh has no vertex property \"%.80s\", and there is no such file",
                 from);
    else if (status != QW_OK) snprintf(message, size, "--density: %s", qw_env_message(r->env));
    return status;
}

qw_status qw_paint_density(qw_context *context, const qw_mesh *mesh, const char *from, char *message, size_t size)
{
    reading r = {.env = qw_env_create(NULL, 1)};
    if (!r.env) return QW_MEMORY;
    qw_status status = read_density(&r, mesh, from, message, size);
    if (status == QW_OK) {
        status = qw_set_density(context, r.density, r.count);
        if (status != QW_OK) snprintf(message, size, "--density: %s", qw_message(context));
    }
    qw_env_destroy(r.env);
    return status;
}
