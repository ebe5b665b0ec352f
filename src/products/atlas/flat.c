#include "products/atlas/flat.h"

#include "base/elementary.h"

#include <assert.h>
#include <string.h>

static const double STIFFER = 4;       /* a triangle that has been stretched too far */
static const double LINE_WEIGHT = 1e3; /* of an edge that is to lie along an axis: the Laplacian's are about 1 */
static const double LEAST_GAIN = 1e-4; /* of a step that lowers the energy, for another */
enum { LONG_ROW = 4 };                 /* quads of such a row, at least */

/* ---- the disk */

/* Numbers the vertices of a chart: corners that no seam parts are one. */
static void number_vertices(const qw_atlas_mesh *m, qw_flat *t, uint32_t *local)
{
    for (uint32_t i = 0; i < t->corner_count; i++) local[t->place[i]] = QW_NONE;
    for (uint32_t i = 0; i < t->corner_count; i++) {
        uint32_t c = t->place[i], at = c;
        if (local[c] == QW_NONE) {
            uint32_t v = local[c] = t->vertex_count++;
            while (!m->seam[qw_atlas_prev(m, at)] && local[qw_atlas_turn(m, at)] == QW_NONE)
                at = qw_atlas_turn(m, at), local[at] = v;
            for (at = c; !m->seam[at] && local[qw_atlas_turn_back(m, at)] == QW_NONE;)
                at = qw_atlas_turn_back(m, at), local[at] = v;
        }
        assert(local[c] < t->vertex_count);
        t->vertex[i] = local[c];
    }
}

/* The shape of a triangle: (x, 0) and (y, z) of its second and third corner. least: its first side and its height are
   no shorter. */
static void shape_of(const double *a, const double *b, const double *c, double least, double rest[3], double *area)
{
    double u[3], v[3], uu = 0, uv = 0, vv = 0;
    for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k];
    for (int k = 0; k < 3; k++) uu += u[k] * u[k], uv += u[k] * v[k], vv += v[k] * v[k];
    double length = sqrt(uu), height2 = length > 0 ? vv - uv * uv / uu : 0;
    rest[0] = fmax(length, least), rest[1] = length > 0 ? uv / length : 0;
    rest[2] = fmax(height2 > 0 ? sqrt(height2) : 0, least);
    *area = rest[0] * rest[2] / 2;
    if (!(rest[2] > 1e-9 * sqrt(vv)) || !(rest[0] > 1e-9 * sqrt(vv))) *area = 0;
}

/* Cuts the faces into fans of triangles: their corners, shapes at rest and areas, into *t. */
static void take_triangles(const qw_atlas_mesh *m, const uint32_t *face, uint32_t count, qw_flat *t)
{
    uint32_t n = 0, at = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t begin = m->begin[face[i]], size = m->begin[face[i] + 1] - begin;
        for (uint32_t k = 1; k + 1 < size; k++, n++) {
            const uint32_t corner[3] = {0, k, k + 1};
            const double *p[3];
            for (int j = 0; j < 3; j++) {
                t->corner[3 * n + (uint32_t)j] = t->vertex[at + corner[j]];
                p[j] = m->position + 3 * (size_t)m->corner[begin + corner[j]];
            }
            shape_of(p[0], p[1], p[2], m->least, t->rest[n], &t->area[n]);
            t->total += t->area[n];
        }
        at += size;
    }
    assert(n == t->triangle_count);
}

/* Seams that have been walked along are 2 in between. */
static void take_rim(qw_env *env, const qw_atlas_mesh *m, qw_flat *t, const uint32_t *local)
{
    enum { IS_SEAM = 1, IS_TAKEN = 2 };
    uint32_t held = 0;
    for (uint32_t i = 0; i < t->corner_count; i++) t->rim_count += m->seam[t->place[i]] != 0;
    t->rim = QW_NEW(env, uint32_t, t->rim_count), t->rim_to = QW_NEW(env, uint32_t, t->rim_count);
    for (uint32_t i = 0; i < t->corner_count; i++) {
        uint32_t first = t->place[i], c = first;
        if (m->seam[first] != IS_SEAM) continue;
        t->loops++;
        do {
            uint32_t next = qw_next_seam(m, c);
            t->rim[held] = local[c], t->rim_to[held++] = local[next], m->seam[c] = IS_TAKEN;
            c = next;
        } while (c != first && held < t->rim_count);
        assert(c == first);
    }
    assert(held == t->rim_count);
    for (uint32_t i = 0; i < t->corner_count; i++)
        if (m->seam[t->place[i]]) m->seam[t->place[i]] = IS_SEAM;
}

