/* One view of a scene, drawn into a part of a picture. */
#pragma once

#include "products/render/letters.h"
#include "products/render/raster.h"
#include "products/render/scene.h"

/* A point p is seen at (x, y) = (right . p, up . p) / (distance - toward . p), in pixels (left + scale x, top - scale
   y). The frame's half diagonal is 1, and the camera outside it, so nothing needs clipping. */
typedef struct view_camera {
    qw_vec3 right, up, toward;
    float distance, scale, left, top;
} view_camera;

typedef struct view_area {
    uint32_t x, y, width, height; /* pixels of the picture */
} view_area;

typedef struct view_bounds {
    float lo[2], hi[2];
} view_bounds;

/* Degrees, as in render_options. */
view_camera view_look(double azimuth, double elevation);
void view_include(const view_camera *camera, const scene *s, view_bounds *bounds);
/* Sets scale, left and top so that the bounds fill the area but for a margin. */
void view_fit(view_camera *camera, const view_bounds *bounds, const view_area *area);
void view_draw(qw_env *env, const scene *s, const view_camera *camera, bool wires, bool dots, picture *p,
               view_area area);
