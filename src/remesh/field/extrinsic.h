/* Orientation field by Eq. (1) of the paper, crosses compared in space. */
#pragma once

#include "remesh/field/hierarchy.h"
#include "base/rosy.h"

/* Solves Eq. (1) coarse to fine, down to level `last`. Vertices with a direction keep the cross aligned with it on
   every level. Returns qw_vec3[vertex_count of that level], within room: unit tangents orthogonal to the normals. room:
   qw_vec3[vertices of all levels from `last` on]. On one thread, so that other fields can be solved beside it. */
const qw_vec3 *qw_extrinsic_field(const qw_hierarchy *hierarchy, uint32_t last, uint64_t seed, qw_vec3 *room);

/* Turns o[v], a unit tangent, to the weighted mean of its neighbours' crosses, each matched to what there is so far. */
void qw_extrinsic_update(const qw_level *level, qw_vec3 *o, uint32_t v);

/* A fixed scrambling: different seeds differ at every vertex. */
static inline uint64_t qw_scramble(uint64_t seed, uint32_t v)
{
    uint64_t z = seed * 0x9e3779b97f4a7c15u + (uint64_t)v * 0xbf58476d1ce4e5b9u + 0x94d049bb133111ebu;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}
