/* Pictures of meshes: a sheet of views, shaded, with the edges of the polygons and the irregular vertices. */
#pragma once

#include "products/render/panel.h"

void render_options_init(render_options *options); /* 1600 by 1200, everything on */

/* Writes the sheet as a PNG file ("-": standard output). On failure: a sentence in message, and no new file. host may
   be NULL. */
qw_status render_sheet(const render_panel *panels, size_t count, const render_options *options, const char *path,
                       const qw_host *host, char *message, size_t message_size);
