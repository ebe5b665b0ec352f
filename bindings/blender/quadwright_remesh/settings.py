# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel shows: settings of a scene, the rest of them made from the library's table of options (options.json, made by the build)."""
import json
import math
import os

import bpy



def _read(name):
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), name), encoding="utf-8") as file:
        return json.load(file)


TABLE = _read("options.json")  # {name: {"kind", "default", "least", "most", "unit", "choices", "help"}}
PRESETS = _read("presets.json")  # {name: {"options": {name: text}, "help"}}

# Options that have a place of their own in the panel, or that it sets itself.
PLACED = {
    "faces",
    "vertices",
    "edge_length",
    "ratio",
    "follow",
    "adaptive",
    "symmetry",
    "symmetry_x",
    "symmetry_y",
    "symmetry_z",
    "symmetry_offset",
    "sharp_angle",
    "sharp_marks",
    "keep_marks",
    "texture",
}
REST = [name for name in TABLE if name not in PLACED]
# Of the rest, what only who knows the paper wants: shown last.
MOST_REAL = 1e30


def _title(name):
    return name.replace("_", " ").capitalize()


def _sentence(text):
    return text[0].upper() + text[1:]  # Blender adds the full stop


def _changed(self, context):
    from . import live

    live.settings_changed(self, context)


def _set_option(settings, name, text):
    """A setting to what an option of a preset says, as text; None: to its default."""
    row = TABLE[name]
    value = row["default"] if text is None else text if row["kind"] == "choice" else text != "off" if row["kind"] == "flag" else float(text)
    if name == "symmetry":
        settings.symmetry = {"none": "OFF"}.get(value, value.upper())
    elif name == "sharp_angle":
        settings.sharp = "AUTO" if value < 0 else "NONE" if value >= 180 else "ANGLE"
        if settings.sharp == "ANGLE":
            settings.angle = math.radians(value)
    elif name == "adaptive":
        settings.density = "CURVATURE" if value > 0 else "EVEN"
        settings.adaptive = value or row["default"]
    elif name == "follow":
        settings.follow = value
    else:
        setattr(settings, "option_" + name, int(value) if row["kind"] == "count" else value)


def _preset_chosen(self, context):
    """Sets what the preset names; what another one may have set goes back to its default. What is changed afterwards wins."""
    own = PRESETS[self.preset.lower()]["options"] if self.preset != "NONE" else {}
    for name in dict.fromkeys(name for row in PRESETS.values() for name in row["options"]):
        _set_option(self, name, own.get(name))


def _property(name, row):
    about = _sentence(row["help"]) + (f" ({row['unit']})" if row["unit"] not in ("", "-") else "")
    common = {"name": _title(name), "description": about, "update": _changed}
    if row["kind"] == "flag":
        return bpy.props.BoolProperty(default=row["default"], **common)
    if row["kind"] == "choice":
        return bpy.props.EnumProperty(items=[(c, c, "") for c in row["choices"]], default=row["default"], **common)
    if row["kind"] == "count":
        return bpy.props.IntProperty(default=int(row["default"]), min=int(row["least"]), max=int(min(row["most"], 2**31 - 1)), **common)
    return bpy.props.FloatProperty(default=row["default"], min=max(row["least"], -MOST_REAL), max=min(row["most"], MOST_REAL), precision=3, **common)


