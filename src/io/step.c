#include "io/step.h"

#include "base/sort.h"
#include "base/vec.h"
#include "io/number.h"
#include "io/pen.h"

#include <math.h>
#include <string.h>

enum { CONTEXT = 15, FIRST = 20 };

typedef struct step {
    qw_env *env;
    qw_file *file;
    qw_pen pen;
    const qw_patches *p;
    uint32_t next;                    /* number of the next entity */
    uint32_t points, vertices, edges; /* numbers of the first of each */
    uint32_t *face;                   /* uint32_t[blocks, or quads]: numbers; 0: part of another's */
    uint32_t *bound;                  /* uint32_t[loops of faces] */
    uint32_t *item;                   /* uint32_t[shells]: solids and surface models */
} step;

static void flush(step *s) { qw_pen_flush(&s->pen, s->file, QW_PEN_FULL); }

/* STEP wants a point in every real number. */
static void put_real(step *s, double x)
{
    size_t from = s->pen.size;
    qw_pen_number(&s->pen, x + 0.0);
    bool has_point = false;
    for (size_t i = from; i < s->pen.size; i++) {
        has_point |= s->pen.at[i] == '.';
        if (s->pen.at[i] != 'e') continue;
        s->pen.at[i] = 'E';
        if (has_point) return;
        size_t tail = s->pen.size - i;
        qw_pen_text(&s->pen, ".");
        memmove(s->pen.at + i + 1, s->pen.at + i, tail);
        s->pen.at[i] = '.';
        return;
    }
    if (!has_point) qw_pen_text(&s->pen, ".");
}

/* The header of a STEP file, its product, units in millimetres, and its tolerance. */
static void put_head(step *s)
{
    qw_pen_text(&s->pen, "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('limit surface of quads'),'2;1');\n"
                         "FILE_NAME('','',(''),(''),'Quadwright','Quadwright','');\n"
                         "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
                         "#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');\n"
                         "#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);\n"
                         "#3=PRODUCT_CONTEXT('',#1,'mechanical');\n#4=PRODUCT('quads','quads','',(#3));\n"
                         "#5=PRODUCT_DEFINITION_FORMATION('','',#4);\n");
    qw_pen_text(&s->pen, "#6=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');\n"
                         "#7=PRODUCT_DEFINITION('design','',#5,#6);\n#8=PRODUCT_DEFINITION_SHAPE('','',#7);\n"
                         "#9=SHAPE_DEFINITION_REPRESENTATION(#8,#10);\n#11=AXIS2_PLACEMENT_3D('',#12,#13,#14);\n"
                         "#12=CARTESIAN_POINT('',(0.,0.,0.));\n#13=DIRECTION('',(0.,0.,1.));\n"
                         "#14=DIRECTION('',(1.,0.,0.));\n");
    qw_pen_text(&s->pen, "#15=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#19))"
                         "GLOBAL_UNIT_ASSIGNED_CONTEXT((#16,#17,#18))REPRESENTATION_CONTEXT('',''));\n"
                         "#16=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n"
                         "#17=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n"
                         "#18=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());\n");
    qw_pen_text(&s->pen, "#19=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(");
    put_real(s, s->p->tolerance);
    qw_pen_text(&s->pen, "),#16,'distance_accuracy_value','');\n");
    s->next = FIRST;
}

static void put_triple(step *s, const char *what, const double x[3])
{
    qw_pen_print(&s->pen, "#%u=%s('',(", s->next++, what);
    for (int k = 0; k < 3; k++) {
        if (k) qw_pen_text(&s->pen, ",");
        put_real(s, x[k]);
    }
    qw_pen_text(&s->pen, "));\n");
}

static void put_points(step *s)
{
    s->points = s->next;
    for (uint32_t i = 0; i < s->p->point_count; i++, flush(s))
        put_triple(s, "CARTESIAN_POINT", s->p->point + 3 * (size_t)i);
    s->vertices = s->next;
    for (uint32_t v = 0; v < s->p->vertex_count; v++, flush(s))
        qw_pen_print(&s->pen, "#%u=VERTEX_POINT('',#%u);\n", s->next++, s->points + v);
}

