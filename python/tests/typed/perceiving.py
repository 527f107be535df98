from __future__ import annotations

import closecall as cc
from closecall.perception import Detection, PerceivedTrack, PerceptionInput, PerceptionSetup


class Follows:
    def start(self, setup: PerceptionSetup) -> None:
        self.lanes = setup.road.lanes

    def track(self, input: PerceptionInput) -> list[PerceivedTrack]:
        nearest_m = max((x_m for scan in input.scans for x_m in scan.x_m), default=None)
        if nearest_m is None:
            return []
        covariance = [[0.1 if row == column else 0.0 for column in range(4)] for row in range(4)]
        speed_mps = input.odometry.speed_mps
        return [PerceivedTrack(1, "confirmed", nearest_m, 0.0, speed_mps, 0.0, covariance, 4.6, 1.8, 0.9, class_probabilities={"car": 1.0})]


class Detects:
    def detect(self, input: PerceptionInput) -> list[Detection]:
        return [Detection(-30.0, 0.0, [[0.1, 0.0], [0.0, 0.1]], 4.6, 1.8, points=len(scan)) for scan in input.scans if len(scan)]


def create() -> Detects:
    return Detects()


for perception in (Follows, Follows(), Detects, create, "lib:./mine.so"):
    result = cc.campaign("low-thw-overtake", n=2, sensors="full", perception=perception)
    outcome = cc.run("low-thw-overtake", sensors="full", perception=perception)
    print(result.verdict, outcome.margins.min_thw_rear_s)
