"""Times other simulators and Closecall in turns on one core, as simulated seconds per second of processor time.

    pip install eclipse-sumo==1.28.0 libsumo==1.28.0 highway-env==1.12.1     # in one environment
    pip install metadrive-simulator==0.4.3                                   # in another one
    cargo build --release -p closecall-xtask
    taskset -c 0 python python/benches/peers.py run ROUNDS PYTHON_OF_METADRIVE

Every round starts each program anew and runs each case once, so that what else the machine does disturbs all of them alike. A case times itself
by the processor time of its process, after a run that is not counted. The last lines are the smallest and the largest figure of each
case. SUMO and MetaDrive are only stepped; the vehicle of highway-env brakes by what its lidar says, as Closecall's ego does.
"""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time

# Step of SUMO (s): the step of Closecall's controller.
SUMO_STEP_S = 0.04
# Simulated time of a case of SUMO (s).
SUMO_S = {3: 1000.0, 60: 100.0}
# Duration of an episode of highway-env and MetaDrive (s), and their number.
EPISODE_S = 20.0
EPISODES = 3
# Physics steps of MetaDrive (s) in one step of its environment.
METADRIVE_STEP_S = 0.02
METADRIVE_REPEAT = 5
# Closecall's modes, by their names in `xtask/src/throughput`.
MODES = [
    "ground-truth",
    "object",
    "full",
    "full, wet road",
    "full, guard rails, 10 vehicles",
    *(f"{mode}, {vehicles} vehicles" for vehicles in (3, 60) for mode in ("ground-truth", "object", "full")),
]
# The program that times them.
XTASK = os.path.join(os.path.dirname(__file__), "..", "..", "target", "release", "xtask")
PEERS = ["sumo 3", "sumo 60", "highway-env"]


def timed(simulate):
    """Returns the simulated seconds per second of processor time of `simulate`, which returns the simulated seconds."""
    started = time.process_time()
    return simulate() / (time.process_time() - started)


def sumo(vehicles):
    """Steps Wiedemann 99 drivers on three lanes, 60 m apart in each lane at 30 m/s, as in Closecall's traffic."""
    import libsumo
    import sumo as package

    os.environ.setdefault("SUMO_HOME", package.SUMO_HOME)
    folder = tempfile.mkdtemp()
    path = lambda name: os.path.join(folder, name)
    with open(path("nodes.xml"), "w") as file:
        file.write('<nodes><node id="a" x="0" y="0"/><node id="b" x="100000" y="0"/></nodes>')
    with open(path("edges.xml"), "w") as file:
        file.write('<edges><edge id="e" from="a" to="b" numLanes="3" speed="36"/></edges>')
    netconvert = os.path.join(package.SUMO_HOME, "bin", "netconvert")
    nodes = ["-n", path("nodes.xml"), "-e", path("edges.xml"), "-o", path("net.xml")]
    subprocess.run([netconvert, *nodes], check=True, stdout=subprocess.DEVNULL)
    cars = "".join(
        f'<vehicle id="v{index}" type="w99" route="r" depart="0" departPos="{500 + 60 * (index // 3)}" '
        f'departLane="{index % 3}" departSpeed="30" insertionChecks="none"/>'
        for index in range(vehicles)
    )
    with open(path("routes.xml"), "w") as file:
        file.write(
            '<routes><vType id="w99" carFollowModel="W99" maxSpeed="30" speedFactor="1" speedDev="0"/>'
            f'<route id="r" edges="e"/>{cars}</routes>'
        )
    options = ["--step-length", str(SUMO_STEP_S), "--no-step-log", "true", "--no-warnings", "true"]
    libsumo.start(["sumo", "-n", path("net.xml"), "-r", path("routes.xml"), "--time-to-teleport", "-1", *options])

    def steps(duration_s):
        for _ in range(round(duration_s / SUMO_STEP_S)):
            libsumo.simulationStep()
        return duration_s

    steps(10.0)
    speed = timed(lambda: steps(SUMO_S[vehicles]))
    assert libsumo.vehicle.getIDCount() == vehicles, "a vehicle has left the road"
    return speed