/* The edges of single patches: cubic curves, then the edges on them. */
static void put_edges(step *s)
{
    uint32_t curves = s->next;
    for (uint32_t e = 0; e < s->p->edge_count; e++, flush(s)) {
        const uint32_t *c = s->p->edge[e];
        qw_pen_print(&s->pen,
                     "#%u=B_SPLINE_CURVE_WITH_KNOTS('',3,(#%u,#%u,#%u,#%u),.UNSPECIFIED.,.F.,.F.,(4,4),(0.,1.),"
                     ".UNSPECIFIED.);\n",
                     s->next++, s->points + c[0], s->points + c[1], s->points + c[2], s->points + c[3]);
    }
    s->edges = s->next;
    for (uint32_t e = 0; e < s->p->edge_count; e++, flush(s))
        qw_pen_print(&s->pen, "#%u=EDGE_CURVE('',#%u,#%u,#%u,.T.);\n", s->next++, s->vertices + s->p->edge[e][0],
                     s->vertices + s->p->edge[e][3], curves + e);
}

/* ---- blocks */

/* Multiplicities and knots of `count` cubics that meet with one tangent. */
static void put_knots(step *s, uint32_t count)
{
    for (uint32_t k = 0; k <= count; k++) qw_pen_print(&s->pen, "%s%d", k ? "," : "(", k == 0 || k == count ? 4 : 2);
    qw_pen_text(&s->pen, ")");
}

static void put_knot_values(step *s, uint32_t count)
{
    for (uint32_t k = 0; k <= count; k++) qw_pen_print(&s->pen, "%s%u.", k ? "," : "(", k);
    qw_pen_text(&s->pen, ")");
}

static void put_references(step *s, const uint32_t *point, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++, flush(s)) qw_pen_print(&s->pen, "%s#%u", i ? "," : "(", s->points + point[i]);
    qw_pen_text(&s->pen, ")");
}

/* An axis through a point, and any direction across it; the last entity is the placement. */
static void put_placement(step *s, const double point[3], const double axis[3])
{
    int least = fabs(axis[0]) < fabs(axis[1]) ? 0 : 1;
    if (fabs(axis[2]) < fabs(axis[least])) least = 2;
    double x[3];
    for (int k = 0; k < 3; k++) x[k] = ((k == least) - axis[least] * axis[k]) / sqrt(1 - axis[least] * axis[least]);
    put_triple(s, "CARTESIAN_POINT", point), put_triple(s, "DIRECTION", axis), put_triple(s, "DIRECTION", x);
    qw_pen_print(&s->pen, "#%u=AXIS2_PLACEMENT_3D('',#%u,#%u,#%u);\n", s->next, s->next - 3, s->next - 2, s->next - 1);
    s->next++;
}

/* The circle that edge e is an arc of, from its first point to its last. */
static void put_circle(step *s, uint32_t e, const qw_patch_surface *about)
{
    const qw_patch_blocks *b = s->p->blocks;
    double middle[3], axis[3], from[3], turn = 0;
    const double *a = s->p->point + 3 * (size_t)b->edge_point[b->edge_first[e]];
    for (int k = 0; k < 3; k++) from[k] = a[k] - about->point[k];
    double along = qw_dot_doubles(from, about->axis);
    for (int k = 0; k < 3; k++) middle[k] = about->point[k] + along * about->axis[k], from[k] = a[k] - middle[k];
    for (uint32_t i = b->edge_first[e] + 1; i < b->edge_first[e + 1]; i++) {
        double to[3], cross[3], last[3];
        for (int k = 0; k < 3; k++) {
            to[k] = s->p->point[3 * (size_t)b->edge_point[i] + (size_t)k] - middle[k];
            last[k] = s->p->point[3 * (size_t)b->edge_point[i - 1] + (size_t)k] - middle[k];
        }
        qw_cross_doubles(last, to, cross);
        turn += qw_dot_doubles(cross, about->axis);
    }
    for (int k = 0; k < 3; k++) axis[k] = turn < 0 ? -about->axis[k] : about->axis[k];
    put_placement(s, middle, axis);
    qw_pen_print(&s->pen, "#%u=CIRCLE('',#%u,", s->next, s->next - 1);
    put_real(s, sqrt(qw_dot_doubles(from, from)));
    qw_pen_text(&s->pen, ");\n");
    s->next++;
}

