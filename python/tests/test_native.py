"""Controllers that are shared libraries and FMUs: the package runs them in processes of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import fmpy.validation
import pyarrow
import pyarrow.parquet
import pytest
from support import SCENARIO, command

import closecall as cc

ROOT = Path(__file__).parents[2]


def compiled(source: str, to: Path) -> str:
    options = ["-std=c11", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-I", "controllers/include"]
    subprocess.run(["cc", *options, "-o", to, source, "-lm"], cwd=ROOT, check=True)
    return f"lib:{to}"


def built(fmi: str, to: Path, *options: str) -> str:
    subprocess.run([sys.executable, "examples/fmu/build.py", fmi, to, *options], cwd=ROOT, check=True)
    return f"fmu:{to}"


def in_python(folder: Path) -> str:
    """Builds the FMU of the example in Python."""
    source = ROOT / "examples" / "fmu" / "acc_slave.py"
    subprocess.run([sys.executable, "-m", "pythonfmu", "build", "-f", source, "-d", folder], check=True)
    return f"fmu:{folder / 'AccSlave.fmu'}"


def rows(table: pyarrow.Table) -> list[dict[str, object]]:
    """Returns the outcomes without the summary of the margin increase system, which `acc` cannot have."""
    columns = [column for column in table.column_names if column != "controller" and not column.startswith("mis_")]
    return table.select(columns).to_pylist()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_fmpy_finds_the_example_valid(fmi: str, tmp_path: Path) -> None:
    fmu = built(fmi, tmp_path / "acc.fmu").removeprefix("fmu:")
    assert fmpy.validation.validate_fmu(fmu) == []
    # The answer of FMPy is no matter of course: it finds an output that is not listed.
    text = (ROOT / "examples" / "fmu" / f"modelDescription-fmi{fmi}.xml").read_text()
    (tmp_path / "bad.xml").write_text(text.replace('<Unknown index="13"/>', "", 1).replace('<Output valueReference="12"/>', ""))
    bad = built(fmi, tmp_path / "bad.fmu", "--description", str(tmp_path / "bad.xml")).removeprefix("fmu:")
    assert fmpy.validation.validate_fmu(bad) != []


def test_every_kind_reproduces_acc_to_the_last_bit(tmp_path: Path) -> None:
    controllers = {
        "lib": compiled("examples/acc_controller.c", tmp_path / "acc.so"),
        "fmi2": built("2", tmp_path / "two.fmu"),
        "fmi3": built("3", tmp_path / "three.fmu"),
        "pythonfmu": in_python(tmp_path),
    }
    assert fmpy.validation.validate_fmu(tmp_path / "AccSlave.fmu") == []
    options = {"n": 12, "seed": 5, "sensors": "object", "no_gate": True, "controller_timeout_ms": 60_000}
    expected = cc.campaign(SCENARIO, n=12, seed=5, sensors="object", no_gate=True, controller="acc", out=tmp_path / "acc")
    for name, controller in controllers.items():
        result = cc.campaign(SCENARIO, controller=controller, out=tmp_path / name, **options)
        assert (result.exit_code, result.errors) == (0, 0), name
        assert rows(pyarrow.table(result.outcomes())) == rows(pyarrow.table(expected.outcomes())), name
        # A single run answers step by step.
        outcome = cc.run(SCENARIO, controller=controller, seed=5, sample=3, sensors="object")
        assert outcome.margins == cc.run(SCENARIO, controller="acc", seed=5, sample=3, sensors="object").margins, name
    # The command has the same bytes.
    words = ["-n", "12", "--seed", "5", "--sensors", "object", "--no-gate", "--controller-timeout-ms", "60000"]
    done = command("campaign", SCENARIO, *words, "--controller", controllers["lib"], "--out", tmp_path / "command")
    assert done.returncode == 0, done.stderr
    files = [tmp_path / name / "outcomes.parquet" for name in ("lib", "command")]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_crash_costs_its_samples_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    controller = compiled("tests/fixtures/controllers/faulty.c", tmp_path / "faulty.so")
    monkeypatch.setitem(os.environ, "FAULT", "segfault")
    result = cc.campaign(SCENARIO, n=24, seed=3, sensors="object", controller=controller, out=tmp_path / "out", no_gate=True)
    table = pyarrow.table(result.outcomes()).to_pylist()
    failed = [row for row in table if row["status"] == "error"]
    assert (result.exit_code, result.errors) == (5, len(failed))
    assert 0 < len(failed) < 24
    assert all("signal: 11 (SIGSEGV)" in row["error_message"] for row in failed)
    monkeypatch.setitem(os.environ, "FAULT_ALWAYS", "1")
    with pytest.raises(cc.SampleError, match="SIGSEGV"):
        cc.run(SCENARIO, controller=controller, sensors="object")


def test_a_module_in_the_working_folder_is_not_that_of_a_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    controller = compiled("examples/acc_controller.c", tmp_path / "acc.so")
    for name in ("signal.py", "closecall.py"):
        (tmp_path / name).write_text("raise SystemExit('another module')\n")
    monkeypatch.chdir(tmp_path)
    assert cc.campaign(SCENARIO, n=2, seed=3, sensors="object", controller=controller, no_gate=True).errors == 0


def test_what_cannot_be_used_is_refused(tmp_path: Path) -> None:
    text = tmp_path / "text.so"
    text.write_text("no library")
    for controller, message in [
        (f"lib:{text}", "is not a shared library"),
        (f"fmu:{text}", "it is not an FMU"),
        (built("2", tmp_path / "foreign.fmu", "--platform", "win64"), "binaries for win64"),
    ]:
        with pytest.raises(cc.InputError, match=message):
            cc.run(SCENARIO, controller=controller)
        with pytest.raises(cc.InputError, match=message):
            cc.campaign(SCENARIO, n=2, controller=controller)
    with pytest.raises(cc.FileError, match="No such file"):
        cc.run(SCENARIO, controller=f"lib:{tmp_path / 'none.so'}")


def test_the_module_is_the_command() -> None:
    done = subprocess.run([sys.executable, "-m", "closecall", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == command("--version").stdout
