"""The built-in controller ``acc`` (cruise control and emergency braking) in Python. It reproduces its outcomes to the last bit.

    python acc.py [SCENARIO] [SAMPLES]
"""

from __future__ import annotations

import math
import sys

import closecall as cc


def required(speed: float, front: cc.LeadVehicle, left_m: float) -> float:
    """Returns the constant deceleration (m/s²) that keeps a distance of ``left_m`` to the vehicle ahead, if that vehicle keeps
    its deceleration."""
    room, lead, braking = max(front.gap_m - left_m, 0.1), front.speed_mps, -front.acceleration_mps2
    removing = (speed - lead) * (speed - lead) / (2.0 * room) if speed > lead else 0.0
    if braking <= 0.0 or lead <= 0.0:
        return removing
    to_stop = speed * speed / (2.0 * (room + lead * lead / (2.0 * braking)))
    if speed * braking >= lead * to_stop:
        return to_stop
    return braking + removing if speed > lead else 0.0


def limited(slow: float, fast: float, speed: float) -> float:
    """Returns a limit that has the value ``slow`` up to 5 m/s, the value ``fast`` from 20 m/s on, and is linear in between."""
    return slow + min(max((speed - 5.0) / 15.0, 0.0), 1.0) * (fast - slow)


class Acc:
    """Adaptive cruise control, with emergency braking underneath."""

    def start(self, setup: cc.Setup) -> None:
        self.acc, self.aeb = setup.settings["acc"], setup.settings["aeb"]
        self.limit_mps: float = setup.road["speed_limit_mps"]
        self.braked = 0.0
        self.comfort = 0.0
        self.before_ns: int | None = None

    def step(self, input: cc.ControllerInput) -> tuple[float, cc.State]:
        speed, front = input.odometry.speed_mps, input.front
        self.braked = self.emergency(speed, front) if self.aeb else 0.0
        elapsed_s = 0.0 if self.before_ns is None else 1e-9 * (input.time_ns - self.before_ns)
        self.before_ns = input.time_ns
        # The jerk limit.
        change = limited(5.0, 2.5, speed) * elapsed_s
        self.comfort = min(max(self.cruise(speed, front), self.comfort - change), self.comfort + change)
        acceleration = min(self.comfort, -self.braked if self.braked else math.inf)
        return acceleration, "emergency-braking" if self.braked else "following"

    def cruise(self, speed: float, front: cc.LeadVehicle | None) -> float:
        """Returns the acceleration (m/s²) of the cruise control: it controls the closing speed that the error of the gap allows."""
        acc = self.acc
        acceleration: float = ((self.limit_mps if acc["set_speed_mps"] is None else acc["set_speed_mps"]) - speed) / 2.0
        if front is not None:
            error = front.gap_m - max(acc["time_gap_s"] * speed, acc["standstill_gap_m"])
            touch = 1.5 / (0.3 * 0.3)
            allowed = 0.3 * error if error < touch else math.sqrt(2.0 * 1.5 * (error - 0.5 * touch))
            gain, opening = max(acc["time_gap_s"], 0.45), front.speed_mps - speed
            slower, faster = (allowed + opening) / gain, (min(allowed, 4.0) + opening) / gain
            acceleration = min(acceleration, slower if slower < 0.0 else max(faster, 0.0))
            needed = required(speed, front, acc["standstill_gap_m"])
            acceleration = min(acceleration, -needed) if needed > limited(5.0, 3.5, speed) else acceleration
        return min(max(acceleration, -limited(5.0, 3.5, speed)), 1.5)

    def emergency(self, speed: float, front: cc.LeadVehicle | None) -> float:
        """Returns the deceleration (m/s²) of the emergency braking, or 0 if none is needed."""
        aeb = self.aeb
        if self.braked > 0.0 and speed < 0.1:
            return 2.0 if front is not None and front.speed_mps < 1.0 else 0.0
        needed = required(speed, front, aeb["standstill_gap_m"]) if front is not None else 0.0
        threshold: float = 1.5 if self.braked > 0.0 else aeb["trigger_mps2"]
        largest: float = aeb["max_deceleration_mps2"]
        return min(1.15 * needed, largest) if needed > threshold else 0.0


if __name__ == "__main__":
    scenario = sys.argv[1] if len(sys.argv) > 1 else "low-thw-overtake"
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    result = cc.campaign(scenario, n=samples, controller=Acc, paired=True, sensors="object", no_gate=True)
    for name, counts in result.report["controllers"].items():
        print(f"{name}: {counts['collisions']} of {samples} samples with a collision")
