"""A server of the Model Context Protocol, for agents: `quadwright-mcp FOLDER [FOLDER...]` hears messages on standard input and answers on standard output.

Files are read and written below the folders only; names that are not absolute are below the first. A call has a thread of its own, so that the server
hears the client meanwhile, and tells how far it is where the client gave it a token for that. The protocol's messages are written here plainly, as the
package needs nothing but NumPy: https://modelcontextprotocol.io/specification. docs/agents.md tells of the tools.
"""
import base64
import inspect
import json
import os
import shutil
import sys
import tempfile
import threading

import quadwright

VERSIONS = ("2025-11-25", "2025-06-18", "2025-03-26", "2024-11-05")  # of the protocol, the newest first: of what is used here they say the same
ASSET_PIECES = 3  # a run, its charts, its maps: each tells how far it is from 0 on
MESHES = (".obj", ".ply", ".off", ".stl", ".glb", ".gltf")
PARSE_ERROR, INVALID_REQUEST, METHOD_NOT_FOUND, INVALID_PARAMS = -32700, -32600, -32601, -32602  # of JSON-RPC
INSTRUCTIONS = ("Quadwright makes clean all-quad meshes of triangle surfaces (scans, sculpts, generated meshes, CAD parts). remesh: quads of a file; asset: quads with new "
                "texture coordinates and baked maps; render: look at meshes, and do so after a remesh; measure: figures; batch: a folder of models; options: every option and preset. "
                "A preset and a number of faces are mostly all that is needed. Files are below these folders: ")

# ------------------------------------------------------------------------------------------------------------------------------- tools

TOOLS = {}  # name: (function, what tools/list says of it)


def _tool(title, description, required, properties, reads_only=False):
    def keep(function):
        schema = {"type": "object", "properties": properties, "required": required, "additionalProperties": False}
        hints = {"readOnlyHint": reads_only, "idempotentHint": True, "openWorldHint": False, **({} if reads_only else {"destructiveHint": True})}
        TOOLS[function.__name__] = (function, {"name": function.__name__, "title": title, "description": description, "inputSchema": schema, "annotations": hints})
        return function

    return keep


def _of(name):
    """An option's schema."""
    row = quadwright.options()[name]
    kinds = {"count": "integer", "real": "number", "flag": "boolean", "choice": "string"}
    return {"type": kinds[row["kind"]], "description": row["help"], **({"enum": row["choices"]} if row["choices"] else {})}


def _text(description, **more):
    return {"type": "string", "description": description, **more}


_FILE = "OBJ, PLY, OFF, STL, GLB or glTF"
_INPUT, _OUTPUT = _text(f"the surface, a file ({_FILE})"), _text("the file to write; its ending says the format: .obj, .ply, .off, .stl, .glb, .gltf, or for simulation .msh, .vtu, .inp, .bdf")
_STEPS = {
    "faces": _of("faces"),
    "preset": _text("; ".join(f"{name}: {row['help']}" for name, row in quadwright.presets().items()), enum=[*quadwright.presets()]),
    "symmetry": {**_of("symmetry"), "enum": [choice for choice in _of("symmetry")["enum"] if choice != "plane"]},
    "keep": _text("borders that edges of the quads follow: seams, materials, groups, or several with commas between"),
    "options": {"type": "object", "description": 'more options by their names, as {"adaptive": 0.75}; the tool options lists them'},
    "time_limit": {"type": "number", "exclusiveMinimum": 0, "description": "seconds after which the run is given up"},
}
_BAKE = _text("maps, with commas between: input (normals, and what the materials, textures and colours have), all, color, normal, orm, emission, occlusion, height")
_TEXTURE = {"type": "integer", "minimum": 16, "maximum": 16384, "description": "texels along each side of a map"}


def _summary(result, target):
    """The figures that say whether quads are good, and what the run warns of."""
    report, topology = result.report, result.report["topology"]
    names = ("faces_asked", "angle_rms", "area_cv", "simple", "seconds", "warnings")
    told = {"output": target, "quads": len(result.quads), "irregular_vertices": topology["irregular"] + topology["irregular_boundary"], **{name: report[name] for name in names}}
    if result.asset:
        told["asset"] = result.asset
    return told


@_tool("Remesh to quads", "Makes a clean all-quad mesh of a triangle surface and writes it. Texture coordinates, materials and colours come along.", ["input", "output"],
       {"input": _INPUT, "output": _OUTPUT, **_STEPS})
def remesh(call, input, output, options=None, **steps):
    return _made(call, input, output, quadwright.remesh, {**call.options(options), **steps})


