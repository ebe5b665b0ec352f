/* Regions, rims that stay, guides, painted density and symmetry, all at once and with any options, on surfaces of known
 * topology: a run ends in a refusal with a sentence, or in a mesh that has the topology of the input, all polygons that
 * were to stay and all vertices of the rims. The first bytes choose, the last four seed the random numbers of the rest,
 * so that a few bytes are a whole case. */
#include "quadwright/quadwright.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
    MOST_SIDE = 24,
    MOST_VERTICES = 2 * (MOST_SIDE + 1) * (MOST_SIDE + 1) + 4,
    MOST_FACES = 4 * MOST_SIDE * (MOST_SIDE + 1),
    MOST_GUIDES = 4,
    MOST_POINTS = 64,
    HEADER = 16
};

typedef struct mesh {
    uint32_t vertex_count, face_count;
    double position[3 * MOST_VERTICES];
    uint32_t corner[3 * MOST_FACES];
} mesh;

/* What a case is made of; `state` is that of the random numbers. */
typedef struct recipe {
    uint8_t surface, columns, rows, bumps, holes, steers, region, guides, faces, bits, more;
    uint64_t state;
} recipe;

static uint32_t draw(recipe *r, uint32_t below)
{
    r->state = r->state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((r->state >> 33) % below);
}

static double uniform(recipe *r) { return draw(r, 1 << 24) / (double)(1 << 24); }

static recipe read_recipe(const uint8_t *d)
{
    recipe r = {d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8], d[9], d[10], 0};
    for (int i = 11; i < HEADER; i++) r.state = r.state << 8 | d[i];
    return r;
}

/* ---- surfaces */

static void add_triangle(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *to = m->corner + 3 * m->face_count++;
    to[0] = a, to[1] = b, to[2] = c;
}

/* A point of a sheet, a tube, a ring or a ball; u and v from 0 to 1. */
static void place(uint8_t kind, double u, double v, double p[3])
{
    static const double TURN = 6.283185307179586;
    double a = TURN * u, b = kind == 2 ? TURN * v : TURN / 2 * v;
    if (kind == 0) p[0] = u, p[1] = v, p[2] = 0.2 * u * v;
    else if (kind == 1) p[0] = cos(a), p[1] = sin(a), p[2] = 3 * v;
    else if (kind == 2) p[0] = (2 + cos(b)) * cos(a), p[1] = (2 + cos(b)) * sin(a), p[2] = sin(b);
    else p[0] = sin(b) * cos(a), p[1] = sin(b) * sin(a), p[2] = -cos(b);
}

/* Adds one component, moved by `away` along x. */
static void add_surface(mesh *m, recipe *r, double away)
{
    uint8_t kind = r->surface % 4;
    uint32_t columns = 3 + r->columns % (MOST_SIDE - 2), rows = 3 + r->rows % (MOST_SIDE - 2), first = m->vertex_count;
    bool around = kind != 0, upward = kind == 2, caps = kind == 3;
    uint32_t wide = columns + !around, high = upward ? rows : caps ? rows - 1 : rows + 1;
    double bump = (r->bumps & 7) * 0.03;
    for (uint32_t j = 0; j < high; j++)
        for (uint32_t i = 0; i < wide; i++) {
            double *p = m->position + 3 * m->vertex_count++;
            place(kind, i / (double)columns, (j + caps) / (double)rows, p);
            for (int k = 0; k < 3; k++) p[k] += bump * (uniform(r) - 0.5) / (r->bumps & 8 ? 10 : 1);
            p[0] += away;
        }
    for (uint32_t j = 0; j + !upward < high; j++)
        for (uint32_t i = 0; i < columns; i++) {
            uint32_t a = first + j * wide + i, b = first + j * wide + (i + 1) % wide,
                     c = first + (j + 1) % high * wide + (i + 1) % wide, d = first + (j + 1) % high * wide + i;
            if (draw(r, 2)) add_triangle(m, a, b, c), add_triangle(m, a, c, d);
            else add_triangle(m, a, b, d), add_triangle(m, b, c, d);
        }
    for (uint32_t end = 0; caps && end < 2; end++) {
        double *p = m->position + 3 * (size_t)m->vertex_count;
        place(kind, 0, end, p), p[0] += away;
        uint32_t pole = m->vertex_count++, row = first + (end ? (high - 1) * wide : 0);
        for (uint32_t i = 0; i < columns; i++) {
            uint32_t a = row + i, b = row + (i + 1) % columns;
            if (end) add_triangle(m, a, b, pole);
            else add_triangle(m, b, a, pole);
        }
    }
}