/* The edges of blocks: circles where they are arcs, else splines; then the edges on them. */
static void put_long_edges(step *s)
{
    const qw_patch_blocks *b = s->p->blocks;
    const qw_patch_faces *o = s->p->faces;
    uint32_t *curve = QW_NEW(s->env, uint32_t, b->edge_count);
    for (uint32_t e = 0; e < b->edge_count; curve[e++] = s->next - 1, flush(s)) {
        uint32_t first = b->edge_first[e], count = b->edge_first[e + 1] - first;
        if (o && o->arc[e] != QW_NONE) {
            put_circle(s, e, &o->surface[o->arc[e]]);
            continue;
        }
        qw_pen_print(&s->pen, "#%u=B_SPLINE_CURVE_WITH_KNOTS('',3,", s->next++);
        put_references(s, b->edge_point + first, count);
        qw_pen_text(&s->pen, ",.UNSPECIFIED.,.F.,.F.,");
        put_knots(s, count / 2 - 1), qw_pen_text(&s->pen, ","), put_knot_values(s, count / 2 - 1);
        qw_pen_text(&s->pen, ",.UNSPECIFIED.);\n");
    }
    s->edges = s->next;
    for (uint32_t e = 0; e < b->edge_count; e++, flush(s))
        qw_pen_print(&s->pen, "#%u=EDGE_CURVE('',#%u,#%u,#%u,.T.);\n", s->next++,
                     s->vertices + b->edge_point[b->edge_first[e]],
                     s->vertices + b->edge_point[b->edge_first[e + 1] - 1], curve[e]);
}

/* The loop around a face and the face itself, after its surface. */
static void put_loop(step *s, uint32_t surface, const uint32_t side[4], const uint8_t is_along[4])
{
    uint32_t sides = surface + 1, loop = surface + 5;
    for (uint32_t k = 0; k < 4; k++)
        qw_pen_print(&s->pen, "#%u=ORIENTED_EDGE('',*,*,#%u,%s);\n", sides + k, s->edges + side[k],
                     is_along[k] ? ".T." : ".F.");
    qw_pen_print(&s->pen, "#%u=EDGE_LOOP('',(#%u,#%u,#%u,#%u));\n", loop, sides, sides + 1, sides + 2, sides + 3);
    qw_pen_print(&s->pen, "#%u=FACE_OUTER_BOUND('',#%u,.T.);\n#%u=ADVANCED_FACE('',(#%u),#%u,.T.);\n", loop + 1, loop,
                 loop + 2, loop + 1, surface);
    s->next = loop + 3;
    flush(s);
}

/* The surface of block f, a bicubic spline, and the face on it. */
static void put_block(step *s, uint32_t f)
{
    const qw_patch_blocks *b = s->p->blocks;
    uint32_t surface = s->next, m = b->span[f][0], n = b->span[f][1], columns = 2 * n + 2;
    qw_pen_print(&s->pen, "#%u=B_SPLINE_SURFACE_WITH_KNOTS('',3,3,", surface);
    for (uint32_t r = 0; r < 2 * m + 2; r++) {
        qw_pen_text(&s->pen, r ? "," : "(");
        put_references(s, b->point + b->first[f] + (size_t)r * columns, columns);
    }
    qw_pen_text(&s->pen, "),.UNSPECIFIED.,.F.,.F.,.F.,");
    put_knots(s, m), qw_pen_text(&s->pen, ","), put_knots(s, n), qw_pen_text(&s->pen, ",");
    put_knot_values(s, m), qw_pen_text(&s->pen, ","), put_knot_values(s, n);
    qw_pen_text(&s->pen, ",.UNSPECIFIED.);\n");
    put_loop(s, surface, b->side[f], b->is_along[f]);
}

