/* STL: triangles that share no vertices, as text or binary.
 *
 *     text    solid NAME / facet normal x y z / outer loop / vertex x y z (three times) / endloop / endfacet / ... /
 * endsolid NAME binary  80 bytes, uint32 count, then for each triangle 12 floats (normal, three corners) and 2 bytes;
 * little-endian
 *
 * Binary files may begin with "solid" too, so their exact length is asked for first. Normals are not looked at: many
 * are wrong.
 */
#include "base/mesh_view.h"
#include "io/build.h"
#include "io/fetch.h"
#include "io/formats.h"
#include "io/text.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <string.h>

enum {
    HEADER_SIZE = 84,
    TRIANGLE_SIZE = 50,
    BYTES_A_FACET = 200 /* of text, as a guess */
};

/* ---- binary */

static uint64_t announced_triangles(qw_bytes bytes)
{
    return bytes.size < HEADER_SIZE ? 0 : qw_fetch_bits(bytes.at + 80, 4, false);
}

/* Programs that write as they go leave the count at nothing, or at all ones: it follows from the size. */
static bool leaves_count_open(qw_bytes bytes)
{
    uint64_t announced = announced_triangles(bytes);
    return announced == 0 || announced == UINT32_MAX;
}

bool qw_is_stl_binary(qw_bytes bytes)
{
    return bytes.size >= HEADER_SIZE && bytes.size - HEADER_SIZE == TRIANGLE_SIZE * announced_triangles(bytes);
}

bool qw_is_stl_binary_bent(qw_bytes bytes)
{
    if (bytes.size < HEADER_SIZE + TRIANGLE_SIZE || !memchr(bytes.at, 0, HEADER_SIZE + TRIANGLE_SIZE)) return false;
    double v[12];
    for (int i = 0; i < 12; i++) v[i] = qw_fetch_float(bytes.at + HEADER_SIZE + 4 * i, false);
    for (int i = 0; i < 12; i++)
        if (!(fabs(v[i]) < 1e30) || (v[i] != 0 && fabs(v[i]) < 1e-30))
            return false; /* what text and small integers look like */
    double length = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    return length == 0 || fabs(length - 1) < 1e-3;
}

qw_soup qw_read_stl_binary(qw_env *env, const char *name, qw_bytes bytes)
{
    uint64_t count = announced_triangles(bytes), held = (bytes.size - HEADER_SIZE) / TRIANGLE_SIZE;
    if (held > 0 && leaves_count_open(bytes)) {
        qw_log(env, QW_LOG_WARNING,
               "%s: the header announces %" PRIu64 " triangles; the %" PRIu64 " that follow are read", name, count,
               held);
        count = held;
    }
    qw_build_check_count(env, name, 3 * count, "corners of triangles");
    if (held < count)
        qw_fail(env, QW_FORMAT_TRUNCATED, -1,
                "%s, byte %zu: the file ends in triangle %" PRIu64 " of the %" PRIu64 " that its header announces",
                name, bytes.size, held, count);
    qw_builder b = qw_build_begin(env, name, 3 * (size_t)count, (size_t)count, 3 * (size_t)count);
    b.soup.separate_corners = true;
    const char *at = bytes.at + HEADER_SIZE;
    for (uint64_t f = 0; f < count; f++, at += TRIANGLE_SIZE) {
        for (int i = 0; i < 3; i++) {
            double p[3];
            for (int k = 0; k < 3; k++) p[k] = qw_fetch_float(at + 12 + 12 * i + 4 * k, false);
            if (!qw_is_finite3(p))
                qw_fail(env, QW_NOT_FINITE, (int64_t)f,
                        "%s, byte %zu: triangle %" PRIu64 " has a coordinate that is NaN or infinite", name,
                        (size_t)(at - bytes.at) + 12 + 12 * (size_t)i, f);
            qw_build_vertex(&b, p);
            qw_build_corner(&b, b.soup.vertex_count - 1);
        }
        qw_build_face(&b);
    }
    size_t read = (size_t)(at - bytes.at);
    if (read < bytes.size) qw_build_warn_rest(&b, bytes.size - read);
    return qw_build_finish(&b);
}

/* ---- text */

/* Words go on over lines here: programs break them as they like. */
static qw_word next_word(qw_text *t)
{
    qw_text_find_line(t);
    return qw_text_word(t);
}

static void expect(qw_text *t, const char *wanted)
{
    qw_text_find_line(t);
    qw_text before = *t;
    if (!qw_word_is_caseless(qw_text_word(t), wanted)) qw_text_expected(&before, wanted);
}

/* Returns false at endloop. */
static bool read_corner(qw_text *t, qw_builder *b, int64_t facet)
{
    qw_text_find_line(t);
    qw_text before = *t;
    qw_word word = qw_text_word(t);
    if (qw_word_is_caseless(word, "endloop")) return false;
    if (!qw_word_is_caseless(word, "vertex")) qw_text_expected(&before, "vertex or endloop");
    double p[3];
    for (int i = 0; i < 3; i++) {
        qw_text_find_line(t);
        p[i] = qw_text_number(t, "a coordinate");
    }
    if (!qw_is_finite3(p))
        qw_text_fail(t, QW_NOT_FINITE, facet, "facet %" PRId64 " has a coordinate that is NaN or infinite", facet);
    qw_build_vertex(b, p);
    qw_build_corner(b, b->soup.vertex_count - 1);
    return true;
}

