"""Campaigns, and controllers that are Python objects."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
import pytest
from support import SCENARIO, command

import closecall as cc
from closecall._controller import registered

from acc import Acc  # isort: skip (support finds the examples)


def sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def test_the_folder_is_that_of_the_command_line(tmp_path: Path) -> None:
    words = ["-n", "30", "--seed", "3", "--sensors", "object", "--paired", "--max-induced", "0"]
    # In the same folder, whose path is part of the commands that the reports print.
    folder, there = tmp_path / "out", tmp_path / "there"
    done = command("campaign", SCENARIO, *words, "--out", folder, "--format", "json")
    folder.rename(there)
    counted: list[tuple[int, int]] = []
    result = cc.campaign(
        SCENARIO,
        n=30,
        seed=3,
        sensors="object",
        paired=True,
        max_induced=0,
        out=folder,
        progress=lambda done, total: counted.append((done, total)),
    )
    assert result.exit_code == done.returncode
    for file in ("outcomes.parquet", "arm_pairs.parquet"):
        assert sha256(folder / file) == sha256(there / file), file
    printed = json.loads(done.stdout)
    assert {**result.report, "wall_s": None} == {**printed, "wall_s": None}
    assert counted[-1] == (30, 30) and counted == sorted(counted)
    assert result.outcomes().num_rows == 60
    manifests = [json.loads((at / "manifest.json").read_text()) for at in (folder, there)]
    assert manifests[0]["closecall_version"] == manifests[1]["closecall_version"]


def test_the_package_resumes_what_the_command_of_the_same_commit_began(tmp_path: Path) -> None:
    program = Path(__file__).parents[2] / "target/release/closecall"
    if not program.exists():
        pytest.skip("the command is not built: cargo build --release")
    built = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if built != command("--version").stdout or "modified" in built:
        pytest.skip("the command and the package are not built from one commit")
    words = ["--seed", "3", "--sensors", "object", "--out"]
    subprocess.run([program, "campaign", SCENARIO, "-n", "10", *words, tmp_path / "grown"], check=False)
    grown = cc.campaign(SCENARIO, n=30, seed=3, sensors="object", out=tmp_path / "grown", resume=True)
    whole = cc.campaign(SCENARIO, n=30, seed=3, sensors="object", out=tmp_path / "whole")
    assert grown.report["samples"] == whole.report["samples"] == 30
    file = "outcomes.parquet"
    assert sha256(tmp_path / "grown" / file) == sha256(tmp_path / "whole" / file)


def test_a_python_controller_reproduces_acc_to_the_last_bit(tmp_path: Path) -> None:
    names = {"acc": "acc", "own": Acc}
    tables = {}
    for name, controller in names.items():
        cc.campaign(SCENARIO, n=20, seed=5, sensors="object", controller=controller, out=tmp_path / name, no_gate=True)
        table = pyarrow.parquet.read_table(tmp_path / name / "outcomes.parquet")
        # The summary of the margin increase system differs: only the own controller could have one.
        columns = [column for column in table.column_names if column != "controller" and not column.startswith("mis_")]
        tables[name] = table.select(columns).to_pylist()
    assert tables["own"] == tables["acc"] and len(tables["own"]) == 20
    # On one thread and on several the file is the same.
    for jobs in (1, 4):
        out = tmp_path / str(jobs)
        cc.campaign(SCENARIO, n=20, seed=5, sensors="object", controller=Acc, out=out, no_gate=True, jobs=jobs)
        assert sha256(out / "outcomes.parquet") == sha256(tmp_path / "own" / "outcomes.parquet")
    # An object is another controller than its class, whose hash the file holds. Its outcomes are the same.
    cc.campaign(SCENARIO, n=20, seed=5, sensors="object", controller=Acc(), out=tmp_path / "object", no_gate=True)
    tables = {name: pyarrow.parquet.read_table(tmp_path / name / "outcomes.parquet") for name in ("own", "object")}
    assert tables["own"].equals(tables["object"])


class Sometimes:
    """Fails in some samples, each time in another way."""

    def __init__(self) -> None:
        self.failure = 0

    def step(self, input: cc.ControllerInput) -> object:
        if input.time_s == 0.0:
            self.failure = int(1e6 * input.odometry.speed_mps) % 5
        if input.time_s < 0.5 or self.failure == 0:
            return 0.0
        if self.failure == 1:
            raise ZeroDivisionError("one in five")
        return [None, None, float("nan"), "0.0", (0.0, "driving")][self.failure]


def test_a_failing_controller_costs_its_sample_only(tmp_path: Path) -> None:
    result = cc.campaign(SCENARIO, n=40, seed=1, sensors="object", controller=Sometimes, out=tmp_path / "out")  # type: ignore[arg-type]
    rows = pyarrow.table(result.outcomes()).to_pylist()
    failed = [row for row in rows if row["status"] == "error"]
    assert (result.exit_code, len(rows), result.errors) == (5, 40, len(failed))
    assert 0 < len(failed) < 40
    messages = "\n".join(row["error_message"] for row in failed)
    for part in [
        "ZeroDivisionError: one in five",
        f'File "{__file__}", line',
        "acceleration of NaN m/s²",
        "`step` answered '0.0', a `str`: it must be a number",
        "`step` answered the state `driving`: it is one of following",
    ]:
        assert part in messages, part
    # Each message says once what was wrong.
    for row in failed:
        for part in ("ZeroDivisionError: one in five", "`step` answered"):
            assert row["error_message"].count(part) <= 1, row["error_message"]
    # The command line can read the folder, and says why it cannot run the samples again.
    again = command("replay", tmp_path / "out", "0")
    assert again.returncode == 5 and "controller of a Python program" in again.stderr
    compared = command("compare", tmp_path / "out", tmp_path / "out")
    assert compared.returncode == 5 and "NOT COMPARED" in compared.stdout


def test_the_cause_of_a_failed_run_is_the_exception() -> None:
    class Raises:
        def step(self, input: cc.ControllerInput) -> float:
            raise KeyError("of the controller")

    with pytest.raises(cc.SampleError) as raised:
        cc.run(SCENARIO, Raises, sensors="object")
    assert isinstance(raised.value.__cause__, KeyError) and raised.value.exit_code == 5
    with pytest.raises(cc.SampleError, match="has no attribute 'step'"):
        cc.run(SCENARIO, lambda: 3, sensors="object")  # type: ignore[arg-type,return-value]


HANGING = """
import closecall as cc