/* One face of all blocks on a surface. */
static void put_joined(step *s, uint32_t p)
{
    const qw_patch_faces *o = s->p->faces;
    const qw_patch_surface *on = &o->surface[p];
    put_placement(s, on->point, on->axis);
    uint32_t surface = s->next++;
    const char *kind = on->radius == 0 ? "PLANE" : on->angle == 0 ? "CYLINDRICAL_SURFACE" : "CONICAL_SURFACE";
    qw_pen_print(&s->pen, "#%u=%s('',#%u", surface, kind, surface - 1);
    if (on->radius > 0) qw_pen_text(&s->pen, ","), put_real(s, on->radius);
    if (on->angle > 0) qw_pen_text(&s->pen, ","), put_real(s, on->angle);
    qw_pen_text(&s->pen, ");\n");
    for (uint32_t l = o->loop_first[p]; l < o->loop_first[p + 1]; l++) {
        uint32_t from = s->next;
        for (uint32_t i = o->side_first[l]; i < o->side_first[l + 1]; i++, flush(s))
            qw_pen_print(&s->pen, "#%u=ORIENTED_EDGE('',*,*,#%u,%s);\n", s->next++, s->edges + o->side[i] / 2,
                         o->side[i] % 2 ? ".T." : ".F.");
        qw_pen_print(&s->pen, "#%u=EDGE_LOOP('',(", s->next);
        for (uint32_t i = from; i < s->next; i++, flush(s)) qw_pen_print(&s->pen, "%s#%u", i > from ? "," : "", i);
        qw_pen_print(&s->pen, "));\n#%u=%s('',#%u,.T.);\n", s->next + 1,
                     l == o->outer[p] ? "FACE_OUTER_BOUND" : "FACE_BOUND", s->next);
        s->bound[l] = s->next + 1, s->next += 2;
    }
    qw_pen_print(&s->pen, "#%u=ADVANCED_FACE('',(", s->next++);
    for (uint32_t l = o->loop_first[p]; l < o->loop_first[p + 1]; l++)
        qw_pen_print(&s->pen, "%s#%u", l > o->loop_first[p] ? "," : "", s->bound[l]);
    qw_pen_print(&s->pen, "),#%u,%s);\n", surface, on->is_hollow ? ".F." : ".T.");
    flush(s);
}

/* All blocks, those of a joined face where its own comes; notes the number of each one's face, or 0. */
static void put_blocks(step *s)
{
    const qw_patch_faces *o = s->p->faces;
    s->bound = QW_NEW(s->env, uint32_t, o ? o->loop_count : 0);
    for (uint32_t b = 0; b < s->p->blocks->count; b++) {
        uint32_t p = o ? o->of_block[b] : QW_NONE;
        s->face[b] = 0;
        if (p != QW_NONE && o->block[p] != b) continue;
        if (p != QW_NONE) put_joined(s, p);
        else put_block(s, b);
        s->face[b] = s->next - 1;
    }
}

/* ---- a face a quad */

/* The surface of a single patch, a bicubic spline of sixteen points, and the face on it. */
static void put_face(step *s, uint32_t f)
{
    uint32_t surface = s->next;
    qw_pen_print(&s->pen, "#%u=B_SPLINE_SURFACE_WITH_KNOTS('',3,3,(", surface);
    for (int i = 0; i < 4; i++) {
        const uint32_t *c = s->p->face[f] + 4 * i;
        qw_pen_print(&s->pen, "%s(#%u,#%u,#%u,#%u)", i ? "," : "", s->points + c[0], s->points + c[1], s->points + c[2],
                     s->points + c[3]);
    }
    qw_pen_text(&s->pen, "),.UNSPECIFIED.,.F.,.F.,.F.,(4,4),(4,4),(0.,1.),(0.,1.),.UNSPECIFIED.);\n");
    put_loop(s, surface, s->p->side[f], s->p->is_along[f]);
}