@_tool("Make an asset", "Makes quads of a surface, gives them texture coordinates of their own and bakes onto maps what the surface looks like. Best written as .glb, which holds the maps.",
       ["input", "output"], {"input": _INPUT, "output": _OUTPUT, **_STEPS, "texture": _TEXTURE, "bake": _BAKE})
def asset(call, input, output, options=None, **steps):
    call.whole = ASSET_PIECES
    return _made(call, input, output, quadwright.asset, {**call.options(options), **steps})


def _made(call, input, output, make, steps):
    mesh, target = call.load(input), call.target(output)
    result = make(mesh, progress=call.progress, **steps)
    call.go_on()
    result.save(target)
    return _summary(result, target)


@_tool("Measure", "Figures of a mesh: whether it is manifold, how many irregular vertices it has, angles, areas; and with `against` how far it is from the surface it was made of.",
       ["input"], {"input": _text(f"the mesh, a file ({_FILE})"), "against": _text("the surface, for distances")}, reads_only=True)
def measure(call, input, against=None):
    return quadwright.measure(call.load(input), against=None if against is None else call.load(against, "against"))


@_tool("Look", "A picture (PNG) of up to eight meshes side by side, with the edges of the quads and dots at irregular vertices.", ["inputs"], {
    "inputs": {"type": "array", "items": {"type": "string"}, "minItems": 1, "maxItems": 8, "description": f"files ({_FILE})"},
    "captions": {"type": "array", "items": {"type": "string"}, "description": "one for each, instead of the names"},
    "width": {"type": "integer", "minimum": 64, "maximum": 4096}, "height": {"type": "integer", "minimum": 64, "maximum": 4096},
    "views": {"type": "integer", "minimum": 0, "maximum": 6, "description": "directions from which each is seen; 0: as many as suit"},
    "azimuth": {"type": "number", "description": "degrees"}, "elevation": {"type": "number", "description": "degrees"},
    "wires": {"type": "boolean", "description": "edges, true unless it is given"},
    "lines": {"type": "boolean", "description": "the lines that leave irregular vertices"},
}, reads_only=True)
def render(call, inputs, captions=None, width=1200, height=900, **how):
    meshes = [call.load(path, "inputs") for path in inputs]
    with tempfile.TemporaryDirectory() as folder:
        picture = os.path.join(folder, "picture.png")
        quadwright.render(meshes, picture, captions=captions or [os.path.basename(path) for path in inputs], width=width, height=height, **how)
        with open(picture, "rb") as file:
            return [{"type": "image", "data": base64.b64encode(file.read()).decode("ascii"), "mimeType": "image/png"}]


@_tool("Options", "Every option with its unit, default, bounds and meaning, and the presets.", [], {"name": _text("of this option alone")}, reads_only=True)
def options(call, name=None):
    table = quadwright.options()
    if name is not None and name.replace("-", "_") not in table:
        raise ValueError(f"name: there is no option {name!r}; there are {', '.join(table)}")
    return {"options": table if name is None else {name: table[name.replace("-", "_")]}, "presets": quadwright.presets()}


@_tool("Remesh a folder", "Makes quads of every model below a folder, or assets with `bake`. What is done already, with the same options, is not done again. One model's failure is told and harms no other.",
       ["input", "output"], {"input": _text("the folder of the models"), "output": _text("the folder for a/b.ply.quads.obj and the like"), **_STEPS, "texture": _TEXTURE, "bake": _BAKE,
                             "format": _text("of what is written", enum=["obj", "ply", "off", "stl", "glb", "gltf"])})
def batch(call, input, output, format="obj", options=None, **steps):
    folder, target = call.path(input, "input"), call.path(output, "output")
    if not os.path.isdir(folder):
        raise ValueError(f"input: {input} is no folder")
    found = sorted(os.path.join(at, name) for at, _, names in os.walk(folder) for name in names if name.lower().endswith(MESHES))
    found = [path for path in found if os.path.commonpath([path, target]) != target or target == folder and ".quads." not in path]
    steps = {**call.options(options), **steps, "progress": call.progress}
    pieces, records = ASSET_PIECES if steps.get("bake") else 1, []
    call.whole = pieces * len(found) or 1
    for i, path in enumerate(found):
        call.done, call.last, name = i * pieces, 0.0, os.path.relpath(path, folder)
        made = os.path.join(target, f"{name}.quads.{format}")
        try:
            record = quadwright._result_of_file(path, call.target(made), steps, call.load)
            report = record["report"]
            records.append({"name": name, "status": "OK", "output": made, "quads": report["topology"]["quads"], "warnings": report["warnings"]})
        except Exception as error:  # one model's, unless it would be so of all
            if call.is_cancelled.is_set() or isinstance(error, (TypeError, quadwright.OptionError)):
                raise
            records.append({"name": name, "status": getattr(error, "status", type(error).__name__), "message": str(error)})
    return {"models": len(records), "failed": sum(record["status"] != "OK" for record in records), "records": records}


