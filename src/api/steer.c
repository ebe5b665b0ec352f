/* The public functions that steer a run: the cross field and the guides that a caller hands in, and the field that was
 * found. */
#include "api/context.h"
#include "whole/cut.h"
#include "whole/mirror.h"

#include "products/attributes/crosses.h"
#include "products/attributes/equal_weights.h"
#include "products/attributes/motion.h"
#include "products/attributes/transfer.h"
#include "io/guides_file.h"
#include "io/rosy_file.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A direction of a face that stands further off it than this (sine, of 30 degrees) belongs to another mesh. */
static const double MOST_OFF = 0.5;
/* A direction whose squared length differs from 1 by less is taken as it is, so that a field that was written comes
   back to the bit. */
static const double UNIT = 1e-6;

static qw_status require_mesh(qw_context *context)
{
    if (context->state.has_input) return QW_OK;
    return qw_refuse(context, QW_NOT_READY, "there is no mesh yet: call qw_set_mesh first");
}

static const char *name_of(qw_domain domain, bool many)
{
    return domain == QW_PER_FACE ? many ? "faces" : "face" : many ? "vertices" : "vertex";
}

static uint32_t elements_of(const qw_context_state *c, qw_domain domain)
{
    return domain == QW_PER_FACE ? c->input.face_count : c->input.vertex_count;
}

/* ---- setting the field */

typedef struct field_call {
    qw_context_state *c;
    const qw_cross_field *field;
    const char *path;
    qw_domain domain;
    uint32_t count;
    qw_vec3 *copy; /* qw_vec3[count] */
} field_call;

/* Fails unless the field has the right size stamp, domain, number of elements, and directions. */
static void require_shape(const qw_context_state *c, const qw_cross_field *f)
{
    qw_env *env = c->env;
    if (f->size != sizeof *f)
        qw_fail(env, QW_ARGUMENT, -1, "the size stamp of the field is %u, not sizeof(qw_cross_field) = %zu", f->size,
                sizeof *f);
    if (f->domain != QW_PER_FACE && f->domain != QW_PER_VERTEX)
        qw_fail(env, QW_ARGUMENT, -1, "a field goes by vertices or by faces");
    if (f->count != elements_of(c, f->domain))
        qw_fail(env, QW_ARGUMENT, -1, "the field has %u elements, but the mesh has %u %s", f->count,
                elements_of(c, f->domain), name_of(f->domain, true));
    if (!f->directions) qw_fail(env, QW_ARGUMENT, -1, "the field has no directions");
}

/* Twice the area of a face as a vector, over the square of the longest coordinate of its edges so that nothing
   overflows. */