/* Sets the item of each shell to the shell itself. */
static void put_shells(step *s)
{
    const qw_patch_blocks *b = s->p->blocks;
    const uint32_t faces = b ? b->count : s->p->face_count, *shell = b ? b->shell : s->p->shell;
    uint64_t *by_shell = QW_NEW(s->env, uint64_t, faces);
    for (uint32_t f = 0; f < faces; f++) by_shell[f] = (uint64_t)shell[f] << 32 | f;
    qw_sort_u64(by_shell, faces);
    s->item = QW_NEW(s->env, uint32_t, s->p->shell_count);
    for (uint32_t c = 0, i = 0; c < s->p->shell_count; c++) {
        bool has_one = false;
        qw_pen_print(&s->pen, "#%u=%s('',(", s->next, s->p->is_closed[c] ? "CLOSED_SHELL" : "OPEN_SHELL");
        for (; i < faces && by_shell[i] >> 32 == c; i++) {
            uint32_t face = s->face[(uint32_t)by_shell[i]];
            if (face == 0) continue; /* in the face of another */
            qw_pen_print(&s->pen, has_one ? ",#%u" : "#%u", face);
            has_one = true;
            flush(s);
        }
        qw_pen_text(&s->pen, "));\n");
        s->item[c] = s->next++;
    }
}

/* Replaces the items of shells by what is made of them; cavities are in the item of their solid. The faces of a cavity
   are turned away from the solid, as those of its outer shell are. */
static void put_items(step *s)
{
    const uint32_t shells = s->p->shell_count, *outer = s->p->outer;
    uint64_t *cavity = QW_NEW(s->env, uint64_t, shells);
    uint32_t cavities = 0;
    for (uint32_t c = 0; c < shells; c++) {
        if (outer[c] == QW_NONE) continue;
        qw_pen_print(&s->pen, "#%u=ORIENTED_CLOSED_SHELL('',*,#%u,.T.);\n", s->next, s->item[c]);
        cavity[cavities++] = (uint64_t)outer[c] << 32 | s->next++;
    }
    qw_sort_u64(cavity, cavities);
    for (uint32_t c = 0, i = 0; c < shells; c++) {
        if (outer[c] != QW_NONE) continue;
        bool has_cavity = i < cavities && cavity[i] >> 32 == c;
        if (!s->p->is_closed[c]) qw_pen_print(&s->pen, "#%u=SHELL_BASED_SURFACE_MODEL('',(#%u", s->next, s->item[c]);
        else if (!has_cavity) qw_pen_print(&s->pen, "#%u=MANIFOLD_SOLID_BREP('',#%u", s->next, s->item[c]);
        else qw_pen_print(&s->pen, "#%u=BREP_WITH_VOIDS('',#%u,(", s->next, s->item[c]);
        for (uint32_t begin = i; i < cavities && cavity[i] >> 32 == c; i++)
            qw_pen_print(&s->pen, i > begin ? ",#%u" : "#%u", (uint32_t)cavity[i]);
        qw_pen_text(&s->pen, has_cavity || !s->p->is_closed[c] ? "));\n" : ");\n");
        s->item[c] = s->next++;
        flush(s);
    }
}

static void put_representation(step *s)
{
    bool all_closed = true;
    for (uint32_t c = 0; c < s->p->shell_count; c++) all_closed &= s->p->is_closed[c] != 0;
    qw_pen_print(&s->pen, "#10=%s('',(#11",
                 all_closed ? "ADVANCED_BREP_SHAPE_REPRESENTATION" : "MANIFOLD_SURFACE_SHAPE_REPRESENTATION");
    for (uint32_t c = 0; c < s->p->shell_count; c++)
        if (s->p->outer[c] == QW_NONE) qw_pen_print(&s->pen, ",#%u", s->item[c]), flush(s);
    qw_pen_print(&s->pen, "),#%d);\nENDSEC;\nEND-ISO-10303-21;\n", CONTEXT);
}

void qw_put_step(qw_env *env, qw_file *file, const qw_patches *patches)
{
    step s = {.env = env, .file = file, .pen = {.env = env}, .p = patches};
    put_head(&s);
    put_points(&s);
    if (patches->blocks) put_long_edges(&s);
    else put_edges(&s);
    s.face = QW_NEW(env, uint32_t, patches->face_count); /* no more blocks than quads */
    if (patches->blocks) put_blocks(&s);
    for (uint32_t f = 0; !patches->blocks && f < patches->face_count; f++) put_face(&s, f), s.face[f] = s.next - 1;
    put_shells(&s);
    put_items(&s);
    put_representation(&s);
    qw_pen_flush(&s.pen, s.file, 1);
}
