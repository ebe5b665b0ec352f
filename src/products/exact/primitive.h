/* Planes, cylinders, cones, spheres and tori: distances from them, and those that points lie on. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef enum { QW_PLANE, QW_CYLINDER, QW_CONE, QW_SPHERE, QW_TORUS, QW_PRIMITIVE_KINDS } qw_primitive_kind;

typedef struct qw_primitive {
    uint32_t kind;   /* qw_primitive_kind */
    double point[3]; /* of the plane, or of the axis; the middle of a sphere or a torus */
    double axis[3];  /* unit: the normal of the plane, or the direction of the axis; a sphere has any */
    double radius;   /* of the circle about `point`, of a torus that in the middle of its tube; a plane has 0 */
    double tube;     /* radius of a torus's tube; 0 but for these */
    double sine;     /* of the angle by which the radius grows along the axis; 0 but for cones */
} qw_primitive;

/* How many numbers say which one it is. */
static inline uint32_t qw_primitive_freedom(uint32_t kind)
{
    static const uint8_t freedom[QW_PRIMITIVE_KINDS] = {3, 5, 6, 4, 7};
    return freedom[kind];
}

/* The signed distance of p, and its gradient, the unit normal there: p less their product lies on the primitive. */
double qw_primitive_distance(const qw_primitive *primitive, const double p[3], double gradient[3]);

/* Facets between points, from which an axis is guessed. */
typedef struct qw_facing {
    const double *normal, *middle; /* double[count][3]: unit normals, and a point of each */
    uint32_t count;
} qw_facing;

/* The least squares of the distances of points, double[count][3]. facing: what lies between them; NULL for planes and
   spheres. Returns the largest distance, or INFINITY where the points, or the first guess, say that it is none. */
double qw_fit_primitive(qw_primitive *primitive, qw_primitive_kind kind, const double *point, uint32_t count,
                        const qw_facing *facing);
/* The same from a primitive that is nearly right. */
double qw_refine_primitive(qw_primitive *primitive, const double *point, uint32_t count);
