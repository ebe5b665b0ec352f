/* What callers hand in is looked at number by number before any of it is used. */
#include "products/attributes/transfer.h"

#include <math.h>
#include <string.h>

/* Refuses attribute i where its sizes, kinds or arrays are none that can be carried. */
static void require_shape(qw_env *env, const qw_attribute *a, uint32_t i)
{
    if (a->size != sizeof *a)
        qw_fail(env, QW_ARGUMENT, i, "the size stamp of attribute %u is %u, not sizeof(qw_attribute) = %zu", i, a->size,
                sizeof *a);
    if (!a->name || !a->name[0]) qw_fail(env, QW_ARGUMENT, i, "attribute %u has no name", i);
    if ((unsigned)a->domain > QW_PER_FACE || (unsigned)a->kind > QW_LABELS)
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s is of no domain or kind that there is", a->name);
    if (a->components < 1 || a->components > QW_MOST_COMPONENTS)
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s has %u components; 1 to %d are allowed", a->name, a->components,
                QW_MOST_COMPONENTS);
    static const struct {
        uint32_t least, most;
        bool on_faces, on_corners;
    } rule[] = {[QW_VALUES] = {1, QW_MOST_COMPONENTS, true, true},
                [QW_NORMALS] = {3, 3, false, true},
                [QW_UVS] = {2, 3, false, true},
                [QW_WEIGHTS] = {1, QW_MOST_COMPONENTS, false, false},
                [QW_LABELS] = {1, 1, true, true}};
    if (a->components < rule[a->kind].least || a->components > rule[a->kind].most)
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s has %u components; its kind has %u to %u", a->name, a->components,
                rule[a->kind].least, rule[a->kind].most);
    if ((a->domain == QW_PER_FACE && !rule[a->kind].on_faces) ||
        (a->domain == QW_PER_CORNER && !rule[a->kind].on_corners))
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s is of a kind that does not go by %s", a->name,
                a->domain == QW_PER_FACE ? "faces" : "corners");
}

/* Fails where attribute i lacks an array that its kind needs. */
static void require_arrays(qw_env *env, const qw_attribute *a, uint32_t i)
{
    bool labels = a->kind == QW_LABELS;
    if (a->count && (labels ? !a->labels : !a->values))
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s has no %s", a->name, labels ? "labels" : "values");
    if (a->count && a->kind == QW_WEIGHTS && !a->group)
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s has weights but no groups", a->name);
    if (a->label_count && !a->label_names)
        qw_fail(env, QW_ARGUMENT, i, "attribute %.80s counts names of labels but has none", a->name);
    for (uint32_t k = 0; k < a->label_count; k++)
        if (!a->label_names[k]) qw_fail(env, QW_ARGUMENT, i, "attribute %.80s has no name for label %u", a->name, k);
}

/* Fails at a label without a name, a value that is not finite, or a weight below 0. */
static void require_numbers(qw_env *env, const qw_attribute *a)
{
    for (uint32_t e = 0; e < a->count && a->kind == QW_LABELS && a->label_names; e++)
        if (a->labels[e] < -1 || a->labels[e] >= (int64_t)a->label_count)
            qw_fail(env, QW_ARGUMENT, e, "attribute %.80s: element %u has label %d, but there are names for 0 to %lld",
                    a->name, e, a->labels[e], (long long)a->label_count - 1);
    if (a->kind == QW_LABELS) return;
    for (size_t n = 0; n < (size_t)a->count * a->components; n++) {
        uint32_t e = (uint32_t)(n / a->components);
        if (!isfinite(a->values[n]))
            qw_fail(env, QW_NOT_FINITE, e, "attribute %.80s: element %u is NaN or infinite", a->name, e);
        if (a->kind == QW_WEIGHTS && a->values[n] < 0)
            qw_fail(env, QW_ARGUMENT, e, "attribute %.80s: element %u has a weight below 0", a->name, e);
    }
}

void qw_require_attributes(qw_env *env, const qw_attribute *attributes, uint32_t count, uint32_t vertices,
                           uint32_t corners, uint32_t faces)
{
    static const char *const things[] = {"vertices", "corners", "faces"};
    const uint32_t wanted[] = {vertices, corners, faces};
    if (count && !attributes) qw_fail(env, QW_ARGUMENT, -1, "there are no attributes, but a count of them");
    for (uint32_t i = 0; i < count; i++) {
        const qw_attribute *a = &attributes[i];
        require_shape(env, a, i);
        if (a->count != wanted[a->domain])
            qw_fail(env, QW_ARGUMENT, i, "attribute %.80s has %u elements, but the mesh has %u %s", a->name, a->count,
                    wanted[a->domain], things[a->domain]);
        require_arrays(env, a, i);
        require_numbers(env, a);
    }
}