bool qw_flat_is_planar(const qw_flat *t)
{
    uint32_t edges = (3 * t->triangle_count + t->rim_count) / 2;
    return t->loops > 0 && t->vertex_count + t->triangle_count + t->loops == edges + 2;
}

/* The pattern of the Laplacian: neighbours by triangles, each edge twice inside, which does no harm. */
static void begin_matrix(qw_env *env, qw_flat *t)
{
    uint32_t *first = QW_NEW_ZERO(env, uint32_t, t->vertex_count + (size_t)1);
    uint32_t *column = QW_NEW(env, uint32_t, 6 * (size_t)t->triangle_count);
    for (uint32_t h = 0; h < 3 * t->triangle_count; h++) first[t->corner[h] + 1] += 2;
    for (uint32_t v = 0; v < t->vertex_count; v++) first[v + 1] += first[v];
    for (uint32_t h = 0; h < 3 * t->triangle_count; h++) {
        uint32_t f = h / 3 * 3;
        for (uint32_t k = 1; k < 3; k++) column[first[t->corner[h]]++] = t->corner[f + (h - f + k) % 3];
    }
    for (uint32_t v = t->vertex_count; v > 0; v--) first[v] = first[v - 1];
    first[0] = 0;
    assert(first[t->vertex_count] == 6 * t->triangle_count);
    t->matrix = qw_envelope_of(env, t->vertex_count, first, column);
    qw_free(env, column), qw_free(env, first);
}

qw_flat qw_flat_of(qw_env *env, const qw_atlas_mesh *m, const uint32_t *face, uint32_t count, uint32_t *local)
{
    qw_flat t = {0};
    for (uint32_t i = 0; i < count; i++) t.corner_count += m->begin[face[i] + 1] - m->begin[face[i]];
    assert(t.corner_count >= 3 * count);
    t.triangle_count = t.corner_count - 2 * count;
    t.place = QW_NEW(env, uint32_t, t.corner_count), t.vertex = QW_NEW(env, uint32_t, t.corner_count);
    t.corner = QW_NEW(env, uint32_t, 3 * (size_t)t.triangle_count);
    t.rest = qw_alloc(env, t.triangle_count, sizeof *t.rest), t.area = QW_NEW(env, double, t.triangle_count);
    t.stiff = QW_NEW(env, double, t.triangle_count);
    for (uint32_t f = 0; f < t.triangle_count; f++) t.stiff[f] = 1;
    t.next = QW_NEW(env, uint32_t, t.corner_count);
    for (uint32_t i = 0, n = 0; i < count; i++) {
        uint32_t begin = n;
        for (uint32_t c = m->begin[face[i]]; c < m->begin[face[i] + 1]; c++, n++) t.place[n] = c, t.next[n] = n + 1;
        t.next[n - 1] = begin;
    }
    number_vertices(m, &t, local);
    take_triangles(m, face, count, &t);
    take_rim(env, m, &t, local);
    t.at = qw_alloc_zero(env, t.vertex_count, sizeof *t.at);
    begin_matrix(env, &t);
    return t;
}

/* ---- the Laplacian */

/* Gradients of the three hat functions of a triangle, in the plane of its shape. */
static void gradients(const double rest[3], double g[3][2])
{
    double x = rest[0], y = rest[1], z = rest[2];
    g[1][0] = 1 / x, g[1][1] = -y / (x * z);
    g[2][0] = 0, g[2][1] = 1 / z;
    g[0][0] = -g[1][0], g[0][1] = -g[1][1] - g[2][1];
}

/* The stiffness matrix, or with `equal` that of edges of weight 1; the vertices that are held keep their values. along:
   1, 2: with the ties of edges along that axis. */
