"""Campaigns on a Ray cluster. `benches/cluster.py survive` is the long form of the last test."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import ray
from support import SCENARIO, command

import closecall as cc
import closecall.ray

import cluster  # isort: skip (support finds the benches)

SAMPLES = 60
COMMON: dict[str, Any] = {"seed": 3, "sensors": "object", "paired": True, "no_gate": True}
WORDS = ["-n", str(SAMPLES), "--seed", "3", "--sensors", "object", "--paired", "--no-gate"]


@pytest.fixture(scope="module")
def machines() -> Iterator[Any]:
    started = cluster.cluster([1])
    yield started
    started.shutdown()


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The hash of the outcomes of the command line."""
    out = tmp_path_factory.mktemp("local") / "out"
    assert command("campaign", SCENARIO, *WORDS, "--out", out).returncode == 0
    return cluster.sha256(out / "outcomes.parquet")


def test_the_command_line_python_and_ray_with_1_2_and_4_workers_have_the_same_bytes(
    machines: Any, expected: str, tmp_path: Path
) -> None:
    folders = {"python": tmp_path / "python"}
    cc.campaign(SCENARIO, SAMPLES, out=folders["python"], **COMMON)
    for workers, more in [(1, 0), (2, 1), (4, 2)]:
        if more:
            machines.add_node(num_cpus=more)
        folders[f"ray {workers}"] = out = tmp_path / str(workers)
        counted: list[tuple[int, int]] = []
        result = closecall.ray.campaign(
            SCENARIO, SAMPLES, address=machines.address, out=out, progress=lambda *two: counted.append(two), **COMMON
        )
        assert (result.exit_code, result.samples, counted[-1]) == (0, SAMPLES, (SAMPLES, SAMPLES))
    folders["command line"] = tmp_path / "command"
    done = command("campaign", SCENARIO, *WORDS, "--out", folders["command line"], "--ray", machines.address)
    assert done.returncode == 0 and " s on a cluster (" in done.stdout, done.stdout + done.stderr
    for file in ("outcomes.parquet", "arm_pairs.parquet", "journal.jsonl"):
        assert len({cluster.sha256(folder / file) for folder in folders.values()}) == 1, file
    assert cluster.sha256(folders["python"] / "outcomes.parquet") == expected


def test_a_rare_event_on_ray_has_the_bytes_of_one_machine(machines: Any, tmp_path: Path) -> None:
    words = ["--design", "importance", "--event", "collision", "-n", "600", "--seed", "3", "--sensors", "object"]
    for name, more in [("here", []), ("ray", ["--ray", machines.address])]:
        done = command("campaign", SCENARIO, *words, "--out", tmp_path / name, *more)
        # An estimate without an interval ends with 4.
        assert done.returncode in (0, 4), done.stdout + done.stderr
    for file in ("rare-journal.jsonl", "rare.json"):
        assert len({cluster.sha256(tmp_path / name / file) for name in ("here", "ray")}) == 1, file


def test_failures_of_an_earlier_campaign_run_first_on_ray_too(machines: Any, expected: str, tmp_path: Path) -> None:
    earlier, later = tmp_path / "earlier", tmp_path / "later"
    assert command("campaign", SCENARIO, *WORDS, "--out", earlier).returncode == 0
    words = [*WORDS, "--out", later, "--ray", machines.address, "--failures-first", earlier]
    done = command("campaign", SCENARIO, *words)
    assert done.returncode == 0 and "first" in done.stderr, done.stdout + done.stderr
    assert cluster.sha256(later / "outcomes.parquet") == expected
    assert cluster.sha256(later / "journal.jsonl") == cluster.sha256(earlier / "journal.jsonl")


def test_fast_samples_on_ray_have_the_bytes_of_one_machine(machines: Any, tmp_path: Path) -> None:
    for name, more in [("here", []), ("ray", ["--ray", machines.address])]:
        done = command("campaign", SCENARIO, *WORDS, "--fidelity", "ground-truth:2", "--out", tmp_path / name, *more)
        assert done.returncode == 0, done.stdout + done.stderr
    for file in ("journal.jsonl", "fidelity.json", "fidelity/journal.jsonl"):
        assert len({cluster.sha256(tmp_path / name / file) for name in ("here", "ray")}) == 1, file


