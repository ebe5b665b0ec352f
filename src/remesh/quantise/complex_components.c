#include "remesh/quantise/complex_components.h"

#include "base/sets.h"

#include <assert.h>
#include <string.h>

/* The component of each vertex of the surface, by the name of its lowest vertex. */
static uint32_t *components_of(qw_env *env, const qw_offset_mesh *m)
{
    uint32_t *set = QW_NEW(env, uint32_t, m->vertex_count);
    qw_sets_begin(set, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) qw_join_sets(set, m->corner[h], m->corner[qw_next(h)]);
    for (uint32_t v = 0; v < m->vertex_count; v++) set[v] = qw_set_of(set, v);
    return set;
}

/* of_vertex: names of components on entry, their numbers on return. Returns the number of components; where no
   triangle is left, one without triangles. */
static uint32_t number_components(qw_env *env, const qw_decimated *s, uint32_t vertex_count, uint32_t *of_vertex)
{
    assert(s->corner && of_vertex);
    uint32_t *number = QW_NEW(env, uint32_t, vertex_count), count = 0;
    memset(number, 0xff, vertex_count * sizeof *number);
    for (uint32_t h = 0; h < 3 * s->complex.face_count; h += 3) {
        uint32_t *n = &number[of_vertex[s->corner[h]]];
        if (*n == QW_NONE) *n = count++;
    }
    for (uint32_t v = 0; v < vertex_count; v++) {
        uint32_t n = number[of_vertex[v]];
        of_vertex[v] = n == QW_NONE ? 0 : n;
    }
    qw_free(env, number);
    return count > 0 ? count : 1;
}

/* Room for what has been counted; the counts start at 0 again, to be filled one by one. */
static void make_room(qw_env *env, qw_component *p)
{
    assert(p->decimated.complex.face_count < QW_NONE / 3);
    qw_complex *c = &p->decimated.complex;
    c->edge = QW_NEW(env, uint32_t, (size_t)3 * c->face_count);
    c->rot = QW_NEW(env, uint8_t, (size_t)3 * c->face_count);
    c->side = QW_NEW(env, uint32_t, (size_t)2 * c->edge_count);
    c->d = QW_NEW(env, qw_int2, c->edge_count);
    c->real = QW_NEW(env, qw_real2, c->edge_count);
    c->fixed = QW_NEW(env, uint8_t, c->edge_count);
    c->weight = QW_NEW(env, float, c->edge_count);
    p->decimated.corner = QW_NEW(env, uint32_t, (size_t)3 * c->face_count);
    p->edge = QW_NEW(env, uint32_t, c->edge_count);
    p->constraint = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)c->face_count); /* no more vertices than corners */
    c->face_count = c->edge_count = 0;                                    /* filled one by one */
}

/* number: room for the whole's faces, edges and vertices. */
static void fill_components(const qw_decimated *s, const qw_offset_mesh *m, const qw_components *components,
                            uint32_t *face_number, uint32_t *edge_number, uint32_t *vertex_number)
{
    const qw_complex *whole = &s->complex;
    for (uint32_t f = 0; f < whole->face_count; f++)
        face_number[f] = components->component[components->of_vertex[s->corner[3 * f]]].decimated.complex.face_count++;
    for (uint32_t e = 0; e < whole->edge_count; e++) {
        qw_component *p = &components->component[components->of_vertex[s->corner[whole->side[2 * e]]]];
        qw_complex *c = &p->decimated.complex;
        uint32_t n = edge_number[e] = c->edge_count++;
        p->edge[n] = e;
        for (uint32_t i = 0; i < 2; i++) {
            uint32_t h = whole->side[2 * e + i];
            c->side[2 * n + i] = h == QW_NONE ? QW_NONE : 3 * face_number[h / 3] + h % 3;
        }
        c->d[n] = whole->d[e], c->real[n] = whole->real[e], c->fixed[n] = whole->fixed[e];
        c->weight[n] = whole->weight ? whole->weight[e] : 1;
    }
    for (uint32_t h = 0; h < 3 * whole->face_count; h++) {
        uint32_t v = s->corner[h], to = 3 * face_number[h / 3] + h % 3;
        qw_component *p = &components->component[components->of_vertex[v]];
        if (vertex_number[v] == QW_NONE) vertex_number[v] = p->vertex_count++;
        if (m->constraint) p->constraint[vertex_number[v]] = m->constraint[v];
        p->decimated.corner[to] = vertex_number[v];
        p->decimated.complex.edge[to] = edge_number[whole->edge[h]], p->decimated.complex.rot[to] = whole->rot[h];
    }
}

qw_components qw_split_components(qw_env *env, const qw_decimated *s, const qw_offset_mesh *m)
{
    assert(s->corner && m->vertex_count > 0);
    const qw_complex *whole = &s->complex;
    qw_components components = {.of_vertex = components_of(env, m)};
    components.count = number_components(env, s, m->vertex_count, components.of_vertex);
    components.component = QW_NEW_ZERO(env, qw_component, components.count);
    for (uint32_t f = 0; f < whole->face_count; f++)
        components.component[components.of_vertex[s->corner[3 * f]]].decimated.complex.face_count++;
    for (uint32_t e = 0; e < whole->edge_count; e++)
        components.component[components.of_vertex[s->corner[whole->side[2 * e]]]].decimated.complex.edge_count++;
    for (uint32_t i = 0; i < components.count; i++) make_room(env, &components.component[i]);
    uint32_t *face_number = QW_NEW(env, uint32_t, whole->face_count),
             *edge_number = QW_NEW(env, uint32_t, whole->edge_count);
    uint32_t *vertex_number = QW_NEW(env, uint32_t, m->vertex_count);
    memset(vertex_number, 0xff, m->vertex_count * sizeof *vertex_number);
    fill_components(s, m, &components, face_number, edge_number, vertex_number);
    qw_free(env, face_number), qw_free(env, edge_number), qw_free(env, vertex_number);
    return components;
}
