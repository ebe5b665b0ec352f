/* Components with next to no area: what scans and exports leave floating about. */
#include "remesh/clean/sheets.h"

#include "base/sets.h"
#include "geometry/trimesh.h"

#include <assert.h>

/* Of a triangle, in the coordinates of the file. */
static double area_of(const qw_sheets *s, uint32_t f)
{
    assert(f < s->face_count);
    const double *p[3];
    for (size_t i = 0; i < 3; i++) p[i] = s->position + 3 * (size_t)s->point[s->corner[3 * (size_t)f + i]];
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double n = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
        sum += n * n;
    }
    return sqrt(sum) / 2;
}

/* Area of each component at its root, 0 elsewhere. */
static double *component_areas(qw_env *env, const qw_sheets *s, uint32_t *set)
{
    double *area = QW_NEW_ZERO(env, double, s->face_count);
    qw_sets_begin(set, s->face_count);
    for (uint32_t h = 0; h < 3 * s->face_count; h++)
        if (s->twin[h] != QW_NONE) qw_join_sets(set, h / 3, s->twin[h] / 3);
    for (uint32_t f = 0; f < s->face_count; f++) area[qw_set_of(set, f)] += area_of(s, f);
    return area;
}

void qw_keep_faces(qw_env *env, qw_sheets *s, const uint8_t *kept)
{
    assert(kept);
    uint32_t *to = QW_NEW(env, uint32_t, s->face_count), *number = QW_NEW(env, uint32_t, s->vertex_count), faces = 0,
             vertices = 0;
    for (uint32_t f = 0; f < s->face_count; f++) to[f] = kept[f] ? faces++ : QW_NONE;
    for (uint32_t v = 0; v < s->vertex_count; v++) number[v] = QW_NONE;
    for (uint32_t f = 0; f < s->face_count; f++) {
        if (!kept[f]) continue;
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t t = s->twin[3 * (size_t)f + i];
            s->corner[3 * (size_t)to[f] + i] = s->corner[3 * (size_t)f + i];
            s->twin[3 * (size_t)to[f] + i] = t == QW_NONE ? QW_NONE : 3 * to[t / 3] + t % 3;
            number[s->corner[3 * (size_t)f + i]] = 0;
        }
        s->source[to[f]] = s->source[f];
        s->kind[to[f]] = s->kind[f];
    }
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        if (number[v] == QW_NONE) continue;
        s->point[vertices] = s->point[v];
        number[v] = vertices++;
    }
    for (uint32_t h = 0; h < 3 * faces; h++) s->corner[h] = number[s->corner[h]];
    s->face_count = faces, s->vertex_count = vertices;
    qw_free(env, to), qw_free(env, number);
}

uint32_t qw_drop_small_components(qw_env *env, qw_sheets *s, double least_share)
{
    assert(least_share >= 0);
    qw_scope_begin(env);
    uint32_t *set = QW_NEW(env, uint32_t, s->face_count), largest = 0, dropped = 0;
    double *area = component_areas(env, s, set), whole = 0;
    uint8_t *kept = QW_NEW(env, uint8_t, s->face_count);
    for (uint32_t f = 0; f < s->face_count; f++) {
        whole += area[f];
        if (area[f] > area[largest]) largest = f;
    }
    largest = qw_set_of(set, largest);
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t root = qw_set_of(set, f);
        kept[f] = root == largest || area[root] >= least_share * whole;
        dropped += root == f && !kept[f];
    }
    if (dropped > 0) qw_keep_faces(env, s, kept);
    qw_scope_end(env);
    return dropped;
}