/* After the word facet. */
static void read_facet(qw_text *t, qw_builder *b, int64_t facet)
{
    expect(t, "normal");
    for (int i = 0; i < 3; i++)
        if (next_word(t).size == 0)
            qw_text_expected(t, "a normal"); /* any words: some programs print "-nan" or worse */
    expect(t, "outer");
    expect(t, "loop");
    while (read_corner(t, b, facet)) {}
    expect(t, "endfacet");
    qw_build_face(b);
}

qw_soup qw_read_stl_text(qw_env *env, const char *name, qw_bytes bytes)
{
    qw_text t = qw_text_open(env, name, bytes, 0);
    size_t facets = bytes.size / BYTES_A_FACET;
    qw_builder b = qw_build_begin(env, name, 3 * facets, facets, 3 * facets);
    b.soup.separate_corners = true;
    bool in_solid = false;
    int64_t facet = 0;
    while (qw_text_find_line(&t)) {
        qw_text before = t;
        qw_word word = qw_text_word(&t);
        if (in_solid && qw_word_is_caseless(word, "facet")) {
            read_facet(&t, &b, facet++);
        } else if (qw_word_is_caseless(word, in_solid ? "endsolid" : "solid")) {
            qw_text_next_line(&t); /* the rest is a name */
            in_solid = !in_solid;
        } else {
            qw_text_expected(&before, in_solid ? "facet or endsolid" : "solid");
        }
    }
    if (in_solid) qw_text_expected(&t, "facet or endsolid");
    return qw_build_finish(&b);
}

bool qw_is_stl_text(qw_env *env, qw_bytes bytes)
{
    qw_text t = qw_text_open(env, "", bytes, 0);
    return qw_text_find_line(&t) && qw_word_is_caseless(qw_text_word(&t), "solid");
}

/* ---- writing */

static double squared_distance(const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < 3; i++) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
}

/* A binary facet: normal and three corners in single precision. */
static void put_facet(qw_file *file, const double *const p[3])
{
    double u[3], v[3], value[12];
    for (int i = 0; i < 3; i++) u[i] = p[1][i] - p[0][i], v[i] = p[2][i] - p[0][i];
    for (int i = 0; i < 3; i++) value[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    double length = sqrt(value[0] * value[0] + value[1] * value[1] + value[2] * value[2]);
    for (int i = 0; i < 3; i++) value[i] = length > 0 ? value[i] / length : 0;
    for (int i = 0; i < 9; i++) value[3 + i] = p[i / 3][i % 3];
    char bytes[TRIANGLE_SIZE] = {0};
    for (int i = 0; i < 12; i++) {
        float number = (float)value[i];
        uint32_t bits;
        memcpy(&bits, &number, sizeof bits);
        for (int k = 0; k < 4; k++) bytes[4 * i + k] = (char)(bits >> 8 * k);
    }
    qw_file_put(file, bytes, sizeof bytes);
}

/* Whether a facet in single precision is no longer what it was: corners move by more than a share of its shortest side,
   or lie beyond. */
static bool is_lost(const double *const p[3])
{
    static const double MOST = 0.25;
    double moved = 0, side = INFINITY;
    for (int i = 0; i < 3; i++) {
        side = fmin(side, squared_distance(p[i], p[(i + 1) % 3]));
        for (int k = 0; k < 3; k++) moved = fmax(moved, fabs(p[i][k] - (double)(float)p[i][k]));
    }
    return moved > (double)FLT_MAX || (side > 0 && moved * moved > MOST * MOST * side);
}

void qw_put_stl(qw_env *env, qw_file *file, const qw_mesh_view *mesh)
{
    char header[HEADER_SIZE] = "quads of Quadwright, each in two";
    uint64_t triangles = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) triangles += qw_view_face_size(mesh, f) - 2;
    if (triangles > UINT32_MAX) qw_fail(env, QW_UNSUPPORTED, -1, "STL holds at most 4294967295 triangles");
    for (int k = 0; k < 4; k++) header[HEADER_SIZE - 4 + k] = (char)(triangles >> 8 * k);
    qw_file_put(file, header, sizeof header);
    const uint32_t *corner = mesh->corners;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t size = qw_view_face_size(mesh, f), first = 0;
        const double *at[4];
        for (uint32_t i = 0; i < size && i < 4; i++) at[i] = mesh->positions + 3 * (size_t)corner[i];
        if (size == 4 && squared_distance(at[1], at[3]) < squared_distance(at[0], at[2])) first = 1;
        for (uint32_t i = 1; i + 1 < size; i++) {
            const double *p[3];
            const uint32_t index[3] = {first, (first + i) % size, (first + i + 1) % size};
            for (int k = 0; k < 3; k++) p[k] = mesh->positions + 3 * (size_t)corner[index[k]];
            if (is_lost(p))
                qw_fail(env, QW_UNSUPPORTED, f,
                        "STL has single precision, which does not tell the corners of face %u apart where they lie: "
                        "write PLY or OBJ",
                        f);
            put_facet(file, p);
        }
        corner += size;
    }
}
