#include "remesh/clean/own_frame.h"

#include "base/vec.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <float.h>
#include <string.h>

/* Extents, in the centred frame. A component below SMALL is enlarged as a whole to ENLARGED; one that is long
   but narrower than NARROW is widened to WIDENED, some 1,000 steps of single precision. A closed one that is thinner
   than THIN, so that its two sides would fall together, gets that thickness. */
static const double SMALL = 1e-4, ENLARGED = 1e-3, NARROW = 2e-5, WIDENED = 1e-4, THIN = 1e-6;
/* A component of more area than this is neither small nor narrow, unless it is folded upon itself many times. */
static const double PLAIN_AREA = 2e-4;
/* A component of smaller extent is flat: double precision does not resolve its thickness. */
static const double FLAT = 1e-14;
/* Slots are cells of a square grid of this width, outside the box of the frame, whose half diagonal is 0.5. */
static const double SLOT = 4e-3, SLOTS_BEGIN = 0.75, SLOTS_FROM = 0.7;

static const double *point_of(const qw_sheets *s, size_t h)
{
    uint32_t v = s->corner[h];
    return s->position + 3 * (size_t)(s->point ? s->point[v] : v);
}

/* Length of the cross product of two sides; *longest: of the three. */
static double cross_of(const qw_sheets *s, uint32_t f, double *longest)
{
    assert(f < s->face_count && longest);
    const double *p[3] = {point_of(s, 3 * (size_t)f), point_of(s, 3 * (size_t)f + 1), point_of(s, 3 * (size_t)f + 2)};
    double e[3][3], most = 0, cross = 0;
    for (int i = 0; i < 3; i++) {
        double length2 = 0;
        for (int k = 0; k < 3; k++) {
            e[i][k] = p[(i + 1) % 3][k] - p[i][k];
            length2 += e[i][k] * e[i][k];
        }
        most = fmax(most, length2);
    }
    for (int k = 0; k < 3; k++) {
        double c = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        cross += c * c;
    }
    *longest = sqrt(most);
    return sqrt(cross);
}

/* Of its longest side, the height below which a triangle has no area. */
static const double LEAST_HEIGHT = 1e-12;

bool qw_face_has_area(const qw_sheets *s, uint32_t f, double offset)
{
    assert(f < s->face_count);
    double longest, cross = cross_of(s, f, &longest);
    return cross > longest * fmax(LEAST_HEIGHT * longest, 2 * DBL_EPSILON * offset);
}

uint32_t qw_drop_flat_components(qw_env *env, qw_sheets *s, double offset, uint32_t *first)
{
    assert(s->component);
    qw_scope_begin(env);
    uint32_t flat = s->components;
    uint8_t *solid = QW_NEW_ZERO(env, uint8_t, s->components);
    for (uint32_t f = 0; f < s->face_count; f++)
        if (!solid[s->component[f]] && qw_face_has_area(s, f, offset)) solid[s->component[f]] = 1, flat--;
    if (flat == s->components) flat = 0;
    if (flat > 0) {
        uint8_t *kept = QW_NEW(env, uint8_t, s->face_count);
        for (uint32_t f = s->face_count; f-- > 0;)
            if (!(kept[f] = solid[s->component[f]])) *first = s->source[f];
        qw_keep_faces(env, s, kept);
        s->components = qw_label_components(env, 3, s->twin, s->face_count, s->component);
    }
    qw_scope_end(env);
    return flat;
}

/* ---- extents */

/* The corners of one component, and whether it has no boundary. */
typedef struct corners {
    const qw_sheets *sheets;
    const uint32_t *face; /* uint32_t[count] */
    uint32_t count;
    bool closed;
} corners;

static double normalise(double *a)
{
    double length = sqrt(qw_dot_doubles(a, a));
    for (int k = 0; k < 3 && length > 0; k++) a[k] /= length;
    return length;
}

/* The corner that is furthest from p, or from the line through p along a unit vector (may be NULL). */
static const double *furthest(const corners *c, const double *p, const double *along)
{
    assert(c->count > 0);
    const double *best = p;
    double most = -1;
    for (uint32_t i = 0; i < 3 * c->count; i++) {
        const double *q = point_of(c->sheets, 3 * (size_t)c->face[i / 3] + i % 3);
        double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, t = along ? qw_dot_doubles(d, along) : 0;
        for (int k = 0; along && k < 3; k++) d[k] -= t * along[k];
        double distance2 = qw_dot_doubles(d, d);
        if (distance2 > most) most = distance2, best = q;
    }
    return best;
}

