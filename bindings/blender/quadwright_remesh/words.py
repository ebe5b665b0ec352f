# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a run in plain words."""
import re


MOST_OFF = 0.05  # of the number of quads: more is said


def count(number, one, many=None):
    return f"{number:,} {one if number == 1 else many or one + 's'}"


# What the library says in a sentence of its own, among the report's warnings, is not here.
REPAIRS = [
    ("welded_vertices", "vertex that lay on another became one with it", "vertices that lay on others became one with them"),
    ("sewn_junctions", "edge was split at a vertex that lay on it", "edges were split at vertices that lay on them"),
    ("dropped_degenerate", "triangle without an area was dropped", "triangles without an area were dropped"),
    ("dropped_isolated", "vertex of no face was dropped", "vertices of no face were dropped"),
    ("dropped_components", "small component was dropped", "small components were dropped"),
    ("split_vertices", "vertex where surfaces touch was cut apart", "vertices where surfaces touch were cut apart"),
    ("unfolded_vertices", "vertex was moved to smooth a fold", "vertices were moved to smooth folds"),
    ("grown_protrusions", "thin part got quads of its own", "thin parts got quads of their own"),
    ("fallback_components", "component was made from its triangles", "components were made from their triangles"),
]


def warnings(report, materials):
    """The library's sentences: labels are slots of materials here; that faces are smooth or flat is another."""
    for warning in report["warnings"]:
        gone = re.match(r'no quad is left of (\w+) "(\d+)"', warning)
        if gone and gone[1] == "smooth":
            continue
        if gone and gone[1] == "material" and int(gone[2]) < len(materials):
            warning = warning.replace(f'"{gone[2]}"', f'"{materials[int(gone[2])]}"', 1)
        yield warning


def sentences(report, transfer, seconds, lost, notes, materials=(), follows_seams=True, asset=None):
    """[(icon, sentence)] for the panel, the most important first. materials: names by slots. follows_seams: whether the run was to follow them."""
    told = list(warnings(report, materials))
    topology = report["topology"]
    vertices = topology["vertices"]
    kept = report["kept_faces"]
    coarse = report["coarse_faces"]  # what was split, if anything
    quads, irregular = coarse or topology["faces"] - kept, topology["irregular"] + topology["irregular_boundary"]
    lines = [
        ("MESH_GRID", f"{count(quads, 'quad')}, {report['faces_asked']:,} asked for, in {seconds:.1f} s"),
        (
            "DOT",
            f"{count(irregular, 'irregular vertex', 'irregular vertices')} of {vertices:,} ({100 * irregular / max(1, vertices):.1f} %)",
        ),
        ("DOT", f"Corners are {report['angle_rms']:.1f}\N{DEGREE SIGN} off the right angle, areas {100 * report['area_cv']:.0f} % off their mean"),
        ("CURVE_PATH", f"{100 * report['simple']:.0f} % in rows that never cross themselves"),
    ]
    if coarse:
        lines.insert(1, ("MOD_MULTIRES", f"Split into {count(topology['faces'], 'quad')}"))
    if asset:
        lines.append(("UV", f"{count(asset['charts'], 'chart')}, {100 * asset['used']:.0f} % of the texture used"))
        if asset["texels"] is not None:
            off = "" if asset["color_error"] is None else f", colors {asset['color_error']:.1f} of 255"
            missed = f"; {count(asset['missed_texels'], 'texel')} met nothing and show what is nearest" if asset["missed_texels"] else ""
            lines.append(("TEXTURE", f"Baked normals are {asset['normal_error']:.1f}\N{DEGREE SIGN} off{off}{missed}"))
    if kept and abs(quads - report["faces_asked"]) > MOST_OFF * report["faces_asked"]:
        lines.append(("INFO", "Other than asked for, as the border of the selection has its vertices: Region Rim Free cuts it anew"))
    if kept:
        lines.append(("FACESEL", f"{count(kept, 'face')} around them stayed, and {'is' if kept == 1 else 'are'} among these figures"))
    if report["symmetric"]:
        lines.append(("MOD_MIRROR", "Both sides are alike" if report["symmetric"] == 1 else "Parts are alike on both sides"))
    told_of = [row for row in REPAIRS if report[row[0]] > 0 and not (kept and row[0] == "dropped_isolated")]  # those of the faces that stay
    repaired = [f"{count(report[name], one, many)}" for name, one, many in told_of]
    lines += [("MODIFIER", line[0].upper() + line[1:]) for line in repaired] or ([] if told else [("CHECKMARK", "Nothing had to be repaired")])
    if transfer:
        if transfer["straddling_quads"]:
            remedy = "" if follows_seams else "; switch on Seams under Follow Marked Edges"
            lines.append(("UV", f"{count(transfer['straddling_quads'], 'quad lies', 'quads lie')} across a UV seam{remedy}"))
        filled = transfer["filled_vertices"] + transfer["filled_corners"] + transfer["filled_faces"]
        if filled:
            lines.append(("INFO", f"{count(filled, 'value')} came from neighbors, as nothing of the surface was near"))
        if transfer["dropped_weights"]:
            lines.append(("GROUP_VERTEX", f"{count(transfer['dropped_weights'], 'small weight')} gave way to larger ones"))
    lines += [("INFO", note[0].upper() + note[1:]) for note in notes]
    lines += [("ERROR", warning[0].upper() + warning[1:]) for warning in told]
    lines += [("ERROR", f"Lost: {', '.join(lost)}")] if lost else []
    return lines
