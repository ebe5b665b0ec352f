/* Attributes: a cylinder whose texture wraps around once, coloured from end to end, to quads that have both. Checks
 * that no quad reaches across the seam. */
#include <math.h>
#include <quadwright/quadwright.h>
#include <stdio.h>

enum { ROUND = 48, UP = 24 };

static double positions[ROUND * (UP + 1)][3];
static uint32_t corners[ROUND * UP][4];
static float colours[ROUND * (UP + 1)][3], uvs[ROUND * UP][4][2];

static void make_cylinder(void)
{
    for (int j = 0; j <= UP; j++)
        for (int i = 0; i < ROUND; i++) {
            double a = 6.283185307179586 * i / ROUND, *p = positions[j * ROUND + i];
            p[0] = cos(a), p[1] = sin(a), p[2] = 4.0 * j / UP;
            colours[j * ROUND + i][0] = (float)j / UP, colours[j * ROUND + i][2] = 1 - (float)j / UP;
        }
    for (int j = 0; j < UP; j++)
        for (int i = 0; i < ROUND; i++)
            for (int k = 0; k < 4; k++) {
                int x = i + (k == 1 || k == 2), y = j + (k > 1);
                corners[j * ROUND + i][k] = (uint32_t)(y * ROUND + x % ROUND);
                uvs[j * ROUND + i][k][0] = (float)x / ROUND, uvs[j * ROUND + i][k][1] = (float)y / UP;
            }
}

int main(void)
{
    make_cylinder();
    qw_mesh_view cylinder = {.size = sizeof cylinder,
                             .vertex_count = ROUND * (UP + 1),
                             .face_count = ROUND * UP,
                             .uniform_face_size = 4,
                             .positions = positions[0],
                             .corners = corners[0]};
    qw_attribute attributes[2] = {
        {.size = sizeof *attributes, .name = "color", .domain = QW_PER_VERTEX, .kind = QW_VALUES, .components = 3},
        {.size = sizeof *attributes, .name = "uv", .domain = QW_PER_CORNER, .kind = QW_UVS, .components = 2}};
    attributes[0].count = ROUND * (UP + 1), attributes[0].values = colours[0];
    attributes[1].count = ROUND * UP * 4, attributes[1].values = uvs[0][0];

    qw_options options;
    qw_options_init(&options);
    options.faces = 300;
    qw_result *result;
    const qw_attribute *carried;
    qw_transfer_report report;
    qw_status status = qw_remesh(&cylinder, &options, NULL, &result);
    if (status == QW_OK) status = qw_result_transfer(result, attributes, 2, 0, &carried, &report);
    if (status != QW_OK) {
        fprintf(stderr, "%s\n", qw_result_message(result));
        qw_result_destroy(result);
        return 1;
    }
    float widest = 0;
    for (uint32_t c = 0; c < carried[1].count; c++) {
        uint32_t next = c % 4 == 3 ? c - 3 : c + 1;
        widest = fmaxf(widest, fabsf(carried[1].values[2 * c] - carried[1].values[2 * next]));
    }
    printf("%u quads, %u at the seam; a quad is %.2f of the texture wide at the most\n",
           qw_result_mesh(result).face_count, report.straddling_quads, (double)widest);
    qw_result_destroy(result);
    return widest > 0.2f;
}
