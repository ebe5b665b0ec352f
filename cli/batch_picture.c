/* The picture of a model in `pictures` of the output folder: its input, and beside it the quads. */
#include "batch.h"

#ifndef _WIN32

#include "products/render/render.h"

#include <stdlib.h>

enum { WIDTH = 480, HEIGHT = 220 };

void batch_picture_path(const qw_arguments *a, const batch_model *m, char *path, size_t size)
{
    if (snprintf(path, size, "%s/pictures/%s.png", a->output, m->name) >= (int)size) path[0] = 0;
}

void batch_draw(const qw_arguments *a, const batch_model *m, const qw_mesh_view *input, const qw_mesh_view *quads)
{
    char path[4200], message[512];
    batch_picture_path(a, m, path, sizeof path);
    const render_panel panels[] = {{.mesh = input}, {.mesh = quads}};
    render_options o;
    render_options_init(&o);
    o.width = WIDTH, o.height = HEIGHT, o.views = 1, o.labels = false;
    o.threads = (uint32_t)a->options.threads;
    if (path[0] && batch_make_folders(path)) (void)render_sheet(panels, 2, &o, path, NULL, message, sizeof message);
}

#endif