static void normal_of(const qw_clean_input *in, uint32_t f, double normal[3])
{
    const uint32_t *corner = in->corner + in->face_begin[f];
    uint32_t n = in->face_begin[f + 1] - in->face_begin[f];
    const double *origin = in->position + 3 * (size_t)corner[0];
    double most = 0;
    for (uint32_t i = 1; i < n; i++)
        for (int k = 0; k < 3; k++)
            most = fmax(most, fabs(in->position[3 * (size_t)corner[i] + (size_t)k] / 2 - origin[k] / 2));
    normal[0] = normal[1] = normal[2] = 0;
    for (uint32_t i = 1; i + 1 < n && most > 0; i++) {
        double a[3], b[3];
        for (size_t k = 0; k < 3; k++)
            a[k] = (in->position[3 * (size_t)corner[i] + k] / 2 - origin[k] / 2) / most,
            b[k] = (in->position[3 * (size_t)corner[i + 1] + k] / 2 - origin[k] / 2) / most;
        for (int k = 0; k < 3; k++) normal[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

static void require_on_face(const qw_context_state *c, uint32_t f, const double d[3])
{
    double n[3], dot = 0, length2 = 0;
    normal_of(&c->input, f, n);
    for (int k = 0; k < 3; k++) dot += n[k] * d[k], length2 += n[k] * n[k];
    if (dot * dot > MOST_OFF * MOST_OFF * length2)
        qw_fail(c->env, QW_ARGUMENT, f,
                "the direction of face %u stands more than 30 degrees off the face: the field is one of another mesh",
                f);
}

/* The direction of element e at length one, as it was given where it had that already; zero stays zero. */
static qw_vec3 unit_of(const qw_context_state *c, const qw_cross_field *f, uint32_t e)
{
    const float *given = f->directions + 3 * (size_t)e;
    double d[3] = {(double)given[0], (double)given[1], (double)given[2]},
           length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (!isfinite(length2))
        qw_fail(c->env, QW_NOT_FINITE, e, "the direction of %s %u is NaN or infinite", name_of(f->domain, false), e);
    if (length2 == 0) return qw_v3(0, 0, 0);
    if (fabs(length2 - 1) < UNIT) {
        if (f->domain == QW_PER_FACE) require_on_face(c, e, d);
        return qw_v3(given[0], given[1], given[2]);
    }
    double scale = 1 / sqrt(length2);
    for (int k = 0; k < 3; k++) d[k] *= scale;
    if (f->domain == QW_PER_FACE) require_on_face(c, e, d);
    return qw_v3_of_doubles(d);
}

static void copy_field(void *user)
{
    field_call *call = user;
    const qw_cross_field *f = call->field;
    require_shape(call->c, f);
    call->domain = f->domain, call->count = f->count;
    call->copy = QW_NEW(call->c->env, qw_vec3, f->count);
    for (uint32_t e = 0; e < f->count; e++) call->copy[e] = unit_of(call->c, f, e);
}

/* Steers by the field that the body copies. */
static qw_status take_field(qw_context *context, field_call *call, void (*body)(void *user))
{
    qw_context_state *c = call->c;
    qw_status status = body ? qw_protect(c->env, body, call) : QW_OK;
    qw_steering steering = c->steering;
    steering.field_domain = call->domain, steering.field_count = call->count, steering.field = call->copy;
    if (status == QW_OK) qw_replace_steering(c, &steering);
    return qw_done(context, status);
}

qw_status qw_set_field(qw_context *context, const qw_cross_field *field)
{
    if (!context) return QW_ARGUMENT;
    qw_status status = require_mesh(context);
    field_call call = {.c = &context->state, .field = field, .domain = QW_PER_VERTEX};
    return status == QW_OK ? take_field(context, &call, field ? copy_field : NULL) : status;
}

/* ---- the field of a run */

/* The crosses of the run, at the vertices or faces of the input, into call->copy. */
static void export_field(void *user)
{
    field_call *call = user;
    qw_context_state *c = call->c;
    const qw_run_state *run = &c->run;
    qw_domain domain = call->field->domain;
    qw_scope_begin(c->env);
    qw_source source = qw_source_build(c->env, &c->input, &run->whole.clean, run->whole.census.component);
    qw_vertex_crosses crosses = qw_crosses_of_whole(run);
    call->copy = qw_crosses_of_elements(c->env, &source, domain, &crosses, (float)(run->rho * qw_whole_scale(run)));
    qw_keep(c->env, call->copy);
    qw_scope_end(c->env);
}

qw_status qw_get_field(qw_context *context, qw_domain domain, qw_cross_field *field)
{
    if (!context || !field) return QW_ARGUMENT;
    qw_context_state *c = &context->state;
    *field = (qw_cross_field){.size = sizeof *field, .domain = domain};
    if (domain != QW_PER_FACE && domain != QW_PER_VERTEX)
        return qw_refuse(context, QW_ARGUMENT, "a field goes by vertices or by faces");
    if (c->done <= QW_STAGE_ORIENTATION)
        return qw_refuse(context, QW_NOT_READY, "the orientation field has not been found yet");
    field->count = elements_of(c, domain);
    if (c->steering.field && c->steering.field_domain == domain) {
        field->directions = &c->steering.field[0].x;
        return qw_done(context, QW_OK);
    }
    field_call call = {.c = c, .field = field};
    qw_status status = qw_protect_listening(c->env, export_field, &call);
    if (status != QW_OK) field->count = 0;
    else {
        qw_free(c->env, c->told);
        c->told = call.copy;
        field->directions = &call.copy[0].x;
    }
    return qw_done(context, status);
}
_Static_assert(sizeof(qw_vec3) == 3 * sizeof(float), "directions are handed out as they are kept");

/* ---- files */

/* What the elements are: as the file says, or else as its count does. */
static qw_domain domain_of(const qw_context_state *c, const qw_rosy *r, const char *path)
{
    if (r->per_face) return QW_PER_FACE;
    if (r->per_vertex) return QW_PER_VERTEX;
    bool faces = r->count == c->input.face_count, vertices = r->count == c->input.vertex_count;
    if (faces && vertices)
        qw_fail(
            c->env, QW_ARGUMENT, -1,
            "%.200s: the mesh has %u faces and as many vertices, and the field does not say which it goes by: end it "
            "with the line \"# per face\" or \"# per vertex\"",
            path, r->count);
    if (!faces && !vertices)
        qw_fail(c->env, QW_ARGUMENT, -1, "%.200s: the field has %u elements, but the mesh has %u vertices and %u faces",
                path, r->count, c->input.vertex_count, c->input.face_count);
    return faces ? QW_PER_FACE : QW_PER_VERTEX;
}

static void load_field(void *user)
{
    field_call *call = user;
    qw_context_state *c = call->c;
    qw_rosy r = qw_read_rosy(c->env, call->path);
    qw_cross_field field = {sizeof field, domain_of(c, &r, call->path), r.count, r.direction};
    call->field = &field;
    copy_field(call);
    call->field = NULL;
    qw_free(c->env, r.direction);
}

qw_status qw_load_field(qw_context *context, const char *path)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to read from");
    qw_status status = require_mesh(context);
    field_call call = {.c = &context->state, .path = path};
    return status == QW_OK ? take_field(context, &call, load_field) : status;
}

static void save_field(void *user)
{
    field_call *call = user;
    const qw_cross_field *f = call->field;
    qw_write_rosy(call->c->env, call->path, f->domain, f->directions, f->count);
}

qw_status qw_save_field(qw_context *context, qw_domain domain, const char *path)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to write to");
    qw_cross_field field;
    qw_status status = qw_get_field(context, domain, &field);
    if (status != QW_OK) return status;
    field_call call = {.c = &context->state, .field = &field, .path = path};
    return qw_done(context, qw_protect(context->state.env, save_field, &call));
}

/* ---- guides */

typedef struct guide_call {
    qw_context_state *c;
    const qw_guide *guides;
    uint32_t count;
    const char *path;
    qw_steering copy; /* its guides only */
} guide_call;

/* Fails unless guide g is of a known kind, has points enough, all finite, and rings only if it is a closed loop. */
static void require_guide(qw_env *env, const qw_guide *guide, uint32_t g)
{
    if (guide->size != sizeof *guide)
        qw_fail(env, QW_ARGUMENT, g, "the size stamp of guide %u is %u, not sizeof(qw_guide) = %zu", g, guide->size,
                sizeof *guide);
    if (guide->kind != QW_GUIDE_DIRECTION && guide->kind != QW_GUIDE_LOOP)
        qw_fail(env, QW_ARGUMENT, g, "guide %u is of no kind that there is", g);
    if (guide->rings > 0 && (guide->kind != QW_GUIDE_LOOP || !guide->closed))
        qw_fail(env, QW_ARGUMENT, g, "guide %u is to have rings, but is no closed loop", g);
    if (guide->rings > QW_MOST_RINGS)
        qw_fail(env, QW_ARGUMENT, g, "guide %u is to have %u rings; %d are the most", g, guide->rings, QW_MOST_RINGS);
    uint32_t least = guide->closed ? 3 : 2;
    if (!guide->points || guide->point_count < least)
        qw_fail(env, QW_ARGUMENT, g, "guide %u has %u points; it needs %u and more", g,
                guide->points ? guide->point_count : 0, least);
    for (size_t i = 0; i < 3 * (size_t)guide->point_count; i++)
        if (!isfinite(guide->points[i]))
            qw_fail(env, QW_NOT_FINITE, g, "point %zu of guide %u is NaN or infinite", i / 3, g);
}

/* Checks all guides and copies them; closed ones get their first point again as the last. */
static void copy_guides(void *user)
{
    guide_call *call = user;
    qw_env *env = call->c->env;
    uint64_t points = 0;
    for (uint32_t g = 0; g < call->count; g++) {
        require_guide(env, &call->guides[g], g);
        points += (uint64_t)call->guides[g].point_count + (call->guides[g].closed != 0);
    }
    if (points > INT32_MAX) qw_fail(env, QW_TOO_LARGE, -1, "the guides have more than %d points", INT32_MAX);
    qw_steering *s = &call->copy;
    s->guide_count = call->count;
    s->guide_begin = QW_NEW(env, uint32_t, (size_t)call->count + 1), s->guide_kind = QW_NEW(env, uint8_t, call->count);
    s->guide_rings = QW_NEW(env, uint32_t, call->count);
    s->guide_point = QW_NEW(env, double, 3 * points);
    s->guide_begin[0] = 0;
    for (uint32_t g = 0; g < call->count; g++) {
        const qw_guide *guide = &call->guides[g];
        double *to = s->guide_point + 3 * (size_t)s->guide_begin[g];
        memcpy(to, guide->points, 3 * (size_t)guide->point_count * sizeof *to);
        if (guide->closed) memcpy(to + 3 * (size_t)guide->point_count, guide->points, 3 * sizeof *to);
        s->guide_kind[g] = (uint8_t)guide->kind, s->guide_rings[g] = guide->rings;
        s->guide_begin[g + 1] = s->guide_begin[g] + guide->point_count + (guide->closed != 0);
    }
}

/* Reads guides from a file and hands them to the context, as if the caller had given them. */
static void load_guides(void *user)
{
    guide_call *call = user;
    qw_env *env = call->c->env;
    qw_guide *guides = qw_read_guides(env, call->path, &call->count);
    call->guides = guides;
    copy_guides(call);
    for (uint32_t g = 0; g < call->count; g++) qw_free(env, (void *)guides[g].points);
    qw_free(env, guides);
    call->guides = NULL;
}

/* Makes guides by `body` and, if it succeeds, lets them replace those of the context. */
static qw_status take_guides(qw_context *context, guide_call *call, void (*body)(void *user))
{
    qw_context_state *c = call->c;
    qw_status status = body ? qw_protect(c->env, body, call) : QW_OK;
    qw_steering steering = c->steering;
    const qw_steering *guides = &call->copy;
    steering.guide_count = guides->guide_count, steering.guide_begin = guides->guide_begin;
    steering.guide_kind = guides->guide_kind, steering.guide_rings = guides->guide_rings;
    steering.guide_point = guides->guide_point;
    if (status == QW_OK) qw_replace_steering(c, &steering);
    return qw_done(context, status);
}

qw_status qw_set_guides(qw_context *context, const qw_guide *guides, uint32_t count)
{
    if (!context) return QW_ARGUMENT;
    if (!guides && count > 0) return qw_refuse(context, QW_ARGUMENT, "the guides are missing");
    qw_status status = require_mesh(context);
    guide_call call = {.c = &context->state, .guides = guides, .count = count};
    return status == QW_OK ? take_guides(context, &call, count > 0 ? copy_guides : NULL) : status;
}

qw_status qw_load_guides(qw_context *context, const char *path)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to read from");
    qw_status status = require_mesh(context);
    guide_call call = {.c = &context->state, .path = path};
    return status == QW_OK ? take_guides(context, &call, load_guides) : status;
}