class Call:
    """A call of a tool: what it may touch, how far it is, and whether it is still wanted."""

    def __init__(self, server, token):
        self.server, self.token = server, token
        self.is_cancelled = threading.Event()
        self.whole, self.done, self.last, self.told = 1, 0, 0.0, -1.0  # pieces in all and done, the piece's fraction, what was told last

    def progress(self, stage, fraction):
        if self.is_cancelled.is_set():
            return quadwright.CANCEL
        if fraction < self.last:  # the next piece has begun
            self.done += 1
        self.last = fraction
        now = min(self.done + fraction, self.whole)
        if self.token is not None and now - self.told >= self.whole / 200:
            self.told = now
            self.server.tell("notifications/progress", progressToken=self.token, progress=round(now, 4), total=self.whole, message=stage)
        return None

    def go_on(self):
        if self.is_cancelled.is_set():
            raise quadwright.Cancelled("cancelled")

    def options(self, given):
        """Options by name; those that name files are none of the table's."""
        wrong = [name for name in given or {} if name not in quadwright.options()]
        if wrong:
            raise ValueError(f"options: there is no option {wrong[0]!r}; the tool options lists them")
        return dict(given or {})

    def path(self, name, argument):
        """The file that a name leads to, links followed; refused where that is not below a folder of the server."""
        if not isinstance(name, str) or not name or "\0" in name:
            raise ValueError(f"{argument}: must be the name of a file, not {name!r:.60}")
        folders = self.server.folders
        path = os.path.realpath(os.path.join(folders[0], name))
        if not any(os.path.commonpath([path, folder]) == folder for folder in folders):
            raise PermissionError(f"{argument}: {name} is outside the folders that this server may touch: {', '.join(folders)}")
        return path

    def target(self, name):
        """A file that is to be written, its folder made; what may be written with it, materials and pictures by the same stem, leads nowhere else either."""
        path = self.path(name, "output")
        folder, stem = os.path.dirname(path), os.path.splitext(os.path.basename(path))[0]
        os.makedirs(folder, exist_ok=True)
        for entry in os.scandir(folder):
            if entry.name.startswith(stem) and entry.is_symlink():
                self.path(entry.path, "output")
        return path

    def allow_all(self, path, names):
        """What a file names beside itself has to be below the folders too."""
        for name in names:
            self.path(os.path.join(os.path.dirname(path), name), f"{os.path.basename(path)} names {name}")

    def load(self, name, argument="input"):
        self.go_on()
        path = self.path(name, argument)
        self.allow_all(path, quadwright._names_beside(path) if os.path.isfile(path) else [])
        mesh = quadwright.load(path)
        self.allow_all(path, quadwright._names_of_materials(path, (mesh.library or "").splitlines()))
        self.go_on()
        return mesh


# ---------------------------------------------------------------------------------------------------------------------------- protocol


class Refused(Exception):
    """What is answered with an error of JSON-RPC: its code and a sentence."""