TARGETS = [
    ("AUTO", "Automatic", "A quarter as many quads as the surface has triangles, from 100 to 20,000"),
    ("FACES", "Faces", "This many quads"),
    ("EDGE", "Edge Length", "Quads whose edges have this mean length, as the object stands in the scene"),
    ("RATIO", "Ratio", "This many quads for each triangle of the surface"),
]
DENSITIES = [
    ("EVEN", "Even", "Quads of one size"),
    ("CURVATURE", "Curvature", "Smaller quads where the surface bends, on limbs and between close sharp edges"),
    ("GROUP", "Vertex Group", "Smaller quads where the weights of a vertex group are larger"),
    ("COLOR", "Color", "Smaller quads where a color attribute is brighter"),
]
SYMMETRIES = [
    ("OFF", "Off", "Both sides as they come; a Mirror modifier still sets its own plane"),
    ("AUTO", "Auto", "Both sides alike where that costs nothing: the surface is nearly symmetric and has no sharp edges"),
    ("ANY", "Any", "Both sides alike where the surface is nearly symmetric, sharp edges or not"),
    ("X", "X", "Both sides alike across the object's X axis"),
    ("Y", "Y", "Both sides alike across the object's Y axis"),
    ("Z", "Z", "Both sides alike across the object's Z axis"),
]
PRESET_ITEMS = [("NONE", "Defaults", "The settings as they come")]
PRESET_ITEMS += [(name.upper(), "CAD" if name == "cad" else _title(name), _sentence(row["help"])) for name, row in PRESETS.items()]
SHARPS = [
    ("AUTO", "Auto", "Edges are sharp above an angle that suits the surface"),
    ("ANGLE", "Angle", "Edges are sharp above this angle"),
    ("MARKS", "Marks Only", "Only the edges that are marked below are sharp"),
    ("NONE", "None", "No edge is sharp"),
]
MARKS = [
    ("SHARP", "Sharp", "Edges that are marked sharp"),
    ("SEAM", "Seams", "Edges that are marked as seams"),
    ("CREASE", "Creases", "Edges with a crease of a half or more"),
    ("MATERIAL", "Materials", "Borders between materials"),
    ("FACE_SET", "Face Sets", "Borders between face sets (Blender 3.6 and later)"),
]
GUIDES = [
    ("NONE", "None", ""),
    ("CURVE", "Curve", "The splines of a curve object on the surface, or the strokes of a grease pencil"),
    ("EDGES", "Selected Edges", "Edges of the mesh that are selected"),
]
GUIDE_KINDS = [("LOOP", "Edges", "Edges of the quads lie on the guides"), ("DIRECTION", "Direction", "Quads run along the guides")]
KEEP = [
    ("UVS", "UVs", "UV maps"),
    ("MATERIALS", "Materials", "Materials, and smooth or flat shading"),
    ("COLORS", "Colors", "Color attributes"),
    ("WEIGHTS", "Weights", "Vertex groups"),
    ("SHAPES", "Shape Keys", "Shape keys"),
]


def _is_curve(self, candidate):
    return candidate.type in {"CURVE", "GPENCIL", "GREASEPENCIL"}


