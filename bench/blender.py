"""Remeshes a surface by Blender's own QuadriFlow, for comparison: blender -b --python bench/blender.py -- IN.obj OUT.obj FACES

Blender refuses meshes with short edges, so the surface is scaled to 100 units across and the result scaled back."""
import sys
import time

import bpy

source, result, faces = sys.argv[sys.argv.index("--") + 1:][:3]
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.wm.obj_import(filepath=source) if hasattr(bpy.ops.wm, "obj_import") else bpy.ops.import_scene.obj(filepath=source)
thing = bpy.context.selected_objects[0]
bpy.context.view_layer.objects.active = thing
scale = 100 / max(thing.dimensions)
for vertex in thing.data.vertices:
    vertex.co *= scale
begin = time.perf_counter()
outcome = bpy.ops.object.quadriflow_remesh(mode="FACES", target_faces=int(faces), use_preserve_sharp=False, use_preserve_boundary=True, seed=0)
print(f"quadriflow: {outcome}, {time.perf_counter() - begin:.2f} s, {len(thing.data.polygons)} faces")
with open(result, "w", encoding="ascii") as out:
    for vertex in thing.data.vertices:
        out.write("v %.9g %.9g %.9g\n" % tuple(vertex.co / scale))
    for face in thing.data.polygons:
        out.write("f " + " ".join(str(i + 1) for i in face.vertices) + "\n")
