"""An asset beside Blender's own way to one (Smart UV Project, Cycles' bake from the input), on the same quads, and both beside the input: rendered
by Cycles from the same place. Mean difference of the pictures, of 255, where both show the surface (the input twice: of its noise alone), and of the normals as they are shaded, in degrees.

usage: asset_render.py QUADWRIGHT FOLDER MESH... [--no-blender] (OBJ, or GLB with a texture)   (needs Debian's blender and numpy; pictures and a table come to FOLDER: NAME-cycles.png: input, quads, quads with our maps; what is there already, NAME.json, is not made again; --no-blender: the program's files alone)"""
import json, pathlib, shutil, subprocess, sys, time

TEXELS, FACES, SIZE, SAMPLES = 2048, 5000, 320, 32  # SIZE: of pictures, SAMPLES: of a pixel
SCENE = """
import numpy; numpy.bool = bool  # Debian's glTF importer
import bpy, mathutils, sys, time, json
source, quads, asset, folder, name = sys.argv[sys.argv.index('--') + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = 'CYCLES', 16, False
scene.render.film_transparent = True
scene.render.resolution_x = scene.render.resolution_y = SIZE
scene.view_settings.view_transform = 'Standard'

def load(path):
    before = set(bpy.data.objects)
    if path.endswith('.glb'): bpy.ops.import_scene.gltf(filepath=path)
    elif path.endswith('.obj'): bpy.ops.wm.obj_import(filepath=path, forward_axis='NEGATIVE_Z', up_axis='Y')
    made = [o for o in bpy.data.objects if o not in before and o.type == 'MESH' and not o.name.startswith('Icosphere')] # how bones are shown
    for o in made: # at rest, as the maps are made: an animation would pose the input alone
        o.modifiers.clear(); o.animation_data_clear()
        if o.data.shape_keys: o.shape_key_clear()
        if not o.data.has_custom_normals: # Blender holds those relative to what is smooth: set afterwards, they would turn
            for p in o.data.polygons: p.use_smooth = True
    for other in bpy.data.objects: other.select_set(other in made)
    bpy.context.view_layer.objects.active = made[0]
    if len(made) > 1: bpy.ops.object.join()
    return made[0]

def trees(o): return [m.node_tree for m in o.data.materials if m and m.use_nodes]
def shader(tree): return next(n for n in tree.nodes if n.type == 'BSDF_PRINCIPLED')
def unlink(tree, *names):
    for link in list(tree.links):
        if link.to_socket.name in names and link.to_node.type == 'BSDF_PRINCIPLED': tree.links.remove(link)

def plain(o):
    m = bpy.data.materials.new('plain'); m.use_nodes = True
    m.node_tree.nodes['Principled BSDF'].inputs['Base Color'].default_value = (0.8, 0.8, 0.8, 1)
    m.node_tree.nodes['Principled BSDF'].inputs['Roughness'].default_value = 1
    o.data.materials.clear(); o.data.materials.append(m)
    return m

def only(o):
    for other in bpy.data.objects:
        if other.type == 'MESH': other.hide_render = other is not o
    for other in bpy.data.objects: other.select_set(other is o)
    bpy.context.view_layer.objects.active = o

def with_normals(m, image):
    n = m.node_tree.nodes; t = n.new('ShaderNodeTexImage'); t.image = image
    k = n.new('ShaderNodeNormalMap')
    m.node_tree.links.new(t.outputs['Color'], k.inputs['Color'])
    m.node_tree.links.new(k.outputs['Normal'], n['Principled BSDF'].inputs['Normal'])
    n.active = t
    return t

whole, bare, ours = load(source), load(quads), load(asset)
def has_color(tree): return bool(shader(tree).inputs['Base Color'].links)
coloured = any(map(has_color, trees(whole)))
if not coloured: plain(whole)
m = plain(bare)
only(bare)
bpy.ops.object.mode_set(mode='EDIT'); bpy.ops.mesh.select_all(action='SELECT')
bpy.ops.uv.smart_project(island_margin=0.004); bpy.ops.object.mode_set(mode='OBJECT')
image = bpy.data.images.new('normals', TEXELS, TEXELS); image.colorspace_settings.name = 'Non-Color'
t = with_normals(m, image)
for link in list(m.node_tree.links):
    if link.to_socket.name == 'Normal': m.node_tree.links.remove(link)
whole.hide_render = False; whole.select_set(True); bpy.context.view_layer.objects.active = bare
size = max(whole.dimensions)
begin = time.time()
scene.cycles.samples = 2
bpy.ops.object.bake(type='NORMAL', use_selected_to_active=True, cage_extrusion=0.02 * size, max_ray_distance=0.04 * size, margin=4)
if coloured:
    t = m.node_tree.nodes.new('ShaderNodeTexImage'); t.image = bpy.data.images.new('colour', TEXELS, TEXELS); m.node_tree.nodes.active = t
    bpy.ops.object.bake(type='DIFFUSE', pass_filter={'COLOR'}, use_selected_to_active=True, cage_extrusion=0.02 * size, max_ray_distance=0.04 * size, margin=4)
    m.node_tree.links.new(t.outputs['Color'], m.node_tree.nodes['Principled BSDF'].inputs['Base Color'])
baked = time.time() - begin
scene.cycles.samples = SAMPLES
k = [n for n in m.node_tree.nodes if n.type == 'NORMAL_MAP'][0]
m.node_tree.links.new(k.outputs['Normal'], m.node_tree.nodes['Principled BSDF'].inputs['Normal'])
for o in (whole, ours, bare):
    for tree in trees(o):
        b = shader(tree)
        unlink(tree, 'Roughness', 'Metallic', 'Emission', *([] if coloured else ['Base Color']))
        b.inputs['Roughness'].default_value, b.inputs['Metallic'].default_value, b.inputs['Emission'].default_value = 1, 0, (0, 0, 0, 1)
        if not coloured: b.inputs['Base Color'].default_value = (0.8, 0.8, 0.8, 1)
corners = [whole.matrix_world @ mathutils.Vector(c) for c in whole.bound_box]
middle = sum(corners, mathutils.Vector()) / 8
radius = max((c - middle).length for c in corners)
camera = bpy.data.objects.new('c', bpy.data.cameras.new('c')); scene.collection.objects.link(camera); scene.camera = camera
camera.data.clip_end = 100 * radius; camera.data.clip_start = 0.01 * radius
away = mathutils.Vector((0.5, -1, 0.35)).normalized()
camera.location = middle + away * 2.6 * radius; camera.rotation_euler = away.to_track_quat('Z', 'Y').to_euler()
sun = bpy.data.objects.new('s', bpy.data.lights.new('s', 'SUN')); scene.collection.objects.link(sun)
sun.data.energy = 2; sun.rotation_euler = (away + mathutils.Vector((0.3, 0, 0.6))).to_track_quat('Z', 'Y').to_euler()
scene.world = bpy.data.worlds.new('w'); scene.world.use_nodes = True
scene.world.node_tree.nodes['Background'].inputs[1].default_value = 0.3
pixels = {}

def shoot(o, what):
    only(o)
    scene.render.filepath = f'{folder}/{name}-{what}.png'
    bpy.ops.render.render(write_still=True)
    i = bpy.data.images.load(scene.render.filepath)
    if '-' in what: i.colorspace_settings.name = 'Non-Color'
    a = numpy.empty(len(i.pixels), numpy.float32); i.pixels.foreach_get(a)
    return a.reshape(-1, 4)

for what, o in (('input', whole), ('noise', whole), ('blender', bare), ('ours', ours)):
    scene.cycles.seed = what == 'noise'
    pixels[what] = shoot(o, what)
b = m.node_tree.nodes['Principled BSDF'] # quads without their maps
links = [(l.from_socket, l.to_socket) for l in m.node_tree.links if l.to_socket.node == b]
for _, end in links: m.node_tree.links.remove(end.links[0])
pixels['quads'] = shoot(bare, 'quads')
for begin, end in links: m.node_tree.links.new(begin, end)
def on_white(a): return numpy.concatenate([a[:, :3] * a[:, 3:] + 1 - a[:, 3:], numpy.ones_like(a[:, 3:])], axis=1).reshape(SIZE, SIZE, 4)
row = bpy.data.images.new('row', 3 * SIZE, SIZE)
row.pixels.foreach_set(numpy.concatenate([on_white(pixels[w]) for w in ('input', 'quads', 'ours')], axis=1).astype(numpy.float32).ravel())
row.filepath_raw, row.file_format = f'{folder}/{name}-cycles.png', 'PNG'; row.save()

# normals as shaded, and depths, as light
scene.render.image_settings.color_depth, scene.cycles.samples = "16", 4
scene.cycles.filter_width = 0.01 # one place a pixel
scene.world.node_tree.nodes['Background'].inputs[1].default_value = 0
begin_z, span_z = 1.6 * radius, 2 * radius # the surface lies between
for what, o in (('input', whole), ('blender', bare), ('ours', ours)):
    lights = []
    for tree in trees(o):
        n, b = tree.nodes, shader(tree)
        normal = next((l.from_socket for l in b.inputs['Normal'].links), None) or n.new('ShaderNodeNewGeometry').outputs['Normal']
        half, light, depth, color = n.new('ShaderNodeVectorMath'), n.new('ShaderNodeEmission'), n.new('ShaderNodeMapRange'), n.new('ShaderNodeRGB')
        half.operation = 'MULTIPLY_ADD'; half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
        depth.inputs['From Min'].default_value, depth.inputs['From Max'].default_value = begin_z, begin_z + span_z
        tree.links.new(n.new('ShaderNodeCameraData').outputs['View Z Depth'], depth.inputs['Value'])
        tree.links.new(normal, half.inputs[0])
        tree.links.new(light.outputs[0], next(k for k in n if k.type == 'OUTPUT_MATERIAL').inputs['Surface'])
        color.outputs[0].default_value = b.inputs['Base Color'].default_value
        lights.append((tree, light, {'normals': half.outputs[0], 'depth': depth.outputs[0], 'color': next((l.from_socket for l in b.inputs['Base Color'].links), color.outputs[0])}))
    for kind in ('normals', 'depth', 'color'):
        for tree, light, shown in lights: tree.links.new(shown[kind], light.inputs['Color'])
        scene.view_settings.view_transform = 'Standard' if kind == 'color' else 'Raw'
        pixels[what + ' ' + kind] = shoot(o, f'{what}-{kind}')

def near(a, reach, of): # of a pixel and those around it
    rows = a.reshape(SIZE, SIZE)
    for axis in (0, 1): rows = of([numpy.roll(rows, k, axis) for k in range(-reach, reach + 1)], axis=0)
    return rows.reshape(-1)

def inside(what): # not within two pixels of where a depth jumps by a fiftieth of the size, as at every outline: a pixel that shows nothing is far away
    z = numpy.where(pixels[what + ' depth'][:, 3] == 1, pixels[what + ' depth'][:, 0], 9)
    return (z < 9) & (near(z, 2, numpy.max) - near(z, 2, numpy.min) < 0.04)

told = {'bake_s': baked}
for what in ('noise', 'blender', 'ours'):
    both = inside('input') & (inside(what) if what != 'noise' else True)
    told[what] = float(numpy.abs(pixels['input'][both, :3] - pixels[what][both, :3]).mean() * 255)
    if what == 'noise': continue
    if coloured: told[what + '_color'] = float(numpy.abs(pixels['input color'][both, :3] - pixels[what + ' color'][both, :3]).mean() * 255)
    a, b = (pixels[w + ' normals'][both, :3] * 2 - 1 for w in ('input', what))
    a, b = (x / numpy.maximum(numpy.linalg.norm(x, axis=1), 1e-9)[:, None] for x in (a, b))
    told[what + '_degrees'] = float(numpy.degrees(numpy.arccos(numpy.clip((a * b).sum(1), -1, 1))).mean())
    told[what + '_share'] = float(both.sum() / (pixels['input'][:, 3] == 1).sum())
open(f'{folder}/{name}.json', 'w').write(json.dumps(told))
"""