def test_a_controller_in_python_is_shipped(machines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "shipped_controller.py"
    file.write_text(
        "GAIN = 0.5\n"
        "def command(speed_mps):\n    return GAIN * (30.0 - speed_mps)\n"
        "class Own:\n"
        "    def step(self, input):\n"
        "        if input.time_s == 0.0 and int(1e6 * input.odometry.speed_mps) % 3 == 0:\n"
        "            raise ValueError('one in three')\n"
        "        return command(input.odometry.speed_mps)\n"
    )
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.stem] = module
    spec.loader.exec_module(module)
    options: dict[str, Any] = {"n": 12, "sensors": "object", "controller": module.Own, "no_gate": True}
    local = cc.campaign(SCENARIO, out=tmp_path / "local", **options)
    parcel = closecall.ray._parcel

    def remove(*arguments: Any) -> Any:
        # What the workers need is not there for them: the module comes to them with the campaign.
        shipped = parcel(*arguments)
        file.unlink()
        return shipped

    monkeypatch.setattr(closecall.ray, "_parcel", remove)
    result = closecall.ray.campaign(SCENARIO, address=machines.address, out=tmp_path / "ray", **options)
    assert not file.exists()
    assert (result.exit_code, result.errors) == (local.exit_code, local.errors) == (5, local.errors)
    journals = [(tmp_path / name / "journal.jsonl").read_text() for name in ("local", "ray")]
    # The traceback of an exception is the same, too, with the lines of the module.
    assert journals[0] == journals[1] and "raise ValueError('one in three')" in journals[0] and 0 < local.errors < 12


def test_the_files_of_a_process_are_shipped(machines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    program = tmp_path / "own.py"
    example = Path(__file__).parents[2] / "examples" / "acc_controller.py"
    program.write_bytes(example.read_bytes())
    options: dict[str, Any] = {"n": 6, "sensors": "object", "controller": f"exec:{sys.executable} own.py", "no_gate": True}
    # No recording is made at the end, for which the process would run here again.
    options["record"] = "failures:0"
    local = cc.campaign(SCENARIO, out=tmp_path / "local", **options)

    def remove(done: int, total: int) -> None:
        program.unlink(missing_ok=True)

    result = closecall.ray.campaign(SCENARIO, address=machines.address, out=tmp_path / "ray", progress=remove, **options)
    assert (local.exit_code, result.exit_code) == (0, 0)
    assert cluster.sha256(tmp_path / "local" / "journal.jsonl") == cluster.sha256(tmp_path / "ray" / "journal.jsonl")
    assert not program.exists()


#: Packages that a worker finds in the place of Closecall.
OTHERS = {
    "another version": ("__version__ = '0.0.1'\n", "has Closecall 0.0.1, and the campaign was started by {version}"),
    "none": ("raise ImportError('no such package')\n", "has no Closecall, and the campaign was started by {version}"),
}


@pytest.mark.parametrize("other", OTHERS)
def test_another_version_of_closecall_is_refused(machines: Any, tmp_path: Path, other: str) -> None:
    text, message = OTHERS[other]
    (tmp_path / "closecall").mkdir()
    (tmp_path / "closecall" / "__init__.py").write_text(text)
    ray.init(address=machines.address, runtime_env={"env_vars": {"PYTHONPATH": str(tmp_path)}}, log_to_driver=False)
    try:
        with pytest.raises(cc.InputError) as raised:
            closecall.ray.campaign(SCENARIO, SAMPLES, address=machines.address, out=tmp_path / "out", **COMMON)
    finally:
        ray.shutdown()
    from closecall import _native

    assert message.format(version=_native.version()) in str(raised.value) and raised.value.exit_code == 3


def _loses_the_last_sample(answer: bytes) -> bytes:
    return b"".join(answer.splitlines(keepends=True)[:-1])


def _answers_with_another_seed(answer: bytes) -> bytes:
    return answer


@pytest.mark.parametrize(
    ("change", "message"), [(_loses_the_last_sample, "instead of"), (_answers_with_another_seed, "another configuration")]
)
def test_an_answer_that_is_not_that_of_the_block_is_an_error(
    machines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[bytes], bytes], message: str
) -> None:
    def task() -> Any:
        wrong_seed = change is _answers_with_another_seed

        def run_block(shipped: Any, work: int, samples: list[int]) -> tuple[str, bytes]:
            from closecall import _native

            _, version, manifest, files, _ = shipped
            if wrong_seed:
                manifest = manifest.replace('"seed":3', '"seed":4')
            records = _native.BlockRunner(version, manifest, files).run(work, samples)
            return "done", records if wrong_seed else b"".join(records.splitlines(keepends=True)[:-1])

        return run_block

    monkeypatch.setattr(closecall.ray, "_task", task)
    with pytest.raises(cc.FileError, match=message):
        closecall.ray.campaign(SCENARIO, SAMPLES, address=machines.address, out=tmp_path / "out", **COMMON)
    assert (tmp_path / "out" / "journal.jsonl").read_bytes() == b""


