"""Your own perception as an external process: DBSCAN of scikit-learn, and a filter with constant velocity.

Use it with --set 'sensors.perception="exec:python3 examples/dbscan_perception.py"' and sensors of mode `full`.
docs/reference/perception.md describes the messages. Needs NumPy, SciPy and scikit-learn.
"""
import base64, json, math, os, sys

os.environ["OMP_NUM_THREADS"] = "1"  # threads cost more than they gain with some hundred points

import numpy as np
from scipy.optimize import linear_sum_assignment
from sklearn.cluster import DBSCAN

ROAD_Z_M, TRUCK_Z_M, SLIM_M = 0.35, 2.2, 1.1  # above the road; higher than a car; narrower than a car
SIZES = {"car": (4.6, 1.85), "truck": (16.5, 2.55), "motorcycle": (2.2, 0.8)}
ACCELERATION_MPS2, GATE, HITS, MISSES = 6.0, 13.8, 4, 12  # 99.9 % of χ² with two degrees of freedom

# Returns an array of a scan.
def array(scan, name, kind="<f4"):
    return np.frombuffer(base64.b64decode(scan[name]), kind).astype(float)

# Returns the matrix that turns from the ego's frame into the frame of the poses.
def turn(pose):
    sin, cos = math.sin(pose["yaw_rad"]), math.cos(pose["yaw_rad"])
    return np.array([[cos, -sin], [sin, cos]])

# Returns the vehicles in a scan: the face that looks at the ego, its time before the end of the scan, and what is seen of its class.
def vehicles(scan, odometry, road):
    x, y, z = (array(scan, name) for name in ("x_m", "y_m", "z_m"))
    widths, lane = road["lane_widths_m"], odometry["lane"]
    left_edge = sum(widths[:lane]) - 0.5 * widths[lane - 1] - odometry["lane_offset_m"]
    left = y - 0.5 * (road["curvature_per_m"] or 0.0) * x * x - left_edge
    kept = (z > ROAD_Z_M) & (z < 4.5) & (left < -0.3) & (left > 0.3 - sum(widths))
    x, y, z, age_s = x[kept], y[kept], z[kept], (scan["end_ns"] - scan["start_ns"] - array(scan, "offset_ns", "<u4")[kept]) * 1e-9
    if not x.size:
        return
    # At night and far away only the two lamps of a car are seen, and along the road its roof lies far behind its front.
    labels = DBSCAN(eps=1.6, min_samples=2).fit_predict(np.column_stack([0.4 * x, y]))
    for label in range(labels.max() + 1):
        of = labels == label
        front, face = x[of].max(), of & (x > x[of].max() - 0.8)
        slim = np.ptp(y[face]) < SLIM_M and abs(front) < 50.0 and z[of].max() > 1.0
        kind = "truck" if z[of].max() > TRUCK_Z_M else "motorcycle" if slim else "car"
        middle, far = 0.5 * (y[face].min() + y[face].max()), abs(front) / 100.0
        yield np.array([front, middle]), np.array([0.1 + 0.3 * far, 0.2 + 0.4 * far]) ** 2, age_s[face].mean(), kind

class Track:
    def __init__(self, number, at, variance, velocity, kind):
        self.number, self.hits, self.misses, self.votes = number, 1, 0, {kind: 1}
        self.state, self.covariance = np.concatenate([at, velocity]), np.diag([*variance, 100.0, 1.0])

    def predict(self, step_s):
        move = np.eye(4) + step_s * np.eye(4, k=2)
        noise = np.vstack([0.5 * step_s**2 * np.eye(2), step_s * np.eye(2)]) * ACCELERATION_MPS2
        self.state, self.covariance = move @ self.state, move @ self.covariance @ move.T + noise @ noise.T

    # Returns the innovation of a face that was measured some time ago, its covariance, and the row of the measurement.
    def innovation(self, at, variance, age_s):
        row = np.eye(2, 4) - age_s * np.eye(2, 4, k=2)
        return at - row @ self.state, row @ self.covariance @ row.T + np.diag(variance), row

    def correct(self, at, variance, age_s, kind):
        error, spread, row = self.innovation(at, variance, age_s)
        gain = self.covariance @ row.T @ np.linalg.inv(spread)
        self.state, self.covariance = self.state + gain @ error, (np.eye(4) - gain @ row) @ self.covariance
        self.hits, self.misses, self.votes[kind] = self.hits + 1, 0, self.votes.get(kind, 0) + 1

    # Returns the track as an answer has it: its centre, in the ego's frame.
    def answer(self, pose, turned):
        kind = max(self.votes, key=self.votes.get)
        (length, width), back, share = SIZES[kind], np.kron(np.eye(2), turned.T), self.votes[kind] / sum(self.votes.values())
        moved = back @ (self.state - [pose["x_m"], pose["y_m"], 0.0, 0.0])
        covariance = back @ self.covariance @ back.T
        status = "tentative" if self.hits < HITS else "coasting" if self.misses else "confirmed"
        scores = {other: 0.05 for other in SIZES} | {"background": 0.05}
        scores[kind] = 0.85
        return {
            "id": self.number, "status": status, "x_m": moved[0] - 0.5 * length, "y_m": moved[1], "vx_mps": moved[2], "vy_mps": moved[3],
            "covariance": (0.5 * (covariance + covariance.T)).tolist(), "length_m": length, "width_m": width,
            "class": scores, "existence": min(0.99, 0.5 + 0.1 * self.hits * share),
        }

tracks, hello, before, count = [], None, None, 0
for message in map(json.loads, sys.stdin):
    if message["type"] == "hello":
        hello, answer = message, {"type": "hello", "protocol": 1, "answers": "tracks", "name": "dbscan"}
    else:
        pose, odometry, time_ns = message["pose"], message["odometry"], message["time_ns"]
        turned, place = turn(pose), np.array([pose["x_m"], pose["y_m"]])
        for track in tracks:
            track.predict(0.0 if before is None else 1e-9 * (time_ns - before))
        before = time_ns
        found = [(turned @ at + place, *rest) for scan in message["scans"] for at, *rest in vehicles(scan, odometry, hello["road"])]
        costs = np.full((len(tracks), len(found)), 1e6)
        for row, track in enumerate(tracks):
            for column, (at, variance, age_s, _) in enumerate(found):
                error, spread, _ = track.innovation(at, variance, age_s)
                distance = error @ np.linalg.solve(spread, error)
                costs[row, column] = distance if distance < GATE else 1e6
        taken = {column: tracks[row] for row, column in zip(*linear_sum_assignment(costs)) if costs[row, column] < GATE}
        for track in tracks:
            track.misses += track not in taken.values()
        for column, (at, variance, age_s, kind) in enumerate(found):
            if column in taken:
                taken[column].correct(at, variance, age_s, kind)
            else:
                velocity = turned @ [odometry["speed_mps"], 0.0]
                tracks.append(Track(count, at + age_s * velocity, variance, velocity, kind))
                count += 1
        tracks = [track for track in tracks if track.misses < (MISSES if track.hits >= HITS else 2)]
        answer = {"time_ns": time_ns, "tracks": [track.answer(pose, turned) for track in tracks]}
    print(json.dumps(answer), flush=True)