def triangulated(mesh, target):
    """Polygons of an OBJ cut from their first corners: how they are bent inside is nowhere said, and every program has its own way."""
    with open(mesh) as file, open(target, "w") as out:
        for line in file:
            word, *rest = line.split() or [""]
            if word != "f" or len(rest) == 3:
                out.write(line)
                continue
            for k in range(1, len(rest) - 1):
                out.write(f"f {rest[0]} {rest[k]} {rest[k + 1]}\n")
    return str(target)


def make(program, folder, script, mesh, name, program_only):
    mesh = triangulated(mesh, folder / f"{name}-input.obj") if mesh.endswith(".obj") else shutil.copy(mesh, folder / f"{name}-input.glb")
    quads, asset, report = str(folder / f"{name}-quads.obj"), str(folder / f"{name}.glb"), folder / f"{name}-report.json"
    if not report.exists():
        begin = time.time()
        subprocess.run([program, "asset", mesh, "-o", asset, "--faces", str(FACES), "--texture", str(TEXELS), "-q"], check=True)
        report.write_text(json.dumps({"asset_s": time.time() - begin}))
        subprocess.run([program, mesh, "-o", quads, "--faces", str(FACES), "--no-attributes", "-q"], check=True)
    if program_only:
        return
    with open(folder / f"{name}.log", "w") as log:
        subprocess.run(["blender", "-b", "-P", str(script), "--", str(mesh), quads, asset, str(folder), name], stdout=log, stderr=log)
    told = json.loads((folder / f"{name}.json").read_text())
    (folder / f"{name}.json").write_text(json.dumps(told | json.loads(report.read_text())))


