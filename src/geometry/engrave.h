/* Polylines engraved in a surface: its triangles are cut along them, so that they become chains of marked edges. The
 * surface stays where it is. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/trimesh.h"

typedef struct qw_polylines {
    uint32_t count;
    const uint32_t *begin;  /* uint32_t[count + 1]: points of polyline i are point[begin[i]] .. point[begin[i + 1]] */
    const qw_vec3 *point;   /* in the frame; closed where the last is the first */
    const uint32_t *number; /* uint32_t[count]: how messages call each */
    const uint8_t *mark;    /* uint8_t[count]: the QW_MARK_ bits of its edges */
    const uint32_t *finer;  /* uint32_t[count]: points of it to one that messages count */
} qw_polylines;

/* The surface with the polylines projected onto it as marked edges; other marks and points stay. length: that of the
   edges that quads are to have there; the projected lines may be shifted by a fiftieth of it. bvh: over the surface.
   *marked: how many edges were. Fails with QW_ARGUMENT where a line cannot be drawn on the surface from one point to
   the next; where drawn is not NULL, bool[lines->count] says instead which could be. Arrays in the caller's scope. */
qw_trimesh qw_engrave(qw_env *env, const qw_trimesh *surface, const qw_bvh *bvh, const qw_polylines *lines,
                      float length, int64_t *marked, bool *drawn);