static double distance_to(const mesh *m, uint32_t face, const double p[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double c = 0;
        for (int i = 0; i < 3; i++) c += m->position[3 * m->corner[3 * face + (uint32_t)i] + (uint32_t)k] / 3;
        sum += (c - p[k]) * (c - p[k]);
    }
    return sqrt(sum);
}

/* Removes the faces near a few vertices. */
static void cut_holes(mesh *m, recipe *r)
{
    for (int hole = 0; hole < r->holes % 4; hole++) {
        const double *p = m->position + 3 * draw(r, m->vertex_count);
        double reach = 0.1 + 0.5 * uniform(r);
        uint32_t kept = 0;
        for (uint32_t f = 0; f < m->face_count; f++)
            if (distance_to(m, f, p) > reach) memmove(m->corner + 3 * kept++, m->corner + 3 * f, 3 * sizeof *m->corner);
        if (kept > 0) m->face_count = kept;
    }
}

/* ---- what steers */

/* 1 for each face of a ball, of a half or by chance; at least one. */
static void choose_region(const mesh *m, recipe *r, uint8_t *inside)
{
    const double *p = m->position + 3 * m->corner[draw(r, 3 * m->face_count)];
    double reach = (1 + r->region / 4 % 16) * 0.15;
    for (uint32_t f = 0; f < m->face_count; f++) {
        double d = distance_to(m, f, p);
        bool is_in = r->region % 4 == 0   ? d < reach
                     : r->region % 4 == 1 ? d >= reach
                     : r->region % 4 == 2 ? draw(r, 16) < 1 + (uint32_t)r->region / 4 % 15
                                          : f < 1 + (uint32_t)r->region / 4 * m->face_count / 64;
        inside[f] = is_in;
    }
    inside[draw(r, m->face_count)] = 1;
}

/* Polylines from corner to corner of faces, some of them off the surface. inside: NULL, or faces where some begin. */
static uint32_t choose_guides(const mesh *m, recipe *r, const uint8_t *inside, qw_guide *guide, double *points)
{
    uint32_t count = 1 + r->guides % MOST_GUIDES;
    for (uint32_t g = 0; g < count; g++) {
        double *p = points + (size_t)3 * MOST_POINTS * g;
        bool closed = r->guides & 4 && draw(r, 2);
        uint32_t n = 3 + draw(r, 12), begin = draw(r, 3 * m->face_count),
                 step = draw(r, 2) ? 3 : 6 * (r->columns % 22u);
        while (inside && r->guides & 32 && !inside[begin / 3]) begin = (begin + 3) % (3 * m->face_count);
        for (uint32_t i = 0; i < n; i++)
            for (uint32_t k = 0; k < 3; k++) {
                uint32_t v = m->corner[(begin + (size_t)i * step) % (3 * m->face_count)];
                p[3 * i + k] = m->position[3 * v + k] + (r->guides & 8 ? 0.02 * uniform(r) : 0);
            }
        guide[g] = (qw_guide){.size = sizeof *guide,
                              .kind = r->guides & 16 && draw(r, 2) ? QW_GUIDE_DIRECTION : QW_GUIDE_LOOP,
                              .closed = closed,
                              .point_count = n,
                              .points = p};
        if (closed && guide[g].kind == QW_GUIDE_LOOP) guide[g].rings = r->columns % 7u;
    }
    return count;
}

static qw_options choose_options(const recipe *r)
{
    qw_options o;
    qw_options_init(&o);
    o.faces = r->faces < 64 ? 1 + r->faces : r->faces < 192 ? 2 * r->faces : 5 * r->faces;
    o.fix_boundary = (r->steers & 2) != 0;
    if (r->steers & 16) o.symmetry = 1 + r->more % 4;
    if (r->steers & 32) o.min_component = 0.3;
    o.region_rim = (r->steers & 64) != 0;
    o.sharp_angle = r->bits & 1 ? 30 : -1;
    o.align_boundary = !(r->bits & 2);
    o.adaptive = r->bits & 4 ? 1 : 0;
    o.relax = !(r->bits & 8 && r->bits & 16);
    o.repair = !(r->bits & 8 && r->bits & 32);
    if (r->bits & 64) o.follow = 0;
    if (r->bits & 128) o.smoothness = 0;
    if (r->more & 8) o.fit = 0;
    if (r->more & 16) o.loops = 1;
    if ((r->more & 96) == 96) o.flow = 0;
    o.threads = 1;
    return o;
}

/* ---- what is held to */

