"""What `quadwright asset` says of itself at 3,000 quads and 2,048 texels, a row of a table for each mesh.

usage: asset.py QUADWRIGHT MESH...

Charts beside others', from the files alone: bench/charts.py, bench/charts_peers.py."""
import json, pathlib, subprocess, sys, tempfile


def main(program, *meshes):
    print("| mesh | angle | area | used | missed | normals (degrees) | colours |\n|---|---|---|---|---|---|---|")
    for mesh in meshes:
        with tempfile.TemporaryDirectory() as folder:
            command = [program, "asset", mesh, "-o", f"{folder}/a.glb", "--faces", "3000", "--texture", "2048", "--json", f"{folder}/a.json", "-q"]
            subprocess.run(command, check=True)
            a = json.loads(pathlib.Path(f"{folder}/a.json").read_text())["asset"]
        assert a["overlapping_charts"] == 0
        told = [f"{a['angle_stretch']:.3f}", f"{a['area_stretch']:.3f}", f"{a['used']:.1%}",
                f"{a['missed_texels'] / a['texels']:.2%}", f"{a['normal_error']:.2f}", "" if a["color_error"] is None else f"{a['color_error']:.2f}"]
        print(f"| {pathlib.Path(mesh).stem} | " + " | ".join(map(str, told)) + " |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
