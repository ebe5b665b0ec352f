#include "products/atlas/seams.h"

#include "base/mesh_view.h"
#include "geometry/polygons.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <string.h>

/* ---- the mesh */

qw_atlas_mesh qw_atlas_mesh_of(qw_env *env, const qw_mesh_view *view, const uint8_t *mark, uint32_t mark_count,
                               const int32_t *label)
{
    qw_polygon_edges edges = qw_find_polygon_edges(env, view);
    qw_atlas_mesh m = {.vertex_count = view->vertex_count,
                       .face_count = view->face_count,
                       .corner_count = edges.corner_count,
                       .position = view->positions,
                       .begin = edges.face_begin,
                       .corner = view->corners,
                       .face = edges.face};
    uint32_t fault;
    m.twin = qw_polygon_twins(env, view, &edges, &fault);
    m.wall = QW_NEW_ZERO(env, uint8_t, m.corner_count), m.seam = QW_NEW_ZERO(env, uint8_t, m.corner_count);
    qw_free(env, edges.sorted), qw_free(env, edges.edge_begin);
    for (uint32_t c = 0; c < m.corner_count; c++) {
        uint32_t t = m.twin[c];
        if (t == QW_NONE || (label && label[m.face[c]] != label[m.face[t]])) m.wall[c] = QW_WALL_BORDER;
        if (mark && c < mark_count && mark[c]) {
            uint8_t wall = qw_is_hard(mark[c]) ? QW_WALL_SHARP : QW_WALL_RING;
            m.wall[c] |= wall;
            if (t != QW_NONE) m.wall[t] |= wall;
        }
    }
    return m;
}

double qw_atlas_edge_length(const qw_atlas_mesh *m, uint32_t c)
{
    const double *a = m->position + 3 * (size_t)m->corner[c],
                 *b = m->position + 3 * (size_t)m->corner[qw_atlas_next(m, c)];
    double x = b[0] - a[0], y = b[1] - a[1], z = b[2] - a[2];
    return sqrt(x * x + y * y + z * z);
}

double qw_seam_length(const qw_atlas_mesh *m)
{
    double sum = 0;
    for (uint32_t c = 0; c < m->corner_count; c++)
        if (m->seam[c] && m->twin[c] != QW_NONE && c < m->twin[c]) sum += qw_atlas_edge_length(m, c);
    return sum;
}

/* ---- lines */

typedef struct riders {
    qw_atlas_mesh *m;
    uint8_t *met;    /* uint8_t[vertex_count]: a line or a wall goes through */
    uint32_t *ahead; /* uint32_t[]: half-edge along which each line goes on */
    uint32_t count;
    size_t capacity;
    qw_env *env;
} riders;

static bool is_quad(const qw_atlas_mesh *m, uint32_t f) { return m->begin[f + 1] - m->begin[f] == 4; }

static void send(riders *r, uint32_t c)
{
    if (r->m->seam[c]) return;
    r->ahead = qw_grow(r->env, r->ahead, &r->capacity, r->count + (size_t)1, sizeof *r->ahead);
    r->ahead[r->count++] = c;
}

/* The first corner of the fan of c's vertex: at a seam where there is one. *seams: seams that leave it. */
static uint32_t fan_begin(const qw_atlas_mesh *m, uint32_t c, uint32_t *size, uint32_t *seams)
{
    uint32_t at = c, first = c;
    *size = 0, *seams = 0;
    for (uint32_t back; (back = qw_atlas_turn_back(m, first)) != QW_NONE && back != c;) first = back;
    if (qw_atlas_turn_back(m, first) == c) first = c;
    at = first;
    do {
        ++*size, *seams += m->seam[at];
        at = qw_atlas_turn(m, at);
    } while (at != QW_NONE && at != first);
    assert(*size > 0);
    *seams += at == QW_NONE;
    if (*seams > 0 && at != QW_NONE)
        while (!m->seam[first]) first = qw_atlas_turn(m, first);
    return first;
}

/* Lines leave along all edges of an irregular vertex; at seams from the sectors of three quads and more. */
static void send_from(riders *r, uint32_t c)
{
    const qw_atlas_mesh *m = r->m;
    uint32_t size, seams, first = fan_begin(m, c, &size, &seams), at = first;
    bool all = seams == 0 ? size != 4 : seams == 1;
    for (uint32_t i = 0; i < size; i++, at = qw_atlas_turn(m, at)) all |= !is_quad(m, m->face[at]);
    at = first;
    for (uint32_t i = 0; i < size;) {
        uint32_t quads = 1, end = qw_atlas_turn(m, at);
        while (i + quads < size && !m->seam[end]) quads++, end = qw_atlas_turn(m, end);
        if (seams == 0) quads = size;
        if (all || (seams > 0 && quads > 2))
            for (uint32_t k = 0, b = at; k < quads; k++, b = qw_atlas_turn(m, b)) send(r, b);
        i += quads, at = end;
    }
}

