"""Measures the stepping interface and Python controllers, beside highway-env if it is installed.

    python stepping.py [SECONDS]

All figures are for one core: the process is pinned to one, and its CPU time is counted.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
os.environ["RAYON_NUM_THREADS"] = "1"

import gymnasium  # noqa: E402
import numpy as np  # noqa: E402

import closecall as cc  # noqa: E402
import closecall.gym as ccgym  # noqa: E402

SCENARIO = "low-thw-overtake"


def rate(step: Callable[[], int], seconds: float) -> float:
    """Returns the number of steps per second of CPU time; `step` returns how many it has made."""
    step()
    count, started = 0, time.process_time()
    while time.process_time() - started < seconds:
        count += step()
    return count / (time.process_time() - started)


def single(env: gymnasium.Env[Any, Any], action: Any) -> Callable[[], int]:
    env.reset(seed=1)

    def step() -> int:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
        return 1

    return step


def vectorised(count: int) -> Callable[[], int]:
    envs = ccgym.EncounterVectorEnv(count, SCENARIO)
    envs.reset(seed=1)
    actions = np.zeros((count, 1))

    def step() -> int:
        envs.step(actions)
        return count

    return step


class Nothing:
    """Answers at once."""

    def step(self, input: cc.ControllerInput) -> float:
        return 0.0


class Reads:
    """Reads the odometry, the lead vehicle and each track, and answers."""

    def step(self, input: cc.ControllerInput) -> float:
        gap_m = input.front.gap_m if input.front is not None else 0.0
        return min((track.x_m for track in input.tracks), default=0.0) * 0.0 + 0.0 * (gap_m + input.odometry.speed_mps)


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 3.0
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, load {os.getloadavg()[0]:.1f}")
    print(f"EncounterEnv                 {rate(single(ccgym.EncounterEnv(SCENARIO), 0.0), seconds):9.0f} steps/s")
    without = ccgym.EncounterEnv(SCENARIO, truth=False, reward=lambda *_: 0.0)
    print(f"  without truth and reward   {rate(single(without, 0.0), seconds):9.0f} steps/s")
    for count in (1, 16, 256):
        print(f"EncounterVectorEnv({count:3})      {rate(vectorised(count), seconds):9.0f} steps/s")
    try:
        import highway_env

        gymnasium.register_envs(highway_env)
        for name in ("highway-v0", "highway-fast-v0"):
            env = gymnasium.make(name)
            frequency = env.unwrapped.config["simulation_frequency"]  # type: ignore[attr-defined]
            steps = frequency // env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
            per_s = rate(single(env, 1), seconds)
            print(f"highway-env {name:16} {per_s:9.1f} steps/s, each {steps} steps of {1000 / frequency:.0f} ms")
    except ImportError:
        print("highway-env is not installed")
    # A campaign without reports: the run itself, with no film and no trace.
    sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
    from acc import Acc

    for controller in ("acc", Nothing, Reads, Acc):
        options: dict[str, Any] = {"n": 400, "seed": 1, "sensors": "object", "jobs": 1, "no_gate": True}
        started = time.process_time_ns()
        result = cc.campaign(SCENARIO, controller=controller, no_validity_checks=True, **options)  # type: ignore[arg-type]
        spent_s = 1e-9 * (time.process_time_ns() - started)
        steps = result.report["simulated_s"] / ccgym.CONTROL_STEP_S
        name = controller if isinstance(controller, str) else controller.__name__
        print(f"campaign with {name:8}        {1e6 * spent_s / steps:9.2f} µs of CPU per control step")


if __name__ == "__main__":
    main()
