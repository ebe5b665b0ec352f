#include "whole/half.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A vertex is moved onto the plane if it is nearer to it than this share of its shortest edge: a cut beside it would
   leave a sliver. */
static const double SNAPPED = 0.01;
/* The sides' areas are equal if they differ by less than this share. */
static const double EQUAL_AREAS = 1e-3;

typedef struct cut {
    qw_env *env;
    const qw_trimesh *mesh;
    qw_half half;
    double *height;   /* double[mesh->vertex_count], 0 for those on the plane */
    uint32_t *vertex; /* uint32_t[mesh->vertex_count]: number in the half, or QW_NONE */
    /* uint32_t[3 mesh->face_count]: number of the cut's vertex on an edge, at one of its half-edges */
    uint32_t *on_edge;
    const double *position;
    const qw_mirror_planes *planes;
    const uint8_t *kind; /* uint8_t[mesh->vertex_count], or NULL */
} cut;

/* Length of an edge as the largest difference of two coordinates: squares could overflow. */
static double length_of(const double *position, uint32_t a, uint32_t b)
{
    const double *p = position + 3 * (size_t)a, *q = position + 3 * (size_t)b;
    return fmax(fabs(p[0] - q[0]), fmax(fabs(p[1] - q[1]), fabs(p[2] - q[2])));
}

/* The height of each vertex above the plane; 0 for those that the plane nearly meets. */
static void find_heights(cut *c)
{
    const qw_trimesh *m = c->mesh;
    double *shortest = QW_NEW(c->env, double, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) shortest[v] = HUGE_VAL;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        double length = length_of(c->position, a, b);
        shortest[a] = fmin(shortest[a], length), shortest[b] = fmin(shortest[b], length);
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        c->height[v] = qw_plane_height(qw_plane_of(c->planes, v), c->position + 3 * (size_t)v);
        if (fabs(c->height[v]) <= SNAPPED * shortest[v]) c->height[v] = 0;
    }
    qw_free(c->env, shortest);
}

/* How many runs of neighbours above the plane there are around a vertex; first: its half-edge of
   qw_trimesh_outgoing. */
static uint32_t count_runs(const cut *c, uint32_t first)
{
    assert(first < 3 * c->mesh->face_count);
    const qw_trimesh *m = c->mesh;
    uint32_t runs = 0, h = first;
    bool was_up = false, first_is_up = false, any = false, closed = false;
    do {
        uint32_t end[2] = {m->corner[qw_next(h)],
                           m->corner[qw_prev(h)]}; /* the last one is looked at twice, which changes nothing */
        for (int i = 0; i < 2; i++) {
            double height = c->height[end[i]];
            if (height == 0) continue;
            if (!any) first_is_up = height > 0, any = true;
            runs += height > 0 && !was_up;
            was_up = height > 0;
        }
        h = qw_around(m, h);
        closed = h == first;
    } while (h != QW_NONE && !closed);
    return runs - (closed && runs > 1 && was_up && first_is_up);
}

/* Marks the vertices on the plane at which the side would not be a surface: saddles, where it would be two sheets that
   touch at a vertex, and ends of an edge in the plane with both its faces above, which would touch its reflection. */
static void find_contacts(const cut *c, const uint32_t *outgoing, uint8_t *contact)
{
    const qw_trimesh *m = c->mesh;
    for (uint32_t v = 0; v < m->vertex_count; v++) contact[v] = c->height[v] == 0 && count_runs(c, outgoing[v]) > 1;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)], twin = m->twin[h];
        if (twin == QW_NONE || c->height[a] != 0 || c->height[b] != 0) continue;
        if (c->height[m->corner[qw_prev(h)]] > 0 && c->height[m->corner[qw_prev(twin)]] > 0)
            contact[a] = contact[b] = 1;
    }
}

/* Treats contact vertices as above the plane, so that the cut passes just below them, nearer than SNAPPED. That may
   make contacts of others, each at most once. */
static void lift_contacts(cut *c)
{
    const qw_trimesh *m = c->mesh;
    uint32_t *outgoing = qw_trimesh_outgoing(c->env, m);
    uint8_t *contact = QW_NEW(c->env, uint8_t, m->vertex_count);
    for (bool any = true; any;) {
        any = false;
        find_contacts(c, outgoing, contact);
        for (uint32_t h = 0; h < 3 * m->face_count; h++) {
            uint32_t v = m->corner[h];
            double length = length_of(c->position, v, m->corner[qw_next(h)]);
            if (contact[v] && (c->height[v] == 0 || c->height[v] > SNAPPED * length))
                c->height[v] = SNAPPED * length, any = true;
        }
        qw_heartbeat(c->env);
    }
    qw_free(c->env, outgoing), qw_free(c->env, contact);
}

