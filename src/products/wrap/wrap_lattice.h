/* The lattice of a wrap: cubic cells about the input, those that the input meets, and those that are reached from
 * outside through cells that it does not meet. What is not outside is inside; gaps narrower than a cell are closed, or
 * than three where that is asked for, and what lies within a shell is inside with it. */
#pragma once

#include "products/wrap/cell_set.h"
#include "products/wrap/predicates.h"

#include "base/env.h"

/* Triangles in double precision, as the wrap is given them. */
typedef struct qw_wrap_triangles {
    uint32_t count;
    const uint32_t *corner; /* uint32_t[3 count], vertices */
    const double *position; /* double[vertices][3], in the units of the lattice */
} qw_wrap_triangles;

/* How the lattice lies in space: units are whole, `side` of them to a cell. at = (unit - 0) * scale + origin. */
typedef struct qw_wrap_frame {
    double origin[3]; /* of the unit 0, in the coordinates of the input */
    double unit;      /* length of one, in the coordinates of the input */
    int32_t side;     /* units */
    uint32_t cells[3];
} qw_wrap_frame;

typedef struct qw_wrap_lattice {
    qw_wrap_frame frame;
    size_t count; /* cells */
    qw_cell_set outside;
    int64_t fragments; /* clusters that were dropped, as none is larger than five cells */
    int64_t clusters;
} qw_wrap_lattice;

enum { QW_MOST_CELLS = 1 << 28 }; /* of a lattice: the guard has four bytes of each */

/* Cells of the frame along a side of the box. */
double qw_cells_across(double side, double cell);
/* The frame in which the box has cells of this edge length, with a margin about it. Fails with QW_TOO_LARGE where these
 * are more than there may be. */
qw_wrap_frame qw_wrap_frame_of(qw_env *env, const double low[3], const double high[3], double cell);

/* Which cells are outside, and which are not; every cell at the rim is outside, and the boundary of what is outside is
 * a closed manifold of cell faces: no two inside cells touch at an edge or a corner alone, nor do two outside. closes:
 * outside cells that are in no ball of three across of them are inside. In the caller's scope. */
qw_wrap_lattice qw_wrap_lattice_fill(qw_env *env, const qw_wrap_frame *frame, const qw_wrap_triangles *triangles,
                                     bool closes);

/* The same of the cell in which a point lies, in units; false outside of the lattice. */
bool qw_point_is_seen(const qw_wrap_lattice *l, const double point[3]);

/* Whether the cells that a triangle meets are seen: all, some or none. */
enum { QW_HIDDEN, QW_SEEN, QW_SEEN_PARTLY };
int qw_triangle_is_seen(const qw_wrap_lattice *l, const double p[3][3]);