static void fill_matrix(qw_flat *t, bool equal, const uint8_t *held, int along)
{
    memset(t->matrix.value, 0, t->matrix.begin[t->vertex_count] * sizeof *t->matrix.value);
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        const uint32_t *v = t->corner + 3 * (size_t)f;
        double g[3][2];
        if (!equal && t->area[f] == 0) continue;
        if (!equal) gradients(t->rest[f], g);
        for (int i = 0; i < 3; i++)
            for (int j = i + 1; j < 3; j++) {
                double w = equal ? -1 : t->stiff[f] * t->area[f] * (g[i][0] * g[j][0] + g[i][1] * g[j][1]);
                if (!held[v[i]]) qw_envelope_add(&t->matrix, v[i], v[i], -w);
                if (!held[v[j]]) qw_envelope_add(&t->matrix, v[j], v[j], -w);
                if (!held[v[i]] && !held[v[j]]) qw_envelope_add(&t->matrix, v[i], v[j], w);
            }
    }
    for (uint32_t i = 0; i < t->rim_count && t->axis && along; i++) {
        uint32_t v = t->rim[i], w = t->rim_to[i];
        if (t->axis[i] != along) continue;
        if (!held[v]) qw_envelope_add(&t->matrix, v, v, LINE_WEIGHT);
        if (!held[w]) qw_envelope_add(&t->matrix, w, w, LINE_WEIGHT);
        if (!held[v] && !held[w]) qw_envelope_add(&t->matrix, v, w, -LINE_WEIGHT);
    }
    for (uint32_t v = 0; v < t->vertex_count; v++)
        if (held[v]) qw_envelope_add(&t->matrix, v, v, 1);
    /* a vertex of degenerate triangles only is tied to nothing: it stays */
    double mean = 0;
    for (uint32_t v = 0; v < t->vertex_count; v++) mean += t->matrix.value[t->matrix.begin[t->matrix.place[v] + 1] - 1];
    for (uint32_t v = 0; v < t->vertex_count; v++) qw_envelope_add(&t->matrix, v, v, 1e-12 * mean / t->vertex_count);
}

static void factor_stiffness(qw_env *env, qw_flat *t, int along)
{
    uint8_t *held = QW_NEW_ZERO(env, uint8_t, t->vertex_count);
    t->held = t->corner[0], held[t->held] = 1;
    fill_matrix(t, false, held, along);
    qw_free(env, held);
    if (!qw_envelope_factor(&t->matrix)) qw_fail(env, QW_INTERNAL, -1, "a chart's stiffness matrix is not definite");
}

/* ---- Tutte */

void qw_flat_on_circle(qw_env *env, qw_flat *t)
{
    uint8_t *held = QW_NEW_ZERO(env, uint8_t, t->vertex_count);
    double *b = QW_NEW_ZERO(env, double, 2 * (size_t)t->vertex_count);
    double radius = sqrt(t->total > 0 ? t->total / QW_PI : 1);
    assert(t->loops == 1);
    for (uint32_t i = 0; i < t->rim_count; i++) {
        double angle = 2 * QW_PI * i / t->rim_count;
        held[t->rim[i]] = 1;
        t->at[t->rim[i]][0] = radius * qw_cos(angle), t->at[t->rim[i]][1] = radius * qw_sin(angle);
    }
    fill_matrix(t, true, held, 0);
    if (!qw_envelope_factor(&t->matrix)) qw_fail(env, QW_INTERNAL, -1, "a chart is not connected");
    for (uint32_t v = 0; v < t->vertex_count; v++)
        for (int k = 0; k < 2 && held[v]; k++) b[k * t->vertex_count + v] = t->at[v][k];
    for (uint32_t f = 0; f < t->triangle_count; f++)
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                uint32_t v = t->corner[3 * f + (uint32_t)i], w = t->corner[3 * f + (uint32_t)j];
                if (i == j || held[v] || !held[w]) continue;
                for (int k = 0; k < 2; k++) b[k * t->vertex_count + v] += t->at[w][k];
            }
    for (int k = 0; k < 2; k++) {
        qw_envelope_solve(&t->matrix, b + k * t->vertex_count);
        for (uint32_t v = 0; v < t->vertex_count; v++) t->at[v][k] = b[k * t->vertex_count + v];
    }
    qw_free(env, b), qw_free(env, held);
}

/* ---- maps of triangles */

/* j[r][c]: derivative of coordinate r along axis c of the triangle's shape. */
static void map_of(const qw_flat *t, uint32_t f, double j[2][2])
{
    const uint32_t *v = t->corner + 3 * (size_t)f;
    const double *rest = t->rest[f];
    for (int r = 0; r < 2; r++) {
        double p = t->at[v[1]][r] - t->at[v[0]][r], q = t->at[v[2]][r] - t->at[v[0]][r];
        j[r][0] = p / rest[0];
        j[r][1] = (q - j[r][0] * rest[1]) / rest[2];
    }
}

