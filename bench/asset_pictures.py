"""Makes the pictures of docs/asset.md anew: asset.png (input and asset by Cycles, base colour and normals), asset-cycles.png and asset-three.png (input, quads, quads with their maps; a row a figure).

usage: asset_pictures.py BUILD SPOT.obj GARGOYLE.obj [FOLDER]   (needs Debian's blender, numpy, python3-pil and chromium, and `npm install` in bindings/web; FOLDER: what is there already is not made again)"""
import io, json, pathlib, struct, subprocess, sys, tempfile

from PIL import Image

import asset_render

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIDE = 240  # pixels of each part of asset.png


def textures(glb):
    """Base colour and normals of the first material, as they stand in the file."""
    data = glb.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    scene, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    material = scene["materials"][0]
    for slot in (material["pbrMetallicRoughness"]["baseColorTexture"], material["normalTexture"]):
        view = scene["bufferViews"][scene["images"][scene["textures"][slot["index"]]["source"]]["bufferView"]]
        begin = view.get("byteOffset", 0)
        yield Image.open(io.BytesIO(binary[begin : begin + view["byteLength"]])).convert("RGB")


def on_white(path):
    picture = Image.open(path).convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture).convert("RGB")


def joined(pictures, downward):
    across = [p.width for p in pictures]
    down = [p.height for p in pictures]
    whole = Image.new("RGB", (max(across), sum(down)) if downward else (sum(across), max(down)))
    for i, p in enumerate(pictures):
        whole.paste(p, (0, sum(down[:i])) if downward else (sum(across[:i]), 0))
    return whole


def save(picture, name):
    picture.quantize(256, dither=Image.Dither.FLOYDSTEINBERG).save(ROOT / "docs/pictures" / name, optimize=True)


def main(build, spot, gargoyle, folder=None):
    folder = pathlib.Path(folder or tempfile.mkdtemp()).resolve()
    folder.mkdir(exist_ok=True)
    source = folder / "inputs" / "painted_spot.glb"
    source.parent.mkdir(exist_ok=True)
    if not source.exists():
        subprocess.run([f"{build}/quadwright-painted", spot, source, source.with_suffix(".png")], check=True)
    asset_render.main(f"{build}/quadwright", folder, str(source), gargoyle)
    names = ["painted_spot", pathlib.Path(gargoyle).stem]
    subprocess.run(["node", "asset.js", folder, *names], cwd=ROOT / "bindings/web/tests", check=True)
    for what in ("cycles", "three"):
        save(joined([on_white(folder / f"{name}-{what}.png") for name in names], True), f"asset-{what}.png")
    parts = [on_white(folder / "painted_spot-input.png"), on_white(folder / "painted_spot-ours.png"), *textures(folder / "painted_spot.glb")]
    save(joined([p.resize((SIDE, SIDE), Image.Resampling.LANCZOS) for p in parts], False), "asset.png")


if __name__ == "__main__":
    main(*sys.argv[1:])
