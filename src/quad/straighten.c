#include "quad/straighten.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum {
    RINGS = 2,
    RINGS_SPREAD = 3,
    SWEEPS = 30,
    SPREADS = 12,
    DIRECTIONS = 8,
    LEAST_SEARCHES = 20000,
    SEARCHES_A_QUAD = 5, /* of single vertices, so that the time is bounded by the mesh */
    SEARCHES_A_PATCH = 6 /* for each of its quads */
};

/* What a sine lacks of 1 counts once, what it lacks of LEAST_SINE so many times more. */
static const float LEAST_SINE = 0.2f;
static const double PULL = 20;
/* Steps, in the length of the edges around: at first, and the least. */
static const float FIRST_STEP = 0.4f, LEAST_STEP = 0.01f;
/* Vertices stay on the sheet where they are: cosine of the normals. */
static const float SAME_SHEET = 0.2f;
/* Corners move no farther than this, in edges: they are what a shape is known by. */
static const float MOST_ASTRAY = 0.3f;
/* Nor what is let off its curve. */
static const float MOST_OFF_CURVE = 0.5f;
/* What the square of a quad's distance from the surface counts, in its area. */
static const double LIFT = 10;
/* The middle of a quad or of a side that comes to lie farther from the surface than this, in edges, and farther than
   any before, is shape lost: a flap pulled off a thin rod. */
static const float FARTHEST = 0.2f;
/* Of the mean area: a quad counts as no smaller. */
static const float LEAST_AREA = 0.05f;
/* A quad that faces against the surface costs as much as some corners. */
static const double AGAINST = 40;

typedef struct patch {
    const qw_untangling *u;
    const qw_curve_tree *loose; /* all curves, where corners may move; or NULL */
    const uint8_t
        *held; /* [vertices] those that stay, where all others move over the surface, on curves or not; or NULL */
    const qw_vec3 *home; /* [vertices] where they were at first */
    uint32_t *faces, face_count, *vertices, vertex_count;
    uint32_t *order;                       /* [face_count] the faces as faults_in() asks them */
    uint8_t *was_flipped;                  /* [faces] when it asked last */
    uint32_t *asked_in, asking;            /* [faces] the number of the question that asked it last */
    uint32_t *face_in, *vertex_in, number; /* [faces], [vertices]: the number of the patch that they were last in */
    qw_vec3 *up;                           /* [faces] normal of the surface at its middle; of those in the patch */
    qw_vec3 *ground;                       /* [faces] where on the surface that is */
    float edge, least_area;
    uint64_t searches; /* left */
    uint8_t *awake;    /* [vertices] 1: something around has moved since no better place was found */
    qw_vec3 *old;      /* [vertex_count] */
    uint32_t *old_edge;
} patch;

static qw_vec3 diagonals_cross(const qw_untangling *u, uint32_t f)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    return qw_cross(qw_sub(u->position[c[2]], u->position[c[0]]), qw_sub(u->position[c[3]], u->position[c[1]]));
}

static qw_vec3 middle_of(const qw_untangling *u, uint32_t f)
{
    const uint32_t *c = u->quads->corner + 4 * (size_t)f;
    const qw_vec3 *x = u->position;
    return qw_scale(qw_add(qw_add(x[c[0]], x[c[1]]), qw_add(x[c[2]], x[c[3]])), 0.25f);
}

static qw_vec3 side_of(const qw_untangling *u, uint32_t h)
{
    return qw_sub(u->position[u->quads->corner[qw_quad_next(h)]], u->position[u->quads->corner[h]]);
}

/* At the corner where half-edge h begins. */
static qw_vec3 corner_cross(const qw_untangling *u, uint32_t h)
{
    return qw_cross(side_of(u, qw_quad_prev(h)), side_of(u, h));
}

uint32_t qw_turned_corners(const qw_untangling *u, uint32_t f)
{
    qw_vec3 n = diagonals_cross(u, f);
    uint32_t count = 0;
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++) count += qw_dot(corner_cross(u, h), n) <= 0;
    return count;
}

