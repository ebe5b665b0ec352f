#include "io/elements.h"

#include "base/sort.h"
#include "base/mesh_view.h"
#include "io/number.h"
#include "io/pen.h"

#include <stdio.h>
#include <string.h>

enum { MOST_NODES = 8, MOST_LABELS = 16, MOST_LABEL_NAME = 64, INP_ROW = 12 };

/* Elements with the same labels. */
typedef struct part {
    uint32_t begin, end; /* in order[] */
} part;

/* The sides of a loop, or of all feature curves. */
typedef struct line_set {
    uint32_t begin, end; /* in line[] */
    bool is_boundary;
} line_set;

typedef struct elements {
    qw_env *env;
    qw_file *file;
    qw_pen pen;
    const qw_mesh_view *mesh;
    const uint32_t *face_begin; /* uint32_t[faces + 1] */
    bool second_order;
    uint32_t node_count, count;             /* count: elements of faces */
    const qw_attribute *label[MOST_LABELS]; /* by faces */
    uint32_t labels;
    const uint32_t *order; /* uint32_t[count]: elements, those of a part together */
    part *part;
    uint32_t parts;
    uint32_t (*line)[3]; /* ends, and the node between them or QW_NONE */
    uint32_t lines;
    line_set *set;
    uint32_t sets;
    uint32_t all; /* MSH: the physical group of faces without a label */
} elements;

static void flush(elements *e) { qw_pen_flush(&e->pen, e->file, QW_PEN_FULL); }

/* ---- what there is */

/* The nodes of an element: its corners, then the middles of its sides. */
static uint32_t nodes_of(const elements *e, uint32_t i, uint32_t node[MOST_NODES])
{
    const uint32_t *corner = e->mesh->corners;
    if (!e->second_order) {
        uint32_t n = e->face_begin[i + 1] - e->face_begin[i];
        memcpy(node, corner + e->face_begin[i], n * sizeof *node);
        return n;
    }
    for (uint32_t k = 0; k < 4; k++)
        node[k] = corner[16 * (size_t)i + 4 * k], node[4 + k] = corner[16 * (size_t)i + 4 * k + 1];
    return 8;
}

static uint32_t face_of(const elements *e, uint32_t i) { return e->second_order ? 4 * i : i; }

/* Where the corners of each face begin; fails at a face that is no element. Counts elements, and nodes without the
   middles that second order leaves out. */
static void take_faces(elements *e)
{
    const qw_mesh_view *m = e->mesh;
    uint32_t *begin = QW_NEW(e->env, uint32_t, m->face_count + (size_t)1);
    begin[0] = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        uint32_t n = qw_view_face_size(m, f);
        if (n > 4 || (e->second_order && n != 4))
            qw_fail(e->env, QW_UNSUPPORTED, f, "face %u has %u corners: elements have three or four%s", f, n,
                    e->second_order ? ", of second order four" : "");
        begin[f + 1] = begin[f] + n;
    }
    e->face_begin = begin;
    e->count = e->second_order ? m->face_count / 4 : m->face_count;
    e->node_count = e->second_order ? m->vertex_count - e->count : m->vertex_count;
}

static bool same_labels(const elements *e, uint32_t i, uint32_t j)
{
    for (uint32_t k = 0; k < e->labels; k++)
        if (e->label[k]->labels[face_of(e, i)] != e->label[k]->labels[face_of(e, j)]) return false;
    return true;
}

/* Orders the elements by their labels, so that those of all the same labels follow one another, and lists these
   parts. */
