#include "io/obj_attributes.h"

#include "io/number.h"

#include <math.h>

static const size_t width[2] = {2, 3};

/* Reads up to `most` numbers; what follows is left. */
static size_t read_numbers(qw_text *t, double *value, size_t most)
{
    size_t count = 0;
    while (count < most && !qw_text_line_ends(t) && qw_number_read(&t->at, &value[count])) count++;
    return count;
}

static bool are_finite(const double *value, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite((float)value[i])) return false;
    return true;
}

void qw_obj_take_row(qw_obj_extras *x, qw_text *t, int which)
{
    double value[3] = {0, 0, 0};
    size_t n = width[which], count = read_numbers(t, value, n);
    if (count == 0 || !are_finite(value, n)) x->is_broken[which] = true;
    x->row[which] = qw_grow(x->env, x->row[which], &x->row_capacity[which], x->rows[which] + 1, n * sizeof(float));
    for (size_t i = 0; i < n; i++) x->row[which][n * x->rows[which] + i] = (float)value[i];
    x->rows[which]++;
}

void qw_obj_take_colour(qw_obj_extras *x, qw_text *t, uint32_t vertex)
{
    double value[4];
    size_t count = read_numbers(t, value, 4);
    const double *rgb = count == 4 ? value + 1 : value; /* x y z w r g b */
    if (count < 3 || !are_finite(rgb, 3) || (x->colours == 0 && vertex != 0)) return;
    x->colour = qw_grow(x->env, x->colour, &x->colour_capacity, vertex + (size_t)1, 3 * sizeof(float));
    for (; x->colours < vertex; x->colours++) /* without one: white */
        for (size_t i = 0; i < 3; i++) x->colour[3 * x->colours + i] = 1;
    for (size_t i = 0; i < 3; i++) x->colour[3 * (size_t)vertex + i] = (float)rgb[i];
    x->colours = vertex + (size_t)1;
}

void qw_obj_take_corner(qw_obj_extras *x, uint32_t corner, const int64_t more[2])
{
    x->corner = qw_grow(x->env, x->corner, &x->corner_capacity, corner + (size_t)1, 2 * sizeof *x->corner);
    for (; x->corners < corner; x->corners++) x->corner[2 * x->corners] = x->corner[2 * x->corners + 1] = QW_NONE;
    for (int i = 0; i < 2; i++) {
        int64_t row = more[i] > 0 ? more[i] - 1 : (int64_t)x->rows[i] + more[i];
        if (more[i] && (row < 0 || row >= QW_NONE)) x->is_broken[i] = true;
        x->corner[2 * (size_t)corner + (size_t)i] = more[i] && !x->is_broken[i] ? (uint32_t)row : QW_NONE;
    }
    if (x->corners <= corner) x->corners = corner + (size_t)1;
}

void qw_obj_take_library(qw_obj_extras *x, qw_word name)
{
    const char *end = memchr(name.at, 0, name.size);
    size_t size = end ? (size_t)(end - name.at) : name.size, gap = x->library_size ? 1 : 0;
    if (size == 0) return;
    x->library = qw_grow(x->env, x->library, &x->library_capacity, x->library_size + gap + size + 1, 1);
    if (gap) x->library[x->library_size++] = '\n';
    memcpy(x->library + x->library_size, name.at, size);
    x->library_size += size;
    x->library[x->library_size] = 0;
}

/* The values that corners name by row; none are kept where a row is missing. */
static void finish_rows(qw_obj_extras *x, qw_soup *soup, int which)
{
    size_t corners = soup->face_begin[soup->face_count], n = width[which], named = 0;
    for (size_t c = 0; c < x->corners && c < corners; c++) {
        uint32_t row = x->corner[2 * c + (size_t)which];
        named += row != QW_NONE;
        if (row != QW_NONE && row >= x->rows[which]) x->is_broken[which] = true;
    }
    if (x->is_broken[which] && (named || x->rows[which]))
        qw_log(x->env, QW_LOG_INFO, "%s are left out: some are no numbers, or corners name some that are not there",
               which ? "normals" : "texture coordinates");
    if (named == 0 || x->is_broken[which]) return;
    qw_attribute *a = qw_build_attribute(x->env, soup, which ? "normal" : "uv", QW_PER_CORNER,
                                         which ? QW_NORMALS : QW_UVS, (uint32_t)n);
    float *value = QW_NEW_ZERO(x->env, float, n *corners);
    for (size_t c = 0; c < x->corners && c < corners; c++) {
        uint32_t row = x->corner[2 * c + (size_t)which];
        if (row != QW_NONE) memcpy(value + n * c, x->row[which] + n * row, n * sizeof *value);
    }
    a->values = value;
}

void qw_obj_finish(qw_obj_extras *x, qw_soup *soup, bool is_counted_on)
{
    if (is_counted_on) x->is_broken[0] = x->is_broken[1] = true;
    for (int which = 0; which < 2 && x->corner; which++) finish_rows(x, soup, which);
    for (int which = 0; which < 2; which++) qw_free(x->env, x->row[which]);
    qw_free(x->env, x->corner);
    if (x->colours > 0) {
        x->colour = qw_resize(x->env, x->colour, soup->vertex_count, 3 * sizeof(float));
        for (size_t i = 3 * x->colours; i < 3 * (size_t)soup->vertex_count; i++) x->colour[i] = 1;
        qw_attribute *a = qw_build_attribute(x->env, soup, "color", QW_PER_VERTEX, QW_VALUES, 3);
        a->values = x->colour;
    }
    soup->library = x->library;
}