/* The last resort asks for quads that do not oppose the surface at all, whatever may agree with them. */
static uint32_t degree_of(const patch *p, uint32_t f)
{
    return p->held ? (qw_is_opposed(p->u, f) ? QW_CERTAINLY_FLIPPED : 0) : qw_flip_degree(p->u, p->edge, f);
}

/* A question about the whole patch counts as much as a search of each of its quads, however soon it is answered. */
static void count_question(patch *p) { p->searches -= p->searches < p->face_count ? p->searches : p->face_count; }

static uint64_t faults_of(patch *p, uint32_t f)
{
    uint32_t degree = degree_of(p, f);
    p->was_flipped[f] = degree > 0;
    return degree == QW_CERTAINLY_FLIPPED ? 8 * (uint64_t)p->face_count + 1 : 4 * degree;
}

/* What is wrong with the patch: flipped quads before corners that are turned over; a quad that is perhaps flipped
   counts as much as its four corners. Where that is `most` or more, something that is no less than `most` and no more
   than that. */
static uint64_t faults_in(patch *p, uint64_t most)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < p->face_count; i++) sum += qw_turned_corners(p->u, p->faces[i]);
    if (sum >= most) return sum;
    count_question(p);
    qw_flipped_first(p->faces, p->face_count, p->was_flipped, p->order);
    for (uint32_t i = 0; i < p->face_count && sum < most; i++) sum += faults_of(p, p->order[i]);
    return sum;
}

/* Those of the quads that v has a part in: at v, or beside one at v. */
static uint64_t faults_at(patch *p, uint32_t v)
{
    const qw_untangling *u = p->u;
    uint64_t sum = 0;
    p->asking++;
    for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++)
        for (uint32_t i = 0, h = u->around[k] & ~3u; i < 5; i++) {
            uint32_t g = i == 4 ? h : u->quads->twin[h + i], f = g / 4;
            if (g == QW_NONE || p->face_in[f] != p->number || p->asked_in[f] == p->asking) continue;
            p->asked_in[f] = p->asking;
            sum += qw_turned_corners(u, f) + faults_of(p, f);
        }
    return sum;
}

static float distance_to_surface(const qw_untangling *u, qw_vec3 point)
{
    return qw_distance(qw_bvh_nearest(u->tree, point, point, -1, INFINITY, QW_NONE).point, point);
}

/* How far the middles of the patch's quads and of their sides are from the surface, at most. */
static float farthest(const patch *p)
{
    float most = 0;
    for (uint32_t i = 0; i < p->face_count; i++) {
        uint32_t f = p->faces[i];
        most = fmaxf(most, distance_to_surface(p->u, middle_of(p->u, f)));
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++)
            most = fmaxf(most, distance_to_surface(
                                   p->u, qw_madd(p->u->position[p->u->quads->corner[h]], 0.5f, side_of(p->u, h))));
    }
    return most;
}

static double cost_of(const patch *p, uint32_t f)
{
    qw_vec3 area = diagonals_cross(p->u, f), n = qw_normalize(area);
    double cost = qw_dot(n, p->up[f]) < 0 ? AGAINST : 0;
    double lifted = qw_dot(qw_sub(middle_of(p->u, f), p->ground[f]), p->up[f]);
    cost += LIFT * lifted * lifted / fmax(0.5 * (double)qw_length(area), (double)p->least_area);
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
        float lengths = sqrtf(qw_length2(side_of(p->u, h)) * qw_length2(side_of(p->u, qw_quad_prev(h))));
        float sine = lengths > 0 ? qw_dot(corner_cross(p->u, h), n) / lengths
                                 : 0; /* less than nothing where it is turned over */
        double poor = fmax((double)(LEAST_SINE - sine), 0), lacks = 1 - (double)sine;
        cost += PULL * poor * poor + lacks * lacks;
    }
    return cost;
}