static void singular_values(const double j[2][2], double *s1, double *s2)
{
    double e = (j[0][0] + j[1][1]) / 2, f = (j[0][0] - j[1][1]) / 2, g = (j[1][0] + j[0][1]) / 2,
           h = (j[1][0] - j[0][1]) / 2;
    double q = sqrt(e * e + h * h), r = sqrt(f * f + g * g);
    *s1 = q + r, *s2 = q - r; /* s2 < 0: inverted */
}

void qw_flat_rigid(qw_env *env, qw_flat *t, uint32_t steps)
{
    assert(t->held < t->vertex_count);
    double *b = QW_NEW(env, double, 2 * (size_t)t->vertex_count);
    factor_stiffness(env, t, 0);
    for (uint32_t step = 0; step < steps; step++) {
        memset(b, 0, 2 * (size_t)t->vertex_count * sizeof *b);
        for (uint32_t f = 0; f < t->triangle_count; f++) {
            double j[2][2], g[3][2];
            if (t->area[f] == 0) continue;
            map_of(t, f, j), gradients(t->rest[f], g);
            double c = j[0][0] + j[1][1], s = j[1][0] - j[0][1], l = sqrt(c * c + s * s);
            double weight = t->stiff[f] * t->area[f];
            if (l > 0) c /= l, s /= l;
            else c = 1, s = 0;
            for (int i = 0; i < 3; i++) {
                uint32_t v = t->corner[3 * f + (uint32_t)i];
                b[v] += weight * (c * g[i][0] - s * g[i][1]);
                b[t->vertex_count + v] += weight * (s * g[i][0] + c * g[i][1]);
            }
        }
        for (int k = 0; k < 2; k++) {
            double *x = b + k * t->vertex_count;
            x[t->held] = 0;
            qw_envelope_solve(&t->matrix, x);
            for (uint32_t v = 0; v < t->vertex_count; v++) t->at[v][k] = x[v];
        }
        qw_heartbeat(env);
    }
    qw_free(env, b);
}

uint32_t qw_flat_stiffen(qw_flat *t, double most)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        double j[2][2], s1, s2;
        if (t->area[f] == 0) continue;
        map_of(t, f, j), singular_values((const double(*)[2])j, &s1, &s2);
        if (s2 > 0 && fmax(s1, 1 / s2) <= most) continue;
        t->stiff[f] *= STIFFER, count++;
    }
    return count;
}

/* ---- symmetric Dirichlet energy */

/* Sum of the squares by which edges lead away from the axes along which they are to lie. Adds the gradient, which may
   be NULL. */
static double line_energy(const qw_flat *t, const double (*at)[2], double *gradient)
{
    double sum = 0;
    for (uint32_t i = 0; i < t->rim_count && t->axis; i++) {
        if (!t->axis[i]) continue;
        uint32_t r = t->axis[i] == 1, v = t->rim[i], w = t->rim_to[i]; /* the coordinate that is to be one */
        double away = at[w][r] - at[v][r];
        sum += LINE_WEIGHT * away * away;
        if (!gradient) continue;
        gradient[r * t->vertex_count + w] += 2 * LINE_WEIGHT * away;
        gradient[r * t->vertex_count + v] -= 2 * LINE_WEIGHT * away;
    }
    return sum;
}

/* Sum over the triangles of area (|J|^2 + |J^-1|^2), and that of lines; infinite where a triangle is inverted.
   gradient: may be NULL. */
static double energy_of(const qw_flat *t, const double (*at)[2], double *gradient)
{
    qw_flat moved = *t;
    double sum = 0;
    moved.at = (double(*)[2])at;
    if (gradient) memset(gradient, 0, 2 * (size_t)t->vertex_count * sizeof *gradient);
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        double j[2][2], g[3][2];
        if (t->area[f] == 0) continue;
        map_of(&moved, f, j);
        double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        double norm = j[0][0] * j[0][0] + j[0][1] * j[0][1] + j[1][0] * j[1][0] + j[1][1] * j[1][1];
        if (!(det > 0)) return INFINITY;
        sum += t->area[f] * norm * (1 + 1 / (det * det));
        if (!gradient) continue;
        double a = 2 * (1 + 1 / (det * det)), b = -2 * norm / (det * det * det);
        double p[2][2] = {{a * j[0][0] + b * j[1][1], a * j[0][1] - b * j[1][0]},
                          {a * j[1][0] - b * j[0][1], a * j[1][1] + b * j[0][0]}};
        gradients(t->rest[f], g);
        for (int i = 0; i < 3; i++)
            for (int r = 0; r < 2; r++)
                gradient[(uint32_t)r * t->vertex_count + t->corner[3 * f + (uint32_t)i]] +=
                    t->area[f] * (p[r][0] * g[i][0] + p[r][1] * g[i][1]);
    }
    return sum + line_energy(t, at, gradient);
}