/* Axes: from end to end of the component, then to what is furthest from that line. extent: of the component along each.
   False where all of it lies on one line. */
static bool find_axes(const corners *c, qw_own_frame *own, double *extent)
{
    const double *a = furthest(c, point_of(c->sheets, 3 * (size_t)c->face[0]), NULL), *b = furthest(c, a, NULL), *d;
    double *x = own->axis[0], *y = own->axis[1];
    for (int k = 0; k < 3; k++) x[k] = b[k] - a[k];
    normalise(x);
    d = furthest(c, a, x);
    for (int k = 0; k < 3; k++) y[k] = d[k] - a[k];
    double t = qw_dot_doubles(y, x);
    for (int k = 0; k < 3; k++) y[k] -= t * x[k];
    if (!(normalise(y) > 0)) return false;
    t = qw_dot_doubles(y, x); /* again, for rounding: little of y may have been left */
    for (int k = 0; k < 3; k++) y[k] -= t * x[k];
    normalise(y);
    qw_cross_doubles(x, y, own->axis[2]);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < 3 * c->count; i++) {
        const double *q = point_of(c->sheets, 3 * (size_t)c->face[i / 3] + i % 3);
        double from[3] = {q[0] - a[0], q[1] - a[1], q[2] - a[2]};
        for (int k = 0; k < 3; k++) {
            double along = qw_dot_doubles(from, own->axis[k]);
            low[k] = fmin(low[k], along), high[k] = fmax(high[k], along);
        }
    }
    for (int k = 0; k < 3; k++) extent[k] = high[k] - low[k], own->center[k] = a[k];
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++) own->center[j] += (low[k] + high[k]) / 2 * own->axis[k][j];
    return true;
}

/* Whether the component needs a frame of its own, which is set then. */
static bool find_own_frame(const corners *c, qw_own_frame *own)
{
    assert(c->count > 0 && own);
    double extent[3];
    if (!find_axes(c, own, extent) || !(extent[1] > FLAT * extent[0])) return false;
    double all = extent[0] < SMALL ? ENLARGED / extent[0] : 1, across = all;
    if (extent[1] * all < NARROW) across = WIDENED / extent[1];
    own->stretch[0] = all, own->stretch[1] = own->stretch[2] = across;
    if (c->closed && extent[2] > FLAT && extent[2] * across < THIN) own->stretch[2] = THIN / extent[2];
    return own->stretch[0] > 1 || own->stretch[1] > 1 || own->stretch[2] > 1;
}

/* ---- slots */

static uint32_t columns_of(uint32_t count) { return (uint32_t)ceil(sqrt(count)); }

static void slot_of(uint32_t k, uint32_t count, double *y, double *z)
{
    assert(k < count);
    uint32_t columns = columns_of(count);
    *y = SLOTS_BEGIN + SLOT * (k / columns);
    *z = SLOT * (k % columns - (columns - 1) / 2.0);
}

qw_vec3 qw_enter_own_frame(const qw_own_frames *own, uint32_t slot, const double q[3])
{
    assert(slot < own->count);
    const qw_own_frame *f = &own->frame[slot];
    double y, z, from[3] = {q[0] - f->center[0], q[1] - f->center[1], q[2] - f->center[2]}, at[3];
    slot_of(slot, own->count, &y, &z);
    for (int j = 0; j < 3; j++) at[j] = f->stretch[j] * qw_dot_doubles(from, f->axis[j]);
    return qw_v3((float)at[0], (float)(y + at[1]), (float)(z + at[2]));
}

static void move_to_slot(const qw_sheets *s, const corners *c, const qw_own_frames *own, uint32_t k, qw_vec3 *position)
{
    for (uint32_t i = 0; i < 3 * c->count; i++) {
        size_t h = 3 * (size_t)c->face[i / 3] + i % 3;
        position[s->corner[h]] = qw_enter_own_frame(own, k, point_of(s, h));
    }
}