/* The half-edge that goes on straight where c ends: between two quads on either side. QW_NONE: there is none. */
static uint32_t straight_on(const qw_atlas_mesh *m, uint32_t c)
{
    uint32_t n = qw_atlas_next(m, c), t = m->twin[n];
    if (!is_quad(m, m->face[c]) || t == QW_NONE || !is_quad(m, m->face[t])) return QW_NONE;
    return qw_atlas_next(m, t);
}

/* All go on by one edge at a time. Those that come to a vertex in the same step all go on, so that what lies symmetric
   is cut symmetrically. */
static void ride(riders *r)
{
    const qw_atlas_mesh *m = r->m;
    while (r->count > 0) {
        uint32_t kept = 0, arrived = 0;
        for (uint32_t i = 0; i < r->count; i++) {
            uint32_t c = r->ahead[i];
            if (m->seam[c]) continue;
            qw_set_seam(m, c, 1);
            if (!r->met[m->corner[qw_atlas_next(m, c)]]) r->ahead[arrived++] = c;
        }
        for (uint32_t i = 0; i < arrived; i++) r->met[m->corner[qw_atlas_next(m, r->ahead[i])]] = 1;
        for (uint32_t i = 0; i < arrived; i++) {
            uint32_t on = straight_on(m, r->ahead[i]);
            if (on != QW_NONE && !m->seam[on]) r->ahead[kept++] = on;
        }
        r->count = kept;
        qw_heartbeat(r->env);
    }
}

static riders begin_riders(qw_env *env, qw_atlas_mesh *m)
{
    riders r = {.m = m, .env = env, .met = QW_NEW_ZERO(env, uint8_t, m->vertex_count)};
    for (uint32_t c = 0; c < m->corner_count; c++)
        if (m->seam[c]) r.met[m->corner[c]] = r.met[m->corner[qw_atlas_next(m, c)]] = 1;
    return r;
}

uint32_t *qw_label_charts(qw_env *env, const qw_atlas_mesh *m, uint32_t *count)
{
    uint32_t *chart = QW_NEW(env, uint32_t, m->face_count), *stack = QW_NEW(env, uint32_t, m->face_count);
    memset(chart, 0xff, m->face_count * sizeof *chart);
    *count = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        if (chart[f] != QW_NONE) continue;
        uint32_t held = 0;
        stack[held++] = f, chart[f] = *count;
        while (held > 0) {
            uint32_t g = stack[--held];
            assert(chart[g] == *count);
            for (uint32_t c = m->begin[g]; c < m->begin[g + 1]; c++) {
                if (m->seam[c] || chart[m->face[m->twin[c]]] != QW_NONE) continue;
                stack[held++] = m->face[m->twin[c]], chart[m->face[m->twin[c]]] = *count;
            }
        }
        ++*count;
    }
    qw_free(env, stack);
    return chart;
}

/* ---- disks */

/* Euler number of each chart, its vertices counted as often as it meets them: 1 for a disk. */
static int32_t *euler_of(qw_env *env, const qw_atlas_mesh *m, const uint32_t *chart, uint32_t count)
{
    int32_t *twice = QW_NEW_ZERO(env, int32_t, count); /* twice the Euler number */
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, m->corner_count);
    for (uint32_t f = 0; f < m->face_count; f++) twice[chart[f]] += 2;
    for (uint32_t c = 0; c < m->corner_count; c++) {
        twice[chart[m->face[c]]] -= m->seam[c] ? 2 : 1;
        if (seen[c]) continue;
        twice[chart[m->face[c]]] += 2;
        seen[c] = 1;
        for (uint32_t at = c; !m->seam[qw_atlas_prev(m, at)];) {
            at = qw_atlas_turn(m, at);
            if (at == c) break;
            seen[at] = 1;
        }
        for (uint32_t at = c; !m->seam[at];) {
            at = qw_atlas_turn_back(m, at);
            if (at == c) break;
            seen[at] = 1;
        }
    }
    qw_free(env, seen);
    for (uint32_t k = 0; k < count; k++) assert(twice[k] % 2 == 0); /* an edge inside is counted from both sides */
    for (uint32_t k = 0; k < count; k++) twice[k] /= 2;
    return twice;
}

