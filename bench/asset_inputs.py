"""Textured inputs for asset.py and asset_render.py: models of Debian's assimp-testmodels as GLB with their pictures inside, and figures that are painted.

usage: asset_inputs.py BUILD FOLDER MESH...   (needs apt-get, assimp-utils and python3-pil; each MESH is painted by BUILD/quadwright-painted)"""
import io, json, pathlib, struct, subprocess, sys

from PIL import Image

MODELS = ["OBJ/spider.obj", "Collada/duck.dae", "MS3D/jeep1.ms3d", "IQM/mrfixit.iqm", "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb"]


def picture_of(path):
    if path.suffix.lower() in (".jpg", ".jpeg"):
        return "image/jpeg", path.read_bytes()
    out = io.BytesIO()
    Image.open(path).convert("RGB").save(out, "PNG")
    return "image/png", out.getvalue()


def pack(bare, beside, target):
    """The same with the pictures inside, and metallic-roughness materials alone: what all programs show alike."""
    data = bare.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    scene, binary = json.loads(data[20 : 20 + size]), bytearray(data[28 + size :])
    for material in scene.get("materials", []):
        material.pop("extensions", None)
    scene.pop("extensionsUsed", None)
    for image in scene.get("images", []):
        if "uri" not in image:
            continue
        image["mimeType"], picture = picture_of(beside / pathlib.PureWindowsPath(image.pop("uri")).name)
        binary += bytes(-len(binary) % 4)
        image["bufferView"] = len(scene["bufferViews"])
        scene["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(picture)})
        binary += picture
    binary += bytes(-len(binary) % 4)
    scene["buffers"][0]["byteLength"] = len(binary)
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<5I", 0x46546C67, 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
    target.write_bytes(head + text + struct.pack("<2I", len(binary), 0x004E4942) + binary)


def main(build, folder, *meshes):
    folder = pathlib.Path(folder)
    folder.mkdir(exist_ok=True)
    subprocess.run(["apt-get", "download", "assimp-testmodels"], cwd=folder, check=True)
    subprocess.run(["dpkg-deb", "-x", next(folder.glob("*.deb")), folder / "models"], check=True)
    for model in MODELS:
        source = folder / "models/usr/share/assimp/models" / model
        target = folder / f"{source.stem}.glb"
        subprocess.run(["assimp", "export", source, target, "-fglb2"], check=True, stdout=subprocess.DEVNULL)
        pack(target, source.parent, target)
    for mesh in map(pathlib.Path, meshes):
        target = folder / f"painted_{mesh.stem}.glb"
        subprocess.run([f"{build}/quadwright-painted", mesh, target, target.with_suffix(".png")], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main(*sys.argv[1:])
