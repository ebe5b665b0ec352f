"""The workbench without a window: freecadcmd headless.py. The last line is "N passed, N failed"."""
import os
import sys
import tempfile
import traceback

import FreeCAD
import Fem  # noqa: F401 what documents with its meshes need
import Mesh
import MeshPart
import Part

import quadwright_freecad as core
import quadwright


def new():
    document = FreeCAD.newDocument()
    document.UndoMode = 1
    return document


def part_with_hole(document):
    block, hole = document.addObject("Part::Box", "Block"), document.addObject("Part::Cylinder", "Hole")
    block.Length, block.Width, block.Height = 40, 30, 10
    hole.Radius, hole.Height, hole.Placement.Base = 6, 40, FreeCAD.Vector(20, 15, -5)
    cut = document.addObject("Part::Cut", "Part")
    cut.Base, cut.Tool = block, hole
    document.recompute()
    return cut


def shapes_become_quads():
    """A designed part: quads in a FEM mesh, all of them on the shape; the same object stays as it was."""
    document = new()
    cut = part_with_hole(document)
    (made,) = core.remesh(cut, faces=600, preset="cad")
    mesh = made.FemMesh
    assert made.TypeId == "Fem::FemMeshObject" and made.Label == "Part quads"
    assert abs(mesh.QuadrangleCount - 600) < 60 and mesh.TriangleCount == 0 and mesh.NodeCount > 500
    off = max(cut.Shape.distToShape(Part.Vertex(point))[0] for point in list(mesh.Nodes.values())[::7])
    assert off < 0.05, off
    assert cut.Shape.isValid() and len(document.Objects) == 4
    path = os.path.join(tempfile.mkdtemp(), "quads.unv")
    mesh.write(path)  # as solvers get it
    assert os.path.getsize(path) > 10000


def meshes_become_triangles_of_quads():
    document = new()
    obj = document.addObject("Mesh::Feature", "Ball")
    obj.Mesh = Mesh.createSphere(10.0, 40)
    obj.Placement.Base = FreeCAD.Vector(100, 0, 0)
    (made,) = core.remesh(obj, mesh="mesh", faces=300, symmetry="none")
    box = made.Mesh.BoundBox
    assert made.Mesh.CountFacets == 2 * len(core.make(core.surface_of(obj), faces=300, symmetry="none").result.quads)
    assert made.Mesh.isSolid() and abs(box.Center.x - 100) < 0.2 and abs(box.XLength - 20) < 0.5
    same = quadwright.remesh(*core.surface_of(obj), faces=300, symmetry="none")
    assert made.Mesh.CountPoints == len(same.vertices)


def patches_are_a_solid():
    """A shape in the document, valid and closed, with the volume of what it was made of; the large ones are few."""
    document = new()
    obj = part_with_hole(document)
    counts = {}
    for patches in ("quads", "blocks"):
        quads, made = core.remesh(obj, patches=patches, faces=400, preset="cad")
        assert quads.TypeId == "Fem::FemMeshObject" and made.TypeId == "Part::Feature" and made.Label.startswith("Part patches")
        shape = made.Shape
        counts[patches] = len(shape.Faces)
        assert shape.isValid() and len(shape.Solids) == 1 and shape.Solids[0].isClosed()
        assert abs(shape.Volume / obj.Shape.Volume - 1) < 0.01, shape.Volume / obj.Shape.Volume
        assert quads.FemMesh.QuadrangleCount >= counts[patches]
    assert counts["blocks"] == len(obj.Shape.Faces) < counts["quads"] / 4, counts
    kinds = [sorted(type(face.Surface).__name__ for face in shape.Faces) for shape in (made.Shape, obj.Shape)]
    assert kinds[0] == kinds[1] and abs(made.Shape.Volume / obj.Shape.Volume - 1) < 1e-5, (kinds, made.Shape.Volume, obj.Shape.Volume)
    (only,) = core.remesh(obj, mesh="none", patches="blocks", faces=400, preset="cad")
    assert only.TypeId == "Part::Feature"
    assert not [name for name in os.listdir(tempfile.gettempdir()) if name.endswith(".step")]


def all_of_it_is_one_step():
    document = new()
    obj = part_with_hole(document)
    before = [o.Name for o in document.Objects]
    core.remesh(obj, patches="quads", faces=200)
    after = [o.Name for o in document.Objects]
    assert len(after) == len(before) + 2 and document.UndoNames[0] == "Remesh to Quads"
    document.undo()
    assert [o.Name for o in document.Objects] == before
    document.redo()
    assert [o.Name for o in document.Objects] == after and document.getObject(after[-1]).Shape.isValid()


def what_fails_leaves_nothing():
    document = new()
    obj = part_with_hole(document)
    undo, before = document.UndoCount, len(document.Objects)
    for call, says in ((lambda: core.remesh(obj, faces=-1), "faces"), (lambda: core.remesh(obj, adaptiv=1), "adaptive"), (lambda: core.remesh(obj, mesh="quads", faces=100), "mesh: must be"),
                       (lambda: core.remesh(obj, patches="all"), "patches: must be"), (lambda: core.remesh(obj, patches="quads", faces=100, progress=lambda *_: quadwright.CANCEL), "cancel")):
        try:
            call()
        except Exception as error:
            assert says in str(error), error
        else:
            raise AssertionError(says)
    assert len(document.Objects) == before and document.UndoCount == undo
    assert not [name for name in os.listdir(tempfile.gettempdir()) if name.endswith(".step")]
    assert not core.is_surface(document.addObject("App::Part", "Empty")) and core.is_surface(obj)


def results_are_where_the_object_is():
    """In the group of the object, with its placement."""
    document = new()
    group, box = document.addObject("App::Part", "Group"), document.addObject("Part::Box", "Box")
    group.Placement.Base = FreeCAD.Vector(0, 500, 0)
    group.addObject(box)
    box.Placement.Base = FreeCAD.Vector(50, 0, 0)
    document.recompute()
    (made,) = core.remesh(box, mesh="mesh", faces=100)
    assert made.getParentGeoFeatureGroup() == group and abs(made.Mesh.BoundBox.XMin - 50) < 1e-6 and abs(made.Mesh.BoundBox.YMin) < 1e-6


def documents_keep_it():
    document = new()
    core.remesh(part_with_hole(document), patches="blocks", faces=300, preset="cad")
    path = os.path.join(tempfile.mkdtemp(), "part.FCStd")
    document.saveAs(path)
    quads = next(o for o in document.Objects if o.TypeId == "Fem::FemMeshObject").FemMesh.QuadrangleCount
    FreeCAD.closeDocument(document.Name)
    again = FreeCAD.openDocument(path)
    assert next(o for o in again.Objects if o.TypeId == "Fem::FemMeshObject").FemMesh.QuadrangleCount == quads
    assert next(o for o in again.Objects if o.Label == "Part patches").Shape.isValid()


TESTS = [shapes_become_quads, meshes_become_triangles_of_quads, patches_are_a_solid, all_of_it_is_one_step, what_fails_leaves_nothing, results_are_where_the_object_is, documents_keep_it]
failed = 0
for test in TESTS:
    try:
        test()
        print(f"\n{test.__name__} ... ok", flush=True)
    except Exception:
        failed += 1
        print(f"\n{test.__name__} ... FAIL\n{traceback.format_exc()}", flush=True)
    for name in list(FreeCAD.listDocuments()):
        FreeCAD.closeDocument(name)
print(f"{len(TESTS) - failed} passed, {failed} failed", flush=True)
os._exit(failed > 0)
