"""The limit surface of `--fit limit` over that of the default result: mean distance, 99.9th percentile, flipped quads, topology.

usage: limit.py QUADWRIGHT ROWS.jsonl MESH... [--faces 1000,5000]   (rows that the file has are not run again, so that a run can be cut)
       limit.py --table ROWS.jsonl                                        (prints a table in Markdown)

Distances are those of `quadwright measure --limit`, both ways, in units of the input."""
import json, math, pathlib, subprocess, sys, tempfile

KEPT = ("components", "boundary_loops", "euler", "nonmanifold_edges", "inconsistent_edges")


def told(command):
    run = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}: {run.stderr.strip()[-200:]}")
    return run.stdout


def of_result(tool, mesh, faces, extra, folder):
    """What measures say of the limit surface, and of the cage itself."""
    quads = folder / "quads.obj"
    told([tool, mesh, "-o", quads, "--faces", faces, "--quiet", *extra])
    limit = json.loads(told([tool, "measure", quads, "--limit", "--against", mesh, "--json"]))
    cage = json.loads(told([tool, "measure", quads, "--json", "--against", mesh]))
    figures = {"mean": limit["chamfer"] * limit["mean_edge"], "p999": limit["hausdorff_p999"] * limit["mean_edge"]}
    return figures | {"flipped": cage["flipped_faces"], "angle": cage["angle_rms"], "edge": cage["mean_edge"]} | {key: cage[key] for key in KEPT}


def run(tool, rows, meshes, counts):
    path = pathlib.Path(rows)
    done = {(r["mesh"], r["faces"]) for r in map(json.loads, path.read_text().splitlines())} if path.exists() else set()
    for faces in counts:
        for mesh in map(pathlib.Path, meshes):
            if (mesh.name, faces) in done:
                continue
            with tempfile.TemporaryDirectory() as name:
                row = {"mesh": mesh.name, "faces": faces}
                try:
                    row["plain"] = of_result(tool, mesh, faces, [], pathlib.Path(name))
                    row["limit"] = of_result(tool, mesh, faces, ["--fit", "limit"], pathlib.Path(name))
                except (RuntimeError, ValueError) as error:
                    row["error"] = str(error)
            with path.open("a") as file:
                file.write(json.dumps(row) + "\n")


def ratio(row, key):
    return max(row["limit"][key], 1e-12) / max(row["plain"][key], 1e-12)


def table(rows):
    rows = [json.loads(line) for line in pathlib.Path(rows).read_text().splitlines()]
    print("| mesh | quads | mean, edges | over the default's | 99.9 % | flipped, and the default's | angle, and the default's |\n|---|---|---|---|---|---|---|")
    for r in sorted(rows, key=lambda r: (r["faces"], r["mesh"])):
        if "error" in r:
            print(f"| {r['mesh']} | {r['faces']} | {r['error']} |")
            continue
        a, b = r["limit"], r["plain"]
        topology = "" if all(a[key] == b[key] for key in KEPT) else ", another topology"
        print(f"| {r['mesh']} | {r['faces']} | {a['mean'] / a['edge']:.4f} | {ratio(r, 'mean'):.2f} | {ratio(r, 'p999'):.2f} | {a['flipped']}, {b['flipped']}{topology} | {a['angle']:.1f}, {b['angle']:.1f} |")
    for faces in sorted({r["faces"] for r in rows}):
        some = [r for r in rows if r["faces"] == faces and "error" not in r]
        means = [math.exp(sum(math.log(ratio(r, key)) for r in some) / len(some)) for key in ("mean", "p999")]
        within = [sum(ratio(r, key) <= bar for r in some) for key, bar in (("mean", 0.35), ("p999", 0.5))]
        print(f"\n{faces} quads, {len(some)} meshes: mean {means[0]:.2f} ({within[0]} at most 0.35), 99.9 % {means[1]:.2f} ({within[1]} at most 0.5), "
              f"flipped {sum(r['limit']['flipped'] for r in some)} for {sum(r['plain']['flipped'] for r in some)}")


if __name__ == "__main__":
    given = sys.argv[1:]
    counts = [1000, 5000]
    if "--faces" in given:
        at = given.index("--faces")
        counts = [int(word) for word in given[at + 1].split(",")]
        del given[at:at + 2]
    if given[0] == "--table":
        table(given[1])
    else:
        run(given[0], given[1], given[2:], counts)