def main(program, folder, *meshes):
    program_only = "--no-blender" in meshes
    meshes = [m for m in meshes if m != "--no-blender"]
    folder = pathlib.Path(folder).resolve()
    folder.mkdir(exist_ok=True)
    script = folder / "scene.py"
    text = SCENE
    for word, value in (("TEXELS", TEXELS), ("SIZE", SIZE), ("SAMPLES", SAMPLES)):
        text = text.replace(word, str(value))
    script.write_text(text)
    print("| mesh | the input twice | ours | Blender | colours alone: ours | Blender | degrees: ours | Blender | ours: s | Blender's bake: s |\n|---|---|---|---|---|---|---|---|---|---|")
    for mesh in meshes:
        name = pathlib.Path(mesh).stem
        if not (folder / f"{name}.json").exists():
            make(program, folder, script, mesh, name, program_only)
        if program_only:
            continue
        t = json.loads((folder / f"{name}.json").read_text())
        colors = " | ".join(f"{t[k]:.2f}" if k in t else "" for k in ("ours_color", "blender_color"))
        print(f"| {name} | {t['noise']:.2f} | {t['ours']:.2f} | {t['blender']:.2f} | {colors} | {t['ours_degrees']:.2f} | {t['blender_degrees']:.2f} | {t['asset_s']:.1f} | {t['bake_s']:.1f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
