"""How a run shows itself in a notebook."""

from __future__ import annotations

import subprocess
import sys
import time
import types
from pathlib import Path
from typing import Any

import pytest
from IPython.core.interactiveshell import InteractiveShell
from support import SCENARIO

import closecall as cc


@pytest.fixture(scope="module")
def outcome() -> cc.Outcome:
    return cc.run(SCENARIO, "mis", seed=1, sample=3, sensors="object")


def shown(outcome: cc.Outcome) -> dict[str, Any]:
    """Returns what a notebook shows: nothing further if the object has displayed itself."""
    formats: dict[str, Any] = InteractiveShell.instance().display_formatter.format(outcome)[0]
    return formats


def test_without_the_viewer_the_figure_is_shown(outcome: cc.Outcome, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert outcome.viewer() is None
    formats = shown(outcome)
    assert formats["text/html"] == outcome.figure() and formats["text/html"].startswith("<svg")
    # An outcome that was read has no run.
    read = cc.Outcome.from_json(outcome._json)
    assert shown(read)["text/html"].startswith("<pre>")


def test_a_viewer_without_its_own_packages_is_none(outcome: cc.Outcome, monkeypatch: pytest.MonkeyPatch) -> None:
    rerun, notebook = types.ModuleType("rerun"), types.ModuleType("rerun.notebook")

    def refuse(**_: object) -> None:
        raise ImportError("'rerun-notebook' could not be imported")

    notebook.Viewer = refuse  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "rerun", rerun)
    monkeypatch.setitem(sys.modules, "rerun.notebook", notebook)
    assert shown(outcome)["text/html"].startswith("<svg")


def test_the_viewer_is_given_the_recording(outcome: cc.Outcome, tmp_path: Path) -> None:
    notebook = pytest.importorskip("rerun.notebook")
    if not notebook.HAS_NOTEBOOK:
        pytest.skip("rerun-sdk[notebook] is not installed")
    import rerun_notebook

    sent: list[bytes] = []
    displayed: list[object] = []
    patch = pytest.MonkeyPatch()
    patch.setattr(rerun_notebook.Viewer, "send_rrd", lambda _, data: sent.append(data))
    patch.setattr(notebook.Viewer, "display", lambda viewer: displayed.append(viewer))
    try:
        assert shown(outcome) == {}
        assert len(displayed) == 1
        # The viewer is sent the recording piece by piece, as its library reads it.
        deadline_s, size = time.monotonic() + 30.0, -1
        while time.monotonic() < deadline_s and (not sent or sum(map(len, sent)) != size):
            size = sum(map(len, sent))
            time.sleep(0.5)
    finally:
        patch.undo()
    file = tmp_path / "run.rrd"
    outcome.record(file)
    received = b"".join(sent)
    assert all(data.startswith(b"RRF") for data in sent) and len(received) > 0.5 * file.stat().st_size
    for entity in (b"closecall-run", b"ego", b"rear"):
        assert entity in received, entity


def test_a_recording_is_whole(outcome: cc.Outcome, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    file = tmp_path / "run.rrd"
    outcome.record(file)
    program = Path(sys.executable).with_name("rerun")
    done = subprocess.run([program, "rrd", "verify", file], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    with pytest.raises(cc.FileError) as raised:
        outcome.record(tmp_path / "none" / "run.rrd")
    assert raised.value.exit_code == 6


def test_a_campaign_without_a_folder_has_outcomes_shows_itself_and_runs_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    first, second = (cc.campaign(SCENARIO, 30, seed=1, paired=True) for _ in range(2))
    tables = [pyarrow.table(result.outcomes()) for result in (first, second)]
    assert tables[0].num_rows == 60 and tables[0].equals(tables[1])
    formats: dict[str, Any] = InteractiveShell.instance().display_formatter.format(first)[0]
    shown = formats["text/html"]
    for part in (first.verdict, "MIS-1", "<td>acc</td>", "<td>mis</td>", "<svg", "Outcome map"):
        assert part in shown, part
    assert first.folder is None
    # The files go with the results.
    assert len(list(tmp_path.iterdir())) == 2
    del first, second
    assert list(tmp_path.iterdir()) == []
