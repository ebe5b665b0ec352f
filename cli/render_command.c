/* `quadwright render`: the meshes of the command line as panels of one sheet. */
#include "commands.h"
#include "system.h"
#include "progress.h"
#include "products/render/render.h"

#include <string.h>

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash && slash[1] ? slash + 1 : path;
}

/* The renderer's options as the switches say; what is not said keeps its initial value. */
static render_options options_of(const qw_arguments *a)
{
    render_options options;
    render_options_init(&options);
    if (a->width) options.width = (uint32_t)a->width;
    if (a->height) options.height = (uint32_t)a->height;
    if (a->views) options.views = (uint32_t)a->views;
    options.own_colours = a->own_colours;
    options.lines = a->lines;
    options.closed = a->closed;
    options.chord = (uint32_t)a->chord;
    if (a->azimuth != QW_UNSET_ANGLE) options.azimuth = (double)a->azimuth;
    if (a->elevation != QW_UNSET_ANGLE) options.elevation = (double)a->elevation;
    return options;
}

/* Draws the panels into the output. Returns the exit code; an interrupt leaves no picture. */
static int draw(const qw_arguments *a, const render_panel *panels, size_t count, const qw_mesh_view *follow)
{
    render_options options = options_of(a);
    options.follow = follow;
    char message[512] = "";
    qw_meter meter;
    const qw_host host = {.progress = qw_meter_progress, .progress_user = &meter};
    qw_hold_interrupts(); /* until here an interrupt simply ends the process, which has written nothing */
    qw_meter_begin(&meter, true, 0);
    qw_status status = render_sheet(panels, count, &options, a->output, &host, message, sizeof message);
    const char *signal = qw_interrupted();
    if (status == QW_CANCELLED && signal)
        snprintf(message, sizeof message, "ended by %s; no picture was finished", signal);
    return status == QW_OK ? 0 : qw_complain(status, message);
}

int qw_command_render(const qw_arguments *a)
{
    qw_mesh *meshes[QW_MOST_PANELS] = {NULL};
    qw_mesh_view views[QW_MOST_PANELS];
    render_panel panels[QW_MOST_PANELS];
    size_t count = (size_t)a->input_count;
    const qw_host loading = {.log = a->quiet ? NULL : qw_say_warnings};
    int code = qw_check_paths_or_complain(a);
    for (size_t i = 0; i < count && code == 0; i++) {
        const char *path = a->inputs[i];
        code = qw_load_or_complain(path, &loading, &meshes[i]);
        views[i] = qw_mesh_get(meshes[i]);
        panels[i] = (render_panel){.mesh = &views[i], .caption = base_name(path)};
        if (code == 0) panels[i].attributes = qw_mesh_attributes(meshes[i], &panels[i].attribute_count);
    }
    qw_mesh *against = NULL;
    if (code == 0 && a->limit) {
        code = qw_take_limit(&loading, &meshes[0]);
        views[0] = qw_mesh_get(meshes[0]);
        panels[0].attribute_count = 0; /* the limit surface has none */
    }
    if (code == 0 && a->follow) code = qw_load_or_complain(a->against, &loading, &against);
    const qw_mesh_view surface = qw_mesh_get(against);
    if (code == 0) code = draw(a, panels, count, a->follow ? &surface : NULL);
    qw_mesh_destroy(against);
    for (size_t i = 0; i < count; i++) qw_mesh_destroy(meshes[i]);
    return code;
}