static bool is_single(const cut *c, uint32_t v) { return c->kind && c->kind[v] == QW_SINGLE; }

/* Twice the area of the triangle, and that of its part above the plane. */
static double area_of(const cut *c, uint32_t f, double *above)
{
    assert(f < c->mesh->face_count);
    const uint32_t *corner = c->mesh->corner + 3 * (size_t)f;
    double area = (double)qw_length(qw_face_cross(c->mesh, f)), h[3];
    int up = 0;
    for (int i = 0; i < 3; i++) h[i] = c->height[corner[i]], up += h[i] > 0;
    *above = up == 0 ? 0 : area;
    for (int i = 0; i < 3; i++) {
        double a = h[i], b = h[(i + 1) % 3], d = h[(i + 2) % 3];
        if (up == 1 && a > 0) *above = area * (a / (a - fmin(b, 0))) * (a / (a - fmin(d, 0)));
        if (up == 2 && a < 0) *above = area * (1 - (a / (a - b)) * (a / (a - d)));
    }
    return area;
}

/* Reverses heights if the side below the plane has the larger area (EQUAL_AREAS), so that the larger side is kept.
   Single components and those kept whole stay, on whichever side they are; on the other side only those left out do. */
static void choose_side(cut *c, bool other)
{
    const uint8_t *of = c->planes->of;
    double all[QW_MOST_CUTS] = {0}, above[QW_MOST_CUTS] = {0}, part;
    bool reverses[QW_MOST_CUTS];
    for (uint32_t f = 0; f < c->mesh->face_count; f++) {
        uint32_t v = c->mesh->corner[3 * f], p = of ? of[v] : 0;
        assert(p < QW_MOST_CUTS);
        if (!is_single(c, v)) all[p] += area_of(c, f, &part), above[p] += part;
    }
    for (int p = 0; p < QW_MOST_CUTS; p++) reverses[p] = (above[p] < all[p] * (0.5 - EQUAL_AREAS / 2)) != other;
    for (uint32_t v = 0; v < c->mesh->vertex_count; v++) {
        if (reverses[of ? of[v] : 0]) c->height[v] = -c->height[v];
        if (!c->kind || c->kind[v] == QW_IS_CUT) continue;
        c->height[v] = (c->kind[v] == QW_LEFT_OUT) == other ? 1 : -1; /* what is not cut may lie on the plane */
    }
}

static uint32_t add_vertex(cut *c, const double p[3], bool on_plane, qw_half_vertex origin)
{
    double *to = c->half.position + 3 * (size_t)c->half.vertex_count;
    memcpy(to, p, 3 * sizeof *to);
    if (on_plane) qw_put_on_plane(qw_plane_of(c->planes, origin.from), to);
    c->half.on_plane[c->half.vertex_count] = on_plane;
    c->half.origin[c->half.vertex_count] = origin;
    return c->half.vertex_count++;
}

static uint32_t take_vertex(cut *c, uint32_t v)
{
    assert(v < c->mesh->vertex_count);
    if (c->vertex[v] == QW_NONE)
        c->vertex[v] = add_vertex(c, c->position + 3 * (size_t)v, c->height[v] == 0, (qw_half_vertex){v, v, 0});
    return c->vertex[v];
}

/* The vertex where the edge of h crosses the plane. It is computed from the lower end, so that both triangles get the
   same point. */
static uint32_t take_crossing(cut *c, uint32_t h)
{
    assert(h < 3 * c->mesh->face_count);
    const qw_trimesh *m = c->mesh;
    uint32_t twin = m->twin[h], at = twin == QW_NONE || h < twin ? h : twin;
    if (c->on_edge[at] == QW_NONE) {
        uint32_t a = m->corner[at], b = m->corner[qw_next(at)];
        const double *p = c->position + 3 * (size_t)a, *q = c->position + 3 * (size_t)b;
        double t = c->height[a] / (c->height[a] - c->height[b]);
        double x[3] = {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])};
        c->on_edge[at] = add_vertex(c, x, true, (qw_half_vertex){a, b, t});
    }
    return c->on_edge[at];
}

static void add_face(cut *c, uint32_t source, uint32_t x, uint32_t y, uint32_t z)
{
    uint32_t *to = c->half.corner + 3 * (size_t)c->half.face_count;
    c->half.source[c->half.face_count++] = source;
    to[0] = x, to[1] = y, to[2] = z;
}

