"""Measures campaigns on a local Ray cluster, and kills its machines.

    python cluster.py survive [SAMPLES] [SEED]     kills two of three machines and the driver, and resumes
    python cluster.py overhead [SAMPLES] [ROUNDS]  compares with the command line on two cores
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

SCENARIO = "low-thw-overtake"
#: What all campaigns of a comparison have in common.
OPTIONS: dict[str, Any] = {"seed": 1, "sensors": "object", "no_gate": True}
WORDS = ["--seed", "1", "--sensors", "object", "--no-gate"]
#: Longest time that a driver may take (s).
TIMEOUT_S = 3_600.0
#: Interval at which the times of processes are looked at (s).
POLL_S = 0.25

DRIVER = """
import json, sys
import closecall.ray
address, samples, out, resume, options = sys.argv[1:]
result = closecall.ray.campaign(
    "low-thw-overtake", int(samples), address=address, out=out, resume=resume == "resume", **json.loads(options)
)
raise SystemExit(result.exit_code)
"""


def cluster(slots: list[int]) -> Any:
    """Starts a cluster on this machine, with a machine of its own for each number of blocks at the same time."""
    from ray.cluster_utils import Cluster

    started = Cluster()
    for index, count in enumerate(slots):
        started.add_node(num_cpus=count, **({"include_dashboard": False} if index == 0 else {}))
    return started


def driver(address: str, samples: int, out: Path, resume: bool = False) -> subprocess.Popen[str]:
    """Starts a program that runs the campaign."""
    words = [address, str(samples), str(out), "resume" if resume else "start", json.dumps(OPTIONS)]
    return subprocess.Popen([sys.executable, "-c", DRIVER, *words], text=True, stderr=subprocess.PIPE)


def local(samples: int, out: Path, *words: str) -> subprocess.Popen[str]:
    """Starts the campaign on the command line."""
    program = str(Path(sys.executable).with_name("closecall"))
    called = [program, "campaign", SCENARIO, "-n", str(samples), *WORDS, "--out", str(out), *words]
    return subprocess.Popen(called, text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def samples_of(journal: Path) -> list[int]:
    """Returns the samples of a journal, line by line."""
    return [json.loads(line.partition(" ")[2])["sample"] for line in journal.read_text().splitlines()]


def _wait_for(journal: Path, lines: int, process: subprocess.Popen[str]) -> None:
    """Waits until a journal has a number of lines."""
    deadline_s = time.monotonic() + TIMEOUT_S
    while not journal.exists() or journal.read_bytes().count(b"\n") < lines:
        if process.poll() is not None or time.monotonic() > deadline_s:
            _, messages = process.communicate()
            raise RuntimeError(f"the driver has ended before sample {lines} ({process.returncode}): {messages}")
        time.sleep(0.01)


def survive(samples: int, seed: int, folder: Path) -> list[str]:
    """Kills two of three machines, and once the driver, at random moments of the first third, and resumes.

    After a kill, the journal waits for the samples that are lost and then grows by a thousand or more at once.

    Returns what has happened. Fails unless every sample is in the journal once, and the outcomes have the bytes of the command line.
    """
    moments = sorted(random.Random(seed).sample(range(samples // 20, samples // 3), 3))
    victims = random.Random(seed + 1).sample(["machine", "machine", "driver"], 3)
    out, there, log = folder / "out", folder / "there", list[str]()
    machines = cluster([1, 1, 1])
    try:
        process = driver(machines.address, samples, out)
        for moment, victim in zip(moments, victims, strict=True):
            _wait_for(out / "journal.jsonl", moment, process)
            found = (out / "journal.jsonl").read_bytes().count(b"\n")
            assert found < samples, f"the campaign was over before the {victim} was killed"
            log.append(f"killed the {victim} after {found} samples")
            if victim == "machine":
                first = sorted(machines.worker_nodes, key=lambda node: str(node.unique_id))[0]
                machines.remove_node(first, allow_graceful=False)
            else:
                process.send_signal(signal.SIGKILL)
                process.communicate()
                assert process.returncode == -signal.SIGKILL, "the campaign was over before the driver was killed"
                process = driver(machines.address, samples, out, resume=True)
        _, messages = process.communicate(timeout=TIMEOUT_S)
        assert process.returncode == 0, messages
    finally:
        machines.shutdown()
    out.rename(there)
    # In the same folder, whose path is part of the reports.
    command = local(samples, out)
    _, messages = command.communicate(timeout=TIMEOUT_S)
    assert command.returncode == 0, messages
    assert samples_of(there / "journal.jsonl") == list(range(samples))
    for name in ("journal.jsonl", "outcomes.parquet"):
        assert sha256(there / name) == sha256(out / name), name
    return [*log, f"{samples} samples, none lost, none twice, outcomes.parquet {sha256(there / 'outcomes.parquet')}"]


def _cpu_s() -> dict[int, float]:
    """Returns the CPU time of this process and of all below it (s)."""
    tick_s, parents, times = 1.0 / os.sysconf("SC_CLK_TCK"), dict[int, int](), dict[int, float]()
    for entry in Path("/proc").iterdir():
        if not entry.name.isdecimal():
            continue
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(entry.name)], times[int(entry.name)] = int(fields[1]), tick_s * (int(fields[11]) + int(fields[12]))
    found = {os.getpid()}
    while more := {process for process, parent in parents.items() if parent in found} - found:
        found |= more
    return {process: times[process] for process in found}


def _measured(command: subprocess.Popen[str]) -> tuple[float, float]:
    """Waits for a program, and returns its wall time and the CPU time of all processes below this one (s).

    Ray's workers end with their driver, and nothing keeps their times: they are looked at until then.
    """
    began_s, first = time.monotonic(), _cpu_s()
    latest = dict(first)
    while command.poll() is None:
        latest.update(_cpu_s())
        time.sleep(POLL_S)
    _, messages = command.communicate()
    assert command.returncode == 0, messages
    return time.monotonic() - began_s, sum(spent_s - first.get(process, 0.0) for process, spent_s in latest.items())


def overhead(samples: int, rounds: int, folder: Path) -> list[str]:
    """Compares the command line with two threads and a cluster of two slots, which take turns."""
    lines, started_s = [f"{samples} samples, {rounds} rounds"], time.monotonic()
    machines = cluster([2])
    lines.append(f"the cluster starts in {time.monotonic() - started_s:.1f} s")
    figures: dict[str, list[tuple[float, float]]] = {"command line": [], "Ray": []}
    try:
        # The library is read from the disk once.
        assert driver(machines.address, 200, folder / "first").wait() == 0
        for index in range(rounds):
            for name, measured in figures.items():
                out = folder / f"{name}-{index}"
                command = driver(machines.address, samples, out) if name == "Ray" else local(samples, out, "--jobs", "2")
                measured.append(_measured(command))
            assert len({sha256(folder / f"{name}-{index}" / "outcomes.parquet") for name in figures}) == 1
    finally:
        machines.shutdown()
    for name, measured in figures.items():
        lines += [f"{name:12}  {wall_s:7.1f} s, {cpu_s:7.1f} s of CPU time" for wall_s, cpu_s in measured]
    best = {name: [min(column) for column in zip(*measured, strict=True)] for name, measured in figures.items()}
    wall, cpu = (100.0 * (ray / own - 1.0) for ray, own in zip(best["Ray"], best["command line"], strict=True))
    return [*lines, f"Ray adds {wall:.1f} % of the time, {cpu:.1f} % of the CPU time (smallest of each)"]


def main() -> None:
    command, numbers = sys.argv[1], [int(word) for word in sys.argv[2:]]
    print(f"load {os.getloadavg()[0]:.1f}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        samples = numbers[0] if numbers else 20_000
        if command == "survive":
            print(*survive(samples, numbers[1] if len(numbers) > 1 else 1, Path(folder)), sep="\n")
        else:
            print(*overhead(samples, numbers[1] if len(numbers) > 1 else 2, Path(folder)), sep="\n")


if __name__ == "__main__":
    main()