uint32_t qw_own_frame_of(const qw_own_frames *own, qw_vec3 p)
{
    if (own->count == 0 || !((double)p.y > SLOTS_FROM)) return QW_NONE;
    uint32_t columns = columns_of(own->count);
    double row = floor((p.y - SLOTS_BEGIN) / SLOT + 0.5), column = floor(p.z / SLOT + (columns - 1) / 2.0 + 0.5);
    row = fmax(row, 0), column = fmin(fmax(column, 0), columns - 1.0);
    return (uint32_t)fmin(row * columns + column, own->count - 1.0);
}

bool qw_leave_own_frame(const qw_own_frames *own, qw_vec3 p, double q[3])
{
    uint32_t k = qw_own_frame_of(own, p);
    if (k == QW_NONE) return false;
    const qw_own_frame *f = &own->frame[k];
    double y, z;
    slot_of(k, own->count, &y, &z);
    double at[3] = {p.x / f->stretch[0], (p.y - y) / f->stretch[1], (p.z - z) / f->stretch[2]};
    for (int i = 0; i < 3; i++)
        q[i] = f->center[i] + at[0] * f->axis[0][i] + at[1] * f->axis[1][i] + at[2] * f->axis[2][i];
    return true;
}

/* ---- which */

/* Components of little area: uint8_t[s->components]. */
static uint8_t *find_suspects(qw_env *env, const qw_sheets *s, uint32_t *faces)
{
    assert(s->component && faces);
    double *area = QW_NEW_ZERO(env, double, s->components), longest;
    uint8_t *suspect = QW_NEW(env, uint8_t, s->components);
    memset(suspect, 1, s->components);
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t c = s->component[f];
        if (suspect[c] && (area[c] += cross_of(s, f, &longest) / 2) > PLAIN_AREA) suspect[c] = 0;
    }
    *faces = 0;
    for (uint32_t f = 0; f < s->face_count; f++) *faces += suspect[s->component[f]];
    qw_free(env, area);
    return suspect;
}

/* The faces of the suspects, by component: face in this order, begin: uint32_t[s->components + 1]. */
static void sort_faces(const qw_sheets *s, const uint8_t *suspect, uint32_t *face, uint32_t *begin)
{
    memset(begin, 0, ((size_t)s->components + 1) * sizeof *begin);
    for (uint32_t f = 0; f < s->face_count; f++) begin[s->component[f] + 1] += suspect[s->component[f]];
    for (uint32_t c = 0; c < s->components; c++) begin[c + 1] += begin[c];
    for (uint32_t f = 0; f < s->face_count; f++)
        if (suspect[s->component[f]]) face[begin[s->component[f]]++] = f;
    for (uint32_t c = s->components; c > 0; c--) begin[c] = begin[c - 1];
    begin[0] = 0;
}

static bool is_closed(const corners *c)
{
    for (uint32_t i = 0; i < 3 * c->count; i++)
        if (c->sheets->twin[3 * (size_t)c->face[i / 3] + i % 3] == QW_NONE) return false;
    return true;
}

qw_own_frames qw_take_own_frames(qw_env *env, const qw_sheets *s, qw_vec3 *position)
{
    assert(s->component);
    qw_own_frames own = {0, NULL};
    qw_scope_begin(env);
    uint32_t faces, moved = 0;
    uint8_t *suspect = find_suspects(env, s, &faces);
    uint32_t *face = QW_NEW(env, uint32_t, faces), *begin = QW_NEW(env, uint32_t, (size_t)s->components + 1);
    sort_faces(s, suspect, face, begin);
    size_t room = 0;
    for (uint32_t c = 0; c < s->components; c++) {
        corners all = {s, face + begin[c], begin[c + 1] - begin[c], false};
        if (c % 1024 == 0) qw_heartbeat(env);
        if (!suspect[c]) continue;
        all.closed = is_closed(&all);
        own.frame = qw_grow(env, own.frame, &room, (size_t)own.count + 1, sizeof *own.frame);
        suspect[c] = find_own_frame(&all, &own.frame[own.count]);
        own.count += suspect[c];
    }
    for (uint32_t c = 0; c < s->components; c++) {
        corners all = {s, face + begin[c], begin[c + 1] - begin[c], false};
        if (suspect[c]) move_to_slot(s, &all, &own, moved++, position);
    }
    if (own.count == 0) own.frame = NULL;
    qw_keep(env, own.frame);
    qw_scope_end(env);
    return own;
}