static void broken(const char *what, double is, double wanted)
{
    fprintf(stderr, "the promise is broken: %s: %g, not %g\n", what, is, wanted);
    abort();
}

static void expect(const char *what, int64_t is, int64_t wanted)
{
    if (is != wanted) broken(what, (double)is, (double)wanted);
}

static qw_topology topology_of(const qw_mesh_view *view)
{
    qw_topology t;
    qw_quality q;
    expect("status of measuring", qw_measure(view, NULL, NULL, &t, &q), QW_OK);
    return t;
}

static bool is_sound(const qw_topology *t)
{
    return t->degenerate_faces == 0 && t->duplicate_faces == 0 && t->nonmanifold_edges == 0 &&
           t->nonmanifold_vertices == 0 && t->inconsistent_edges == 0;
}

/* Whether the polygon has these three corners, with all their digits. */
static bool is_same_triangle(const mesh *m, uint32_t face, const qw_mesh_view *result, uint32_t corner)
{
    for (uint32_t i = 0; i < 3; i++)
        if (memcmp(m->position + 3 * (size_t)m->corner[3 * face + i],
                   result->positions + 3 * (size_t)result->corners[corner + i], 3 * sizeof(double)))
            return false;
    return true;
}

/* The polygons that stayed come last, in the order of the input. */
static void check_kept(const mesh *m, const uint8_t *inside, const qw_mesh_view *result, int64_t kept)
{
    uint32_t corner = 0, face = 0;
    for (; result->face_sizes && face + kept < result->face_count; face++) corner += result->face_sizes[face];
    for (uint32_t f = 0; f < m->face_count && result->face_sizes; f++) {
        if (face < result->face_count && is_same_triangle(m, f, result, corner)) face++, corner += 3;
        else if (!inside[f]) broken("a face that was to stay is gone", f, f);
    }
    if (result->face_sizes) expect("faces that stayed", face, result->face_count);
}

/* Where the rim is cut anew: polygons that no vertex of the region is of come last in the same way, among others. */
static void check_beyond(const mesh *m, const uint8_t *inside, const qw_mesh_view *result, int64_t kept)
{
    static uint8_t touched[MOST_VERTICES];
    memset(touched, 0, sizeof touched);
    for (uint32_t f = 0; f < m->face_count; f++)
        for (int i = 0; i < 3 && inside[f]; i++) touched[m->corner[3 * f + (uint32_t)i]] = 1;
    uint32_t corner = 0, face = 0;
    for (; result->face_sizes && face + kept < result->face_count; face++) corner += result->face_sizes[face];
    for (uint32_t f = 0; f < m->face_count && result->face_sizes; f++) {
        const uint32_t *c = m->corner + 3 * f;
        if (inside[f] || touched[c[0]] || touched[c[1]] || touched[c[2]]) continue;
        while (face < result->face_count && !(result->face_sizes[face] == 3 && is_same_triangle(m, f, result, corner)))
            corner += result->face_sizes[face++];
        if (face == result->face_count) broken("a face away from the region is gone", f, f);
    }
}

static void check(const mesh *m, const qw_mesh_view *input, const uint8_t *inside, const qw_context *context,
                  const qw_options *o)
{
    const qw_report *r = qw_get_report(context);
    qw_mesh_view result;
    expect("status of the mesh", qw_get_mesh(context, &result), QW_OK);
    qw_topology was = topology_of(input), is = topology_of(&result);
    expect("quads", is.quads, is.faces - r->kept_faces);
    for (size_t i = 0; i < 3 * (size_t)result.vertex_count; i++)
        if (!isfinite(result.positions[i])) broken("a coordinate", result.positions[i], 0);
    if (inside && !o->region_rim) check_kept(m, inside, &result, r->kept_faces);
    else if (inside) check_beyond(m, inside, &result, r->kept_faces);
    if (!o->repair || !is_sound(&was)) return;
    expect("degenerate faces", is.degenerate_faces, 0);
    expect("duplicate faces", is.duplicate_faces, 0);
    expect("edges of more than two faces", is.nonmanifold_edges, 0);
    expect("vertices of several fans", is.nonmanifold_vertices, 0);
    expect("isolated vertices", is.isolated_vertices, 0);
    expect("edges of inconsistent faces", is.inconsistent_edges, 0);
    if (r->symmetric || r->dropped_components) return;
    expect("components", is.components, was.components);
    expect("boundary loops", is.boundary_loops, was.boundary_loops);
    expect("Euler number", is.euler, was.euler);
}

/* ---- */

/* A plane that was asked for may leave no room for both sides, which is a refusal. */
static bool is_plane_asked(const qw_options *o) { return o->symmetry > 1; /* neither none nor auto */ }

