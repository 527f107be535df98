#!/usr/bin/env python3
"""Trajectories of SUMO's Wiedemann 99 follower, as an independent reference for ours.

    pip install eclipse-sumo==1.28.0
    python simulation/tests/golden/wiedemann99_sumo.py

writes `wiedemann99_sumo.csv` beside this script: one row for every logged instant of every case, with the leader's
speed, the follower's speed and the gap bumper to bumper. The leader's speed is prescribed in every step; the follower
is SUMO's `carFollowModel="W99"` with the parameters published for Vissim (SUMO's own defaults are others). Emergency
braking is limited to 8 m/s2 by the vehicle type, as in the model under test. Steps of 0.1 s, seed 1.

Cases:
  constant  the leader drives at 20 or 30 m/s; the follower comes up from behind
  braking   the leader drives at 30 m/s for a minute, then brakes at a constant rate to standstill
  waves     the leader's speed swings by 5 m/s around 25 m/s with a period of 40 s
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile

import sumo

sys.path.append(str(pathlib.Path(sumo.SUMO_HOME) / "tools"))
import traci  # noqa: E402  (it lies in the wheel's folder of tools)

STEP_S = 0.1
LENGTH_M = 4.6
DESIRED_MPS = 36.0
# Vissim's published defaults; cc0 is SUMO's minGap, and cc1 is varied.
VISSIM = {"cc2": 4.0, "cc3": -8.0, "cc4": -0.35, "cc5": 0.35, "cc6": 11.44, "cc7": 0.25, "cc8": 3.5, "cc9": 1.5}
CC0_M = 1.5

NODES = '<nodes><node id="a" x="0" y="0"/><node id="b" x="20000" y="0"/></nodes>'
EDGES = '<edges><edge id="road" from="a" to="b" numLanes="1" speed="60"/></edges>'
ROUTES = """<routes>
<vType id="leader" length="{length}" minGap="0" maxSpeed="60" sigma="0"/>
<vType id="follower" carFollowModel="W99" length="{length}" minGap="{cc0}" maxSpeed="{desired}" speedFactor="1"
       accel="4" decel="8" emergencyDecel="8" apparentDecel="8" cc1="{cc1}" {others}/>
<route id="r" edges="road"/>
<vehicle id="leader" type="leader" route="r" depart="0" departPos="{leader_pos}" departSpeed="{leader_mps}"/>
<vehicle id="follower" type="follower" route="r" depart="0" departPos="100" departSpeed="{follower_mps}"/>
</routes>"""


def cases():
    """Name, cc1, start gap, start speed of the follower, duration, logging from and every, leader's speed(t)."""
    for speed in (20.0, 30.0):
        for cc1 in (0.2, 0.4, 0.6, 0.9, 1.5):
            yield f"constant-{speed:.0f}-{cc1}", cc1, 100.0, speed + 5.0, 240.0, (0.0, 2.0), lambda t, v=speed: v
    # Times to standstill that are multiples of the logging step, so that the logged profile is the prescribed one.
    for stop_s in (15.0, 7.5, 5.0, 4.0, 3.5):
        for cc1 in (0.2, 0.4, 0.6, 0.9, 1.5):
            rate = 30.0 / stop_s
            yield f"braking-{rate:.1f}-{cc1}", cc1, 5.0 + cc1 * 30.0, 30.0, 80.0, (58.0, 0.5), (
                lambda t, b=rate: max(0.0, 30.0 - b * max(0.0, t - 60.0))
            )
    for cc1 in (0.2, 0.4, 0.9, 1.5):
        yield f"waves-{cc1}", cc1, 5.0 + cc1 * 25.0, 25.0, 160.0, (0.0, 2.0), (
            lambda t: 25.0 + 5.0 * math.sin(2.0 * math.pi * t / 40.0)
        )


def run(folder, case):
    """Yields the logged rows of one case."""
    name, cc1, gap_m, follower_mps, duration_s, (from_s, every_s), leader_mps = case
    routes = folder / f"{name}.rou.xml"
    routes.write_text(
        ROUTES.format(
            length=LENGTH_M,
            cc0=CC0_M,
            cc1=cc1,
            desired=DESIRED_MPS,
            leader_pos=100.0 + gap_m + LENGTH_M,
            leader_mps=leader_mps(0.0),
            follower_mps=follower_mps,
            others=" ".join(f'{key}="{value}"' for key, value in VISSIM.items()),
        )
    )
    command = [
        str(pathlib.Path(sumo.SUMO_HOME) / "bin" / "sumo"), "-n", str(folder / "road.net.xml"), "-r", str(routes),
        "--step-length", str(STEP_S), "--seed", "1", "--collision.action", "none", "--time-to-teleport", "-1",
        "--no-step-log", "--no-warnings", "--extrapolate-departpos", "false",
    ]
    traci.start(command)
    try:
        traci.simulationStep()
        traci.vehicle.setSpeedMode("leader", 0)
        steps = round(duration_s / STEP_S)
        first, every = round(from_s / STEP_S), round(every_s / STEP_S)
        for step in range(steps + 1):
            ahead, own = (traci.vehicle.getPosition(v)[0] for v in ("leader", "follower"))
            if step == 0 or step >= first and (step - first) % every == 0:
                speeds = (traci.vehicle.getSpeed(v) for v in ("leader", "follower"))
                row = [step * STEP_S, *speeds, ahead - LENGTH_M - own]
                yield [name, cc1, *(f"{value:.3f}" for value in row)]
            traci.vehicle.setSpeed("leader", leader_mps((step + 1) * STEP_S))
            traci.simulationStep()
    finally:
        traci.close()


def main():
    out = pathlib.Path(__file__).with_suffix(".csv")
    with tempfile.TemporaryDirectory() as name, out.open("w", newline="") as file:
        folder = pathlib.Path(name)
        (folder / "road.nod.xml").write_text(NODES)
        (folder / "road.edg.xml").write_text(EDGES)
        subprocess.run(
            [str(pathlib.Path(sumo.SUMO_HOME) / "bin" / "netconvert"), "-n", "road.nod.xml", "-e", "road.edg.xml",
             "-o", "road.net.xml", "--no-warnings"],
            cwd=folder, check=True, stdout=subprocess.DEVNULL,
        )
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["case", "cc1_s", "time_s", "leader_mps", "follower_mps", "gap_m"])
        for case in cases():
            writer.writerows(run(folder, case))


if __name__ == "__main__":
    main()