/* ---- what moves */

typedef struct motion_call {
    qw_context_state *c;
    const qw_attribute *attributes;
    uint32_t count;
    qw_vec3 *made;
    qw_equal_weights joints;
} motion_call;

/* How the faces move with bones and morph targets, and curves around joints, into call->made and call->joints. */
static void find_motion(void *user)
{
    motion_call *call = user;
    qw_env *env = call->c->env;
    const qw_clean_input *in = &call->c->input;
    qw_require_attributes(env, call->attributes, call->count, in->vertex_count, in->face_begin[in->face_count],
                          in->face_count);
    double *largest = qw_largest_offsets(env, in, call->attributes, call->count);
    call->made = qw_motion_of_faces(env, in, call->attributes, call->count, largest);
    call->joints = qw_find_equal_weights(env, in, call->attributes, call->count, largest, call->made);
    qw_free(env, largest);
}

qw_status qw_set_motion(qw_context *context, const qw_attribute *attributes, uint32_t count)
{
    if (!context) return QW_ARGUMENT;
    qw_context_state *c = &context->state;
    motion_call call = {.c = c, .attributes = attributes, .count = count};
    qw_status status = require_mesh(context);
    if (status != QW_OK) return status;
    status = qw_protect_listening(c->env, find_motion, &call);
    qw_steering steering = c->steering;
    steering.motion = call.made;
    steering.joint_count = call.joints.count, steering.joint_begin = call.joints.begin;
    steering.joint_point = call.joints.point;
    bool is_other = call.made || c->steering.motion;
    if (status == QW_OK && is_other) qw_replace_steering(c, &steering);
    return qw_done(context, status);
}

