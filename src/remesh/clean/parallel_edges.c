/* Edges between the same two vertices: all but one are split in the middle.
 *
 *             w                        w
 *            / \                      /|\
 *           /   \                    / | \        h = u -> v of face f becomes u -> m;
 *          / f   \         ->       / f|  \       the new face has the corners m, v, w.
 *         u --h-- v                u --m-- v
 */
#include "remesh/clean/sheets.h"

#include "geometry/trimesh.h"

#include <assert.h>

/* Flags one side of each edge to be split. */
static uint32_t flag_parallel(const qw_sheets *s, const qw_edges *edges, uint8_t *flag)
{
    uint32_t count = 0;
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            uint32_t first = qw_side_half(edges->side[i]);
            for (uint32_t j = i + 1; j < end; j++) {
                uint32_t h = qw_side_half(edges->side[j]), t = s->twin[h];
                if (t == first || (t != QW_NONE && t < h)) continue; /* the edge that stays, and second sides */
                flag[h] = 1;
                count++;
            }
        }
    return count;
}

static void join(qw_sheets *s, uint32_t h, uint32_t t)
{
    s->twin[h] = t;
    if (t != QW_NONE) s->twin[t] = h;
}

/* Splits the face of h at the vertex m in the middle of h; returns the new face, whose first side is the far half of h.
 */
static uint32_t split_face(qw_sheets *s, uint8_t *flag, uint32_t h, uint32_t m)
{
    assert(h < 3 * s->face_count && m < s->vertex_count);
    uint32_t f = s->face_count++, n = qw_next(h);
    uint32_t *c = s->corner + 3 * (size_t)f;
    c[0] = m;
    c[1] = s->corner[n];
    c[2] = s->corner[qw_next(n)];
    s->source[f] = s->source[h / 3];
    join(s, 3 * f + 1, s->twin[n]);
    flag[3 * (size_t)f + 1] = flag[n];
    flag[3 * (size_t)f] = flag[3 * (size_t)f + 2] = flag[n] = 0;
    s->corner[n] = m;
    join(s, n, 3 * f + 2);
    return f;
}

/* Puts a vertex in the middle of an edge, and splits the triangles on both sides. */
static void split_edge(qw_sheets *s, uint8_t *flag, uint32_t h)
{
    assert(h < 3 * s->face_count);
    uint32_t t = s->twin[h], m = s->vertex_count++, p = s->point_count++;
    const double *a = s->position + 3 * (size_t)s->point[s->corner[h]],
                 *b = s->position + 3 * (size_t)s->point[s->corner[qw_next(h)]];
    for (int k = 0; k < 3; k++) s->position[3 * (size_t)p + k] = (a[k] + b[k]) / 2;
    s->point[m] = p;
    uint32_t f = split_face(s, flag, h, m);
    s->twin[3 * (size_t)f] = QW_NONE;
    if (t == QW_NONE) return;
    uint32_t g = split_face(s, flag, t, m);
    join(s, h, 3 * g);
    join(s, 3 * f, t);
}

uint32_t qw_split_parallel_edges(qw_env *env, qw_sheets *s)
{
    assert(s->twin && s->corner);
    qw_scope_begin(env);
    size_t half_edges = 3 * (size_t)s->face_count;
    uint8_t *flag = QW_NEW_ZERO(env, uint8_t, half_edges);
    qw_edges edges = qw_edges_build(env, 3, s->corner, s->face_count, s->vertex_count);
    uint32_t count = flag_parallel(s, &edges, flag);
    qw_edges_free(env, &edges);
    if (count > 0) {
        size_t faces = s->face_count + 2 * (size_t)count;
        if (faces >= QW_NONE / 3) qw_fail(env, QW_TOO_LARGE, -1, "%zu triangles are more than can be addressed", faces);
        flag = qw_resize(env, flag, 3 * faces, 1);
        s->corner = qw_resize(env, s->corner, 3 * faces, sizeof(uint32_t));
        s->twin = qw_resize(env, s->twin, 3 * faces, sizeof(uint32_t));
        s->source = qw_resize(env, s->source, faces, sizeof(uint32_t));
        s->point = qw_resize(env, s->point, (size_t)s->vertex_count + count, sizeof(uint32_t));
        s->position = qw_resize(env, s->position, 3 * ((size_t)s->point_count + count), sizeof(double));
    }
    for (uint32_t h = 0; count > 0 && h < 3 * s->face_count; h++)
        if (flag[h]) {
            flag[h] = 0;
            split_edge(s, flag, h);
        }
    qw_scope_end(env);
    return count;
}
