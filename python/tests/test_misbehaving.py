"""Controllers that crash, hang, leak or end their process cost their samples only: on this machine, and on a cluster."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
import pytest
from support import SCENARIO

import closecall as cc
import closecall.ray
from closecall import _host

import cluster  # isort: skip (support finds the benches)

ROOT = Path(__file__).parents[2]
COMMON: dict[str, Any] = {"seed": 1, "sensors": "object", "no_gate": True, "record": "failures:0"}

#: What the message of each fault holds.
FAULTS = [
    "",
    "ZeroDivisionError: of the controller",
    "failed at 0.52 s: no answer within 3000 ms",
    "failed at 0.52 s: no answer within 3000 ms",
    "the controller ended its process (exit status: 9)",
    "the controller ended its process (signal: 11 (SIGSEGV)); it last wrote: ",
    "the controller ended its process (signal: 6 (SIGABRT)); it last wrote: ",
    "holds more than the 192 MiB of memory allowed",
    "acceleration of NaN m/s²",
    "`step` answered None, a `NoneType`: it must be a number",
    "failed at 0.52 s: no answer within 3000 ms",
]


def fault_of(speed_mps: float) -> int:
    """The fault of a sample. The first speed of the ego tells which."""
    return int(1e6 * speed_mps) % len(FAULTS)


class Misbehaves:
    """Misbehaves at 0.52 s, in each sample in another way."""

    fault: int | None = None

    def step(self, input: cc.ControllerInput) -> Any:
        if self.fault is None:
            self.fault = fault_of(input.odometry.speed_mps)
        if input.time_s < 0.5:
            return 0.0
        if self.fault == 1:
            raise ZeroDivisionError("of the controller")
        if self.fault == 2:
            while True:
                pass
        if self.fault == 3:
            time.sleep(3_600.0)
        if self.fault == 4:
            os._exit(9)
        if self.fault == 5:
            ctypes.string_at(0)
        if self.fault == 6:
            os.abort()
        if self.fault == 7:
            kept = [bytearray(b"x" * (1 << 20)) for _ in range(1 << 20)]
            del kept
        if self.fault == 10:
            # Takes years, and keeps the interpreter to itself.
            re.match(r"(a+)+$", "a" * 60 + "b")
        return {8: float("nan"), 9: None}.get(self.fault, 0.0)


class Constant:
    """What `Misbehaves` is without its faults."""

    def step(self, input: cc.ControllerInput) -> float:
        return 0.0


#: Enough for every fault to appear.
SAMPLES = 40
#: On a busy machine, too, what leaks reaches its limit long before the time is over.
LIMITS = {"controller_timeout_ms": 3_000, "controller_memory_mib": 192}


def rows(result: cc.CampaignResult) -> list[dict[str, Any]]:
    return pyarrow.table(result.outcomes()).to_pylist()


def journal(folder: Path) -> bytes:
    return (folder / "journal.jsonl").read_bytes()


@pytest.fixture(scope="module")
def isolated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a campaign in worker processes."""
    out = tmp_path_factory.mktemp("isolated") / "out"
    result = cc.campaign(SCENARIO, SAMPLES, controller=Misbehaves, isolate=True, jobs=2, out=out, **LIMITS, **COMMON)
    assert (result.exit_code, result.samples) == (5, SAMPLES)
    return out


@pytest.fixture(scope="module")
def machines() -> Iterator[Any]:
    started = cluster.cluster([2])
    yield started
    started.shutdown()


def test_each_fault_of_an_object_in_a_worker_process_costs_its_sample_only(isolated: Path, tmp_path: Path) -> None:
    result = cc.campaign(SCENARIO, SAMPLES, controller=Constant, out=tmp_path / "sound", **COMMON)
    assert result.errors == 0
    found: dict[int, int] = {}
    table = pyarrow.parquet.read_table(isolated / "outcomes.parquet").to_pylist()
    for row, sound in zip(table, rows(result), strict=True):
        fault = fault_of(sound["param_cruise_mps"])
        found[fault] = found.get(fault, 0) + 1
        if fault:
            assert row["status"] == "error" and FAULTS[fault] in row["error_message"], (fault, row["error_message"])
        else:
            assert {**row, "controller": ""} == {**sound, "controller": ""}
    assert set(found) == set(range(len(FAULTS)))


