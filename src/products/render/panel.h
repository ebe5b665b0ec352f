/* What is to be drawn, and how: one mesh of a sheet, the options of all, and the colours that say something. */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>

/* One mesh of a sheet. Several stand side by side, in the same scale where they are about the same size and place. */
typedef struct render_panel {
    const qw_mesh_view *mesh;
    const char *caption;            /* ASCII; NULL: none */
    const qw_attribute *attributes; /* qw_attribute[attribute_count], of the mesh: for own_colours; NULL: none */
    uint32_t attribute_count;
} render_panel;

typedef struct render_options {
    uint32_t width, height; /* pixels, 16 to 16384 each */
    uint32_t views;         /* 1, 2, 4 or 6; 0: four of a single mesh, one of each of several */
    bool wires;             /* edges of the polygons, where they are not too dense to be told apart */
    bool dots;              /* irregular vertices of meshes that are mostly quads */
    bool labels;            /* captions and counts */
    /* colours quads by their angle to the principal directions of this surface; NULL: not */
    const qw_mesh_view *follow;
    bool own_colours;          /* faces have the mesh's own colours, or one for each material or group */
    bool lines;                /* lines of the base complex: straight on from irregular vertices */
    bool closed;               /* rings: loops of edges that go straight on, close and pass no vertex twice */
    uint32_t chord;            /* colours one strip of quads: 1 is the longest; 0: none */
    double azimuth, elevation; /* degrees, of the first view: to the right of the front (+z), and above it (+y) */
    uint32_t threads;          /* 0: one a processor; never changes the picture */
} render_options;

/* Colours of quads by their angle, from the first (0 degrees) to the last (45). Where the surface has no clear
   direction a quad keeps the colour of the material. */
enum { RENDER_ANGLES = 4 };
extern const uint8_t render_angle_colour[RENDER_ANGLES][3];

/* Colours of irregular interior vertices, as they are drawn and named in the legend: 0 to 2 and less, 3, 5, 6 and more.
 */
typedef enum render_kind { RENDER_FEW, RENDER_THREE, RENDER_FIVE, RENDER_MANY, RENDER_KINDS } render_kind;
extern const uint8_t render_kind_colour[RENDER_KINDS][3];