/* The part of the triangle above the plane: nothing, all of it, a triangle or a quad. */
static void take_face(cut *c, uint32_t f)
{
    assert(f < c->mesh->face_count);
    const uint32_t *corner = c->mesh->corner + 3 * (size_t)f;
    uint32_t polygon[4], count = 0, up = 0, down = 0;
    for (uint32_t i = 0; i < 3; i++) up += c->height[corner[i]] > 0, down += c->height[corner[i]] < 0;
    c->half.in_plane += up == 0 && down == 0;
    if (up == 0) return;
    for (uint32_t i = 0; i < 3; i++) {
        double a = c->height[corner[i]], b = c->height[corner[(i + 1) % 3]];
        if (a >= 0) polygon[count++] = take_vertex(c, corner[i]);
        if ((a > 0 && b < 0) || (a < 0 && b > 0)) polygon[count++] = take_crossing(c, 3 * f + i);
    }
    assert(count == 3 || count == 4);
    add_face(c, f, polygon[0], polygon[1], polygon[2]);
    if (count == 4) add_face(c, f, polygon[0], polygon[2], polygon[3]);
}

/* Takes over the marked edges of the half, cut where they cross the plane. */
static void take_marks(cut *c)
{
    const qw_trimesh *m = c->mesh;
    if (!m->mark) return;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        if (!(m->mark[h] & QW_MARK_FEATURE) || !qw_stands_for_edge(m, h)) continue;
        if (c->height[a] <= 0 && c->height[b] <= 0) continue; /* below, or on the boundary of the half */
        uint32_t *to = c->half.mark + 2 * (size_t)c->half.mark_count++;
        to[0] = c->height[a] >= 0 ? take_vertex(c, a) : take_crossing(c, h);
        to[1] = c->height[b] >= 0 ? take_vertex(c, b) : take_crossing(c, h);
    }
}

/* Sets the census of the half and its reflection, sewn together along the cut, and the topology of each component. */
static void count_whole(cut *c)
{
    qw_half *half = &c->half;
    uint32_t sides = 3 * half->face_count, count = half->vertex_count;
    qw_trimesh one = {.vertex_count = count, .face_count = half->face_count, .corner = half->corner};
    qw_trimesh_link(c->env, &one);
    uint8_t *on = QW_NEW_ZERO(c->env, uint8_t, count);
    for (uint32_t h = 0; h < sides;
         h++) /* a vertex within the boundary of the surface that lies on the plane is sewn too */
        if (one.twin[h] == QW_NONE && half->on_plane[one.corner[h]] && half->on_plane[one.corner[qw_next(h)]])
            on[one.corner[h]] = on[one.corner[qw_next(h)]] = 1;
    qw_trimesh all = {.vertex_count = count, .face_count = half->face_count};
    uint32_t *reflected = QW_NEW(c->env, uint32_t, count);
    for (uint32_t v = 0; v < count; v++)
        reflected[v] = on[v] || is_single(c, half->origin[v].from) ? v : all.vertex_count++;
    all.corner = QW_NEW(c->env, uint32_t, 2 * (size_t)sides);
    memcpy(all.corner, half->corner, sides * sizeof *all.corner);
    for (uint32_t f = 0; f < half->face_count; f++) {
        if (is_single(c, half->origin[half->corner[3 * f]].from)) continue;
        uint32_t *to = all.corner + 3 * (size_t)all.face_count++;
        for (int i = 0; i < 3; i++) to[2 - i] = reflected[half->corner[3 * f + (uint32_t)i]];
        assert(all.vertex_count <= 2 * count && all.face_count <= 2 * half->face_count);
    }
    qw_trimesh_link(c->env, &all);
    half->whole = qw_trimesh_census(c->env, &all);
    half->topology = qw_list_topologies(c->env, &all, &half->whole);
}