def _annotations():
    made = {
        "preset": bpy.props.EnumProperty(
            name="Preset", items=PRESET_ITEMS, default="NONE", update=_preset_chosen, description="Settings that suit a kind of surface; change them afterwards as you like"
        ),
        "target": bpy.props.EnumProperty(name="Target", items=TARGETS, default="AUTO", update=_changed, description="How many quads"),
        "faces": bpy.props.IntProperty(
            name="Faces", default=5000, min=8, max=20000000, soft_max=100000, step=100, update=_changed, description="Number of quads wanted"
        ),
        "edge_length": bpy.props.FloatProperty(
            name="Edge Length",
            default=0.1,
            min=1e-6,
            soft_max=100,
            max=MOST_REAL,
            precision=4,
            subtype="DISTANCE",
            update=_changed,
            description="Mean length of the quads' edges, as the object stands in the scene",
        ),
        "ratio": bpy.props.FloatProperty(
            name="Ratio",
            default=0.25,
            min=0.0001,
            soft_max=2.0,
            max=100.0,
            precision=3,
            update=_changed,
            description=_sentence(TABLE["ratio"]["help"]).split(" (0:")[0],
        ),
        "follow": bpy.props.FloatProperty(
            name="Follow", default=TABLE["follow"]["default"], min=0, max=1, precision=2, update=_changed, description=_sentence(TABLE["follow"]["help"])
        ),
        "density": bpy.props.EnumProperty(
            name="Density", items=DENSITIES, default="CURVATURE", update=_changed, description="Where quads are smaller; their number stays"
        ),
        "adaptive": bpy.props.FloatProperty(
            name="Adaptive", default=TABLE["adaptive"]["default"], min=0, max=1, precision=2, update=_changed, description=_sentence(TABLE["adaptive"]["help"])
        ),
        "density_group": bpy.props.StringProperty(
            name="Group", update=_changed, description="Vertex group; where its weight is 1 edges are as many times shorter as Contrast says"
        ),
        "density_color": bpy.props.StringProperty(
            name="Color", update=_changed, description="Color attribute; where it is white edges are as many times shorter as Contrast says"
        ),
        "contrast": bpy.props.FloatProperty(
            name="Contrast",
            default=4,
            min=1,
            max=20,
            precision=1,
            update=_changed,
            description="How many times shorter edges are at weight 1 or white than at 0 or black",
        ),
        "symmetry": bpy.props.EnumProperty(
            name="Symmetry", items=SYMMETRIES, default="AUTO", update=_changed, description="Both sides of a plane alike"
        ),
        "sharp": bpy.props.EnumProperty(
            name="Sharp", items=SHARPS, default="AUTO", update=_changed, description="Which edges of the surface edges of the quads follow"
        ),
        "angle": bpy.props.FloatProperty(
            name="Angle",
            default=0.6981317,
            min=0,
            max=3.1415927,
            subtype="ANGLE",
            update=_changed,
            description="An edge is sharp where its faces' normals differ by more than this",
        ),
        "marks": bpy.props.EnumProperty(
            name="Marked Edges",
            items=MARKS,
            options={"ENUM_FLAG"},
            default={"SHARP", "MATERIAL"},
            update=_changed,
            description="Marked edges and borders that edges of the quads follow as well",
        ),
        "guides": bpy.props.EnumProperty(
            name="Guides", items=GUIDES, default="NONE", update=_changed, description="Lines on the surface that steer the quads"
        ),
        "guide_curve": bpy.props.PointerProperty(
            name="Curve", type=bpy.types.Object, poll=_is_curve, update=_changed, description="Its splines or strokes are the guides"
        ),
        "guide_kind": bpy.props.EnumProperty(name="Guide", items=GUIDE_KINDS, default="LOOP", update=_changed, description="What the guides do"),
        "guide_rings": bpy.props.IntProperty(
            name="Rings",
            default=0,
            min=0,
            max=1000,
            soft_max=12,
            update=_changed,
            description="Closed rings of quads on each side of guides that are closed loops, as around an eye",
        ),
        "keep": bpy.props.EnumProperty(
            name="Keep",
            items=KEEP,
            options={"ENUM_FLAG"},
            default={item[0] for item in KEEP},
            update=_changed,
            description="What is carried over to the quads",
        ),
        "apply_modifiers": bpy.props.BoolProperty(
            name="Apply Modifiers",
            default=True,
            update=_changed,
            description="Remesh what the modifiers make, except armatures and simulations, which stay; off remeshes the mesh below them",
        ),
        "unwrap": bpy.props.BoolProperty(
            name="Unwrap", default=False, update=_changed, description="A UV map of the quads' own, of few charts, instead of the UV maps of the surface"
        ),
        "bake": bpy.props.BoolProperty(
            name="Unwrap and Bake",
            default=False,
            update=_changed,
            description="A UV map of the quads' own, and on it what the surface looks like: colors, normals and what else its materials have, "
            "as packed images of a new material",
        ),
        "multires": bpy.props.BoolProperty(
            name="Multiresolution",
            default=True,
            update=_changed,
            description="Where quads are split (Subdivide), the object has the coarse ones and a Multiresolution modifier with the others as its levels; "
            "off gives it the finest",
        ),
        "lods": bpy.props.StringProperty(
            name="Levels",
            default="",
            update=_changed,
            description="Numbers of quads, with commas between them: each is made of the same surface as an object of its own beside the first, NAME_LOD1, NAME_LOD2 and so on",
        ),
        "keep_original": bpy.props.BoolProperty(name="Keep Original", default=False, description="Keep a hidden copy of the object as it was"),
        "selected_only": bpy.props.BoolProperty(
            name="Selected Faces Only",
            default=True,
            update=_changed,
            description="In edit mode, where some faces are selected, remesh these leave the others and all modifiers as they are; "
            "with none or all selected, or selected edges as guides, the whole mesh is remeshed",
        ),
        "is_live": bpy.props.BoolProperty(name="Live", default=False, description="After a run, remesh the same surface again whenever a setting changes"),
        "show_wires": bpy.props.BoolProperty(
            name="Show Edges", default=True, description="After a run the edges of the quads are drawn over the faces (Object > Viewport Display > Wireframe)"
        ),
        "show_irregular": bpy.props.BoolProperty(
            name="Irregular Vertices", default=False, update=_redraw, description="Dots at the vertices where other than four quads meet"
        ),
    }
    for name in [*REST, "texture"]:
        made["option_" + name] = _property(name, TABLE[name])
    return made