static void take_parts(elements *e, const qw_attribute *attributes, uint32_t count)
{
    qw_attribute by[MOST_LABELS];
    for (uint32_t i = 0; i < count && e->labels < MOST_LABELS; i++)
        if (attributes[i].kind == QW_LABELS && attributes[i].domain == QW_PER_FACE)
            e->label[e->labels++] = &attributes[i];
    for (uint32_t k = 0; k < e->labels; k++) {
        by[k] = *e->label[k];
        if (!e->second_order) continue;
        int32_t *label = QW_NEW(e->env, int32_t, e->count);
        for (uint32_t i = 0; i < e->count; i++) label[i] = by[k].labels[4 * (size_t)i];
        by[k].labels = label, by[k].count = e->count;
    }
    uint32_t *order = qw_order_faces(e->env, e->count, by, e->labels);
    if (!order) {
        order = QW_NEW(e->env, uint32_t, e->count);
        for (uint32_t i = 0; i < e->count; i++) order[i] = i;
    }
    e->order = order, e->part = QW_NEW(e->env, part, (size_t)e->count + 1);
    for (uint32_t i = 0, end; i < e->count; i = end) {
        for (end = i; end < e->count && same_labels(e, order[i], order[end]); end++) continue;
        e->part[e->parts++] = (part){i, end};
    }
}

static void label_name(const qw_attribute *a, int32_t label, char text[MOST_LABEL_NAME])
{
    if (label < 0) snprintf(text, MOST_LABEL_NAME, "none");
    else if (a->label_names) snprintf(text, MOST_LABEL_NAME, "%.60s", a->label_names[label]);
    else snprintf(text, MOST_LABEL_NAME, "%.40s_%d", a->name, label);
    for (char *c = text; *c; c++) /* what all four formats allow in a name */
        if (!((*c >= '0' && *c <= '9') || (*c >= 'A' && *c <= 'Z') || (*c >= 'a' && *c <= 'z') || *c == '-')) *c = '_';
}

/* ---- lines */

