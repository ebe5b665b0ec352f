# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials to be baked, as the library reads them: a glTF file in memory with a material a slot; and maps that it baked, as a material.

Of each material the Principled BSDF is looked at: its numbers, and image textures that are linked to it, straight or by way of the nodes Normal Map and
Separate Color. What other nodes make is named, and its socket's number stands for it.
"""
import json
import os
import struct
import zlib

import bpy
import numpy as np

SETS = 4  # of texture coordinates that the library looks at
MAPS = ("color", "normal", "orm", "emission")  # those that "input" may give


# ---- pictures in


def png_of(pixels):
    """Bytes of a PNG: uint8 (height, width, channels), the upper row first."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    head = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)) + chunk(b"IEND", b"")


def _file_of(image):
    """The bytes of the file that an image is, where it is a PNG or JPEG as it came; or None."""
    data = None
    if image.is_dirty or image.source != "FILE":
        return None
    if image.packed_file is not None:
        data = bytes(image.packed_file.data)
    else:
        try:
            with open(bpy.path.abspath(image.filepath, library=image.library), "rb") as file:
                data = file.read()
        except OSError:
            return None
    return data if data[:8] == b"\x89PNG\r\n\x1a\n" or data[:3] == b"\xff\xd8\xff" else None


def _bytes_of(image):
    """An image as a PNG or JPEG, or None where it has no pixels."""
    data = _file_of(image)
    if data is not None:
        return data
    width, height = image.size
    if width * height == 0:
        return None
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, -1)[::-1]
    if image.is_float and image.colorspace_settings.name != "Non-Color":
        low = values[..., :3] <= 0.0031308
        values[..., :3] = np.where(low, 12.92 * values[..., :3], 1.055 * np.maximum(values[..., :3], 1e-9) ** (1 / 2.4) - 0.055)
    coded = (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
    if coded.shape[2] not in (1, 3, 4):
        coded = np.repeat(coded[..., :1], 3, 2)
    return png_of(np.ascontiguousarray(coded))


# ---- materials in


def _principled(material):
    if material is None or not material.use_nodes or material.node_tree is None:
        return None
    nodes = material.node_tree.nodes
    output = next((n for n in nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)
    links = output.inputs["Surface"].links if output else ()
    node = links[0].from_node if links else None
    return node if node is not None and node.type == "BSDF_PRINCIPLED" else None


def _socket(node, *names):
    return next((node.inputs[name] for name in names if name in node.inputs), None)


def _from(socket):
    """(node, name of its output) that a socket is linked to, or (None, "")."""
    if socket is None or not socket.is_linked:
        return None, ""
    link = socket.links[0]
    return link.from_node, link.from_socket.name


class _Writer:
    """The glTF that is made. uvs: names of UV maps, of which the first SETS are the library's."""

    def __init__(self, name, uvs, rendered):
        self.name, self.uvs, self.rendered = name, uvs, rendered
        self.materials, self.textures, self.samplers, self.images, self.views = [], [], [], [], []
        self.data = b""
        self.known, self.notes, self.color_layer = {}, [], None

    def _image(self, image):
        if image.name not in self.known:
            data = _bytes_of(image)
            if data is None:
                self.notes.append(f"the image {image.name} has no pixels and was not baked")
            else:
                self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
                kind = "image/png" if data[:1] == b"\x89" else "image/jpeg"
                self.images.append({"bufferView": len(self.views) - 1, "mimeType": kind, "name": image.name})
                self.data += data + b"\0" * (-len(data) % 4)
            self.known[image.name] = None if data is None else len(self.images) - 1
        return self.known[image.name]

    def texture(self, node):
        """A textureInfo for a node with an image; None where it can't be baked."""
        source = self._image(node.image) if node.image is not None else None
        if source is None:
            return None
        at, _ = _from(node.inputs["Vector"])
        name = self.rendered
        if at is not None and at.type == "UVMAP":
            name = at.uv_map or self.rendered
        elif at is not None and at.type != "TEX_COORD":
            self.notes.append(f"the image {node.image.name} is placed by nodes that are not baked; it lies as its UV map says")
        if name not in self.uvs[:SETS]:
            return None
        wrap = {"REPEAT": 10497, "EXTEND": 33071, "CLIP": 33071, "MIRROR": 33648}.get(node.extension, 10497)
        self.samplers.append({"wrapS": wrap, "wrapT": wrap})
        self.textures.append({"source": source, "sampler": len(self.samplers) - 1})
        return {"index": len(self.textures) - 1, "texCoord": self.uvs.index(name)}

    def _color(self, material, socket):
        """(factor, textureInfo or None) of a socket of colours."""
        node, _ = _from(socket)
        if node is None:
            return list(socket.default_value), None
        if node.type == "TEX_IMAGE":
            texture = self.texture(node)
            return ([1, 1, 1, 1], texture) if texture else (list(socket.default_value), None)
        if node.type in ("VERTEX_COLOR", "ATTRIBUTE"):
            self.color_layer = getattr(node, "layer_name", "") or getattr(node, "attribute_name", "")
            return [1, 1, 1, 1], None
        self.notes.append(f"{socket.name} of {material.name} is made by nodes that are not baked; its number stands for it")
        return list(socket.default_value), None

    def _number(self, material, socket, channel):
        """(factor, textureInfo or None): roughness in green, metallic in blue, as glTF has them."""
        node, output = _from(socket)
        if node is None:
            return float(socket.default_value), None
        if node.type in ("SEPARATE_COLOR", "SEPRGB") and output in (channel, channel[0]):
            node, _ = _from(node.inputs[0])
        elif node.type == "TEX_IMAGE" and node.image is not None and node.image.channels >= 3:
            return 1.0, self.texture(node)  # a grey image: all its channels are alike
        if node is not None and node.type == "TEX_IMAGE":
            return 1.0, self.texture(node)
        self.notes.append(f"{socket.name} of {material.name} is made by nodes that are not baked; its number stands for it")
        return float(socket.default_value), None

    def _normal(self, material, shader, made):
        node, _ = _from(_socket(shader, "Normal"))
        if node is None:
            return
        image, _ = _from(node.inputs["Color"]) if node.type == "NORMAL_MAP" else (None, "")
        texture = self.texture(image) if image is not None and image.type == "TEX_IMAGE" else None
        if texture is None:
            self.notes.append(f"Normal of {material.name} is made by nodes that are not baked")
        else:
            made["normalTexture"] = dict(texture, scale=float(node.inputs["Strength"].default_value))

    def add(self, material):
        shader = _principled(material)
        if shader is None:
            color = list(material.diffuse_color) if material is not None else [1, 1, 1, 1]
            if material is not None and material.use_nodes:
                self.notes.append(f"{material.name} has no Principled BSDF at its output; its viewport color was baked")
            self.materials.append({"pbrMetallicRoughness": {"baseColorFactor": color[:3] + [1], "roughnessFactor": 0.5, "metallicFactor": 0}})
            return
        pbr = {}
        made = {"pbrMetallicRoughness": pbr, "doubleSided": not material.use_backface_culling}
        color, texture = self._color(material, _socket(shader, "Base Color"))
        alpha = _socket(shader, "Alpha")
        is_cut = material.blend_method != "OPAQUE" and (alpha.is_linked or alpha.default_value < 1)
        pbr["baseColorFactor"] = color[:3] + [1.0 if alpha.is_linked else float(alpha.default_value)]
        if is_cut:
            made["alphaMode"] = "MASK" if material.blend_method == "CLIP" else "BLEND"
        if texture:
            pbr["baseColorTexture"] = texture
        pbr["roughnessFactor"], rough = self._number(material, _socket(shader, "Roughness"), "Green")
        pbr["metallicFactor"], metal = self._number(material, _socket(shader, "Metallic"), "Blue")
        if rough or metal:
            pbr["metallicRoughnessTexture"] = rough or metal
        emission = _socket(shader, "Emission Color", "Emission")
        strength = float(_socket(shader, "Emission Strength").default_value)
        factor, texture = self._color(material, emission) if emission.is_linked or strength > 0 else ([0, 0, 0], None)
        made["emissiveFactor"] = [min(1.0, max(0.0, f * strength)) for f in factor[:3]]
        if texture:
            made["emissiveTexture"] = texture
        self._normal(material, shader, made)
        self.materials.append(made)

    def glb(self):
        """With a triangle, as a file without a mesh is none."""
        triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
        views = self.views + [{"buffer": 0, "byteOffset": len(self.data), "byteLength": len(triangle)}]
        data = self.data + triangle
        accessor = {"bufferView": len(views) - 1, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
        made = {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": len(data)}],
            "bufferViews": views,
            "accessors": [accessor],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            "scene": 0,
            "materials": self.materials or [{}],
        }
        for name in ("images", "textures", "samplers"):
            if getattr(self, name):
                made[name] = getattr(self, name)
        text = json.dumps(made).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


class Look:
    """glb: bytes. notes: sentences. color_layer: name of the color attribute that base colours come from, or None."""

    def __init__(self, obj, uvs):
        rendered = next((name for name, _, is_rendered, _ in uvs if is_rendered), "")
        writer = _Writer(obj.name, [name for name, *_ in uvs], rendered)
        for material in [slot.material for slot in obj.material_slots] or [None]:
            writer.add(material)
        self.glb, self.notes, self.color_layer = writer.glb(), list(dict.fromkeys(writer.notes)), writer.color_layer


def attributes_of(snapshot, about, arrays):
    """Adds to what is carried what the library looks at, under its names for it."""

    def add(name, values, per, kind):
        about[name] = {"array": "a:" + name, "per": per, "kind": kind}
        arrays["a:" + name] = values

    for i, (_, _, _, values) in enumerate(snapshot.uvs[:SETS]):
        add(f"uv{i}" if i else "uv", values, "corner", "uvs")
    add("material", snapshot.materials, "face", "labels")
    if snapshot.corner_normals is not None:
        add("normal", snapshot.corner_normals, "corner", "normals")
    layer = next((c for c in snapshot.colors if c["name"] == snapshot.look.color_layer), None) if snapshot.look.color_layer is not None else None
    if layer is None and snapshot.look.color_layer == "" and snapshot.colors:
        layer = snapshot.colors[max(snapshot.render_color, 0)]
    if layer is not None:
        add("color", layer["values"], "vertex" if layer["domain"] == "POINT" else "corner", "values")


# ---- maps out


def _image(name, pixels, is_data):
    """A packed image of uint8 (height, width, channels)."""
    height, width, channels = pixels.shape
    image = bpy.data.images.new(name, width, height, alpha=channels == 4, is_data=is_data)
    values = np.ones((height, width, 4), np.float32)
    values[..., :channels] = pixels[::-1].astype(np.float32) / 255
    image.pixels.foreach_set(values.reshape(-1))
    image.update()
    image.pack()
    return image


def _texture(tree, image, x, y):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.location, node.label = image, (x, y), image.name
    return node


def _link_number_maps(tree, shader, image):
    node = _texture(tree, image, -620, -20)
    kind = "ShaderNodeSeparateColor" if hasattr(bpy.types, "ShaderNodeSeparateColor") else "ShaderNodeSeparateRGB"
    split = tree.nodes.new(kind)
    split.location = (-260, -60)
    tree.links.new(node.outputs["Color"], split.inputs[0])
    tree.links.new(split.outputs[1], shader.inputs["Roughness"])
    tree.links.new(split.outputs[2], shader.inputs["Metallic"])


def _link_normal_map(tree, shader, image):
    node = _texture(tree, image, -620, -320)
    bend = tree.nodes.new("ShaderNodeNormalMap")
    bend.location, bend.uv_map = (-260, -320), "UVMap"
    tree.links.new(node.outputs["Color"], bend.inputs["Color"])
    tree.links.new(bend.outputs["Normal"], shader.inputs["Normal"])


def material_of(name, maps, old):
    """A material with the maps as image nodes. maps: {name: uint8 (height, width, channels)}. old: a material, for what is the same everywhere; or None."""
    material = bpy.data.materials.new(f"{name} baked")
    material[BAKED] = True
    material.use_nodes = True
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    before = _principled(old)
    for number in ("Roughness", "Metallic"):
        if before is not None and not before.inputs[number].is_linked:
            shader.inputs[number].default_value = before.inputs[number].default_value
    if "color" in maps:
        node = _texture(tree, _image(f"{name} color", maps["color"], False), -620, 280)
        tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        if maps["color"].shape[2] == 4:
            tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
            material.blend_method = old.blend_method if old is not None and old.blend_method != "OPAQUE" else "HASHED"
    elif before is not None and not before.inputs["Base Color"].is_linked:
        shader.inputs["Base Color"].default_value = before.inputs["Base Color"].default_value
    if "orm" in maps:
        _link_number_maps(tree, shader, _image(f"{name} occlusion roughness metallic", maps["orm"], True))
    if "normal" in maps:
        _link_normal_map(tree, shader, _image(f"{name} normal", maps["normal"], True))
    if "emission" in maps:
        node = _texture(tree, _image(f"{name} emission", maps["emission"], False), -620, -620)
        tree.links.new(node.outputs["Color"], _socket(shader, "Emission Color", "Emission"))
        _socket(shader, "Emission Strength").default_value = 1
    return material


BAKED = "quadwright_baked"  # a property of materials that were made here


def restore(mesh, slots):
    """The surface's materials, names of which are slots, where the last run had baked them into one."""
    if any(material is not None and BAKED in material for material in mesh.materials):
        mesh.materials.clear()
        for name in slots:
            mesh.materials.append(bpy.data.materials.get(name) if name else None)


def dress(mesh, name, arrays, old):
    """UV map, normals and material of a mesh whose faces are the quads alone. old: the material that was first."""
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    layer = mesh.uv_layers.new(name="UVMap", do_init=False)
    layer.data.foreach_set("uv", np.ascontiguousarray(arrays["own uv"], np.float32).reshape(-1))
    if "own normal" not in arrays:
        return  # texture coordinates alone
    maps = {kind: arrays["map " + kind] for kind in MAPS if "map " + kind in arrays}
    mesh.materials.clear()
    mesh.materials.append(material_of(name, maps, old))
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    if hasattr(mesh, "use_auto_smooth"):  # before Blender 4.1
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, 3.1415927
    mesh.normals_split_custom_set(arrays["own normal"].reshape(-1, 3).tolist())
    mesh.update()
