/* Planes, cylinders and cones: distances from them, and those that points lie on. */
#ifndef QW_EXACT_PRIMITIVE_H
#define QW_EXACT_PRIMITIVE_H

#include <stdbool.h>
#include <stdint.h>

typedef enum { QW_PLANE, QW_CYLINDER, QW_CONE, QW_PRIMITIVE_KINDS } qw_primitive_kind;

typedef struct qw_primitive {
    uint32_t kind;   /* qw_primitive_kind */
    double point[3]; /* of the plane, or of the axis */
    double axis[3];  /* unit: the normal of the plane, or the direction of the axis */
    double radius;   /* of the circle about `point`; a plane has 0 */
    double sine;     /* of the angle by which the radius grows along the axis; 0 but for cones */
} qw_primitive;

/* How many numbers say which one it is. */
static inline uint32_t qw_primitive_freedom(uint32_t kind)
{
    return kind == QW_PLANE ? 3 : kind == QW_CYLINDER ? 5 : 6;
}

/* The signed distance of p, and its gradient, the unit normal there: p less their product lies on the primitive. */
double qw_primitive_distance(const qw_primitive *primitive, const double p[3], double gradient[3]);

/* The least squares of the distances of points, double[count][3]. normal: double[normals][3], unit, of facets between
   the points, from which the axis is guessed first. Returns the largest distance, or INFINITY where the points, or the
   first guess, say that it is none. */
double qw_fit_primitive(qw_primitive *primitive, qw_primitive_kind kind, const double *point, uint32_t count,
                        const double *normal, uint32_t normals);
/* The same from a primitive that is nearly right. */
double qw_refine_primitive(qw_primitive *primitive, const double *point, uint32_t count);

#endif
