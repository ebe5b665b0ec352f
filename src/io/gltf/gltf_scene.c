#include "io/gltf/gltf_scene.h"

#include <math.h>
#include <string.h>

/* Below this share of the product of its columns' lengths a determinant counts as 0: the map cannot be undone. */
static const double LEAST_DETERMINANT = 1e-12;

typedef struct scene {
    qw_gltf_document *d;
    uint32_t *parent; /* uint32_t[nodes]: QW_NONE: a root */
    uint32_t *order;  /* uint32_t[nodes]: parents before their children */
    qw_gltf_map *map; /* qw_gltf_map[nodes]: to the scene */
    bool *is_shown;   /* bool[nodes] */
} scene;

/* ---- maps */

static const qw_gltf_map identity = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};

static qw_gltf_map compose(const qw_gltf_map *outer, const qw_gltf_map *inner)
{
    qw_gltf_map out;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) {
            double sum = k == 3 ? outer->m[4 * i + 3] : 0;
            for (int j = 0; j < 3; j++) sum += outer->m[4 * i + j] * inner->m[4 * j + k];
            out.m[4 * i + k] = sum;
        }
    return out;
}

static double cofactor(const double *m, int i, int k)
{
    int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    return m[4 * i1 + k1] * m[4 * i2 + k2] - m[4 * i1 + k2] * m[4 * i2 + k1];
}

/* False where it has none. */
static bool invert(const qw_gltf_map *map, double out[12], bool *is_mirrored)
{
    const double *m = map->m;
    double det = 0, lengths = 1;
    for (int k = 0; k < 3; k++) det += m[k] * cofactor(m, 0, k);
    for (int k = 0; k < 3; k++) lengths *= sqrt(m[k] * m[k] + m[4 + k] * m[4 + k] + m[8 + k] * m[8 + k]);
    if (!(fabs(det) > LEAST_DETERMINANT * lengths) || !(fabs(det) > 0) || !isfinite(1 / det)) return false;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) out[4 * i + k] = cofactor(m, k, i) / det;
        out[4 * i + 3] = -(out[4 * i] * m[3] + out[4 * i + 1] * m[7] + out[4 * i + 2] * m[11]);
    }
    for (int i = 0; i < 12; i++)
        if (!isfinite(out[i]) || !isfinite(m[i])) return false;
    *is_mirrored = det < 0;
    return true;
}

/* False where the node has no such member. */
static bool read_numbers(const qw_gltf_document *d, uint32_t node, const char *member, uint32_t count, double *out)
{
    uint32_t object = d->list[QW_GLTF_NODES][node], array = qw_gltf_array(d, object, member, QW_GLTF_NODES, node);
    if (array == QW_NONE) return false;
    bool good = d->json.token[array].count == count;
    for (uint32_t k = 0, t = array + 1; k < count && good; k++, t = d->json.token[t].next)
        good = qw_json_number(&d->json, t, &out[k]) && isfinite(out[k]);
    if (!good) qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_NODES, node, "its %s is not %u finite numbers", member, count);
    return true;
}

/* The map of a node into its parent: its matrix, or that of translation, rotation and scale. */
static qw_gltf_map read_map(const qw_gltf_document *d, uint32_t node)
{
    double by_columns[16], t[3] = {0, 0, 0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    qw_gltf_map map = identity;
    if (read_numbers(d, node, "matrix", 16, by_columns)) {
        for (int i = 0; i < 12; i++) map.m[i] = by_columns[i % 4 * 4 + i / 4];
        return map;
    }
    read_numbers(d, node, "translation", 3, t);
    read_numbers(d, node, "rotation", 4, r);
    read_numbers(d, node, "scale", 3, s);
    double length = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3], f = length > 0 ? 2 / length : 0;
    const double x = r[0], y = r[1], z = r[2], w = r[3];
    const double turn[9] = {1 - f * (y * y + z * z), f * (x * y - z * w),     f * (x * z + y * w),
                            f * (x * y + z * w),     1 - f * (x * x + z * z), f * (y * z - x * w),
                            f * (x * z - y * w),     f * (y * z + x * w),     1 - f * (x * x + y * y)};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) map.m[4 * i + k] = turn[3 * i + k] * s[k];
        map.m[4 * i + 3] = t[i];
    }
    return map;
}

