# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface in the worker: the library's Remesher, which keeps what two runs have in common."""
import time

import numpy as np
import quadwright


def _attribute(about, arrays):
    """about: {"array", "per", "kind", "groups" or absent}."""
    groups = arrays[about["groups"]] if "groups" in about else None
    return quadwright.Attribute(arrays[about["array"]], about["per"], about["kind"], groups=groups)


class Surface:
    """header: {"attributes": {name: about}}; arrays: vertices, corners, sizes, marks (may be missing), and those of the attributes."""

    def __init__(self, header, arrays):
        attributes = {name: _attribute(about, arrays) for name, about in header["attributes"].items()}
        marks = arrays.get("marks")
        self.has_marks = marks is not None and len(marks) > 0
        scene = quadwright.load_memory(arrays["scene"]).scene if "scene" in arrays else None  # materials, to be baked
        if not len(arrays["sizes"]):  # points: what belongs to corners and faces has nothing to belong to
            of_points = {name: attribute for name, attribute in attributes.items() if attribute.per == "vertex"}
            self.remesher = quadwright.Remesher(arrays["vertices"], attributes=of_points)
        else:
            mesh = quadwright.Mesh(arrays["vertices"], arrays["corners"], arrays["sizes"], marks if self.has_marks else None, scene=scene)
            self.remesher = quadwright.Remesher(mesh, marked_edges=mesh.marked_edges, attributes=attributes)
        self.sizes = arrays["sizes"]
        self.steering = self.region = None

    def choose(self, arrays):
        """The region of the next runs, where it is another than that of the last."""
        region = arrays.get("region")
        if (None if region is None else region.tobytes()) != self.region:
            self.region = None
            self.remesher.set_region(region)
            self.region = None if region is None else region.tobytes()

    def steer(self, header, arrays):
        """Density and guides of the next runs, where they are others than those of the last."""
        density = arrays.get("density")
        points = [arrays[name] for name in header["guides"]]
        steering = (header["guide_kind"], header["guide_rings"], header["closed"], None if density is None else density.tobytes(), [p.tobytes() for p in points])
        if steering == self.steering or (self.steering is None and density is None and not points):
            return
        self.steering = None
        self.remesher.set_density(density)
        rings = header["guide_rings"]
        guides = [quadwright.Guide(p, header["guide_kind"], closed, rings if closed else 0) for p, closed in zip(points, header["closed"])]
        self.remesher.set_guides(guides or None)
        self.steering = steering

    def run(self, header, arrays, progress):
        """header: {"options", "guides": names of arrays, "closed", "guide_kind", "guide_rings", "most_weights"}. ({"report", "transfer", "seconds"}, {array name: array}). Of a region there are
        also the faces that stayed: "kept", int32 (corners,), "kept sizes", int32 (faces,), and "kept from", int32 (corners,), corners of the surface."""
        begun = time.monotonic()
        self.choose(arrays)
        self.steer(header, arrays)
        options = header["options"]
        result = self.remesher.remesh(progress=progress, most_weights=header["most_weights"], provenance=self.region is not None, **options)
        reply = {"report": dict(result.report), "transfer": result.transfer, "seconds": time.monotonic() - begun, "asset": result.asset}
        out = {"vertices": result.vertices, "quads": result.quads}
        if result.creases is not None:
            out["creases"] = result.creases
        if result.coarse is not None:
            out["coarse vertices"], out["coarse quads"] = result.coarse
        if self.region is not None:
            out.update(self._kept(result))
        for name, attribute in result.attributes.items():
            out["a:" + name] = np.asarray(attribute.values)
            if attribute.groups is not None:
                out["g:" + name] = np.asarray(attribute.groups)
        if result.asset is not None:
            self._dress(result, out)
        return reply, out

    @staticmethod
    def _dress(result, out):
        """Texture coordinates of the quads' own as "own uv"; with maps "map color" and so on, and "own normal", those of the quads by corners."""
        out["own uv"] = out.pop("a:uv")
        if result.maps:
            out["own normal"] = out.pop("a:normal")
        for name, pixels in result.maps.items():
            out["map " + name] = pixels

    def _kept(self, result):
        count = 4 * len(result.quads)
        kept = result.faces.reshape(-1)[count:]
        sizes = np.full(len(kept) // 4, 4, np.int32) if result.face_sizes is None else result.face_sizes[len(result.quads) :]
        origin = result.provenance.corners[count:]
        begins = np.cumsum(self.sizes) - self.sizes
        return {"kept": kept, "kept sizes": sizes, "kept from": (begins[origin["face"]] + origin["corner"][:, 0]).astype(np.int32)}
