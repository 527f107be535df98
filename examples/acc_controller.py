"""The built-in controller `acc` (cruise control and emergency braking) as an external process.

Use it with --controller "exec:python3 examples/acc_controller.py".
"""
import json, math, sys

# Returns the constant deceleration (m/s²) that keeps a distance of `left_m` to the vehicle ahead, if that vehicle keeps its
# deceleration.
def required(v, front, left_m):
    room, lead, braking = max(front["gap_m"] - left_m, 0.1), front["speed_mps"], -front["acceleration_mps2"]
    removing = (v - lead) * (v - lead) / (2.0 * room) if v > lead else 0.0
    if braking <= 0.0 or lead <= 0.0:
        return removing
    to_stop = v * v / (2.0 * (room + lead * lead / (2.0 * braking)))
    return to_stop if v * braking >= lead * to_stop else braking + removing if v > lead else 0.0

# Returns a limit that has the value `slow` up to 5 m/s, the value `fast` from 20 m/s on, and is linear in between.
def limited(slow, fast, v):
    return slow + min(max((v - 5.0) / 15.0, 0.0), 1.0) * (fast - slow)

# Returns the acceleration (m/s²) of the cruise control, without its jerk limit. It controls the closing speed that the error of the gap allows.
def cruise(v, limit, front, acc):
    a = ((limit if acc["set_speed_mps"] is None else acc["set_speed_mps"]) - v) / 2.0
    if front:
        error, touch = front["gap_m"] - max(acc["time_gap_s"] * v, acc["standstill_gap_m"]), 1.5 / (0.3 * 0.3)
        allowed = 0.3 * error if error < touch else math.sqrt(2.0 * 1.5 * (error - 0.5 * touch))
        gain, opening = max(acc["time_gap_s"], 0.45), front["speed_mps"] - v
        slower, faster = (allowed + opening) / gain, (min(allowed, 4.0) + opening) / gain
        a, needed = min(a, slower if slower < 0.0 else max(faster, 0.0)), required(v, front, acc["standstill_gap_m"])
        a = min(a, -needed) if needed > limited(5.0, 3.5, v) else a
    return min(max(a, -limited(5.0, 3.5, v)), 1.5)

# Returns the acceleration (m/s²) nearest to `a` that the jerk limit allows `step` (s) after the acceleration `last`.
def limit_jerk(a, last, v, step):
    change = limited(5.0, 2.5, v) * step
    return min(max(a, last - change), last + change)

# Returns the deceleration (m/s²) of the emergency braking, or 0 if none is needed. `braked`: whether it braked before.
def emergency(v, front, aeb, braked):
    if braked and v < 0.1:
        return 2.0 if front and front["speed_mps"] < 1.0 else 0.0
    needed = required(v, front, aeb["standstill_gap_m"]) if front else 0.0
    return min(1.15 * needed, aeb["max_deceleration_mps2"]) if needed > (1.5 if braked else aeb["trigger_mps2"]) else 0.0

braked, comfort, before = 0.0, 0.0, None
for message in map(json.loads, sys.stdin):
    if message["type"] == "hello":
        hello, answer = message, {"type": "hello", "protocol": 1}
    else:
        v, front, settings = message["odometry"]["speed_mps"], message["front"], hello["settings"]
        braked = emergency(v, front, settings["aeb"], braked > 0.0) if settings["aeb"] else 0.0
        now = message["time_ns"]
        step, before = 0.0 if before is None else 1e-9 * (now - before), now
        comfort = limit_jerk(cruise(v, hello["road"]["speed_limit_mps"], front, settings["acc"]), comfort, v, step)
        a = min(comfort, -braked if braked else math.inf)
        answer = {"acceleration_mps2": a, "state": "emergency-braking" if braked else "following", "time_ns": now}
    print(json.dumps(answer), flush=True)