qw_half qw_cut_half(qw_env *env, const qw_trimesh *mesh, const double *position, const qw_mirror_planes *planes,
                    const uint8_t *kind, bool other)
{
    assert(mesh->face_count > 0 && mesh->twin && planes->count <= QW_MOST_CUTS);
    size_t sides = 3 * (size_t)mesh->face_count;
    cut c = {.env = env, .mesh = mesh, .position = position, .planes = planes, .kind = kind};
    c.half.position = QW_NEW(env, double,
                             3 * (mesh->vertex_count + sides)); /* at most one vertex is added for each edge */
    c.half.origin = QW_NEW(env, qw_half_vertex, mesh->vertex_count + sides);
    c.half.on_plane = QW_NEW(env, uint8_t, mesh->vertex_count + sides);
    c.half.corner = QW_NEW(env, uint32_t, 2 * sides),
    c.half.source = QW_NEW(env, uint32_t, 2 * (size_t)mesh->face_count);
    c.half.mark = QW_NEW(env, uint32_t, 2 * sides);
    c.height = QW_NEW(env, double, mesh->vertex_count);
    c.vertex = QW_NEW(env, uint32_t, mesh->vertex_count);
    c.on_edge = QW_NEW(env, uint32_t, sides);
    memset(c.vertex, 0xff, mesh->vertex_count * sizeof *c.vertex);
    memset(c.on_edge, 0xff, sides * sizeof *c.on_edge);
    find_heights(&c);
    choose_side(&c, other);
    lift_contacts(&c);
    for (uint32_t f = 0; f < mesh->face_count; f++) take_face(&c, f);
    take_marks(&c);
    if (c.half.face_count) count_whole(&c);
    qw_free(env, c.height), qw_free(env, c.vertex), qw_free(env, c.on_edge);
    return c.half;
}

bool qw_is_like_half(qw_env *env, const qw_half *half, const qw_trimesh *surface, const qw_census *was)
{
    if (half->whole.components != was->components) return false;
    uint64_t *topology = qw_list_topologies(env, surface, was);
    bool same = memcmp(topology, half->topology, (size_t)was->components * sizeof *topology) == 0;
    qw_free(env, topology);
    return same;
}

/* ---- the whole */

typedef struct seam {
    const qw_quadmesh *half;
    const uint8_t *edge; /* uint8_t[4 half->face_count]: half-edges of the boundary that are sewn */
    double *position;    /* double[half->vertex_count][3] of the half, then of the rest */
    uint8_t *on;         /* uint8_t[half->vertex_count]: lies on the plane */
} seam;

/* Puts the vertices of the seam on the plane exactly. */
static void put_seam(seam *s, const qw_mirror_plane *plane)
{
    const qw_quadmesh *q = s->half;
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (s->edge[h]) s->on[q->corner[h]] = s->on[q->corner[qw_quad_next(h)]] = 1;
    for (uint32_t v = 0; v < q->vertex_count; v++)
        if (s->on[v]) qw_put_on_plane(plane, s->position + 3 * (size_t)v);
}

/* Rounds the plane's offset and the heights of the vertices that are reflected to multiples of one power of two which
   doubles of their size can represent, so that reflections are exact. Vertices move by less than a rounding error of
   the output. */
static void make_exact(double *position, const uint8_t *on, const uint8_t *single, uint32_t vertex_count,
                       qw_mirror_plane *plane)
{
    double largest = fabs(plane->offset);
    if (plane->axis == QW_NO_AXIS || plane->offset == 0) return;
    for (uint32_t v = 0; v < vertex_count; v++)
        largest = fmax(largest, fabs(qw_plane_height(plane, position + 3 * (size_t)v)));
    double half = 0.5; /* a power of two, from half of the largest up to the largest */
    while (half < largest / 2) half *= 2;
    while (half > largest) half /= 2;
    assert(half >= largest / 2 && half <= largest);
    double unit = fmax(half / 1125899906842624.0, DBL_TRUE_MIN); /* 2^-52 of twice the largest, or the least there is */
    plane->offset = floor(plane->offset / unit + 0.5) * unit;
    for (uint32_t v = 0; v < vertex_count; v++) {
        double *x = position + 3 * (size_t)v + plane->axis;
        if (single && single[v]) continue;
        *x = on[v] ? plane->offset : floor(*x / unit + 0.5) * unit;
    }
}

/* The quads and the half-edges of one side, and of the other by the number of the quad's reflection. */
typedef struct reflections {
    const qw_quadmesh *half;
    uint32_t *face; /* uint32_t[half->face_count]: the reflection of each, or QW_NONE */
} reflections;

/* The half-edge of the reflection of h. */
static uint32_t reflected_half(const reflections *r, uint32_t h)
{
    assert(r->face[h / 4] != QW_NONE);
    return 4 * r->face[h / 4] + (3 - (h & 3u));
}

/* The twins of the half's quads and of their reflections. edge: uint8_t[half-edges], 1 where the two are joined. */
static void link_halves(const reflections *r, const uint8_t *edge, uint32_t *twin)
{
    assert(edge && r->half->twin);
    for (uint32_t h = 0; h < 4 * r->half->face_count; h++) {
        uint32_t other = r->half->twin[h];
        twin[h] = other;
        if (r->face[h / 4] == QW_NONE) continue;
        uint32_t mate = reflected_half(r, h);
        if (edge[h]) twin[h] = mate, twin[mate] = h;
        else twin[mate] = other == QW_NONE ? QW_NONE : reflected_half(r, other);
    }
}