/* Sends lines from one vertex of each chart that is no disk: of its boundary, where there is one. */
static bool cut_open(qw_env *env, qw_atlas_mesh *m)
{
    uint32_t count;
    qw_scope_begin(env);
    uint32_t *chart = qw_label_charts(env, m, &count), *start = QW_NEW(env, uint32_t, count);
    int32_t *euler = euler_of(env, m, chart, count);
    memset(start, 0xff, count * sizeof *start);
    riders r = begin_riders(env, m);
    bool any = false;
    for (uint32_t c = 0; c < m->corner_count; c++) {
        uint32_t k = chart[m->face[c]];
        bool at_rim = !m->seam[c] && m->seam[qw_atlas_prev(m, c)]; /* an edge that leaves the boundary inward */
        if (euler[k] == 1 || m->seam[c]) continue;
        if (start[k] == QW_NONE || (at_rim && start[k] & 1)) start[k] = 2 * c + !at_rim;
    }
    for (uint32_t k = 0; k < count; k++) {
        if (start[k] == QW_NONE) continue;
        uint32_t c = start[k] / 2, size, seams;
        any = true;
        if (start[k] & 1) { /* closed: from a vertex inside */
            uint32_t at = fan_begin(m, c, &size, &seams);
            for (uint32_t i = 0; i < size; i++, at = qw_atlas_turn(m, at)) send(&r, at);
            r.met[m->corner[c]] = 1;
        } else {
            send(&r, c);
        }
    }
    ride(&r);
    qw_scope_end(env);
    return any;
}

void qw_cut_patches(qw_env *env, qw_atlas_mesh *m)
{
    for (uint32_t c = 0; c < m->corner_count; c++) m->seam[c] = m->wall[c] != 0;
    qw_scope_begin(env);
    riders r = begin_riders(env, m);
    uint8_t *done = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    for (uint32_t c = 0; c < m->corner_count; c++) {
        if (done[m->corner[c]]) continue;
        done[m->corner[c]] = 1;
        uint32_t before = r.count;
        send_from(&r, c);
        if (r.count > before) r.met[m->corner[c]] = 1;
    }
    ride(&r);
    qw_scope_end(env);
    while (cut_open(env, m)) continue; /* each time a patch that is no disk is cut by another line */
}

/* ---- splitting */

/* Faces of a patch by how many steps they are from its boundary; returns the farthest, of several the first. */
static uint32_t middle_face(const qw_atlas_mesh *m, const uint32_t *face, uint32_t count, uint32_t *order,
                            uint32_t *depth)
{
    uint32_t held = 0;
    for (uint32_t i = 0; i < count; i++) {
        bool rim = false;
        for (uint32_t c = m->begin[face[i]]; c < m->begin[face[i] + 1]; c++) rim |= m->seam[c];
        depth[face[i]] = rim ? 0 : QW_NONE;
        if (rim) order[held++] = face[i];
    }
    for (uint32_t at = 0; at < held; at++)
        for (uint32_t c = m->begin[order[at]]; c < m->begin[order[at] + 1]; c++) {
            if (m->seam[c] || depth[m->face[m->twin[c]]] != QW_NONE) continue;
            depth[m->face[m->twin[c]]] = depth[order[at]] + 1, order[held++] = m->face[m->twin[c]];
        }
    assert(held == count);
    return order[held - 1];
}

/* The interior edge of a strip that leaves both sides nearest to equal: the strip is walked from one end. */
static uint32_t middle_edge(const qw_atlas_mesh *m, const uint32_t *face, uint32_t count)
{
    uint32_t best = QW_NONE;
    double longest = 0;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t c = m->begin[face[i]]; c < m->begin[face[i] + 1]; c++) {
            /* faces on this side of the edge, in a strip: walked until its end */
            if (m->seam[c]) continue;
            uint32_t near = 0, at = c;
            for (bool on = true; on && near <= count;) {
                near++, on = false;
                uint32_t from = at;
                for (uint32_t b = qw_atlas_next(m, from); b != from; b = qw_atlas_next(m, b))
                    if (!m->seam[b]) {
                        at = m->twin[b], on = true;
                        break;
                    }
            }
            double balance = near < count ? (near < count - near ? near : count - near) : 0;
            if (balance > longest) longest = balance, best = c;
        }
    return best;
}

bool qw_split_patch(qw_env *env, qw_atlas_mesh *m, const uint32_t *face, uint32_t count)
{
    if (count < 2) return false;
    qw_scope_begin(env);
    riders r = begin_riders(env, m);
    uint32_t *order = QW_NEW(env, uint32_t, count), *depth = QW_NEW(env, uint32_t, m->face_count);
    uint32_t f = middle_face(m, face, count, order, depth), from = QW_NONE;
    for (uint32_t c = m->begin[f]; c < m->begin[f + 1] && from == QW_NONE; c++)
        if (!r.met[m->corner[c]]) from = c;
    if (from != QW_NONE) {
        uint32_t size, seams, at = fan_begin(m, from, &size, &seams);
        for (uint32_t i = 0; i < size; i++, at = qw_atlas_turn(m, at)) send(&r, at);
        r.met[m->corner[from]] = 1;
        ride(&r);
    } else {
        uint32_t c = middle_edge(m, face, count);
        for (uint32_t i = 0; i < count && c == QW_NONE; i++)
            for (uint32_t b = m->begin[face[i]]; b < m->begin[face[i] + 1] && c == QW_NONE; b++)
                if (!m->seam[b]) c = b;
        assert(c != QW_NONE);
        qw_set_seam(m, c, 1); /* no vertex lies inside, so both its ends are on the boundary */
    }
    qw_scope_end(env);
    return true;
}
