"""usage: run.py ZIP PICTURES [headless|window]...: the tests of the workbench, in FreeCAD with a home of its own into which the zip was unpacked."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
# No page of news at the start, which root may not see.
START = """<?xml version="1.0" encoding="UTF-8"?><FCParameters><FCParamGroup Name="Root"><FCParamGroup Name="BaseApp"><FCParamGroup Name="Preferences"><FCParamGroup Name="General">
<FCText Name="AutoloadModule">PartWorkbench</FCText></FCParamGroup></FCParamGroup></FCParamGroup></FCParamGroup></FCParameters>"""
LIMIT_S = 900  # ends hangs only
COMMANDS = {"headless": ["freecadcmd", "headless.py"], "window": ["xvfb-run", "-a", "-s", "-screen 0 1400x1000x24", "freecad", "window.py"]}


def run(kind, path, pictures):
    home = tempfile.mkdtemp(prefix="quadwright-freecad-")
    try:
        mod = pathlib.Path(home, ".local/share/FreeCAD/Mod")
        mod.mkdir(parents=True)
        with zipfile.ZipFile(path) as archive:
            archive.extractall(mod)
        (pathlib.Path(home) / "tmp").mkdir()
        (pathlib.Path(home) / ".config/FreeCAD").mkdir(parents=True)
        (pathlib.Path(home) / ".config/FreeCAD/user.cfg").write_text(START)
        environment = {**os.environ, "HOME": home, "TMPDIR": f"{home}/tmp", "XDG_RUNTIME_DIR": home, "QUADWRIGHT_PICTURES": str(pictures), "LIBGL_ALWAYS_SOFTWARE": "1"}
        environment.pop("PYTHONPATH", None)
        *command, script = COMMANDS[kind]
        told = subprocess.run([*command, str(HERE / script)], capture_output=True, text=True, errors="replace", env=environment, timeout=LIMIT_S, stdin=subprocess.DEVNULL)
        text = re.sub(r"\t*\(\d+ %\)\t*", "", told.stdout)
        print("\n".join(line for line in text.splitlines() if re.search(r" \.\.\. |passed|Error|assert|File ", line)))
        good = re.search(r"^([1-9]\d*) passed, 0 failed$", text, re.M)
        if not good:
            print(text[-3000:], told.stderr[-3000:], sep="\n", file=sys.stderr)
        return bool(good)
    finally:
        shutil.rmtree(home, ignore_errors=True)


def main(path, pictures, *kinds):
    pathlib.Path(pictures).mkdir(parents=True, exist_ok=True)
    results = [run(kind, path, pictures) for kind in kinds or COMMANDS]
    sys.exit(not all(results))


main(*sys.argv[1:])
