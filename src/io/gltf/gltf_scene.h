/* The nodes of a glTF scene: where each shows its mesh. */
#pragma once

#include "io/gltf/gltf_document.h"

/* An affine map: double[3][4], the last column the shift. */
typedef struct qw_gltf_map {
    double m[12];
} qw_gltf_map;

/* The objects of the scene that is shown, with to_local, is_mirrored, node, mesh and joints set, in the order of their
   nodes; and the map of each to the scene, which to_local undoes. Fails where nodes have two parents or go round in a
   circle. Where a skin bends the mesh, the map is that of its first joint at rest. In the caller's scope. */
qw_gltf_object *qw_gltf_find_objects(qw_gltf_document *d, uint32_t *count, qw_gltf_map **to_scene, uint32_t *joints);