class Server:
    def __init__(self, folders, output):
        self.folders = [os.path.realpath(folder) for folder in folders]
        self.output, self.lock, self.calls = output, threading.Lock(), {}

    def send(self, message):
        with self.lock:
            self.output.write(json.dumps({"jsonrpc": "2.0", **message}) + "\n")
            self.output.flush()

    def tell(self, method, **params):
        self.send({"method": method, "params": params})

    def hear(self, line):
        """A message of the client, or a list of them as older versions of the protocol have it."""
        try:
            told = json.loads(line)
        except ValueError:
            self.send({"id": None, "error": {"code": PARSE_ERROR, "message": "not a line of JSON"}})
            return
        for message in told if isinstance(told, list) else [told]:
            self.take(message)

    def take(self, message):
        number = message.get("id") if isinstance(message, dict) else None
        is_named = isinstance(number, (str, int))
        try:
            if not isinstance(message, dict) or not isinstance(message.get("method", ""), str) or not isinstance(message.get("params", {}), dict) or not (number is None or is_named):
                raise Refused(INVALID_REQUEST, "not a message of JSON-RPC with a method and named params")
            if "method" not in message:
                return  # an answer: nothing is asked of clients
            answer = self.answer(message["method"], message.get("params", {}), number)
            if number is not None and answer is not None:
                self.send({"id": number, "result": answer})
        except Refused as refused:
            if not isinstance(message, dict) or "id" in message:
                self.send({"id": number if is_named else None, "error": {"code": refused.args[0], "message": refused.args[1]}})

    def answer(self, method, params, number):
        """The result; None where there is none, or not yet."""
        if method == "initialize":
            wanted = params.get("protocolVersion")
            return {"protocolVersion": wanted if wanted in VERSIONS else VERSIONS[0], "capabilities": {"tools": {}},
                    "serverInfo": {"name": "quadwright", "title": "Quadwright", "version": quadwright.__version__},
                    "instructions": INSTRUCTIONS + ", ".join(self.folders)}
        if method == "ping":
            return {}
        if method == "tools/list":
            return {"tools": [told for _, told in TOOLS.values()]}
        if method == "tools/call":
            return self.begin(params, number)
        if method == "notifications/cancelled":
            call = self.calls.get(json.dumps(params.get("requestId")))
            if call:
                call.is_cancelled.set()
            return None
        if method.startswith("notifications/"):
            return None
        raise Refused(METHOD_NOT_FOUND, f"there is no method {method}")

    def begin(self, params, number):
        name, given, more = params.get("name"), params.get("arguments") or {}, params.get("_meta") or {}
        if not isinstance(name, str) or name not in TOOLS:
            raise Refused(INVALID_PARAMS, f"there is no tool {name!r}; there are {', '.join(TOOLS)}")
        if not isinstance(given, dict) or not isinstance(more, dict):
            raise Refused(INVALID_PARAMS, "arguments and _meta: must be objects")
        if number is None:
            raise Refused(INVALID_REQUEST, "a call needs an id")
        call = self.calls[json.dumps(number)] = Call(self, more.get("progressToken"))
        threading.Thread(target=self.work, args=(call, number, *TOOLS[name], given), daemon=True).start()
        return None

    def work(self, call, number, tool, told, given):
        try:
            result = {"content": _content(tool(call, **_checked(told, given)))}
            if result["content"][0]["type"] == "text":
                result["structuredContent"] = json.loads(result["content"][0]["text"])
        except Exception as error:  # whatever it is, the agent reads it and may do better
            status = getattr(error, "status", None)
            result = {"content": [{"type": "text", "text": f"{status + ': ' if status else ''}{error or type(error).__name__}"}], "isError": True}
        self.calls.pop(json.dumps(number), None)
        if not call.is_cancelled.is_set():  # what was cancelled has no answer
            self.send({"id": number, "result": result})


def _content(told):
    return told if isinstance(told, list) else [{"type": "text", "text": json.dumps(told)}]


def _checked(told, given):
    """The arguments, if the tool has them all; their values are checked where they are used."""
    schema = told["inputSchema"]
    wrong = [name for name in given if name not in schema["properties"]]
    if wrong:
        raise TypeError(f"{told['name']} has no argument {wrong[0]!r}; it has {', '.join(schema['properties'])}" + ("; options of the table go into `options`" if wrong[0] in quadwright.options() else ""))
    missing = [name for name in schema["required"] if name not in given]
    if missing:
        raise TypeError(f"{told['name']} needs {missing[0]}: {schema['properties'][missing[0]]['description']}")
    return given


def main(folders=None):
    folders = sys.argv[1:] if folders is None else folders
    wrong = [folder for folder in folders if not os.path.isdir(folder)]
    if not folders or wrong:
        sys.exit(f"quadwright-mcp: {wrong[0]} is no folder" if wrong and not wrong[0].startswith("-") else inspect.cleandoc(__doc__))
    messages = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n")
    os.dup2(2, 1)  # what else writes to standard output does not get among the messages
    server = Server(folders, messages)
    for line in sys.stdin.buffer:
        if line.strip():
            server.hear(line)
    for call in list(server.calls.values()):  # the client is gone
        call.is_cancelled.set()
    os._exit(0)


def program():
    """`quadwright mcp FOLDER...`: lists of servers start a package by its own name. The command line program of that name is no part of it and goes on to its own."""
    if sys.argv[1:2] == ["mcp"]:
        main(sys.argv[2:])
        return
    here = os.path.realpath(os.path.dirname(sys.argv[0]))
    others = [folder for folder in os.environ.get("PATH", "").split(os.pathsep) if folder and os.path.realpath(folder) != here]
    other = shutil.which("quadwright", path=os.pathsep.join(others))
    if other is None:
        sys.exit("quadwright: the Python package has `quadwright mcp FOLDER...`; the command line program is built with `make`, or comes with Debian packages")
    os.execv(other, [other, *sys.argv[1:]])


if __name__ == "__main__":
    main()
