# SPDX-License-Identifier: GPL-3.0-or-later
"""A run over one object or several: what they are is read at once, the worker makes their quads, and all of it is written at the end.

A Job never waits: step() is called by the operator until it is over. Until finish() nothing of the scene has changed.
"""
import hashlib
import threading
import time

import bpy
import numpy as np

from . import bake, child, levels, rebuild, settings as settings_module, snapshot as snapshots, state, words
from .snapshot import Refusal

MOST_SURFACES = 4  # that the worker keeps
LEVEL_OF = "quadwright_level_of"  # of an object that is a level of detail: the name of the first
_jobs = [0]


def _suffix(item):
    return f"_LOD{item.level}" if item.level else ""


class Item:
    """One mesh of the run."""

    def __init__(self, snapshot, object_name, expected, is_again):
        self.snapshot, self.object_name, self.expected, self.is_again = snapshot, object_name, expected, is_again
        self.mesh_name = bpy.data.objects[object_name].data.name
        self.level = 0  # of detail: above 0 it becomes an object of its own
        self.error = None  # a sentence
        self.notes, self.lost = [], []
        self.reply = self.arrays = None


def _again(context, obj, settings):
    """The Snapshot that this object's unchanged quads were made from, or None."""
    source, made = state.sources.get(obj.data.name, (None, None)) if obj.type == "MESH" else (None, None)
    if source is None or source.object_name != obj.name:
        return None
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    region = snapshots.region_of(obj, settings)
    if (None if region is None else region.tobytes()) != source.picked:
        return None
    scale, stretch = snapshots.stretch_of(obj)
    same_stretch = np.allclose(stretch, source.stretch) if stretch is not None and source.stretch is not None else stretch is source.stretch
    staying = source.halving[0] if source.halving else None
    own, highest = source.levels or (None, None)
    if source.region is None and any(m.name not in (staying, own) for m in snapshots.applied_modifiers(obj, settings)):
        return None
    if own and own in obj.modifiers and (obj.mode == "SCULPT" or levels.fingerprint(context, obj) != highest):
        return None
    if abs(scale - source.scale) > 1e-6 * scale or not same_stretch or snapshots.fingerprint(obj.data) != made:
        return None
    if settings.bake and source.look is None:  # the quads have the surface's materials still
        source.take_look(obj)
    return source