/* ---- regions */

typedef struct region_call {
    qw_context_state *c;
    const uint8_t *inside;
    uint32_t count;
    uint8_t *copy;
} region_call;

/* Checks and copies which faces are inside of the region: a number for each face, 0 or 1, not all of them 0. */
static void copy_region(void *user)
{
    region_call *call = user;
    qw_env *env = call->c->env;
    if (call->count != call->c->input.face_count)
        qw_fail(env, QW_ARGUMENT, -1, "the region says something of %u faces, but the mesh has %u", call->count,
                call->c->input.face_count);
    uint32_t inside = 0;
    for (uint32_t f = 0; f < call->count; f++) {
        if (call->inside[f] > 1)
            qw_fail(env, QW_ARGUMENT, f, "face %u is %u in the region; it must be 0, outside, or 1, inside", f,
                    call->inside[f]);
        inside += call->inside[f];
    }
    if (inside == 0) qw_fail(env, QW_ARGUMENT, -1, "no face is in the region");
    call->copy = QW_NEW(env, uint8_t, call->count);
    memcpy(call->copy, call->inside, call->count);
}

qw_status qw_set_region(qw_context *context, const uint8_t *inside, uint32_t count)
{
    if (!context) return QW_ARGUMENT;
    if (!inside && count > 0) return qw_refuse(context, QW_ARGUMENT, "the region is missing");
    qw_context_state *c = &context->state;
    qw_status status = require_mesh(context);
    region_call call = {c, inside, count, NULL};
    if (status != QW_OK) return status;
    if (inside) status = qw_protect(c->env, copy_region, &call);
    qw_steering steering = c->steering;
    steering.region = call.copy;
    if (status == QW_OK) qw_replace_steering(c, &steering);
    return qw_done(context, status);
}
