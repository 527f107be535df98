"""The built-in controller `acc` as an FMU in Python, with pythonfmu (`pip install pythonfmu`), to the last bit.

    pythonfmu build -f examples/fmu/acc_slave.py
    closecall run low-thw-overtake --controller fmu:./AccSlave.fmu
"""
import math

from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real


# Returns the constant deceleration (m/s²) that keeps a distance of `left_m` to the vehicle ahead, if that vehicle keeps its
# deceleration.
def required(v, front, left_m):
    gap, lead, acceleration = front
    room, braking = max(gap - left_m, 0.1), -acceleration
    removing = (v - lead) * (v - lead) / (2.0 * room) if v > lead else 0.0
    if braking <= 0.0 or lead <= 0.0:
        return removing
    to_stop = v * v / (2.0 * (room + lead * lead / (2.0 * braking)))
    return to_stop if v * braking >= lead * to_stop else braking + removing if v > lead else 0.0


# Returns a limit that has the value `slow` up to 5 m/s, the value `fast` from 20 m/s on, and is linear in between.
def limited(slow, fast, v):
    return slow + min(max((v - 5.0) / 15.0, 0.0), 1.0) * (fast - slow)


class AccSlave(Fmi2Slave):
    author = "Closecall"
    description = "Cruise control and emergency braking"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.ego_speed = self.front_gap = self.front_speed = self.front_acceleration = 0.0
        self.front_present = False
        self.road_speed_limit, self.acc_time_gap_s, self.acc_standstill_gap_m = 36.1, 1.0, 2.0
        # Negative: no set speed and no emergency braking.
        self.acc_set_speed_mps = self.aeb_trigger_mps2 = -1.0
        self.aeb_max_deceleration_mps2 = self.aeb_standstill_gap_m = 0.0
        self.acceleration, self.state = 0.0, 0
        self.braked, self.comfort, self.before = 0.0, 0.0, None
        for name in ("ego_speed", "front_gap", "front_speed", "front_acceleration"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(
            Boolean("front_present", causality=Fmi2Causality.input, variability=Fmi2Variability.discrete)
        )
        for name in (
            "road_speed_limit", "acc_time_gap_s", "acc_standstill_gap_m", "acc_set_speed_mps", "aeb_trigger_mps2",
            "aeb_max_deceleration_mps2", "aeb_standstill_gap_m",
        ):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("acceleration", causality=Fmi2Causality.output, initial=Fmi2Initial.exact))
        self.register_variable(
            Integer(
                "state", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete, initial=Fmi2Initial.exact
            )
        )

    def cruise(self, v, front):
        a = ((self.acc_set_speed_mps if self.acc_set_speed_mps >= 0.0 else self.road_speed_limit) - v) / 2.0
        if front:
            error, touch = front[0] - max(self.acc_time_gap_s * v, self.acc_standstill_gap_m), 1.5 / (0.3 * 0.3)
            allowed = 0.3 * error if error < touch else math.sqrt(2.0 * 1.5 * (error - 0.5 * touch))
            gain, opening = max(self.acc_time_gap_s, 0.45), front[1] - v
            slower, faster = (allowed + opening) / gain, (min(allowed, 4.0) + opening) / gain
            a = min(a, slower if slower < 0.0 else max(faster, 0.0))
            needed = required(v, front, self.acc_standstill_gap_m)
            a = min(a, -needed) if needed > limited(5.0, 3.5, v) else a
        return min(max(a, -limited(5.0, 3.5, v)), 1.5)

    def emergency(self, v, front):
        if self.aeb_trigger_mps2 < 0.0:
            return 0.0
        has_braked = self.braked > 0.0
        if has_braked and v < 0.1:
            return 2.0 if front and front[1] < 1.0 else 0.0
        needed = required(v, front, self.aeb_standstill_gap_m) if front else 0.0
        threshold = 1.5 if has_braked else self.aeb_trigger_mps2
        return min(1.15 * needed, self.aeb_max_deceleration_mps2) if needed > threshold else 0.0

    def do_step(self, current_time, step_size):
        v = self.ego_speed
        front = (self.front_gap, self.front_speed, self.front_acceleration) if self.front_present else None
        self.braked = self.emergency(v, front)
        now = round(1e9 * current_time)
        step, self.before = 0.0 if self.before is None else 1e-9 * (now - self.before), now
        change = limited(5.0, 2.5, v) * step
        self.comfort = min(max(self.cruise(v, front), self.comfort - change), self.comfort + change)
        self.acceleration = min(self.comfort, -self.braked) if self.braked else self.comfort
        self.state = 4 if self.braked else 0
        return True
