/* Steering: a part of a mesh is remeshed alone and comes back joined to the rest, which stays as it was; density and a
 * guide say how. */
#include <quadwright/quadwright.h>

#include <math.h>
#include <stdio.h>

/* A torus of 48 x 24 cells, two triangles each. */
enum { LONG_WAY = 48, SHORT_WAY = 24 };
static double positions[LONG_WAY * SHORT_WAY][3];
static uint32_t corners[2 * LONG_WAY * SHORT_WAY][3];

static qw_mesh_view make_torus(void)
{
    const double turn = 6.283185307179586;
    uint32_t t = 0;
    for (uint32_t i = 0; i < LONG_WAY; i++)
        for (uint32_t j = 0; j < SHORT_WAY; j++) {
            double u = turn * i / LONG_WAY, v = turn * j / SHORT_WAY, r = 1 + 0.4 * cos(v);
            double *p = positions[i * SHORT_WAY + j];
            p[0] = r * cos(u), p[1] = r * sin(u), p[2] = 0.4 * sin(v);
            uint32_t i1 = (i + 1) % LONG_WAY, j1 = (j + 1) % SHORT_WAY;
            uint32_t a = i * SHORT_WAY + j, b = i1 * SHORT_WAY + j, c = i1 * SHORT_WAY + j1, d = i * SHORT_WAY + j1;
            corners[t][0] = a, corners[t][1] = b, corners[t++][2] = c;
            corners[t][0] = a, corners[t][1] = c, corners[t++][2] = d;
        }
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = LONG_WAY * SHORT_WAY,
                          .face_count = t,
                          .uniform_face_size = 3,
                          .positions = positions[0],
                          .corners = corners[0]};
}

/* The faces that are to be remeshed, and where quads are to be half as large. */
static uint8_t inside[2 * LONG_WAY * SHORT_WAY];
static float density[LONG_WAY * SHORT_WAY];

static void choose(const qw_mesh_view *torus)
{
    for (uint32_t f = 0; f < torus->face_count; f++) inside[f] = positions[corners[f][0]][0] > 0.5;
    for (uint32_t v = 0; v < torus->vertex_count; v++) density[v] = positions[v][1] > 0 ? 2 : 1;
}

static int run(qw_context *context)
{
    qw_mesh_view torus = make_torus(), whole;
    qw_options options;
    double line[24][3]; /* along the outside of the torus */
    for (int i = 0; i < 24; i++) {
        double u = 0.5 * (i / 23.0 - 0.5);
        line[i][0] = 1.4 * cos(u), line[i][1] = 1.4 * sin(u), line[i][2] = 0;
    }
    qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 0, 24, line[0], 0};
    choose(&torus);
    qw_options_init(&options);
    options.faces = 300; /* of the region */
    if (qw_set_mesh(context, &torus) != QW_OK || qw_set_region(context, inside, torus.face_count) != QW_OK ||
        qw_set_density(context, density, torus.vertex_count) != QW_OK || qw_set_guides(context, &guide, 1) != QW_OK ||
        qw_run(context, &options) != QW_OK || qw_get_mesh(context, &whole) != QW_OK)
        return 1;
    const qw_report *report = qw_get_report(context);
    printf("%lld quads beside %lld triangles that stayed, on %u vertices; %lld boundary edges\n",
           (long long)report->topology.quads, (long long)report->kept_faces, whole.vertex_count,
           (long long)report->topology.boundary_edges);
    printf("%lld vertices are shared by both; the guide is %.2f edges from edges of quads at the most\n",
           (long long)report->rim_vertices, report->guide_off);
    return 0;
}

int main(void)
{
    qw_context *context;
    if (qw_create(NULL, &context) != QW_OK) return 1;
    int failed = run(context);
    if (failed) fprintf(stderr, "%s\n", qw_message(context));
    qw_destroy(context);
    return failed;
}