class Hangs:
    def step(self, input):
        while input.time_s > 1.0:
            pass
        return 0.0

result = cc.campaign("low-thw-overtake", n=3, sensors="object", controller=Hangs, sample_timeout_s=1, jobs=2)
print(result.exit_code, result.errors, flush=True)
"""


def test_a_controller_that_hangs_costs_its_sample_only() -> None:
    # The interpreter ends, although threads hang in the controller.
    done = subprocess.run([sys.executable, "-c", HANGING], capture_output=True, text=True, timeout=120)
    assert (done.stdout.split(), done.returncode, done.stderr) == (["5", "3"], 0, "")


class Gain:
    """Holds a speed with a gain."""

    def __init__(self, gain: float) -> None:
        self.gain = gain
        self.others: list[object] = []

    def step(self, input: cc.ControllerInput) -> float:
        return self.gain * (30.0 - input.odometry.speed_mps)


def test_the_name_of_a_controller_changes_with_its_code_and_state() -> None:
    def names(*controllers: Any) -> list[str]:
        with registered(list(controllers)) as found:
            return found

    first, again, other = names(Gain(0.5), Gain(0.5), Gain(0.6))
    assert first == again != other and first.startswith("python:Gain@")

    def enclosing(gain: float) -> Any:
        return lambda: Gain(gain)

    first, again, other = names(enclosing(0.5), enclosing(0.5), enclosing(0.6))
    assert first == again != other
    unknown = Gain(0.5)
    unknown.others = [threading.Lock()]
    assert "unidentified" in names(Gain)[0] + names(lambda: unknown)[0]


def test_several_objects_of_one_class_are_compared() -> None:
    arms = ["acc", Gain(0.5), Gain(0.6)]
    result = cc.campaign(SCENARIO, n=4, sensors="object", arms=arms, no_gate=True)
    assert sorted(result.report["controllers"]) == ["acc", "python:Gain-1", "python:Gain-2"]


def test_a_controller_that_has_changed_does_not_resume(tmp_path: Path) -> None:
    def written(gain: float) -> Any:
        file = tmp_path / f"own_{int(10 * gain)}.py"
        file.write_text(f"class Own:\n    def step(self, input):\n        return {gain} * (30.0 - input.odometry.speed_mps)\n")
        spec = importlib.util.spec_from_file_location(file.stem, file)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[file.stem] = module
        spec.loader.exec_module(module)
        return module.Own

    def campaign(gain: float, resume: bool) -> int:
        options: dict[str, Any] = {"n": 4, "sensors": "object", "out": tmp_path / "out", "no_gate": True}
        return cc.campaign(SCENARIO, controller=written(gain), resume=resume, **options).exit_code

    assert campaign(0.5, resume=False) == 0
    with pytest.raises(cc.UsageError):
        campaign(0.6, resume=True)
    assert campaign(0.5, resume=True) == 0


def script(text: str, *words: str | Path, timeout_s: float = 120.0, **variables: str) -> subprocess.CompletedProcess[str]:
    """Runs a Python program."""
    environment = {**os.environ, **variables}
    program = [sys.executable, "-c", text, *map(str, words)]
    return subprocess.run(program, capture_output=True, text=True, timeout=timeout_s, env=environment)


DROPPED = """
import time, closecall as cc

