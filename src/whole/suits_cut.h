/* Which surfaces may be cut along a plane of symmetry without loss. */
#pragma once

#include "whole/state.h"

/* What would be cut: the clean surface, or a component of it. */
typedef struct qw_cut_surface {
    const qw_trimesh *mesh;
    const qw_census *census;
    double area; /* in the frame of the whole */
} qw_cut_surface;

static inline qw_cut_surface qw_cut_whole(const qw_run_state *run)
{
    return (qw_cut_surface){&run->whole.clean.mesh, &run->whole.census, run->whole.area};
}

/* Whether half of the surface can be made into quads as well as the whole. It cannot where a tip lies on the plane,
   where the plane cuts along what is narrow, where creases were sampled, if it is a plain solid, or if it has sharp
   edges and was wrapped: the two sides of a wrapped sheet are fitted at once. is_turned: it is a solid of revolution.
   Needs what CLEAN leaves. */
bool qw_suits_cut(const qw_run_state *run, const qw_cut_surface *surface, const qw_mirror_plane *plane, bool is_turned);

/* Whether the surface has sharp edges of some length. */
bool qw_is_sharp(const qw_run_state *run);
