"""Charts by Quadwright and by others on the same quads: Blender's Smart UV Project, Blender's unwrap with our seams, and
xatlas (npm's xatlas-web, whose triangles are the quads' halves). Measured by charts.py, on OBJ files alone.

usage: charts_peers.py QUADWRIGHT [-n FACES] [-x FOLDER] [-p PICTURE.png] MESH...
       needs numpy and Debian's blender; -x: where `npm install xatlas-web` was run, else there is no xatlas;
       -p: a page of the atlases, a row for each mesh (needs Debian's python3-pil)

s is what the unwrapping takes, in seconds of the processor: of ours, the whole program without what it takes to make the
quads."""
import pathlib, re, subprocess, sys, tempfile
import numpy as np
import charts

BLENDER = """
import bpy, bmesh, sys, time
source, target, way = sys.argv[sys.argv.index('--') + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=source)
thing = bpy.context.selected_objects[0]
bpy.context.view_layer.objects.active = thing
bpy.ops.object.mode_set(mode='EDIT')
mesh = bmesh.from_edit_mesh(thing.data)
layer = mesh.loops.layers.uv.active
for edge in mesh.edges:
    ends = {tuple(sorted((l.vert.index, *l[layer].uv) for l in (k, k.link_loop_next))) for k in edge.link_loops}
    edge.seam = len(ends) > 1
bmesh.update_edit_mesh(thing.data)
bpy.ops.mesh.select_all(action='SELECT')
begin = time.process_time()
if way == 'smart':
    bpy.ops.uv.smart_project(island_margin=0.002)
else:
    bpy.ops.uv.unwrap(method='ANGLE_BASED', margin=0.002)
print('seconds', time.process_time() - begin)
bpy.ops.object.mode_set(mode='OBJECT')
bpy.ops.wm.obj_export(filepath=target, export_materials=False, export_normals=False, apply_modifiers=False)
"""

XATLAS = """
const [source, target] = process.argv.slice(2), fs = require('fs');
globalThis.window = globalThis, globalThis.document = {}; // the package is made for pages
const wasmBinary = fs.readFileSync('node_modules/xatlas-web/dist/xatlas-web.wasm');
const m = require('xatlas-web')({wasmBinary, onRuntimeInitialized: () => unwrap()});
function unwrap() {
    const place = [], corner = [];
    for (const line of fs.readFileSync(source, 'utf8').split('\\n')) {
        const [word, ...rest] = line.trim().split(/ +/);
        if (word === 'v') place.push(...rest.slice(0, 3).map(Number));
        if (word !== 'f') continue;
        const v = rest.map(r => parseInt(r) - 1);
        for (let k = 1; k + 1 < v.length; k++) corner.push(v[0], v[k], v[k + 1]);
    }
    m.createAtlas();
    const mesh = m.createMesh(place.length / 3, corner.length, false, false);
    m.HEAPU16.set(corner, mesh.indexOffset / 2), m.HEAPF32.set(place, mesh.positionOffset / 4);
    const begin = process.cpuUsage(), failed = m.addMesh();
    if (failed) throw Error('addMesh: ' + failed);
    m.generateAtlas();
    const took = process.cpuUsage(begin).user / 1e6, made = m.getMeshData(mesh.meshId);
    const index = [...m.HEAPU32.subarray(made.indexOffset / 4, made.indexOffset / 4 + made.newIndexCount)];
    const old = m.HEAPU32.subarray(made.originalIndexOffset / 4, made.originalIndexOffset / 4 + made.newVertexCount);
    const uv = m.HEAPF32.subarray(made.uvOffset / 4, made.uvOffset / 4 + 2 * made.newVertexCount);
    // divided by the width and by the height, which are not told: as the maps are near conformal, gradients of both
    // coordinates are as large
    const sum = [0, 0];
    for (let i = 0; i < index.length; i += 3) {
        const at = k => index.slice(i, i + 3).map(v => place[3 * old[v] + k]), g = [0, 0, 0];
        for (let k = 0; k < 3; k++) {
            const [p, q, r] = at(k);
            g[0] += (q - p) ** 2, g[1] += (q - p) * (r - p), g[2] += (r - p) ** 2;
        }
        const area = Math.sqrt(Math.max(g[0] * g[2] - g[1] ** 2, 1e-30));
        for (let k = 0; k < 2; k++) {
            const [p, q, r] = index.slice(i, i + 3).map(v => uv[2 * v + k]);
            sum[k] += (g[2] * (q - p) ** 2 - 2 * g[1] * (q - p) * (r - p) + g[0] * (r - p) ** 2) / area;
        }
    }
    const high = Math.sqrt(sum[0] / sum[1]), side = Math.max(1, high);
    let text = '';
    for (let i = 0; i < place.length; i += 3) text += 'v ' + place.slice(i, i + 3).join(' ') + '\\n';
    for (let i = 0; i < uv.length; i += 2) text += `vt ${uv[i] / side} ${uv[i + 1] * high / side}\\n`;
    for (let i = 0; i < index.length; i += 3)
        text += 'f ' + index.slice(i, i + 3).map(v => `${old[v] + 1}/${v + 1}`).join(' ') + '\\n';
    fs.writeFileSync(target, text);
    console.log('seconds', took);
}
"""
SHOWN = ["charts", "seams", "l2", "worst", "linf", "used", "twice", "s"]