/* Appends the reflections of the vertices. Returns the reflection of each: itself on the plane and where there is
   none. */
static uint32_t *reflect_vertices(qw_env *env, const seam *s, const qw_mirror_plane *exact, const uint8_t *single,
                                  const double *own, uint32_t *count)
{
    uint32_t *twin = QW_NEW(env, uint32_t, s->half->vertex_count);
    for (uint32_t v = 0; v < s->half->vertex_count; v++) {
        twin[v] = s->on[v] || (single && single[v]) ? v : (*count)++;
        if (twin[v] == v) continue;
        double *to = s->position + 3 * (size_t)twin[v];
        if (own) memcpy(to, own + 3 * (size_t)v, 3 * sizeof *to);
        else qw_reflect(exact, s->position + 3 * (size_t)v, to);
    }
    return twin;
}

qw_mirrored qw_mirror_quads(qw_env *env, const qw_quadmesh *half, const double *position, const qw_mirror_plane *plane,
                            const uint8_t *sewn, const uint8_t *single, const double *own)
{
    assert(half->twin);
    uint32_t count = half->vertex_count, faces = half->face_count;
    qw_mirrored m = {.quads = {.vertex_count = count, .face_count = faces}};
    m.position = QW_NEW(env, double, 6 * (size_t)count), m.source = QW_NEW(env, uint32_t, 2 * (size_t)faces);
    m.quads.corner = QW_NEW(env, uint32_t, 8 * (size_t)faces), m.quads.twin = QW_NEW(env, uint32_t, 8 * (size_t)faces);
    seam s = {half, sewn, m.position, QW_NEW_ZERO(env, uint8_t, count)};
    qw_mirror_plane exact = *plane;
    memcpy(m.position, position, 3 * (size_t)count * sizeof *m.position);
    put_seam(&s, plane);
    make_exact(m.position, s.on, single, count, &exact);
    uint32_t *twin = reflect_vertices(env, &s, &exact, single, own, &m.quads.vertex_count);
    reflections r = {half, QW_NEW(env, uint32_t, faces)};
    memcpy(m.quads.corner, half->corner, 4 * (size_t)faces * sizeof *m.quads.corner);
    for (uint32_t f = 0; f < faces; f++) {
        m.source[f] = f;
        r.face[f] = single && single[half->corner[4 * (size_t)f]] ? QW_NONE : m.quads.face_count++;
        if (r.face[f] == QW_NONE) continue;
        m.source[r.face[f]] = f;
        for (uint32_t i = 0; i < 4; i++) /* the first corner stays the first: the diagonal is drawn from there */
            m.quads.corner[4 * (size_t)r.face[f] + ((4 - i) & 3u)] = twin[half->corner[4 * (size_t)f + i]];
    }
    link_halves(&r, sewn, m.quads.twin);
    qw_free(env, s.on), qw_free(env, twin), qw_free(env, r.face);
    return m;
}

void qw_reflect_again(qw_env *env, const qw_mirrored *m, uint32_t reflected, const qw_mirror_planes *planes,
                      bool follows)
{
    const qw_quadmesh *q = &m->quads;
    uint8_t *on = QW_NEW_ZERO(env, uint8_t, q->vertex_count), *others = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    for (uint32_t h = 4 * reflected; h < 4 * q->face_count; h++) {
        uint32_t from = 4 * m->source[h / 4] + ((4 - (h & 3u)) & 3u), v = q->corner[h];
        assert(m->source[h / 4] < reflected);
        if (v == q->corner[from] && !on[v])
            qw_put_on_plane(qw_plane_of(planes, v), m->position + 3 * (size_t)v), on[v] = 1;
    }
    for (uint32_t p = 0; p < planes->count; p++) {
        qw_mirror_plane exact = planes->plane[p];
        for (uint32_t v = 0; v < q->vertex_count; v++) others[v] = planes->of && planes->of[v] != p;
        make_exact(m->position, on, others, q->vertex_count, &exact);
        for (uint32_t h = 4 * reflected; h < 4 * q->face_count && !follows; h++) {
            uint32_t from = 4 * m->source[h / 4] + ((4 - (h & 3u)) & 3u), v = q->corner[h], u = q->corner[from];
            if (v != u && !others[v]) qw_reflect(&exact, m->position + 3 * (size_t)u, m->position + 3 * (size_t)v);
        }
    }
    qw_free(env, on), qw_free(env, others);
}