def test_a_block_that_ends_its_worker_is_an_error(machines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def task() -> Any:
        def run_block(shipped: Any, work: int, samples: list[int]) -> tuple[str, bytes]:
            os._exit(9)

        return run_block

    monkeypatch.setattr(closecall.ray, "RETRIES", 1)
    monkeypatch.setattr(closecall.ray, "_task", task)
    with pytest.raises(cc.FileError, match="has failed for good"):
        closecall.ray.campaign(SCENARIO, 4, address=machines.address, sensors="object", no_gate=True)


def test_a_worker_that_needs_too_much_memory_is_not_started_without_end() -> None:
    class Fake:
        """A Ray whose tasks all end with too much memory, which takes an hour of real tasks to see."""

        exceptions = ray.exceptions
        started = 0
        options: dict[str, Any]

        def put(self, value: Any) -> Any:
            return value

        def remote(self, *arguments: Any, **options: Any) -> Any:
            if not arguments:
                self.options = options
                return lambda function: self
            self.started += 1
            return self.started

        def wait(self, refs: list[Any], num_returns: int, timeout: float) -> tuple[list[Any], list[Any]]:
            return refs, []

        def get(self, ref: Any) -> Any:
            raise ray.exceptions.OutOfMemoryError("too much memory")

    fake = Fake()
    machines = closecall.ray.Cluster(fake, ("", "", [], []), lambda: None)
    # Ray's own retries for memory have no limit unless it has none at all.
    assert fake.options["max_retries"] == 0
    machines.submit(7, 0, [1, 2])
    for _ in range(closecall.ray.RETRIES):
        assert machines.wait(0.0) == []
    with pytest.raises(cc.FileError, match="block 7 .* has failed for good: too much memory"):
        machines.wait(0.0)
    assert fake.started == closecall.ray.RETRIES + 1


def test_a_cluster_that_is_started_for_the_campaign_lives_until_its_end(expected: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = command("campaign", SCENARIO, *WORDS, "--ray", "local", "--out", out)
    assert done.returncode == 0, done.stderr
    assert cluster.sha256(out / "outcomes.parquet") == expected


def test_without_ray_the_error_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(cc.InputError, match=r'pip install "closecall\[ray\]"') as raised:
        closecall.ray.campaign(SCENARIO, SAMPLES, out=tmp_path / "out", **COMMON)
    assert raised.value.exit_code == 3 and not (tmp_path / "out").exists()


def test_a_cluster_that_is_not_there_is_named(tmp_path: Path) -> None:
    done = command("campaign", SCENARIO, *WORDS, "--ray", "127.0.0.1:9", "--out", tmp_path / "out")
    assert done.returncode == 6 and "there is no cluster at `127.0.0.1:9`" in done.stderr
    assert not (tmp_path / "out").exists()
    done = command("campaign", SCENARIO, *WORDS, "--ray", "nonsense", "--out", tmp_path / "out")
    assert done.returncode == 6 and "expected `auto`, `local`, `HOST:PORT` or `ray://HOST:PORT`" in done.stderr
    assert command("campaign", SCENARIO, *WORDS, "--ray", "auto", "--jobs", "2").returncode == 2


def test_ctrl_c_stops_a_campaign_that_goes_on_without_ray(machines: Any, expected: str, tmp_path: Path) -> None:
    out, many = tmp_path / "out", 100_000
    process = cluster.driver(machines.address, many, out)
    while not (out / "journal.jsonl").exists() or not (out / "journal.jsonl").stat().st_size:
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, messages = process.communicate(timeout=60)
    assert process.returncode == 1 or process.returncode == -signal.SIGINT
    assert "KeyboardInterrupt" in messages
    found = cluster.samples_of(out / "journal.jsonl")
    assert 0 < len(found) < many and found == list(range(len(found)))
    # The command stops by the same signal, with the exit code of a campaign on one machine.
    program, there = Path(sys.executable).with_name("closecall"), tmp_path / "there"
    words = ["campaign", SCENARIO, "-n", str(many), *cluster.WORDS, "--ray", machines.address, "--out", str(there)]
    stopped = subprocess.Popen([program, *words], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    while not (there / "journal.jsonl").exists() or not (there / "journal.jsonl").stat().st_size:
        assert stopped.poll() is None, stopped.communicate()[1]
        time.sleep(0.02)
    stopped.send_signal(signal.SIGTERM)
    _, messages = stopped.communicate(timeout=60)
    assert stopped.returncode == 143 and "SIGTERM" in messages and "Traceback" not in messages, messages
    assert len(json.loads((there / "manifest.json").read_text())["command"]) == len(words) + 1


def test_killed_machines_and_a_killed_driver_lose_nothing(tmp_path: Path) -> None:
    log = cluster.survive(8_000, 2, tmp_path)
    assert sum("killed" in line for line in log) == 3