class Resource:
    def __del__(self):
        time.sleep(0.01)

class Raises:
    def step(self, input):
        resource = Resource()
        if input.time_s > 0.5:
            raise ValueError("of the controller")
        return 0.0

result = cc.campaign("low-thw-overtake", n=60, sensors="object", controller=Raises, jobs=4, no_gate=True)
print(result.exit_code, result.errors)
"""


def test_dropping_an_exception_whose_objects_wait_does_not_block_the_campaign() -> None:
    done = script(DROPPED)
    assert (done.stdout.split(), done.returncode, done.stderr) == (["5", "60"], 0, "")


HASHED = """
from closecall._controller import registered

class Base:
    GAIN = 0.5
    MODES = frozenset({"a", "b", "c"})

    @property
    def limit(self):
        return 3.0

    @staticmethod
    def near(gap_m):
        return gap_m < 5.0

    @classmethod
    def make(cls):
        return cls()

class Own(Base):
    def __init__(self):
        self.words = {"d", "e", "f"}

    def step(self, input):
        return 0.0 if input in {"g", "h", "i"} else 1.0

with registered([Own, Own()]) as names:
    print(*names)
"""


def test_the_hash_of_a_controller_covers_its_class_and_is_that_of_any_process() -> None:
    names = script(HASHED, PYTHONHASHSEED="1").stdout.split()
    assert len(names) == 2 and all("python:Own@" in name and "unidentified" not in name for name in names)
    assert script(HASHED, PYTHONHASHSEED="2").stdout.split() == names
    for old, new in [
        ("GAIN = 0.5", "GAIN = 0.6"),
        ('"c"})', '"z"})'),
        ("return 3.0", "return 4.0"),
        ("gap_m < 5.0", "gap_m < 6.0"),
        ("return cls()", "return None"),
        ('"g", "h"', '"g", "z"'),
    ]:
        assert old in HASHED
        changed = script(HASHED.replace(old, new), PYTHONHASHSEED="1").stdout.split()
        assert len(changed) == 2 and not set(changed) & set(names), new


class Fails:
    """Raises at its first step."""

    def step(self, input: cc.ControllerInput) -> float:
        raise ValueError("at once")


def test_a_campaign_that_ends_early_has_a_result(tmp_path: Path) -> None:
    for options in ({"fail_fast": True}, {"max_errors": 0}):
        out = tmp_path / next(iter(options))
        result = cc.campaign(SCENARIO, n=20, sensors="object", controller=Fails, out=out, **options)
        assert (result.verdict, result.exit_code, result.errors, result.samples) == ("ENDED EARLY", 5, 1, 1)
        resume = result.report["resume"]
        assert result.report["of"] == 20 and resume.startswith("closecall.campaign(") and resume.count("resume=True") == 1
        assert "fail_fast=True" not in resume
        assert result.sentence.startswith("ENDED EARLY, without a verdict: ") and result.sentence.endswith("; 1 of 20 samples are done")
        shown = result._repr_html_()
        assert result.sentence in shown and "ValueError: at once" in shown, shown


def test_the_settings_of_one_scenario_are_not_those_of_another() -> None:
    plain, short = cc.Scenario.load(SCENARIO), cc.Scenario.load(SCENARIO, set={"duration-s": 5})
    orders: list[list[cc.Scenario | str]] = [[plain, short], [short, plain], [SCENARIO, short], [short, SCENARIO]]
    for several in orders:
        with pytest.raises(cc.UsageError, match="by the same settings"):
            cc.campaign(several, n=1)


PAUSED = """
import os, sys, time, closecall as cc

class Slow:
    def step(self, input):
        os.write(1, b"step\\n")
        time.sleep(float(os.environ["PAUSE_S"]))
        return 0.0

try:
    result = cc.campaign("low-thw-overtake", n=4, seed=2, sensors="object", controller=Slow, no_gate=True, jobs=2,
                         out=sys.argv[1], resume=sys.argv[2] == "resume")
except KeyboardInterrupt:
    raise SystemExit(7)