def highway():
    """Runs episodes with four vehicles and a lidar of 128 cells at 15 Hz, by which the ego keeps its distance."""
    import gymnasium
    import highway_env
    import numpy

    if hasattr(highway_env, "register_highway_envs"):
        highway_env.register_highway_envs()
    lidar = {"type": "LidarObservation", "cells": 128, "maximum_range": 60, "normalize": True}
    config = {
        "simulation_frequency": 15,
        "policy_frequency": 15,
        "vehicles_count": 3,
        "lanes_count": 3,
        "duration": EPISODE_S,
        "observation": lidar,
        "action": {"type": "ContinuousAction"},
    }
    environment = gymnasium.make("highway-v0", render_mode=None, config=config).unwrapped

    def episodes():
        simulated_s = 0.0
        for seed in range(EPISODES):
            seen, _ = environment.reset(seed=seed)
            is_over = False
            while not is_over:
                pedal = numpy.clip(0.02 * (60.0 * float(seen[0, 0]) - 35.0), -1.0, 0.4)
                seen, _, crashed, truncated, _ = environment.step(numpy.array([pedal, 0.0], dtype=numpy.float32))
                is_over = crashed or truncated
            simulated_s += float(environment.time)
        return simulated_s

    episodes()
    return timed(episodes)


def metadrive():
    """Runs episodes with a lidar of 240 rays on a straight road, at 10 Hz."""
    import logging

    # The pictures of the environment, which are not needed without a window, would be downloaded.
    assets = os.path.join(os.path.dirname(importlib.util.find_spec("metadrive").origin), "assets")
    if not os.path.exists(os.path.join(assets, "version.txt")):
        from importlib.metadata import version

        os.makedirs(os.path.join(assets, "textures", "grass1"), exist_ok=True)
        open(os.path.join(assets, "textures", "grass1", "GroundGrassGreen002_COL_1K.jpg"), "w").close()
        with open(os.path.join(assets, "version.txt"), "w") as file:
            file.write(version("metadrive-simulator") + "\n")
    from metadrive.envs.metadrive_env import MetaDriveEnv

    lidar = {"num_lasers": 240, "distance": 50, "num_others": 0}
    config = {
        "use_render": False,
        "map": "SSSSSSSS",
        "num_scenarios": 100,
        "traffic_density": 0.02,
        "random_traffic": False,
        "decision_repeat": METADRIVE_REPEAT,
        "physics_world_step_size": METADRIVE_STEP_S,
        "horizon": None,
        "crash_vehicle_done": False,
        "out_of_road_done": False,
        "log_level": logging.CRITICAL,
        "vehicle_config": {
            "lidar": lidar,
            "side_detector": {"num_lasers": 0},
            "lane_line_detector": {"num_lasers": 0},
        },
    }
    environment = MetaDriveEnv(config)
    step_s = METADRIVE_REPEAT * METADRIVE_STEP_S

    def episodes():
        steps = 0
        for seed in range(EPISODES):
            seen, _ = environment.reset(seed=seed)
            for _ in range(round(EPISODE_S / step_s)):
                seen, *_ = environment.step([0.0, 0.2 if float(seen[-240]) > 0.5 else -0.4])
                steps += 1
        return steps * step_s

    episodes()
    return timed(episodes)


CASES = {
    "sumo 3": lambda: sumo(3),
    "sumo 60": lambda: sumo(60),
    "highway-env": highway,
    "metadrive": metadrive,
}


def run(rounds, metadrive_python):
    """Runs every case in turns, and prints the smallest and the largest figure of each."""
    figures = {}
    for _ in range(rounds):
        for case in PEERS + (["metadrive"] if metadrive_python else []):
            python = metadrive_python if case == "metadrive" else sys.executable
            done = subprocess.run([python, __file__, "case", case], check=True, stdout=subprocess.PIPE, text=True)
            figures.setdefault(case, []).append(float(done.stdout.splitlines()[-1]))
        done = subprocess.run([XTASK, "throughput", "1", *MODES], check=True, stdout=subprocess.PIPE, text=True)
        for line in map(json.loads, done.stdout.splitlines()):
            if "mode" in line:
                figures.setdefault(line["mode"], []).append(line["simulated_s_per_cpu_s"])
    for case, speeds in figures.items():
        print(f"{case}: {min(speeds):.4g} to {max(speeds):.4g}")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["case", name]:
            print(CASES[name]())
        case ["run", rounds, *python]:
            run(int(rounds), python[0] if python else None)
        case _:
            sys.exit(__doc__)