/* Where that is `most` or more, something that is no less than `most` and no more than that. */
static double cost_around(const patch *p, uint32_t v, double most)
{
    double cost = 0;
    for (uint32_t k = p->u->begin[v]; k < p->u->begin[v + 1] && cost < most; k++)
        cost += cost_of(p, p->u->around[k] / 4);
    return cost;
}

/* ---- patches */

static bool is_of_curve(const qw_untangling *u, uint32_t v)
{
    return u->curves->edge[v] != QW_NONE || (u->quads->kind && u->quads->kind[v] != QW_VERTEX_FREE);
}

static bool is_free(const patch *p, uint32_t v) { return p->held || !is_of_curve(p->u, v); }

static bool may_move(const patch *p, uint32_t v)
{
    if (p->held) return !p->held[v];
    return p->loose || p->u->curves->edge[v] != QW_NONE || is_free(p, v);
}

/* Whether v may be at a point though it belongs on a curve. */
static bool may_stray(const patch *p, uint32_t v, qw_vec3 to)
{
    return !p->held || !is_of_curve(p->u, v) || qw_distance(to, p->home[v]) <= MOST_OFF_CURVE * p->edge;
}

static void look_up(patch *p, uint32_t f)
{
    qw_vec3 middle = middle_of(p->u, f), around = {0, 0, 0};
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
        uint32_t g = p->u->quads->twin[h];
        if (g != QW_NONE) around = qw_add(around, diagonals_cross(p->u, g / 4));
    }
    qw_hit hit = qw_bvh_nearest(p->u->tree, middle, qw_normalize(around), SAME_SHEET, INFINITY, QW_NONE);
    p->ground[f] = hit.face == QW_NONE ? middle : hit.point;
    p->up[f] = hit.face == QW_NONE ? qw_normalize(around) : qw_normalize(qw_face_cross(p->u->surface, hit.face));
}

static void look_up_all(patch *p)
{
    for (uint32_t i = 0; i < p->face_count; i++) look_up(p, p->faces[i]);
}

static void add_face(patch *p, uint32_t f)
{
    if (p->face_in[f] == p->number) return;
    p->face_in[f] = p->number, p->faces[p->face_count++] = f;
    look_up(p, f);
}

static void add_around(patch *p, uint32_t v)
{
    for (uint32_t k = p->u->begin[v]; k < p->u->begin[v + 1]; k++) add_face(p, p->u->around[k] / 4);
}

/* The vertices of the quads of some rings around the seed, and all quads at them. */
static void grow(patch *p, uint32_t seed, uint32_t rings)
{
    p->number++;
    p->face_count = p->vertex_count = 0;
    add_face(p, seed);
    for (uint32_t ring = 0, done = 0; ring < rings; ring++)
        for (uint32_t end = p->face_count; done < end; done++)
            for (uint32_t i = 0; i < 4; i++) {
                uint32_t v = p->u->quads->corner[4 * p->faces[done] + i];
                if (p->vertex_in[v] == p->number) continue;
                p->vertex_in[v] = p->number;
                add_around(p, v);
                if (may_move(p, v)) p->vertices[p->vertex_count++] = v;
            }
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        uint32_t v = p->vertices[i];
        p->old[i] = p->u->position[v], p->old_edge[i] = p->u->curves->edge[v];
    }
}

/* ---- the search */

static qw_vec3 normal_at(const patch *p, uint32_t v)
{
    qw_vec3 n = {0, 0, 0};
    for (uint32_t k = p->u->begin[v]; k < p->u->begin[v + 1]; k++) n = qw_add(n, p->up[p->u->around[k] / 4]);
    return qw_normalize(n);
}

static float edge_at(const patch *p, uint32_t v)
{
    const qw_untangling *u = p->u;
    float sum = 0;
    for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++)
        sum += qw_distance(u->position[v], u->position[u->quads->corner[qw_quad_next(u->around[k])]]);
    return sum / (float)(u->begin[v + 1] - u->begin[v]);
}