def _redraw(self, context):
    for area in context.screen.areas if context.screen else ():
        if area.type == "VIEW_3D":
            area.tag_redraw()


Settings = type("QUADWRIGHT_PG_settings", (bpy.types.PropertyGroup,), {"__annotations__": _annotations(), "__doc__": "Settings of Quick Remesh to Quads"})


def _number(value):
    """A float32 property as the number that was typed: 0.3, not 0.30000001192092896."""
    return float(f"{value:.7g}")


def rest_of(settings):
    """{name: value} of the fold-out, where they are not the defaults."""
    given = {}
    for name in [*REST, "texture"]:
        value = getattr(settings, "option_" + name)
        value = _number(value) if TABLE[name]["kind"] == "real" else value
        if value != TABLE[name]["default"]:
            given[name] = value
    return given


def levels_of(settings):
    """Numbers of quads of the levels of detail beside the first, as they were typed. Raises Refusal for other words."""
    from .snapshot import Refusal

    words = settings.lods.replace(",", " ").split()
    if not all(word.isdigit() and int(word) > 0 for word in words):
        raise Refusal(f'Levels of Detail must be numbers of quads, such as "5000, 1200", not "{settings.lods}"')
    return [int(word) for word in words]


LEAST_AUTOMATIC, MOST_AUTOMATIC = 100, 20000  # as the library has them


def automatic(obj, context, settings):
    """How many quads the target Automatic makes of an object: a quarter of its triangles."""
    mesh = obj.data
    if settings.apply_modifiers and obj.modifiers and obj.mode != "EDIT":
        mesh = obj.evaluated_get(context.evaluated_depsgraph_get()).data
    triangles = len(mesh.loops) - 2 * len(mesh.polygons)
    return min(max(triangles // 4, LEAST_AUTOMATIC), MOST_AUTOMATIC)


def options_of(settings, scale=1.0):
    """Options of the library for these settings, as keyword arguments; scale: units of the surface for a unit of the scene. The planes of symmetry and what
    the surface brings along (marks, density, guides) are not among them."""
    given = rest_of(settings)
    if settings.target == "FACES":
        given["faces"] = settings.faces
    elif settings.target == "EDGE":
        given["edge_length"] = _number(settings.edge_length) * scale
    elif settings.target == "RATIO":
        given["ratio"] = _number(settings.ratio)
    if _number(settings.follow) != TABLE["follow"]["default"]:
        given["follow"] = _number(settings.follow)
    for name, power in (("cage", 1), ("texel_density", -1)):
        if name in given:
            given[name] *= scale**power
    if settings.density != "CURVATURE":
        given["adaptive"] = 0.0
    elif _number(settings.adaptive) != TABLE["adaptive"]["default"]:
        given["adaptive"] = _number(settings.adaptive)
    if settings.sharp == "ANGLE":
        given["sharp_angle"] = _number(math.degrees(settings.angle))
    elif settings.sharp == "NONE":
        given["sharp_angle"] = 180.0
    return given


classes = (Settings,)


def register():
    bpy.utils.register_class(Settings)
    bpy.types.Scene.quadwright = bpy.props.PointerProperty(type=Settings)


def unregister():
    del bpy.types.Scene.quadwright
    bpy.utils.unregister_class(Settings)