void qw_flat_lower(qw_env *env, qw_flat *t, uint32_t steps)
{
    enum { MOST_HALVINGS = 30 };
    assert(t->held < t->vertex_count);
    size_t n = t->vertex_count;
    double *d = QW_NEW(env, double, 2 * n), *gradient = QW_NEW(env, double, 2 * n), step = 0.25;
    double(*moved)[2] = qw_alloc(env, n, sizeof *moved);
    for (uint32_t f = 0; f < t->triangle_count; f++) t->stiff[f] = 1;
    factor_stiffness(env, t, 2);
    qw_envelope solver[2] = {t->matrix,
                             t->matrix}; /* of x, whose values are one along edges that lie along y, and of y */
    if (t->axis) {
        t->matrix.value = QW_NEW(env, double, t->matrix.begin[n]);
        factor_stiffness(env, t, 1);
        solver[1] = t->matrix;
    }
    double now = energy_of(t, (const double(*)[2])t->at, gradient);
    for (uint32_t i = 0; i < steps && now < INFINITY; i++) {
        double slope = 0, next = now;
        memcpy(d, gradient, 2 * n * sizeof *d);
        for (int k = 0; k < 2; k++) d[k * n + t->held] = 0, qw_envelope_solve(&solver[k], d + k * n);
        for (size_t k = 0; k < 2 * n; k++) slope += d[k] * gradient[k];
        int halvings = 0;
        for (; halvings < MOST_HALVINGS; halvings++, step /= 2) {
            for (size_t v = 0; v < n; v++)
                moved[v][0] = t->at[v][0] - step * d[v], moved[v][1] = t->at[v][1] - step * d[n + v];
            next = energy_of(t, (const double(*)[2])moved, NULL);
            if (next <= now - 1e-4 * step * slope) break;
        }
        if (halvings == MOST_HALVINGS) break;
        memcpy(t->at, moved, n * sizeof *moved);
        double gained = now - next;
        now = energy_of(t, (const double(*)[2])t->at, gradient);
        if (!(gained > LEAST_GAIN * now)) break;
        step *= 2;
        qw_heartbeat(env);
    }
    qw_free(env, moved), qw_free(env, gradient), qw_free(env, d);
}

/* ---- measures */

static double flat_area(const qw_flat *t)
{
    double sum = 0;
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        const double *a = t->at[t->corner[3 * f]], *b = t->at[t->corner[3 * f + 1]], *c = t->at[t->corner[3 * f + 2]];
        sum += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
    }
    return sum;
}

/* That of the edges, but for quarter turns, in the mean. */
static double angle_of_rows(const qw_flat *t)
{
    double c4 = 0, s4 = 0;
    for (uint32_t i = 0; i < t->corner_count; i++) {
        const double *a = t->at[t->vertex[i]], *b = t->at[t->vertex[t->next[i]]];
        double x = b[0] - a[0], y = b[1] - a[1], n = x * x + y * y;
        if (!(n > 0)) continue;
        double c = (x * x - y * y) / n, s = 2 * x * y / n, l = sqrt(n);
        c4 += l * (c * c - s * s), s4 += l * 2 * c * s;
    }
    return c4 != 0 || s4 != 0 ? qw_atan2(s4, c4) / 4 : 0;
}

void qw_flat_turn(qw_flat *t)
{
    double angle = angle_of_rows(t), c = qw_cos(angle), s = qw_sin(angle);
    for (uint32_t v = 0; v < t->vertex_count; v++) {
        double x = t->at[v][0], y = t->at[v][1];
        t->at[v][0] = c * x + s * y, t->at[v][1] = c * y - s * x;
    }
}

/* A row of quads on the boundary, edges from `first` on of the loop begin .. end - 1: up to where the chart has no two
   corners at a vertex. */
typedef struct row {
    uint32_t first, count, begin, end;
    double least[2], most[2]; /* coordinates of its vertices */
    double sum[2];
} row;

static uint32_t vertex_of_row(const qw_flat *t, const row *w, uint32_t i)
{
    return t->rim[w->begin + (w->first - w->begin + i) % (w->end - w->begin)];
}