class Job:
    def __init__(self, context, objects, settings, is_draft=False):
        """Reads the objects. Raises Refusal where there is nothing to do."""
        self.is_draft = is_draft
        self.settings = settings
        self.keep = set(settings.keep)
        self.items, self.refused = [], []
        self.stage, self.fraction, self.is_over, self.is_cancelled = "starting", 0.0, False, False
        self.begun = time.monotonic()
        self.current = -1
        self.number = None
        self.worker = None  # that the current item was sent to
        self.starting = None
        meshes = set()
        others = [o for o in objects if o.type != "MESH"]
        if settings.selected_only and settings.guides != "EDGES":  # of several in edit mode those with selected faces, where any has some
            objects = [o for o in objects if snapshots.selected_faces(o).any()] or objects
        for obj in objects:
            if obj.type != "MESH" or (obj.data.name in meshes and not snapshots.applied_modifiers(obj, settings)):
                continue
            meshes.add(obj.data.name)
            self._add(context, obj, settings)
        if not self.items and not self.refused:
            raise Refusal("no mesh is selected" if not others else snapshots.no_mesh(others[0]))
        if not self.items:
            raise Refusal("; ".join(self.refused))

    def _add(self, context, obj, settings):
        try:
            counts = settings_module.levels_of(settings)
            snapshots.check_editable(obj)
            source = _again(context, obj, settings)
            found = source or snapshots.Snapshot(context, obj, settings)
            item = Item(found, obj.name, snapshots.fingerprint(obj.data) if source else found.before, source is not None)
            self._prepare(context, item, settings)
        except Refusal as refusal:
            self.refused.append(str(refusal))
        else:
            self.items.append(item)
            if not self.is_draft and item.snapshot.region is None:
                self._add_levels(item, counts)

    def _add_levels(self, first, counts):
        """The same surface with other numbers of quads."""
        for level, count in enumerate(counts, 1):
            item = Item(first.snapshot, first.object_name, first.expected, first.is_again)
            options = {name: value for name, value in first.run[0]["options"].items() if name not in ("edge_length", "ratio", "vertices")}
            item.level, item.surface, item.key = level, first.surface, first.key
            item.run = (dict(first.run[0], options=dict(options, faces=count)), first.run[1])
            self.items.append(item)

    def _prepare(self, context, item, settings):
        """What goes to the worker: the surface under a key of its contents, and the run."""
        source = item.snapshot
        marks = source.marks(settings)
        if "FACE_SET" in settings.marks and not source.has_face_sets and bpy.app.version < (3, 6, 0):
            item.notes.append("face sets can't be read in this version of Blender")
        about, attributes = rebuild.attributes_of(source, self.keep)
        bakes = settings.bake and not self.is_draft
        if bakes:
            for row in [row for row in about.values() if row["kind"] == "uvs"]:
                attributes.pop(row["array"])
            about = {name: row for name, row in about.items() if row["kind"] != "uvs"}
            bake.attributes_of(source, about, attributes)
        item.surface = ({"kind": "surface", "attributes": about}, dict(attributes, vertices=source.vertices, corners=source.corners, sizes=source.sizes))
        if bakes:
            item.surface[1]["scene"] = np.frombuffer(source.look.glb, np.uint8)
        if len(marks):
            item.surface[1]["marks"] = marks
        options = settings_module.options_of(settings, 1.0 / source.scale)
        if settings.target == "AUTO" and source.region is not None:
            options["faces"] = source.faces_of_region()
        options.update(source.plane(settings))
        if self.is_draft and options.get("fast", "no") == "no":
            options["fast"] = "draft"
        if bakes:
            options.update(bake="input", normals="split")
        elif settings.unwrap and not self.is_draft:
            options["unwrap"] = True
        if len(marks):
            options["sharp_marks" if settings.sharp == "MARKS" else "keep_marks"] = True
            if settings.sharp != "MARKS":
                options["sharp_marks"] = False
        elif settings.sharp == "MARKS":
            options["sharp_angle"] = 180.0
        item.run = ({"kind": "run", "options": options, "most_weights": 0, "guide_kind": settings.guide_kind.lower(), "guide_rings": settings.guide_rings if settings.guide_kind == "LOOP" else 0, "guides": [], "closed": []}, {})
        if source.region is not None:
            item.run[1]["region"] = source.region.astype(np.uint8)
        density = source.density(settings)
        if density is not None:
            item.run[1]["density"] = density
        for i, (_, closed, points) in enumerate(snapshots.guides_of(context, source, settings)):
            item.run[0]["guides"].append(f"guide {i}")
            item.run[0]["closed"].append(bool(closed))
            item.run[1][f"guide {i}"] = np.ascontiguousarray(points)
        item.run[0]["had_marks"] = bool(len(marks))
        digest = hashlib.sha256(repr(sorted(about.items())).encode())
        for name, array in sorted(item.surface[1].items()):
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        item.key = digest.hexdigest()

    # ---- the worker

    def _start(self):
        box = self.starting = {}
        temporary, blender = bpy.app.tempdir, bpy.app.binary_path

        def body():
            try:
                box["child"] = child.start(temporary, blender)
            except Exception as error:
                box["error"] = str(error)

        box["thread"] = threading.Thread(target=body, daemon=True)
        box["thread"].start()

    def _child(self):
        """The worker, or None while it starts; sets an error where it can't be started."""
        found = state.live_child()
        if found is not None:
            return found
        if self.starting is None:
            self._start()
            return None
        if "child" in self.starting:
            state.adopt(self.starting.pop("child"))
            state.child.keys = []
            self.starting = None
            return state.child
        if "error" in self.starting:
            for item in self.items[self.current + 1 :]:
                item.error = self.starting["error"]
            self.is_over = True
        return None

    def _send(self, worker, item):
        self.worker = worker
        _jobs[0] += 1
        self.number = _jobs[0]
        if item.key in worker.keys:
            worker.keys.remove(item.key)
        else:
            worker.send(dict(item.surface[0], key=item.key), item.surface[1])
        worker.keys.append(item.key)
        while len(worker.keys) > MOST_SURFACES:
            worker.send({"kind": "forget", "key": worker.keys.pop(0)})
        worker.send(dict(item.run[0], key=item.key, job=self.number), item.run[1])

    def step(self):
        """Looks what the worker says and gives it the next surface; never waits."""
        if self.is_over:
            return
        if self.number is not None:
            for header, arrays in self.worker.poll():
                self._hear(header, arrays)
            if self.number is not None and self.worker.is_killed:
                self._hear({"kind": "died", "message": "the process that makes the quads was ended"}, {})
            return
        if self.current + 1 == len(self.items):
            self.is_over = True
            return
        worker = self._child()
        if worker is not None:
            self.current += 1
            self._send(worker, self.items[self.current])

    def _hear(self, header, arrays):
        item = self.items[self.current]
        if header["kind"] == "died":
            item.error = header["message"]
            if state.child is self.worker:
                state.stop_child()
        elif header.get("job") != self.number:
            if header["kind"] in ("failed", "done"):
                self.worker.obeyed()  # a run that was cancelled before this one
            return
        elif header["kind"] == "progress":
            self.stage, self.fraction = header["stage"], (self.current + header["fraction"]) / len(self.items)
            return
        elif header["kind"] == "failed":
            item.error = f"{item.object_name}: {header['message']}"
        else:
            item.reply, item.arrays = header, arrays
        self.number = None

    def cancel(self):
        """At once: the worker has a quarter of a second to stop, and is ended then."""
        self.is_over = self.is_cancelled = True
        if self.number is not None and self.worker.is_alive:
            self.worker.cancel(self.number)
            watch(self.worker, self.number)
        else:
            self._abandon_start()

    def _abandon_start(self):
        box = self.starting
        if box is None:
            return

        def collect():
            if box["thread"].is_alive():
                return 0.05
            if "child" in box and state.live_child() is None:
                state.adopt(box["child"])
                state.child.keys = []
            elif "child" in box:
                box["child"].kill()
            return None

        bpy.app.timers.register(collect)

    # ---- the scene

    def finish(self, context):
        """Writes what was made: ({name of each object that has quads now: how many}, sentences about the others)."""
        failures = self.refused + [item.error for item in self.items if item.error]
        made = []
        for item in self.items:
            if item.error or (item.level and item.object_name not in [first.object_name for first, _ in made]):
                continue
            try:
                made.append((item, self._build(item)))
            except Refusal as refusal:
                failures.append(str(refusal))
        if not made:
            return {}, failures
        state.sources.clear()
        mode = context.mode
        active = context.view_layer.objects.active
        back = active.mode if active and mode != "OBJECT" else None
        if back:
            bpy.ops.object.mode_set(mode="OBJECT")
        try:
            for item, (mesh, quads, is_half, notes) in made:
                (self._add_object if item.level else self._replace)(context, item, mesh, quads, is_half, notes)
        finally:
            if back:
                bpy.ops.object.mode_set(mode=back)
        for item, *_ in made:
            if item.snapshot.region is not None:
                item.snapshot.picked = snapshots.selected_faces(bpy.data.objects[item.object_name]).tobytes()
        state.irregular = None
        return {item.object_name: len(quads.quads) for item, (_, quads, _, _) in made if not item.level}, failures

    def _build(self, item):
        obj = bpy.data.objects.get(item.object_name)
        if obj is None or obj.type != "MESH":
            raise Refusal(f"{item.object_name} was removed or renamed while its quads were made; nothing was done to it")
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        if snapshots.fingerprint(obj.data) != item.expected:
            raise Refusal(f"{obj.name} changed while its quads were made; nothing was done to it")
        source, notes = item.snapshot, []
        quads, is_half = rebuild.Quads(source, item.arrays), False
        if source.halving and source.halving[0] in obj.modifiers and item.reply["asset"] is None:
            half = quads.half(source.halving[1], source.halving[2]) if item.reply["report"]["symmetric"] == 1 else None
            if half is not None:
                quads, is_half = half, True
            else:
                notes.append(f"the Mirror modifier {source.halving[0]} was applied, as the quads of both sides are not alike")
        keep = self.keep - {"UVS"} if item.reply["asset"] else self.keep
        fine = quads if levels.times(quads) and self.settings.multires and not item.reply["asset"] else None
        quads = levels.level_zero(fine) if fine else quads
        mesh = rebuild.build(source, quads, obj.data, keep)
        try:
            bake.restore(mesh, source.slots)
            item.lost = rebuild.mark_edges(mesh, source, quads, set(self.settings.marks))
            rebuild.mark_faces(mesh, source, quads)
            if fine:  # creases bend the levels: after these
                levels.displace(bpy.context, mesh, fine)
            rebuild.dress(bpy.context, mesh, source, quads, obj.data, self.keep)
            if item.reply["asset"]:
                bake.dress(mesh, obj.name + _suffix(item), rebuild.own_of(source, quads), next((m for m in obj.data.materials if m), None))
        except BaseException:
            bpy.data.meshes.remove(mesh)
            raise
        return mesh, quads, is_half, notes

    def _replace(self, context, item, mesh, quads, is_half, notes):
        obj = bpy.data.objects[item.object_name]
        source, old = item.snapshot, obj.data
        sharing = [o for o in bpy.data.objects if o.type == "MESH" and o.data == old and o != obj]
        if self.settings.keep_original and not item.is_again:
            self._keep_original(context, obj)
        staying = source.halving[0] if is_half else None
        removed = [
            name for name in source.applied if name in obj.modifiers and name != staying and not (item.is_again and name != (source.halving or [None])[0])
        ]
        others = [] if source.applied and not item.is_again else sharing  # they get the mesh, too
        for name in removed:
            obj.modifiers.remove(obj.modifiers[name])
        for each in [obj] + others if source.levels else []:
            levels.remove_modifier(each, source.levels[0])
        obj.data = mesh
        self._show(obj)
        for slot in obj.material_slots if item.reply["asset"] and item.snapshot.look else ():
            slot.link = "DATA"
        if len(others) < len(sharing):
            notes.append(f"the mesh was shared with {words.count(len(sharing), 'other object')}; {obj.name} has one of its own now")
        elif others:
            for other in others:
                other.data = mesh
            notes.append(f"{words.count(len(sharing), 'other object shares', 'other objects share')} the mesh and changed too")
        source.levels = None
        if quads.has_levels:
            names = [levels.add_modifier(each) for each in [obj] + others]
            source.levels = names[0], levels.fingerprint(context, obj)
        if removed:
            notes.append(f"modifiers were applied: {', '.join(removed)}")
        if source.region is not None and snapshots.applied_modifiers(obj, self.settings):
            notes.append("modifiers stay where only selected faces are remeshed")
        if staying:
            notes.append(f"the Mirror modifier {staying} stays, and the quads are those of one side")
        name = old.name
        old.name = f"{name} original"
        mesh.name = name
        if old.users == 0 or (old.users == 1 and old.use_fake_user):
            bpy.data.meshes.remove(old)
        state.sources[mesh.name] = (source, snapshots.fingerprint(mesh))
        self._report(item, mesh, source.notes + item.notes + notes)

    def _add_object(self, context, item, mesh, quads, is_half, notes):
        """A level of detail: a copy of the object, which has its quads already, with these instead. That of an earlier run goes."""
        obj = bpy.data.objects[item.object_name]
        name = obj.name + _suffix(item)
        old = bpy.data.objects.get(name)
        if old is not None and old.get(LEVEL_OF) == obj.name:
            gone = old.data
            bpy.data.objects.remove(old)
            if gone.users == 0:
                bpy.data.meshes.remove(gone)
        made = obj.copy()
        made.data, made.name, mesh.name = mesh, name, name
        made[LEVEL_OF] = obj.name
        halving = item.snapshot.halving
        if halving and not is_half and halving[0] in made.modifiers:
            made.modifiers.remove(made.modifiers[halving[0]])
        for collection in obj.users_collection:
            collection.objects.link(made)
        made.select_set(False)
        self._report(item, mesh, item.snapshot.notes + item.notes + notes)

    def _show(self, obj):
        """The edges of the quads over the faces, where that is wanted."""
        if self.settings.show_wires:
            obj.show_wire = obj.show_all_edges = True

    def _report(self, item, mesh, notes):
        source, reply = item.snapshot, item.reply
        names = [material.name if material else "none" for material in mesh.materials]
        lost, follows_seams = self._lost(source) + item.lost, "SEAM" in self.settings.marks
        lines = words.sentences(reply["report"], reply["transfer"], reply["seconds"], lost, notes, names, follows_seams, reply["asset"])
        state.reports[mesh.name] = (snapshots.fingerprint(mesh), lines, (len(mesh.vertices), len(mesh.polygons)))

    def _lost(self, source):
        lost = []
        if "UVS" not in self.keep and source.uvs and not (self.settings.bake or self.settings.unwrap):
            lost.append("UV maps")
        if "MATERIALS" not in self.keep and len(np.unique(source.materials)) > 1:
            lost.append("materials of faces")
        if "COLORS" not in self.keep and source.colors:
            lost.append("colors")
        if "WEIGHTS" not in self.keep and source.group_names:
            lost.append("weights")
        if "SHAPES" not in self.keep and source.shapes:
            lost.append("shape keys")
        return lost

    @staticmethod
    def _keep_original(context, obj):
        kept = obj.copy()
        kept.name = f"{obj.name} original"
        for collection in obj.users_collection:
            collection.objects.link(kept)
        kept.hide_render = True
        kept.hide_set(True)


def watch(worker, job):
    """Ends a worker that does not obey in time."""

    def look():
        if worker.kill_at is None or not worker.is_alive:
            return None
        if state.running is None:
            for header, _ in worker.poll():
                if header.get("job") == job and header["kind"] in ("failed", "done"):
                    worker.obeyed()
                    return None
        worker.look()
        return 0.02

    bpy.app.timers.register(look)
