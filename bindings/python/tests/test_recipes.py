"""The recipes of docs/python.md, one after another in one folder."""
import os
import pathlib
import re

import pytest


def test_recipes(tmp_path, monkeypatch):
    root = pathlib.Path(os.environ.get("QUADWRIGHT_ROOT") or pathlib.Path(__file__).parents[3])
    page = root / "docs/python.md"
    if not page.exists():
        pytest.skip("no docs/python.md beside these tests")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
    assert len(blocks) >= 5
    names = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)
    assert (tmp_path / "sheet.png").stat().st_size > 1000