/* ---- nodes */

/* Each node has one parent at most, and every one is below a root. */
static void order_nodes(scene *s)
{
    const qw_gltf_document *d = s->d;
    uint32_t nodes = d->length[QW_GLTF_NODES], ordered = 0;
    for (uint32_t i = 0; i < nodes; i++) s->parent[i] = QW_NONE;
    for (uint32_t i = 0; i < nodes; i++) {
        uint32_t children = qw_gltf_array(d, d->list[QW_GLTF_NODES][i], "children", QW_GLTF_NODES, i);
        if (children == QW_NONE) continue;
        for (uint32_t k = 0, t = children + 1; k < d->json.token[children].count; k++, t = d->json.token[t].next) {
            uint32_t child = qw_gltf_item_index(d, t, QW_GLTF_NODES, QW_GLTF_NODES, i);
            if (s->parent[child] != QW_NONE)
                qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_NODES, child, "it is a child of both node %u and node %u",
                             s->parent[child], i);
            s->parent[child] = i;
        }
    }
    for (uint32_t i = 0; i < nodes; i++)
        if (s->parent[i] == QW_NONE) s->order[ordered++] = i;
    for (uint32_t at = 0; at < ordered; at++) {
        uint32_t children = qw_json_member(&d->json, d->list[QW_GLTF_NODES][s->order[at]], "children");
        if (children == QW_NONE) continue;
        for (uint32_t k = 0, t = children + 1; k < d->json.token[children].count; k++, t = d->json.token[t].next)
            s->order[ordered++] = qw_gltf_item_index(d, t, QW_GLTF_NODES, QW_GLTF_NODES, s->order[at]);
    }
    if (ordered == nodes) return;
    bool *is_ordered = QW_NEW_ZERO(d->env, bool, nodes);
    for (uint32_t at = 0; at < ordered; at++) is_ordered[s->order[at]] = true;
    for (uint32_t i = 0; i < nodes; i++)
        if (!is_ordered[i])
            qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_NODES, i, "it is below itself, in a circle of nodes");
}

/* The nodes of the scene that the file shows first; all where it has no scenes. */
static void mark_shown(scene *s)
{
    const qw_gltf_document *d = s->d;
    uint32_t nodes = d->length[QW_GLTF_NODES], scenes = d->length[QW_GLTF_SCENES], shown = 0;
    if (scenes == 0) {
        for (uint32_t i = 0; i < nodes; i++) s->is_shown[i] = true;
        return;
    }
    uint32_t number = qw_json_member(&d->json, 0, "scene");
    if (number != QW_NONE) shown = qw_gltf_item_index(d, number, QW_GLTF_SCENES, QW_GLTF_SCENES, 0);
    uint32_t roots = qw_gltf_array(d, d->list[QW_GLTF_SCENES][shown], "nodes", QW_GLTF_SCENES, shown);
    for (uint32_t k = 0, t = roots + 1; roots != QW_NONE && k < d->json.token[roots].count;
         k++, t = d->json.token[t].next)
        s->is_shown[qw_gltf_item_index(d, t, QW_GLTF_NODES, QW_GLTF_SCENES, shown)] = true;
    for (uint32_t at = 0; at < nodes; at++) {
        uint32_t i = s->order[at];
        if (s->parent[i] != QW_NONE && s->is_shown[s->parent[i]]) s->is_shown[i] = true;
    }
    if (scenes > 1)
        qw_log(d->env, QW_LOG_WARNING, "%s: there are %u scenes; only the meshes of scene %u are read", d->name, scenes,
               shown);
}

static void find_maps(scene *s)
{
    for (uint32_t at = 0; at < s->d->length[QW_GLTF_NODES]; at++) {
        uint32_t i = s->order[at];
        qw_gltf_map local = read_map(s->d, i);
        s->map[i] = s->parent[i] == QW_NONE ? local : compose(&s->map[s->parent[i]], &local);
    }
}

/* ---- skins */