/* The first of the keys, which ascend, that is not below the one given. */
static uint32_t find_key(const uint64_t *key, uint32_t count, uint64_t wanted)
{
    uint32_t low = 0, high = count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (key[middle] < wanted) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* The keys of all sides of elements, or of the marked edges, ascending. */
static uint64_t *keys_of_sides(const elements *e, uint32_t *count)
{
    uint32_t node[MOST_NODES], at = 0;
    uint64_t *key = QW_NEW(e->env, uint64_t, 4 * (size_t)e->count);
    for (uint32_t i = 0; i < e->count; i++) {
        uint32_t n = nodes_of(e, i, node), sides = n == 8 ? 4 : n;
        for (uint32_t k = 0; k < sides; k++) key[at++] = qw_pair_key(node[k], node[(k + 1) % sides]);
    }
    qw_sort_u64(key, at);
    *count = at;
    return key;
}

static uint64_t *keys_of_marks(const elements *e)
{
    const uint32_t *mark = e->mesh->marked_edges;
    uint64_t *key = QW_NEW(e->env, uint64_t, e->mesh->marked_edge_count);
    for (uint32_t m = 0; m < e->mesh->marked_edge_count; m++)
        key[m] = qw_pair_key(mark[2 * (size_t)m], mark[2 * (size_t)m + 1]);
    qw_sort_u64(key, e->mesh->marked_edge_count);
    return key;
}

static void put_line(elements *e, uint32_t a, uint32_t b, uint32_t middle)
{
    uint32_t *line = e->line[e->lines++];
    line[0] = a, line[1] = b, line[2] = middle;
}

/* Lists the marked sides, and sets next, uint32_t[vertices][2], at each node where a side of one element begins: the
   node that it ends at and what is between. */
static void sort_sides(elements *e, uint32_t (*next)[2])
{
    uint32_t node[MOST_NODES], all, marks = e->mesh->marked_edge_count;
    uint64_t *key = keys_of_sides(e, &all), *mark = keys_of_marks(e);
    for (uint32_t i = 0; i < e->count; i++) {
        uint32_t n = nodes_of(e, i, node), sides = n == 8 ? 4 : n;
        for (uint32_t k = 0; k < sides; k++) {
            uint32_t a = node[k], b = node[(k + 1) % sides], middle = n == 8 ? node[4 + k] : QW_NONE;
            uint64_t own = qw_pair_key(a, b), marked = n == 8 ? qw_pair_key(a, middle) : own;
            uint32_t at = find_key(key, all, own), m = find_key(mark, marks, marked);
            if (at + 1 == all || key[at + 1] != own) next[a][0] = b, next[a][1] = middle;
            else if (a < b && m < marks && mark[m] == marked) put_line(e, a, b, middle);
        }
    }
    qw_free(e->env, key), qw_free(e->env, mark);
}

/* Creases as elements of lines in one set, and each loop of the boundary in a set of its own. */
static void take_lines(elements *e)
{
    uint32_t(*next)[2] = qw_alloc(e->env, e->mesh->vertex_count, sizeof *next);
    memset(next, 0xff, e->mesh->vertex_count * sizeof *next);
    e->line = qw_alloc(e->env, 4 * (size_t)e->count, sizeof *e->line);
    e->set = QW_NEW(e->env, line_set, 4 * (size_t)e->count + 1);
    sort_sides(e, next);
    if (e->lines > 0) e->set[e->sets++] = (line_set){0, e->lines, false};
    for (uint32_t v = 0; v < e->mesh->vertex_count; v++) {
        uint32_t first = e->lines;
        for (uint32_t a = v; next[a][0] != QW_NONE;) {
            uint32_t b = next[a][0];
            put_line(e, a, b, next[a][1]);
            next[a][0] = QW_NONE, a = b;
        }
        if (e->lines > first) e->set[e->sets++] = (line_set){first, e->lines, true};
    }
    qw_free(e->env, next);
}

static void set_name(const elements *e, uint32_t s, char text[MOST_LABEL_NAME])
{
    uint32_t number = s + 1 - (e->set[0].is_boundary ? 0 : 1);
    if (e->set[s].is_boundary) snprintf(text, MOST_LABEL_NAME, "boundary_%u", number);
    else snprintf(text, MOST_LABEL_NAME, "features");
}

static void put_point(elements *e, uint32_t v, const char *between)
{
    for (int k = 0; k < 3; k++) {
        if (k) qw_pen_text(&e->pen, between);
        qw_pen_number(&e->pen, e->mesh->positions[3 * (size_t)v + (size_t)k]);
    }
}

/* ---- Gmsh */

typedef struct physical {
    uint32_t first_tag; /* of each label attribute's labels */
} physical;

static int32_t most_label(const qw_attribute *a)
{
    int32_t most = -1;
    for (uint32_t f = 0; f < a->count; f++) most = a->labels[f] > most ? a->labels[f] : most;
    return most;
}

/* Physical groups: surfaces 1 .. of all labels, one attribute after the other; curves 1 .. of the line sets. */
static void put_msh_names(elements *e, physical *tags)
{
    uint32_t names = e->sets, tag = 1;
    char text[MOST_LABEL_NAME];
    for (uint32_t k = 0; k < e->labels; k++) tags[k].first_tag = tag, tag += (uint32_t)(most_label(e->label[k]) + 1);
    e->all = tag; /* what has no label */
    names += tag;
    qw_pen_print(&e->pen, "$PhysicalNames\n%u\n", names);
    for (uint32_t s = 0; s < e->sets; s++) set_name(e, s, text), qw_pen_print(&e->pen, "1 %u \"%s\"\n", s + 1, text);
    for (uint32_t k = 0; k < e->labels; k++)
        for (int32_t l = 0; l <= most_label(e->label[k]); l++) {
            label_name(e->label[k], l, text);
            qw_pen_print(&e->pen, "2 %u \"%s\"\n", tags[k].first_tag + (uint32_t)l, text);
        }
    qw_pen_print(&e->pen, "2 %u \"quads\"\n", e->all);
    qw_pen_text(&e->pen, "$EndPhysicalNames\n");
}

/* Writes the surfaces and curves of a Gmsh file, all with the box of the mesh, and what is physical of them. */
static void put_msh_entities(elements *e, const physical *tags)
{
    double low[3] = {0}, high[3] = {0};
    for (uint32_t v = 0; v < e->mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            double x = e->mesh->positions[3 * (size_t)v + (size_t)k];
            if (v == 0 || x < low[k]) low[k] = x;
            if (v == 0 || x > high[k]) high[k] = x;
        }
    qw_pen_print(&e->pen, "$Entities\n0 %u %u 0\n", e->sets, e->parts);
    for (uint32_t i = 0; i < e->sets + e->parts; i++) {
        bool is_curve = i < e->sets;
        qw_pen_print(&e->pen, "%u", is_curve ? i + 1 : i - e->sets + 1);
        for (int k = 0; k < 6; k++) qw_pen_text(&e->pen, " "), qw_pen_number(&e->pen, k < 3 ? low[k] : high[k - 3]);
        if (is_curve) {
            qw_pen_print(&e->pen, " 1 %u 0\n", i + 1);
            continue;
        }
        uint32_t own[MOST_LABELS], count = 0, f = face_of(e, e->order[e->part[i - e->sets].begin]);
        for (uint32_t k = 0; k < e->labels; k++)
            if (e->label[k]->labels[f] >= 0) own[count++] = tags[k].first_tag + (uint32_t)e->label[k]->labels[f];
        if (count == 0) own[count++] = e->all;
        qw_pen_print(&e->pen, " %u", count);
        for (uint32_t k = 0; k < count; k++) qw_pen_print(&e->pen, " %u", own[k]);
        qw_pen_text(&e->pen, " 0\n");
    }
    qw_pen_text(&e->pen, "$EndEntities\n");
}

static void put_msh_nodes(elements *e)
{
    qw_pen_print(&e->pen, "$Nodes\n1 %u 1 %u\n2 1 0 %u\n", e->node_count, e->node_count, e->node_count);
    for (uint32_t v = 0; v < e->node_count; v++) qw_pen_print(&e->pen, "%u\n", v + 1), flush(e);
    for (uint32_t v = 0; v < e->node_count; v++) put_point(e, v, " "), qw_pen_text(&e->pen, "\n"), flush(e);
    qw_pen_text(&e->pen, "$EndNodes\n");
}

/* Blocks of elements are of one type: quads of a part, then its triangles. */
static uint32_t count_in(const elements *e, part p, uint32_t corners)
{
    uint32_t count = 0, node[MOST_NODES];
    for (uint32_t i = p.begin; i < p.end; i++) count += nodes_of(e, e->order[i], node) == corners;
    return count;
}

/* Writes the elements of a Gmsh file in blocks: lines of a set, quads and triangles of a part. */
static void put_msh_elements(elements *e)
{
    uint32_t blocks = e->sets, tag = 1, node[MOST_NODES], most = e->second_order ? 8 : 4;
    for (uint32_t p = 0; p < e->parts; p++)
        blocks += (count_in(e, e->part[p], most) > 0) + (count_in(e, e->part[p], 3) > 0);
    qw_pen_print(&e->pen, "$Elements\n%u %u 1 %u\n", blocks, e->lines + e->count, e->lines + e->count);
    for (uint32_t s = 0; s < e->sets; s++) {
        qw_pen_print(&e->pen, "1 %u %d %u\n", s + 1, e->second_order ? 8 : 1, e->set[s].end - e->set[s].begin);
        for (uint32_t i = e->set[s].begin; i < e->set[s].end; i++) {
            qw_pen_print(&e->pen, "%u %u %u", tag++, e->line[i][0] + 1, e->line[i][1] + 1);
            if (e->second_order) qw_pen_print(&e->pen, " %u", e->line[i][2] + 1);
            qw_pen_text(&e->pen, "\n"), flush(e);
        }
    }
    for (uint32_t p = 0; p < e->parts; p++)
        for (uint32_t corners = most; corners >= 3; corners -= corners - 3 ? corners - 3 : 1) {
            uint32_t count = count_in(e, e->part[p], corners);
            if (count == 0) continue;
            qw_pen_print(&e->pen, "2 %u %d %u\n", p + 1, corners == 8 ? 16 : corners == 4 ? 3 : 2, count);
            for (uint32_t i = e->part[p].begin; i < e->part[p].end; i++) {
                if (nodes_of(e, e->order[i], node) != corners) continue;
                qw_pen_print(&e->pen, "%u", tag++);
                for (uint32_t k = 0; k < corners; k++) qw_pen_print(&e->pen, " %u", node[k] + 1);
                qw_pen_text(&e->pen, "\n"), flush(e);
            }
        }
    qw_pen_text(&e->pen, "$EndElements\n");
}

static void put_msh(elements *e)
{
    physical tags[MOST_LABELS];
    qw_pen_text(&e->pen, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    put_msh_names(e, tags);
    put_msh_entities(e, tags);
    put_msh_nodes(e);
    put_msh_elements(e);
}

/* ---- VTK */

static void open_array(elements *e, const char *type, const char *name)
{
    qw_pen_print(&e->pen, "<DataArray type=\"%s\" Name=\"%.60s\" format=\"ascii\">\n", type, name);
}
static void close_array(elements *e) { qw_pen_text(&e->pen, "</DataArray>\n"); }

/* The cells of a VTU file: nodes, ends and types of elements and lines. */
static void put_vtu_cells(elements *e)
{
    uint32_t node[MOST_NODES], end = 0;
    open_array(e, "Int64", "connectivity");
    for (uint32_t i = 0; i < e->count; i++) {
        uint32_t n = nodes_of(e, i, node);
        for (uint32_t k = 0; k < n; k++) qw_pen_print(&e->pen, "%u ", node[k]);
        qw_pen_text(&e->pen, "\n"), flush(e);
    }
    for (uint32_t i = 0; i < e->lines; i++) {
        qw_pen_print(&e->pen, "%u %u ", e->line[i][0], e->line[i][1]);
        if (e->second_order) qw_pen_print(&e->pen, "%u", e->line[i][2]);
        qw_pen_text(&e->pen, "\n"), flush(e);
    }
    close_array(e), open_array(e, "Int64", "offsets");
    for (uint32_t i = 0; i < e->count; i++) qw_pen_print(&e->pen, "%u\n", end += nodes_of(e, i, node)), flush(e);
    for (uint32_t i = 0; i < e->lines; i++) qw_pen_print(&e->pen, "%u\n", end += e->second_order ? 3 : 2), flush(e);
    close_array(e), open_array(e, "UInt8", "types");
    for (uint32_t i = 0; i < e->count; i++) {
        uint32_t n = nodes_of(e, i, node);
        qw_pen_text(&e->pen, n == 8 ? "23\n" : n == 4 ? "9\n" : "5\n"), flush(e);
    }
    for (uint32_t i = 0; i < e->lines; i++) qw_pen_text(&e->pen, e->second_order ? "21\n" : "3\n"), flush(e);
    close_array(e);
}

/* Writes points, cells and labels as VTK's unstructured grid. */
static void put_vtu(elements *e)
{
    char name[MOST_LABEL_NAME];
    qw_pen_text(&e->pen, "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
                         "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n");
    qw_pen_print(&e->pen, "<Piece NumberOfPoints=\"%u\" NumberOfCells=\"%u\">\n<Points>\n", e->node_count,
                 e->count + e->lines);
    qw_pen_text(&e->pen, "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n");
    for (uint32_t v = 0; v < e->node_count; v++) put_point(e, v, " "), qw_pen_text(&e->pen, "\n"), flush(e);
    close_array(e);
    qw_pen_text(&e->pen, "</Points>\n<Cells>\n");
    put_vtu_cells(e);
    qw_pen_text(&e->pen, "</Cells>\n<CellData>\n");
    for (uint32_t k = 0; k < e->labels; k++) {
        snprintf(name, sizeof name, "%.60s", e->label[k]->name);
        for (char *c = name; *c; c++)
            if (*c == '"' || *c == '<' || *c == '&' || (unsigned char)*c < ' ') *c = '_';
        open_array(e, "Int32", name);
        for (uint32_t i = 0; i < e->count; i++)
            qw_pen_print(&e->pen, "%d\n", e->label[k]->labels[face_of(e, i)]), flush(e);
        for (uint32_t i = 0; i < e->lines; i++) qw_pen_text(&e->pen, "-1\n"), flush(e);
        close_array(e);
    }
    open_array(e, "Int32", "line_set"); /* 0: a face; boundary loops 1, 2, ...; features -1 */
    for (uint32_t i = 0; i < e->count; i++) qw_pen_text(&e->pen, "0\n"), flush(e);
    for (uint32_t s = 0; s < e->sets; s++)
        for (uint32_t i = e->set[s].begin; i < e->set[s].end; i++)
            qw_pen_print(&e->pen, "%d\n", e->set[s].is_boundary ? (int)(s + 1) - !e->set[0].is_boundary : -1);
    close_array(e);
    qw_pen_text(&e->pen, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
}

/* ---- Abaqus */

static void put_inp_number(elements *e, uint32_t number, uint32_t *in_row)
{
    qw_pen_print(&e->pen, *in_row == 0 ? "%u" : *in_row % INP_ROW == 0 ? ",\n%u" : ", %u", number);
    ++*in_row;
    flush(e);
}

/* Writes the sets of elements of an Abaqus file, one a label, in rows of INP_ROW numbers. */
static void put_inp_sets(elements *e)
{
    char name[MOST_LABEL_NAME];
    for (uint32_t k = 0; k < e->labels; k++)
        for (int32_t l = 0; l <= most_label(e->label[k]); l++) {
            uint32_t in_row = 0;
            for (uint32_t i = 0; i < e->count; i++) {
                if (e->label[k]->labels[face_of(e, i)] != l) continue;
                if (in_row == 0) label_name(e->label[k], l, name), qw_pen_print(&e->pen, "*ELSET, ELSET=%s\n", name);
                put_inp_number(e, i + 1, &in_row);
            }
            if (in_row > 0) qw_pen_text(&e->pen, "\n");
        }
    for (uint32_t s = 0; s < e->sets; s++) {
        uint32_t in_row = 0;
        set_name(e, s, name);
        qw_pen_print(&e->pen, "*NSET, NSET=%s\n", name);
        for (uint32_t i = e->set[s].begin; i < e->set[s].end; i++) {
            put_inp_number(e, e->line[i][0] + 1, &in_row);
            if (e->second_order) put_inp_number(e, e->line[i][2] + 1, &in_row);
            bool is_last = !e->set[s].is_boundary || i + 1 == e->set[s].end;
            if (is_last && (!e->set[s].is_boundary || e->line[i][1] != e->line[e->set[s].begin][0]))
                put_inp_number(e, e->line[i][1] + 1, &in_row);
        }
        qw_pen_text(&e->pen, "\n");
    }
}

/* A field holds 20 characters. */
static void put_inp_field(elements *e, double x)
{
    char exact[QW_NUMBER_SIZE], text[32];
    if (qw_number_print(exact, x) <= 20) {
        qw_pen_number(&e->pen, x);
        return;
    }
    snprintf(text, sizeof text, "%.12E", x);
    qw_pen_text(&e->pen, text);
}

/* An Abaqus file: nodes, elements from most corners to fewest, and sets. */
static void put_inp(elements *e)
{
    uint32_t node[MOST_NODES];
    qw_pen_text(&e->pen, "*HEADING\nquads of Quadwright\n*NODE, NSET=NALL\n");
    for (uint32_t v = 0; v < e->node_count; v++) {
        qw_pen_print(&e->pen, "%u", v + 1);
        for (size_t k = 0; k < 3; k++)
            qw_pen_text(&e->pen, ", "), put_inp_field(e, e->mesh->positions[3 * (size_t)v + k]);
        qw_pen_text(&e->pen, "\n"), flush(e);
    }
    for (uint32_t corners = e->second_order ? 8 : 4; corners >= 3; corners -= corners == 8 ? 5 : 1) {
        bool has_begun = false;
        for (uint32_t i = 0; i < e->count; i++) {
            if (nodes_of(e, i, node) != corners) continue;
            if (!has_begun)
                qw_pen_print(&e->pen, "*ELEMENT, TYPE=S%u%s, ELSET=EALL\n", corners, corners == 8 ? "R" : "");
            has_begun = true;
            qw_pen_print(&e->pen, "%u", i + 1);
            for (uint32_t k = 0; k < corners; k++) qw_pen_print(&e->pen, ", %u", node[k] + 1);
            qw_pen_text(&e->pen, "\n"), flush(e);
        }
    }
    put_inp_sets(e);
}

/* ---- Nastran */

/* A number of 16 columns. */
static void put_wide(elements *e, double x)
{
    char text[32];
    snprintf(text, sizeof text, "%16.9E", x + 0.0);
    qw_pen_text(&e->pen, text);
}

static void put_bdf_element(elements *e, uint32_t i, uint32_t property)
{
    uint32_t node[MOST_NODES], n = nodes_of(e, i, node);
    qw_pen_print(&e->pen, "%s%8u%8u", n == 8 ? "CQUAD8  " : n == 4 ? "CQUAD4  " : "CTRIA3  ", i + 1, property);
    for (uint32_t k = 0; k < n; k++) qw_pen_print(&e->pen, k == 6 ? "\n        %8u" : "%8u", node[k] + 1);
    qw_pen_text(&e->pen, "\n"), flush(e);
}

/* Properties 1, 2, ... are the parts; what their labels are stands in comments before them. */
static void put_bdf(elements *e)
{
    char name[MOST_LABEL_NAME];
    qw_pen_text(&e->pen, "$ quads of Quadwright\nBEGIN BULK\n");
    for (uint32_t v = 0; v < e->node_count; v++) {
        const double *p = e->mesh->positions + 3 * (size_t)v;
        qw_pen_print(&e->pen, "GRID*   %16u%16s", v + 1, "");
        put_wide(e, p[0]), put_wide(e, p[1]);
        qw_pen_text(&e->pen, "\n*       "), put_wide(e, p[2]), qw_pen_text(&e->pen, "\n"), flush(e);
    }
    for (uint32_t p = 0; p < e->parts; p++) {
        qw_pen_print(&e->pen, "$ property %u", p + 1);
        for (uint32_t k = 0; k < e->labels; k++) {
            label_name(e->label[k], e->label[k]->labels[face_of(e, e->order[e->part[p].begin])], name);
            qw_pen_print(&e->pen, ", %.40s %s", e->label[k]->name, name);
        }
        qw_pen_text(&e->pen, "\n");
        for (uint32_t i = e->part[p].begin; i < e->part[p].end; i++) put_bdf_element(e, e->order[i], p + 1);
    }
    for (uint32_t s = 0, tag = e->count + 1; s < e->sets; s++) {
        set_name(e, s, name);
        qw_pen_print(&e->pen, "$ %s: elements %u to %u\n", name, tag, tag + e->set[s].end - e->set[s].begin - 1);
        for (uint32_t i = e->set[s].begin; i < e->set[s].end; i++)
            qw_pen_print(&e->pen, "PLOTEL  %8u%8u%8u\n", tag++, e->line[i][0] + 1, e->line[i][1] + 1), flush(e);
    }
    qw_pen_text(&e->pen, "ENDDATA\n");
}

void qw_put_elements(qw_env *env, qw_file *file, qw_format format, const qw_mesh_view *mesh,
                     const qw_attribute *attributes, uint32_t count, bool second_order)
{
    elements e = {.env = env, .file = file, .pen = {.env = env}, .mesh = mesh, .second_order = second_order};
    take_faces(&e);
    take_parts(&e, attributes, count);
    take_lines(&e);
    if (format == QW_FORMAT_MSH) put_msh(&e);
    if (format == QW_FORMAT_VTU) put_vtu(&e);
    if (format == QW_FORMAT_INP) put_inp(&e);
    if (format == QW_FORMAT_BDF) put_bdf(&e);
    qw_pen_flush(&e.pen, e.file, 1);
}