def test_a_cluster_has_the_same_errors_in_the_same_bytes(isolated: Path, machines: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = closecall.ray.campaign(
        SCENARIO, SAMPLES, address=machines.address, controller=Misbehaves, out=out, **LIMITS, **COMMON
    )
    assert result.exit_code == 5
    assert journal(out) == journal(isolated)
    # Ray ends its workers without notice: nothing that they have written stays.
    assert not list(Path(tempfile.gettempdir()).glob("closecall-*/controllers.pickle"))


def compiled(fault: str, folder: Path, kind: str) -> str:
    """Builds a library or an FMU with a fault in every sample."""
    original = ROOT / "tests" / "fixtures" / "controllers" / {"lib": "faulty.c", "fmu": "faulty_fmu.c"}[kind]
    source, to = folder / f"{fault}.c", folder / f"{fault}.{kind}"
    setting = f'setenv("FAULT", "{fault}", 1); setenv("FAULT_ALWAYS", "1", 1);'
    source.write_text(f'#include "{original}"\n__attribute__((constructor)) static void set(void) {{ {setting} }}\n')
    if kind == "lib":
        options = ["-std=c11", "-O2", "-fexceptions", "-shared", "-fPIC", "-I", str(ROOT / "controllers/include")]
        subprocess.run(["cc", *options, "-o", to, source, "-lm"], check=True)
    else:
        subprocess.run([sys.executable, ROOT / "examples/fmu/build.py", "2", to, "--source", source], check=True)
    return f"{kind}:{to}"


#: A kind of controller, its fault, and what the message holds.
OTHERS = [
    ("lib", "segfault", "(signal: 11 (SIGSEGV)); it last wrote: about to crash"),
    ("lib", "exit-3", "(exit status: 3)"),
    ("lib", "hang", "no answer within 3000 ms"),
    ("lib", "leak", "holds more than the 192 MiB of memory allowed"),
    ("lib", "nan", "acceleration of NaN m/s²"),
    ("fmu", "segfault", "(signal: 11 (SIGSEGV))"),
    ("fmu", "hang", "no answer within 3000 ms"),
    ("fmu", "fatal", "fmi2DoStep answered fmi2Fatal: the solver does not converge"),
    ("exec", "dies", "the process ended (exit status: 3) after 1 answer; it last wrote: out of cheese"),
    ("exec", "killed", "(signal: 9 (SIGKILL))"),
    ("exec", "hangs", "the process hangs: no answer in twice the 3000 ms allowed"),
    ("exec", "nan", "which is not a finite number"),
]


@pytest.mark.parametrize(("kind", "fault", "message"), OTHERS)
def test_each_fault_of_another_controller_costs_its_samples_on_a_cluster(
    machines: Any, tmp_path: Path, kind: str, fault: str, message: str
) -> None:
    bad = ROOT / "tests" / "fixtures" / "controllers" / "bad.sh"
    controller = f"exec:sh {bad} {fault}" if kind == "exec" else compiled(fault, tmp_path, kind)
    options: dict[str, Any] = {"n": 2, "arms": ["acc", controller], **LIMITS, **COMMON}
    local = cc.campaign(SCENARIO, out=tmp_path / "local", **options)
    result = closecall.ray.campaign(SCENARIO, address=machines.address, out=tmp_path / "ray", **options)
    assert (local.exit_code, result.exit_code, result.errors) == (5, 5, 2)
    assert journal(tmp_path / "ray") == journal(tmp_path / "local")
    kept = [row for row in rows(result) if row["status"] == "error"]
    assert len(kept) == 2 and all(message in row["error_message"] for row in kept), kept
    # The other arm has its outcomes.
    assert [row["status"] for row in rows(result)].count("ok") == 2


#: Where a controller is, and what the machine without it says.
ABSENT = {
    "lib": ("lib:{folder}/own.so", 6, "failed to use the controller `lib:{folder}/own.so`: failed to read {folder}/own.so"),
    "exec": ("exec:{folder}/own.sh dies", 3, "`{folder}/own.sh` could not be started: No such file"),
    "script": ("exec:sh {folder}/own.sh dies", 3, "{folder}/own.sh has changed: "),
}


@pytest.mark.parametrize("kind", ABSENT)
def test_what_a_machine_lacks_is_refused_with_its_name(
    machines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    compiled("nan", tmp_path, "lib")
    files = {tmp_path / "own.so": tmp_path / "nan.lib", tmp_path / "own.sh": ROOT / "tests/fixtures/controllers/bad.sh"}
    for to, source in files.items():
        shutil.copy(source, to)
        to.chmod(0o700)
    controller, code, message = ABSENT[kind]
    controller, message = controller.format(folder=tmp_path), message.format(folder=tmp_path)
    options: dict[str, Any] = {"address": machines.address, "controller": controller, **COMMON}
    parcel = closecall.ray._parcel

    def remove(*arguments: Any) -> Any:
        # The driver has seen it, and the machines do not find it.
        for file in files:
            file.unlink()
        return parcel(*arguments)

    monkeypatch.setattr(closecall.ray, "_parcel", remove)
    with pytest.raises(cc.InputError) as raised:
        closecall.ray.campaign(SCENARIO, 2, out=tmp_path / "out", **options)
    assert raised.value.exit_code == 3
    assert f"failed to run on Ray: {socket.gethostname()}: " in str(raised.value) and message in str(raised.value)
    # Where the campaign is prepared, it is refused before anything runs. Of a script, only its program can be tried.
    if kind != "script":
        with pytest.raises(cc.ClosecallError, match=re.escape(message)) as raised_here:
            closecall.ray.campaign(SCENARIO, 2, out=tmp_path / "none", **options)
        assert raised_here.value.exit_code == code and not (tmp_path / "none").exists()


def test_libraries_and_fmus_with_a_relative_path_are_shipped(
    machines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own").mkdir()
    include = ["-I", str(ROOT / "controllers/include"), "-I", str(ROOT / "examples")]
    options = ["-std=c11", "-O2", "-ffp-contract=off", "-shared", "-fPIC", *include]
    subprocess.run(["cc", *options, "-o", "own/acc.so", ROOT / "examples/acc_controller.c", "-lm"], check=True)
    # An FMU with a name of its own, which the scenario maps to a quantity.
    description = (ROOT / "examples/fmu/modelDescription-fmi2.xml").read_text().replace('name="ego_speed"', 'name="VEH_SPD"')
    (tmp_path / "own.xml").write_text(description)
    subprocess.run([sys.executable, ROOT / "examples/fmu/build.py", "2", "own/acc.fmu", "--description", "own.xml"], check=True)
    text = (ROOT / "scenarios/library/low-thw-overtake.toml").read_text()
    table = '[controller.fmu]\ninputs = { VEH_SPD = "ego_speed" }\n\n[parameters]'
    (tmp_path / "mapped.toml").write_text(text.replace("[parameters]", table, 1))
    parcel = closecall.ray._parcel
    arms = ["acc", "lib:own/acc.so", "fmu:./own/acc.fmu"]
    local = cc.campaign("mapped.toml", 4, arms=arms, out=tmp_path / "local", **COMMON)

    def remove(*arguments: Any) -> Any:
        shutil.rmtree(tmp_path / "own")
        return parcel(*arguments)

    monkeypatch.setattr(closecall.ray, "_parcel", remove)
    result = closecall.ray.campaign("mapped.toml", 4, arms=arms, address=machines.address, out=tmp_path / "ray", **COMMON)
    assert (local.exit_code, result.exit_code, result.errors) == (0, 0, 0)
    assert journal(tmp_path / "ray") == journal(tmp_path / "local") and not (tmp_path / "own").exists()


def test_a_sample_with_an_error_in_any_arm_is_not_recorded(tmp_path: Path) -> None:
    options = {**COMMON, "record": "random:3,worst:3"}
    arms = [Misbehaves, "acc"]
    result = cc.campaign(SCENARIO, 12, arms=arms, isolate=True, jobs=2, out=tmp_path / "out", **LIMITS, **options)
    failed = {row["sample"] for row in rows(result) if row["status"] == "error"}
    recorded = {int(file.stem.rpartition("-")[2]) for file in (tmp_path / "out" / "recordings").glob("*.rrd")}
    # This process would end, or hang, if it ran one of them again.
    assert result.exit_code == 5 and failed and recorded and not failed & recorded


class Endless:
    """Never answers, in any sample."""

    running = 0
    most = 0

    def step(self, input: cc.ControllerInput) -> float:
        type(self).running += 1
        type(self).most = max(self.most, self.running)
        try:
            while True:
                pass
        finally:
            type(self).running -= 1


def test_steps_that_hang_in_this_process_end_after_their_sample_is_given_up() -> None:
    result = cc.campaign(SCENARIO, 24, controller=Endless, jobs=2, sample_timeout_s=0.5, **COMMON)
    assert (result.exit_code, result.errors) == (5, 24)
    # Otherwise all of them would run at the end, each with its share of the interpreter.
    assert 0 < Endless.most < 20 and Endless.running == 0


def test_a_controller_of_the_main_program_runs_in_worker_processes(tmp_path: Path) -> None:
    program = tmp_path / "own.py"
    program.write_text(
        "import closecall as cc, helper\n"
        "class Own:\n"
        "    def step(self, input):\n"
        "        return helper.gain() * (30.0 - input.odometry.speed_mps)\n"
        f"one, two = [cc.campaign('{SCENARIO}', n=4, sensors='object', controller=Own, isolate=isolate, no_gate=True, out=str(isolate))\n"
        "            for isolate in (False, True)]\n"
        "print(one.errors, two.errors)\n"
    )
    (tmp_path / "helper.py").write_text("def gain():\n    return 0.5\n")
    done = subprocess.run([sys.executable, program], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.stdout.split(), done.returncode) == (["0", "0"], 0), done.stderr
    assert (tmp_path / "False" / "outcomes.parquet").read_bytes() == (tmp_path / "True" / "outcomes.parquet").read_bytes()


class Unloadable:
    """Cannot be read in another process."""

    def __reduce__(self) -> Any:
        return int, ("no number",)

    def step(self, input: cc.ControllerInput) -> float:
        return 0.0


class Unpicklable:
    """Cannot be given to another process."""

    def __reduce__(self) -> Any:
        raise TypeError("it holds a device")

    def step(self, input: cc.ControllerInput) -> float:
        return 0.0


@pytest.mark.parametrize(
    ("controller", "message"),
    [(Unloadable, "a controller cannot be read there: ValueError: invalid literal"), (Unpicklable, "it holds a device")],
)
def test_an_object_that_cannot_be_given_to_another_process_is_refused(controller: Any, message: str) -> None:
    with pytest.raises(cc.InputError, match=message) as raised:
        cc.campaign(SCENARIO, 2, controller=controller(), isolate=True, **COMMON)
    assert raised.value.exit_code == 3


def test_limits_without_a_process_are_refused() -> None:
    with pytest.raises(cc.UsageError, match="add `isolate=True`"):
        cc.campaign(SCENARIO, 2, controller=Constant, controller_timeout_ms=100, **COMMON)
    for wrong in (0, 1.5, True, 600_001):
        with pytest.raises(cc.UsageError, match="controller_timeout_ms: expected a whole number from 1 to 600000"):
            cc.campaign(SCENARIO, 2, controller=Constant, isolate=True, controller_timeout_ms=wrong, **COMMON)


def test_without_cloudpickle_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_host.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(cc.UsageError, match=r'pip install "closecall\[isolate\]"'):
        cc.campaign(SCENARIO, 2, controller=Constant, isolate=True, **COMMON)