static void move_to(const patch *p, uint32_t v, qw_vec3 to, qw_vec3 normal)
{
    const qw_untangling *u = p->u;
    float length = qw_distance(to, u->position[v]);
    if (is_free(p, v)) {
        qw_hit hit = qw_bvh_nearest(u->tree, to, normal, SAME_SHEET, length, QW_NONE);
        if (hit.face != QW_NONE && may_stray(p, v, hit.point)) u->position[v] = hit.point;
    } else if (u->curves->edge[v] != QW_NONE) {
        u->position[v] = qw_slide_bound(u->curves, &u->curves->edge[v], to);
    } else {
        qw_curve_hit hit = qw_curve_nearest(p->loose, to, length);
        if (hit.segment != QW_NONE && qw_distance(hit.point, p->home[v]) <= MOST_ASTRAY * p->edge)
            u->position[v] = hit.point;
    }
}

static const float direction[DIRECTIONS][2] = {{1, 0},  {0.7071f, 0.7071f},   {0, 1},  {-0.7071f, 0.7071f},
                                               {-1, 0}, {-0.7071f, -0.7071f}, {0, -1}, {0.7071f, -0.7071f}};

/* Returns whether a place was found where the quads around cost less. */
static bool search(const patch *p, uint32_t v, float step)
{
    const qw_untangling *u = p->u;
    double least = cost_around(p, v, INFINITY);
    qw_vec3 from = u->position[v], best = from, n = normal_at(p, v), a = qw_any_orthogonal(n), b = qw_cross(n, a);
    uint32_t from_edge = u->curves->edge[v], best_edge = from_edge;
    float length = step * edge_at(p, v);
    bool found = false;
    for (int i = 0; i < DIRECTIONS; i++) {
        move_to(p, v, qw_madd(qw_madd(from, length * direction[i][0], a), length * direction[i][1], b), n);
        double cost = cost_around(p, v, least);
        if (cost < 0.999 * least) least = cost, best = u->position[v], best_edge = u->curves->edge[v], found = true;
        u->position[v] = from, u->curves->edge[v] = from_edge;
    }
    u->position[v] = best, u->curves->edge[v] = best_edge;
    return found;
}

static void wake_all(const patch *p)
{
    for (uint32_t i = 0; i < p->vertex_count; i++) p->awake[p->vertices[i]] = 1;
}

static void wake_around(const patch *p, uint32_t v)
{
    for (uint32_t k = p->u->begin[v]; k < p->u->begin[v + 1]; k++)
        for (uint32_t i = 0; i < 4; i++) p->awake[p->u->quads->corner[(p->u->around[k] & ~3u) + i]] = 1;
}

/* All vertices once, but for those around which nothing has moved since their last search. Returns whether any has
 * found a better place. */
static bool sweep(patch *p, float step)
{
    bool any = false;
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        uint32_t v = p->vertices[i];
        if (!p->awake[v]) continue;
        p->awake[v] = 0, p->searches -= p->searches > 0;
        if (search(p, v, step)) wake_around(p, v), any = true;
    }
    return any;
}

static qw_vec3 middle_of_neighbours(const qw_untangling *u, uint32_t v)
{
    qw_vec3 sum = {0, 0, 0};
    float count = 0;
    for (uint32_t k = u->begin[v]; k < u->begin[v + 1]; k++) {
        uint32_t h = u->around[k], back = qw_quad_prev(h);
        sum = qw_add(sum, u->position[u->quads->corner[qw_quad_next(h)]]), count += 1;
        if (u->quads->twin[back] == QW_NONE) sum = qw_add(sum, u->position[u->quads->corner[back]]), count += 1;
    }
    return qw_scale(sum, 1 / count);
}

/* Free vertices to the middle of their neighbours, over and over: another place to begin, with nothing folded. */
static void spread(const patch *p)
{
    const qw_untangling *u = p->u;
    for (int sweep = 0; sweep < SPREADS; sweep++)
        for (uint32_t i = 0; i < p->vertex_count; i++) {
            uint32_t v = p->vertices[i];
            if (!is_free(p, v)) continue;
            qw_hit hit = qw_bvh_nearest(u->tree, middle_of_neighbours(u, v), normal_at(p, v), SAME_SHEET, INFINITY,
                                        QW_NONE);
            if (hit.face != QW_NONE && may_stray(p, v, hit.point)) u->position[v] = hit.point;
        }
}

