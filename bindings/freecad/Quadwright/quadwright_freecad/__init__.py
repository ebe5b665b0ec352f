"""Quads of FreeCAD's meshes and shapes, without a window: `remesh(obj, faces=800)` in a script or the console. panel.py has the window's part.

FreeCAD's meshes have triangles only: quads stay quads in a mesh of its FEM workbench, and are halved in one of its Mesh workbench. Patches, the smooth
surface of the quads, are a shape."""
import os
import sys
import tempfile

import FreeCAD

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # the workbench's folder
ICON = os.path.join(HERE, "icons", "Quadwright.svg")
try:
    import quadwright
except ImportError:  # the package comes with the workbench
    sys.path.append(os.path.join(HERE, "lib"))
    import quadwright
import numpy as np

MESHES = {"fem": "FEM mesh: quads", "mesh": "Mesh: two triangles a quad", "none": "None"}
PATCHES = {"none": "None", "quads": "A patch a quad", "blocks": "Large patches"}
TURN = 0.15  # radians between neighbouring triangles of a shape's round faces: 42 around a circle
SAG = 5e-4  # how far these lie off the faces, as a share of the diagonal


def is_surface(obj):
    """Whether an object of a document has something to be remeshed."""
    if hasattr(obj, "Mesh"):
        return obj.Mesh.CountFacets > 0
    return hasattr(obj, "Shape") and len(obj.Shape.Faces) > 0


def surface_of(obj):
    """Vertices and triangles, where the object is in its group."""
    mesh = getattr(obj, "Mesh", None)
    if mesh is None:
        import MeshPart

        box = obj.Shape.BoundBox
        mesh = MeshPart.meshFromShape(Shape=obj.Shape, LinearDeflection=max(SAG * box.DiagonalLength, 1e-7), AngularDeflection=TURN, Relative=False)
    points, faces = mesh.Topology
    return np.array([tuple(point) for point in points], float), np.array(faces, np.int32)


class Outcome:
    """What a run has made: a Result, and the file of its patches or None."""

    def __init__(self, result, step):
        self.result, self.step = result, step

    def forget(self):
        """Removes the file."""
        if self.step and os.path.exists(self.step):
            os.remove(self.step)


def make(surface, patches="none", **options):
    """Quads of vertices and triangles; may be called on any thread, as nothing of FreeCAD is touched. With patches it is their surface that lies on the input, unless fit_to says otherwise."""
    if patches not in PATCHES:
        raise ValueError(f"patches: must be {', '.join(PATCHES)}, not {patches!r}")
    if patches != "none":
        options.setdefault("fit_to", "limit")
    remesher = quadwright.Remesher(*surface)
    result = remesher.remesh(**options)
    if patches == "none":
        return Outcome(result, None)
    handle, path = tempfile.mkstemp(suffix=".step")
    os.close(handle)
    try:
        remesher.save_patches(path, patches)
    except Exception:
        os.remove(path)
        raise
    return Outcome(result, path)


def _fem_mesh(result):
    import Fem

    mesh = Fem.FemMesh()
    for i, point in enumerate(result.vertices.tolist()):
        mesh.addNode(*point, i + 1)
    for quad in (result.quads + 1).tolist():
        mesh.addFace(quad)
    return mesh


def _triangle_mesh(result):
    import Mesh

    return Mesh.Mesh(([FreeCAD.Vector(*point) for point in result.vertices.tolist()], [*map(tuple, result._triangles().tolist())]))


def add(obj, outcome, mesh="fem"):
    """Adds what was made beside the object, in its group: the new objects."""
    if mesh not in MESHES:
        raise ValueError(f"mesh: must be {', '.join(MESHES)}, not {mesh!r}")
    document, made = obj.Document, []
    if mesh == "fem":
        made.append(document.addObject("Fem::FemMeshObject", f"{obj.Name}_Quads"))
        made[-1].FemMesh = _fem_mesh(outcome.result)
    elif mesh == "mesh":
        made.append(document.addObject("Mesh::Feature", f"{obj.Name}_Quads"))
        made[-1].Mesh = _triangle_mesh(outcome.result)
    if outcome.step:
        import Part

        shape = Part.Shape()
        shape.read(outcome.step)
        made.append(document.addObject("Part::Feature", f"{obj.Name}_Patches"))
        made[-1].Shape = shape
    group = obj.getParentGeoFeatureGroup()
    for one, words in zip(made, ("quads",) * (mesh != "none") + ("patches",)):
        one.Label = f"{obj.Label} {words}"
        if group:
            group.addObject(one)
    return made


def said(result):
    """The run in a sentence, and what it warns of."""
    report = result.report
    irregular = report["topology"]["irregular"] + report["topology"]["irregular_boundary"]
    return f"{len(result.quads):,} quads, {report['faces_asked']:,} asked for, {irregular:,} irregular vertices, in {report['seconds']:.1f} s", report["warnings"]


def remesh(obj, mesh="fem", patches="none", **options):
    """Remeshes an object of a document into new ones, which are one step to be undone. Options as of quadwright.remesh(): faces=800, preset="cad"."""
    outcome = make(surface_of(obj), patches, **options)
    try:
        return in_one_step(obj.Document, lambda: add(obj, outcome, mesh))
    finally:
        outcome.forget()


def in_one_step(document, work):
    document.openTransaction("Remesh to Quads")
    try:
        made = work()
    except Exception:
        document.abortTransaction()
        raise
    document.commitTransaction()
    document.recompute()
    return made


def show(line, is_warning=False):
    (FreeCAD.Console.PrintWarning if is_warning else FreeCAD.Console.PrintMessage)(f"Quadwright: {line}\n")