def seconds(command, **more):
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=300, **more)
    return float(re.search(r"^seconds ([\d.]+)", done.stdout, re.M)[1])


def ours(program, mesh, faces, folder):
    """Also the quads alone, for the others; what they cost is left out of the time."""
    made, state = folder / "quadwright.obj", folder / "state.qws"
    common = ["--faces", faces, "--no-attributes", "-q"]
    subprocess.run([program, mesh, "-o", folder / "quads.obj", "--dump-stage", f"assemble:{state}", *common], check=True)
    begin = charts.spent()
    subprocess.run([program, "--from-stage", state, "-o", made, "--unwrap", *common], check=True)
    return made, charts.spent() - begin


def all_of(program, mesh, faces, folder, npm):
    yield ("Quadwright", *ours(program, mesh, faces, folder))
    for name, way in (("Blender, Smart UV Project", "smart"), ("Blender, unwrap with our seams", "seams")):
        made = folder / f"{way}.obj"
        (folder / "peer.py").write_text(BLENDER)
        yield name, made, seconds(["blender", "-b", "--python", folder / "peer.py", "--", folder / "quadwright.obj", made, way])
    if npm:
        made = folder / "xatlas.obj"
        yield "xatlas", made, seconds(["node", "-e", XATLAS, "x", folder / "quadwright.obj", made], cwd=npm)


def drawn(path, size=360):
    from PIL import Image, ImageDraw
    _, coords, corners, texels = charts.load(path)
    chart, *_ = charts.cut(coords, corners, texels)
    picture, chance = Image.new("RGB", (size, size), "white"), np.random.RandomState(1)
    colour = chance.randint(110, 245, (chart.max() + 1, 3))
    pen = ImageDraw.Draw(picture)
    for f, t in enumerate(texels):
        pen.polygon([(x * size / charts.GRID, size - y * size / charts.GRID) for x, y in coords[t]],
                    fill=tuple(int(c) for c in colour[chart[f]]), outline=(70, 70, 70))
    return picture


def page(rows, path):
    from PIL import Image
    size, gap = rows[0][0].width, 12
    whole = Image.new("RGB", ((size + gap) * max(map(len, rows)), (size + gap) * len(rows)), "grey")
    for y, row in enumerate(rows):
        for x, picture in enumerate(row):
            whole.paste(picture, (x * (size + gap), y * (size + gap)))
    whole.quantize(64).save(path, optimize=True)


def main(argv):
    program, meshes, faces, npm, picture, rows, pages = argv.pop(0), [], "3000", None, None, {}, []
    while argv:
        word = argv.pop(0)
        if word == "-n":
            faces = argv.pop(0)
        elif word == "-x":
            npm = argv.pop(0)
        elif word == "-p":
            picture = argv.pop(0)
        else:
            meshes.append(word)
    print("| mesh | by | " + " | ".join(SHOWN) + " |\n" + "|---" * (len(SHOWN) + 2) + "|")
    for mesh in meshes:
        pages.append([])
        with tempfile.TemporaryDirectory() as folder:
            for name, made, took in all_of(program, mesh, faces, pathlib.Path(folder), npm):
                m = charts.measure(made) | {"s": took}
                rows.setdefault(name, []).append(m)
                print(f"| {pathlib.Path(mesh).stem} | {name} | " + " | ".join(f"{m[k]:.4g}" for k in SHOWN) + " |", flush=True)
                if picture:
                    pages[-1].append(drawn(made))
    for name, of in rows.items():
        print(f"| **median** | {name} | " + " | ".join(f"{np.median([m[k] for m in of]):.4g}" for k in SHOWN) + " |")
    if picture:
        page(pages, picture)


if __name__ == "__main__":
    main(sys.argv[1:])