raise SystemExit(result.exit_code)
"""


@pytest.mark.parametrize("signals", [1, 2])
def test_ctrl_c_before_the_first_sample_is_done_leaves_no_errors(tmp_path: Path, signals: int) -> None:
    out, there = tmp_path / "out", tmp_path / "there"
    assert script(PAUSED, out, "start", PAUSE_S="0").returncode == 0
    out.rename(there)
    program = [sys.executable, "-c", PAUSED, str(out), "start"]
    environment = {**os.environ, "PAUSE_S": "0.1"}
    process = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None and process.stdout.readline() == "step\n"
    process.send_signal(signal.SIGINT)
    if signals == 2:
        time.sleep(0.5)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
    steps, messages = process.communicate(timeout=60)
    assert (process.returncode, messages) == (7, "")
    # The second signal ends the steps, which the first one grants 5 s: about 50 in each of two threads.
    assert steps.count("step") < 40 if signals == 2 else steps.count("step") >= 40
    assert '"error"' not in (out / "journal.jsonl").read_text()
    assert script(PAUSED, out, "resume", PAUSE_S="0").returncode == 0
    assert sha256(out / "outcomes.parquet") == sha256(there / "outcomes.parquet")


INTERRUPTED = """
import sys, closecall as cc
try:
    cc.campaign("low-thw-overtake", n=100_000, seed=2, sensors="object", no_gate=True, out=sys.argv[1],
                progress=lambda done, total: print(done, flush=True))
except KeyboardInterrupt:
    print("interrupted", flush=True)
    raise SystemExit(7)
"""


def test_ctrl_c_stops_a_campaign_that_can_be_resumed(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, str(tmp_path / "out")], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert int(process.stdout.readline()) > 0
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=60)
    assert process.returncode == 7 and rest.splitlines()[-1] == "interrupted"
    records = (tmp_path / "out" / "journal.jsonl").read_text().count("\n")
    assert 0 < records < 100_000


SLOW = """
import time, closecall as cc

class Slow:
    def step(self, input):
        print("step", flush=True)
        time.sleep(0.05)
        return 0.0

try:
    cc.run("low-thw-overtake", Slow, sensors="object")
except KeyboardInterrupt:
    print("interrupted", flush=True)
    raise SystemExit(7)
"""


def test_ctrl_c_ends_a_run() -> None:
    process = subprocess.Popen([sys.executable, "-c", SLOW], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "step\n"
    process.send_signal(signal.SIGINT)
    rest, messages = process.communicate(timeout=30)
    assert (process.returncode, messages) == (7, "") and "interrupted" in rest and rest.count("step") < 100


ENDLESS = """
import closecall as cc

class Endless:
    def step(self, input):
        print("step", flush=True)
        while input.time_s >= 0.0:
            pass
        return 0.0

try:
    cc.run("low-thw-overtake", Endless, sensors="object")
except KeyboardInterrupt:
    raise SystemExit(7)
"""


def test_ctrl_c_ends_a_run_whose_controller_hangs() -> None:
    process = subprocess.Popen([sys.executable, "-c", ENDLESS], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "step\n"
    process.send_signal(signal.SIGINT)
    _, messages = process.communicate(timeout=30)
    assert (process.returncode, messages) == (7, "")


def test_ctrl_c_ends_the_command_as_it_does_without_python(tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("closecall")
    words = ["campaign", SCENARIO, "-n", "100000", "--sensors", "object", "--no-gate", "--out", str(tmp_path / "out")]
    process = subprocess.Popen([program, *words], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    journal = tmp_path / "out" / "journal.jsonl"
    while not (journal.exists() and journal.stat().st_size):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, messages = process.communicate(timeout=60)
    assert process.returncode == 130 and "SIGINT" in messages and "Traceback" not in messages


def test_an_argument_that_is_not_utf_8_is_passed_on(tmp_path: Path) -> None:
    program = os.fsencode(Path(sys.executable).with_name("closecall"))
    done = subprocess.run([program, b"check", os.fsencode(tmp_path) + b"/\xff.toml"], capture_output=True, timeout=60)
    assert done.returncode == 6 and b".toml" in done.stderr


def test_exit_codes_of_the_command(tmp_path: Path) -> None:
    assert command("--version").returncode == 0
    assert command("campaign").returncode == 2
    bad = tmp_path / "bad.toml"
    bad.write_text("name = 3\n")
    assert command("check", bad).returncode == 3
    assert command("run", tmp_path / "none.toml").returncode == 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"max_collision": 3}, "no keyword `max_collision`"),
        ({"paired": True, "controller": "acc"}, "paired= compares"),
        ({"arms": ["acc", "mis"], "paired": True}, "leave out `controller` and `paired`"),
        ({"n": 0}, "a whole number of 1 or more is needed"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(cc.UsageError, match=message) as raised:
        cc.campaign(SCENARIO, **arguments)  # type: ignore[arg-type]
    assert raised.value.exit_code == 2


def test_the_interpreter_goes_on_during_a_campaign() -> None:
    ticks = 0
    is_over = False

    def tick() -> None:
        nonlocal ticks
        while not is_over:
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    cc.campaign(SCENARIO, n=60, sensors="object", no_gate=True, jobs=os.cpu_count())
    is_over = True
    thread.join()
    assert ticks > 10