/* corners: uint8_t[vertex_count]: of the chart at each, up to 3; two at none of a loop: its row goes around. */
static row row_at(const qw_flat *t, const uint8_t *corners, uint32_t first, uint32_t begin, uint32_t end)
{
    row w = {first, 0, begin, end, {INFINITY, INFINITY}, {-INFINITY, -INFINITY}, {0, 0}};
    for (bool on = true; on; w.count++) {
        uint32_t v = vertex_of_row(t, &w, w.count);
        for (int r = 0; r < 2; r++) {
            w.least[r] = fmin(w.least[r], t->at[v][r]), w.most[r] = fmax(w.most[r], t->at[v][r]);
            w.sum[r] += t->at[v][r];
        }
        on = w.count == 0 || corners[v] == 2;
    }
    w.count--; /* vertices: edges and one */
    return w;
}

/* Rows that are long enough and no higher than `bulge` of their length are to lie along an axis; with `exactly` those
   that are to are moved there, each to the mean of its vertices. Returns how many edges. */
static uint32_t lay_rows(qw_flat *t, const uint8_t *corners, double bulge, bool exactly)
{
    uint32_t edges = 0;
    for (uint32_t begin = 0, end; begin < t->rim_count; begin = end) {
        for (end = begin + 1; t->rim_to[end - 1] != t->rim[begin];) end++;
        for (uint32_t i = begin; i < end; i++) {
            if (corners[t->rim[i]] == 2 || (exactly && !t->axis[i])) continue;
            row w = row_at(t, corners, i, begin, end);
            double size[2] = {w.most[0] - w.least[0], w.most[1] - w.least[1]};
            uint32_t r = exactly ? t->axis[i] == 1 : size[0] > size[1]; /* the coordinate that is to be one */
            if (!exactly && (w.count < LONG_ROW || size[r] > bulge * size[!r])) continue;
            for (uint32_t k = 0; k < w.count && !exactly; k++)
                t->axis[begin + (i - begin + k) % (end - begin)] = r ? 1 : 2;
            for (uint32_t k = 0; k <= w.count && exactly; k++)
                t->at[vertex_of_row(t, &w, k)][r] = w.sum[r] / (w.count + 1);
            edges += w.count;
        }
    }
    return edges;
}

bool qw_flat_straighten(qw_env *env, qw_flat *t, double bulge, uint32_t steps)
{
    uint8_t *corners = QW_NEW_ZERO(env, uint8_t, t->vertex_count);
    for (uint32_t i = 0; i < t->corner_count; i++) corners[t->vertex[i]] += corners[t->vertex[i]] < 3;
    t->axis = QW_NEW_ZERO(env, uint8_t, t->rim_count);
    bool any = lay_rows(t, corners, bulge, false) > 0;
    if (any) qw_flat_lower(env, t, steps), lay_rows(t, corners, bulge, true);
    qw_free(env, corners);
    return any;
}

static void scale_by(qw_flat *t, double s)
{
    for (uint32_t v = 0; v < t->vertex_count; v++) t->at[v][0] *= s, t->at[v][1] *= s;
}

void qw_flat_scale(qw_flat *t)
{
    double area = flat_area(t);
    if (area > 0 && t->total > 0) scale_by(t, sqrt(t->total / area));
}

void qw_flat_scale_best(qw_flat *t)
{
    double forward = 0, back = 0; /* the energy of a scale x is forward x^2 + back / x^2 */
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        double j[2][2], s1, s2;
        if (t->area[f] == 0) continue;
        map_of(t, f, j), singular_values((const double(*)[2])j, &s1, &s2);
        if (!(s2 > 0)) return;
        forward += t->area[f] * (s1 * s1 + s2 * s2), back += t->area[f] * (1 / (s1 * s1) + 1 / (s2 * s2));
    }
    if (forward > 0 && back < INFINITY) scale_by(t, sqrt(sqrt(back / forward)));
}

qw_stretch qw_flat_stretch(const qw_flat *t)
{
    qw_stretch s = {0};
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        double j[2][2], s1, s2;
        if (t->area[f] == 0) continue;
        map_of(t, f, j), singular_values((const double(*)[2])j, &s1, &s2);
        assert(!(s1 < s2));
        if (!(s2 > 0)) {
            s.inverted++;
            continue;
        }
        double most = fmax(s1, 1 / s2);
        s.angle += t->area[f] * s1 / s2, s.area += t->area[f] * fmax(s1 * s2, 1 / (s1 * s2));
        s.mean += t->area[f] * most, s.most = fmax(s.most, most);
    }
    if (t->total > 0) s.angle /= t->total, s.area /= t->total, s.mean /= t->total;
    return s;
}
