"""The tutorial as a notebook: its cells run twice in one kernel, leave nothing behind, and end in a gate."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import pytest
from test_every_day import findings

nbformat = pytest.importorskip("nbformat")

TUTORIAL = Path(__file__).parents[1] / "examples" / "tutorial.ipynb"
CELLS = 10


def cells() -> list[Any]:
    """Returns the cells of the tutorial that have code."""
    notebook = nbformat.read(TUTORIAL, as_version=4)
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def shown(cell: Any) -> str:
    """Returns what a notebook shows of the last value of a cell that has run."""
    texts = [data.get("text/html", data.get("text/plain", "")) for output in cell.outputs if (data := output.get("data"))]
    return "\n".join(texts)


def test_the_tutorial_is_kept_without_outputs() -> None:
    for cell in cells():
        assert cell.outputs == [] and cell.execution_count is None


def test_the_cells_of_the_tutorial_run_twice_in_one_kernel_and_end_in_a_gate(tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient")
    repeated = [*cells(), *cells()]
    for number, cell in enumerate(repeated):
        assert "out=" not in cell.source
        cell.id = f"cell-{number}"
    twice = nbformat.v4.new_notebook(cells=repeated)
    assert len(twice.cells) == 2 * CELLS
    nbclient.NotebookClient(twice, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert list(tmp_path.iterdir()) == []
    for cell_1, cell_2 in zip(twice.cells[:CELLS], twice.cells[CELLS:], strict=True):
        assert shown(cell_1) and ("rerun" in shown(cell_1) or shown(cell_1) == shown(cell_2)), cell_1.source
    verdicts = [shown(cell).split(":")[0] for cell in twice.cells if "= cc.campaign(" in cell.source]
    assert verdicts == 2 * ["<p><strong>FAIL", "<p><strong>PASS"]
    last = twice.cells[-1]
    assert "upper(induced)" in shown(last) and "python:Mended" in shown(last)


def module(cell: Any) -> str:
    """Returns a cell as a part of a module, which shows no value: the last expression is printed."""
    last = ast.parse(cell.source).body[-1]
    if not isinstance(last, ast.Expr):
        return f"{cell.source}\n"
    lines = cell.source.splitlines()
    before, value = lines[: last.lineno - 1], lines[last.lineno - 1 :]
    return "\n".join([*before, "print(", *value, ")", ""])


def test_pyright_is_clean_on_the_tutorial_and_finds_mistakes_in_it(tmp_path: Path) -> None:
    pytest.importorskip("basedpyright")
    file = tmp_path / "tutorial.py"
    text = "".join(map(module, cells()))
    file.write_text(text)
    assert findings(file) == {}
    mistakes = {
        "n=200": 'n="200"',
        'sensors="object"': 'sensors="objects"',
        "lead.gap_m": "lead.distance_m",
        "input.odometry": "input.truth",
        "first.outcomes()": "first.outcome()",
    }
    planted = text
    for right, wrong in mistakes.items():
        assert right in planted
        planted = planted.replace(right, wrong, 1)
    file.write_text(planted)
    lines = zip(text.splitlines(), planted.splitlines(), strict=True)
    changed = {number for number, (before, after) in enumerate(lines, 1) if before != after}
    assert len(changed) == len(mistakes) and changed <= set(findings(file))
