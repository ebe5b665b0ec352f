/* What relaxation makes small: how far each quad is from a square of the wanted area, in the plane of the quad.
 *
 * With a corner's edges a, b (to the next and to the previous corner), its area D = a x b and the quad's area A, both
 * over the wanted area S:
 *
 *     corner:  conformal |b - turned a|^2 / (S X(D))  +  square (a.b / S)^2 / X(D)^2        turned: by a quarter turn
 *     quad:    area (1 - A)^2 / X(A)  +  mean of its corners
 *
 * For D > 0 the terms are |J|^2/det - 2 (squareness and equal sides), the squared cotangent of the angle (squareness
 * alone) and det + 1/det - 2. X(D) = (D + sqrt(D^2 + soft^2))/2 takes the place of D so that corners that are inverted
 * still have a finite energy, from which there is a way down: Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov,
 * Foldover-free maps in 50 lines of code, 2021.
 */
#pragma once

#include "base/simd.h"

typedef struct qw_vec2 {
    float x, y;
} qw_vec2;

typedef struct qw_relax_weights {
    float conformal, square, area;
} qw_relax_weights;

/* Four quads side by side: their corners in the plane, counter-clockwise. */
typedef struct qw_plane_quads {
    qw_lanes x[4], y[4];
} qw_plane_quads;

/* To second order: gradient[2 i + k], by coordinate k of corner i, and the Gauss-Newton matrix of the energy, symmetric
 * and never indefinite. */
typedef struct qw_relax_model {
    qw_lanes gradient[8], matrix[8][8];
} qw_relax_model;

/* wanted: area; soft: over it. least: the smallest D. */
qw_lanes qw_quad_energy(const qw_plane_quads *q, qw_lanes wanted, qw_lanes soft, const qw_relax_weights *w,
                        qw_lanes *least);

/* The same with its model. */
qw_lanes qw_quad_energy_model(const qw_plane_quads *q, qw_lanes wanted, qw_lanes soft, const qw_relax_weights *w,
                              qw_relax_model *model);