/* From the mesh to the scene as the first joint of the skin has it at rest. */
static qw_gltf_map map_of_skin(scene *s, uint32_t skin)
{
    qw_gltf_document *d = s->d;
    uint32_t t = d->list[QW_GLTF_SKINS][skin], joints = qw_gltf_array(d, t, "joints", QW_GLTF_SKINS, skin);
    if (joints == QW_NONE || d->json.token[joints].count == 0)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_SKINS, skin, "it has no joints");
    qw_gltf_map joint = s->map[qw_gltf_item_index(d, joints + 1, QW_GLTF_NODES, QW_GLTF_SKINS, skin)],
                inverse = identity;
    uint32_t a = qw_gltf_index(d, t, "inverseBindMatrices", QW_GLTF_ACCESSORS, QW_GLTF_SKINS, skin);
    if (a == QW_NONE) return joint;
    if (d->accessor[a].components != 16 || !d->accessor[a].is_matrix ||
        d->accessor[a].count < d->json.token[joints].count)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_SKINS, skin, "its inverseBindMatrices are not a MAT4 for each joint");
    const float *by_columns = qw_gltf_values(d, a);
    for (int i = 0; i < 12; i++) inverse.m[i] = (double)by_columns[i % 4 * 4 + i / 4];
    return compose(&joint, &inverse);
}

/* uint32_t[skins + 1]: where the joints of each begin among all. */
static uint32_t *count_joints(const qw_gltf_document *d)
{
    uint32_t skins = d->length[QW_GLTF_SKINS], *begin = QW_NEW_ZERO(d->env, uint32_t, skins + (size_t)1);
    for (uint32_t i = 0; i < skins; i++) {
        uint32_t joints = qw_gltf_array(d, d->list[QW_GLTF_SKINS][i], "joints", QW_GLTF_SKINS, i);
        begin[i + 1] = begin[i] + (joints == QW_NONE ? 0 : d->json.token[joints].count);
    }
    return begin;
}

/* ---- objects */

/* The map of an object's vertices into the scene, and back; one that flattens the mesh is taken for the identity. */
static void settle_object(scene *s, qw_gltf_object *o, uint32_t skin, const uint32_t *joint_begin, qw_gltf_map *map)
{
    *map = s->map[o->node];
    if (skin != QW_NONE) {
        *map = map_of_skin(s, skin);
        o->joint_begin = joint_begin[skin], o->joint_count = joint_begin[skin + 1] - joint_begin[skin];
    }
    if (invert(map, o->to_local, &o->is_mirrored)) return;
    qw_log(s->d->env, QW_LOG_WARNING, "%s: node %u flattens its mesh, which is read as if it did not", s->d->name,
           o->node);
    *map = identity;
    memcpy(o->to_local, identity.m, sizeof o->to_local);
}

qw_gltf_object *qw_gltf_find_objects(qw_gltf_document *d, uint32_t *count, qw_gltf_map **to_scene, uint32_t *joints)
{
    uint32_t nodes = d->length[QW_GLTF_NODES];
    scene s = {d, QW_NEW(d->env, uint32_t, nodes), QW_NEW(d->env, uint32_t, nodes), QW_NEW(d->env, qw_gltf_map, nodes),
               QW_NEW_ZERO(d->env, bool, nodes)};
    order_nodes(&s);
    mark_shown(&s);
    find_maps(&s);
    const uint32_t *joint_begin = count_joints(d);
    *count = 0;
    *joints = joint_begin[d->length[QW_GLTF_SKINS]];
    qw_gltf_object *objects = QW_NEW_ZERO(d->env, qw_gltf_object, nodes);
    *to_scene = QW_NEW(d->env, qw_gltf_map, nodes);
    for (uint32_t i = 0; i < nodes; i++) {
        uint32_t t = d->list[QW_GLTF_NODES][i], mesh = qw_gltf_index(d, t, "mesh", QW_GLTF_MESHES, QW_GLTF_NODES, i),
                 skin = qw_gltf_index(d, t, "skin", QW_GLTF_SKINS, QW_GLTF_NODES, i);
        if (!s.is_shown[i] || mesh == QW_NONE) continue;
        objects[*count] = (qw_gltf_object){.node = i, .mesh = mesh};
        settle_object(&s, &objects[*count], skin, joint_begin, &(*to_scene)[*count]);
        ++*count;
    }
    return objects;
}
