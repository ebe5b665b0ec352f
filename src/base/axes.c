#include "base/axes.h"

#include <math.h>
#include <stdbool.h>

/* Whether another turn would change no digit. */
static bool is_diagonal(double m[3][3])
{
    double off = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
    return off <= 1e-20 * (fabs(m[0][0]) + fabs(m[1][1]) + fabs(m[2][2]));
}

void qw_principal_axes(double m[3][3], double axis[3][3])
{
    enum { SWEEPS = 12 }; /* converges quadratically; about six are needed */
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) axis[i][j] = i == j;
    for (int sweep = 0; sweep < SWEEPS && !is_diagonal(m); sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                if (m[p][q] == 0) continue;
                double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; k++) {
                    double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b, m[k][q] = s * a + c * b;
                }
                for (int k = 0; k < 3; k++) {
                    double a = m[p][k], b = m[q][k], x = axis[p][k], y = axis[q][k];
                    m[p][k] = c * a - s * b, m[q][k] = s * a + c * b;
                    axis[p][k] = c * x - s * y, axis[q][k] = s * x + c * y;
                }
            }
}
