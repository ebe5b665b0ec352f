/* Meshes for simulation: Gmsh MSH 4.1, VTK VTU, Abaqus INP and Nastran BDF, all as text.
 *
 * Labels of faces (materials, groups, objects) become element sets; boundary loops and feature curves line sets, in INP
 * node sets, in the order of the loop. Of quads that were split once each four can be written as one of second order.
 */
#pragma once

#include "io/file.h"
#include "io/soup.h"

/* Faces of three or four corners, else it fails with QW_UNSUPPORTED. Marked edges of the mesh are its feature curves.
   second_order: the faces 4 f .. 4 f + 3 are quads, the children of one at its first to last corner, and their common
   vertices the last of all. */
void qw_put_elements(qw_env *env, qw_file *file, qw_format format, const qw_mesh_view *mesh,
                     const qw_attribute *attributes, uint32_t count, bool second_order);