static void require(qw_context *context, qw_status status)
{
    if (status != QW_OK) fprintf(stderr, "%s\n", qw_message(context)), abort();
}

/* How many runs of each kind there were, for what is said at the end. */
static struct {
    long runs, refused, regions, rims_anew, rims_kept, guides, densities, planes, moving;
} tally;

static void steer(qw_context *context, const mesh *m, recipe *r, uint8_t *inside)
{
    static double points[3 * MOST_POINTS * MOST_GUIDES];
    static qw_density density[MOST_VERTICES];
    qw_guide guide[MOST_GUIDES];
    if (r->steers & 1) {
        choose_region(m, r, inside);
        require(context, qw_set_region(context, inside, m->face_count));
    }
    if (r->steers & 4)
        require(context,
                qw_set_guides(context, guide, choose_guides(m, r, r->steers & 1 ? inside : NULL, guide, points)));
    if (r->steers & 8) {
        for (uint32_t v = 0; v < m->vertex_count; v++)
            density[v] = (qw_density)(draw(r, 8) ? 1 + m->position[3 * v] * m->position[3 * v] : 50);
        require(context, qw_set_density(context, density, m->vertex_count));
    }
    if (r->steers & 128) {
        static float share[2 * MOST_VERTICES], offset[3 * MOST_VERTICES];
        static uint32_t group[2 * MOST_VERTICES];
        float steep = (float)(1 + draw(r, 20));
        for (uint32_t v = 0; v < m->vertex_count; v++) {
            float x = (float)m->position[3 * v], y = (float)m->position[3 * v + 1];
            share[2 * v] = fminf(fmaxf(0.5f + steep * (x + 0.3f * y), 0), 1), share[2 * v + 1] = 1 - share[2 * v];
            group[2 * v] = 0, group[2 * v + 1] = 1, offset[3 * v + 1] = expf(-steep * (x * x + y * y));
        }
        const qw_attribute moves[] = {
            {.size = sizeof *moves,
             .name = "weights",
             .kind = QW_WEIGHTS,
             .components = 2,
             .count = m->vertex_count,
             .values = share,
             .group = group},
            {.size = sizeof *moves, .name = "target:up", .components = 3, .count = m->vertex_count, .values = offset}};
        require(context, qw_set_motion(context, moves, 2));
        tally.moving++;
    }
}

static void print_tally(void)
{
    printf("%ld runs, %ld refused: %ld regions (%ld with a rim cut anew), %ld with boundaries that stay, %ld with "
           "guides, %ld with a density, %ld with symmetry, %ld that move\n",
           tally.runs, tally.refused, tally.regions, tally.rims_anew, tally.rims_kept, tally.guides, tally.densities,
           tally.planes, tally.moving);
}

static void count_run(const qw_options *o, uint8_t steers, qw_status status)
{
    if (tally.runs == 0) atexit(print_tally);
    bool has_region = steers & 1;
    tally.runs++, tally.refused += status != QW_OK;
    tally.regions += has_region, tally.rims_anew += has_region && o->region_rim;
    tally.rims_kept += o->fix_boundary, tally.guides += (steers & 4) != 0;
    tally.densities += (steers & 8) != 0, tally.planes += o->symmetry != 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < HEADER) return 0;
    static mesh m;
    static uint8_t inside[MOST_FACES];
    recipe r = read_recipe(data);
    m.vertex_count = m.face_count = 0;
    add_surface(&m, &r, 0);
    if (r.surface & 4 && m.face_count < MOST_FACES / 3) add_surface(&m, &r, r.surface & 8 ? 1 : 6);
    cut_holes(&m, &r);
    qw_mesh_view view = {.size = sizeof view,
                         .vertex_count = m.vertex_count,
                         .face_count = m.face_count,
                         .uniform_face_size = 3,
                         .positions = m.position,
                         .corners = m.corner};
    qw_options options = choose_options(&r);
    qw_context *context;
    expect("status of a context", qw_create(NULL, &context), QW_OK);
    require(context, qw_set_mesh(context, &view));
    steer(context, &m, &r, inside);
    qw_status status = qw_run(context, &options);
    count_run(&options, r.steers, status);
    if (status == QW_OK) check(&m, &view, r.steers & 1 ? inside : NULL, context, &options);
    else if (qw_message(context)[0] == 0 || (status == QW_INTERNAL && options.repair && !is_plane_asked(&options)))
        fprintf(stderr, "%s: %s\n", qw_status_name(status), qw_message(context)), abort();
    qw_destroy(context);
    return 0;
}