/* Whether v at `to` leaves no more than `most` turned over, `others` of which it has no part in. It stays there, and
 * *faults is what there is then, if so. */
static bool may_go(patch *p, uint32_t v, qw_vec3 to, uint64_t most, uint64_t others, uint64_t *faults)
{
    qw_vec3 *at = &p->u->position[v], from = *at;
    *at = to;
    uint64_t now = others + faults_at(p, v);
    count_question(p);
    if (now <= most) *faults = now;
    else *at = from;
    return now <= most;
}

/* Corners go back to where they were, or half the way, if no more is turned over then. */
static void put_corners_back(patch *p)
{
    const qw_untangling *u = p->u;
    uint64_t most = faults_in(p, UINT64_MAX), faults = most;
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        uint32_t v = p->vertices[i];
        if (!is_of_curve(u, v) || u->curves->edge[v] != QW_NONE || qw_distance(u->position[v], p->home[v]) == 0)
            continue;
        uint64_t others = faults - faults_at(p, v);
        if (may_go(p, v, p->home[v], most, others, &faults)) continue;
        qw_vec3 half = qw_lerp(u->position[v], p->home[v], 0.5f);
        may_go(p, v, p->loose ? qw_curve_nearest(p->loose, half, INFINITY).point : half, most, others, &faults);
    }
}

static void swap_old(const patch *p)
{
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        qw_vec3 *x = &p->u->position[p->vertices[i]], was = p->old[i];
        uint32_t *e = &p->u->curves->edge[p->vertices[i]], was_edge = p->old_edge[i];
        p->old[i] = *x, p->old_edge[i] = *e;
        *x = was, *e = was_edge;
    }
}

/* Whether nothing has come to lie farther from the surface than FARTHEST and than anything before. */
static bool keeps_shape(const patch *p)
{
    float now = farthest(p);
    if (now <= FARTHEST * p->edge) return true;
    swap_old(p);
    float before = farthest(p);
    swap_old(p);
    return now <= before;
}

/* Leaves in place what it finds where that has fewer faults. */
static void straighten(patch *p, uint32_t seed, uint32_t rings, bool from_spread)
{
    grow(p, seed, rings);
    uint64_t before = faults_in(p, UINT64_MAX);
    if (before == 0) return;
    float step = FIRST_STEP;
    if (from_spread) spread(p);
    if (from_spread && p->held) look_up_all(p); /* what was folded looked the wrong way up */
    wake_all(p);
    for (int i = 0; i < SWEEPS && step > LEAST_STEP && p->searches >= p->vertex_count; i++) {
        if (sweep(p, step)) continue;
        step *= 0.5f;
        wake_all(p);
    }
    if (faults_in(p, before) < before && keeps_shape(p)) {
        if (p->loose) put_corners_back(p);
        return;
    }
    swap_old(p);
}

static bool is_poor(const qw_untangling *u, uint32_t f)
{
    return qw_turned_corners(u, f) > 0 || (u->flipped && u->flipped[f]);
}

static uint32_t count_turned(const qw_untangling *u)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < u->quads->face_count; f++) count += qw_turned_corners(u, f);
    return count;
}

static uint32_t count_flipped(const qw_untangling *u)
{
    uint32_t count = 0;
    for (uint32_t f = 0; u->flipped && f < u->quads->face_count; f++) count += u->flipped[f] > 0;
    return count;
}

/* The quads of some rings around f, more where it is still poor. */
static void straighten_at(patch *p, uint32_t f, bool from_spread)
{
    const qw_untangling *u = p->u;
    for (uint32_t rings = 1; rings <= (from_spread ? RINGS_SPREAD : RINGS) && p->searches > 0 && is_poor(u, f);
         rings++) {
        straighten(p, f, rings, from_spread);
        if (u->flipped && u->flipped[f]) u->flipped[f] = (uint8_t)qw_flip_degree(u, p->edge, f);
    }
}

/* Returns whether any is left. */
static bool straighten_all(qw_env *env, patch *p)
{
    const qw_untangling *u = p->u;
    uint32_t faces = u->quads->face_count;
    bool any = false;
    p->searches = LEAST_SEARCHES + SEARCHES_A_QUAD * (uint64_t)faces;
    for (uint32_t f = 0; f < faces; f++) {
        if (!is_poor(u, f)) continue;
        qw_break_silence(env);
        straighten_at(p, f, false);
        if (u->flipped && u->flipped[f]) straighten_at(p, f, true);
    }
    for (uint32_t f = 0; f < faces; f++) {
        if (u->flipped && u->flipped[f]) u->flipped[f] = (uint8_t)qw_flip_degree(u, p->edge, f);
        any |= is_poor(u, f);
    }
    return any;
}

static patch make_patch(qw_env *env, const qw_untangling *u, float edge)
{
    uint32_t faces = u->quads->face_count, vertices = u->quads->vertex_count;
    patch p = {.u = u,
               .faces = QW_NEW(env, uint32_t, faces),
               .vertices = QW_NEW(env, uint32_t, vertices),
               .edge = edge,
               .least_area = FLT_MIN};
    p.order = QW_NEW(env, uint32_t, faces), p.was_flipped = QW_NEW_ZERO(env, uint8_t, faces),
    p.asked_in = QW_NEW_ZERO(env, uint32_t, faces);
    p.face_in = QW_NEW_ZERO(env, uint32_t, faces), p.vertex_in = QW_NEW_ZERO(env, uint32_t, vertices);
    p.ground = QW_NEW(env, qw_vec3, faces), p.up = QW_NEW(env, qw_vec3, faces);
    p.old = QW_NEW(env, qw_vec3, vertices), p.old_edge = QW_NEW(env, uint32_t, vertices);
    p.awake = QW_NEW_ZERO(env, uint8_t, vertices);
    for (uint32_t f = 0; f < faces; f++) p.least_area += LEAST_AREA * qw_length(diagonals_cross(u, f)) / (float)faces;
    qw_vec3 *home = QW_NEW(env, qw_vec3, vertices);
    memcpy(home, u->position, vertices * sizeof *home);
    p.home = home;
    return p;
}

uint32_t qw_straighten_corners(qw_env *env, const qw_untangling *u)
{
    qw_scope_begin(env);
    uint32_t turned = count_turned(u), flipped = count_flipped(u), left = turned;
    if (turned > 0 || flipped > 0) {
        patch p = make_patch(env, u, qw_mean_edge(u));
        if (straighten_all(env, &p)) p.loose = qw_all_curves(env, u->surface);
        if (p.loose) straighten_all(env, &p);
        left = count_turned(u);
        qw_log(env, QW_LOG_DEBUG, "corners turned over: %u, now %u; quads flipped: %u, now %u", turned, left, flipped,
               count_flipped(u));
    }
    qw_scope_end(env);
    return left;
}

void qw_put_on_curves(qw_env *env, const qw_untangling *u, const uint8_t *held, float edge, const qw_vec3 *home)
{
    qw_scope_begin(env);
    patch p = make_patch(env, u, edge);
    p.held = held, p.home = home;
    grow(&p, 0, u->quads->face_count);
    put_corners_back(&p);
    qw_scope_end(env);
}

void qw_straighten_patch(qw_env *env, const qw_untangling *u, const uint8_t *held, float edge)
{
    qw_scope_begin(env);
    patch p = make_patch(env, u, edge);
    p.held = held;
    for (int from_spread = 0; from_spread < 2; from_spread++) {
        p.searches = SEARCHES_A_PATCH * (uint64_t)u->quads->face_count;
        straighten(&p, 0, u->quads->face_count, from_spread != 0);
    }
    qw_scope_end(env);
}
