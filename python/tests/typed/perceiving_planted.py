# Each line that calls the package has a mistake that a type checker finds. Nothing here is run.
from __future__ import annotations

import closecall as cc
from closecall.perception import Detection, PerceivedTrack, PerceptionInput


class OfAnotherType:
    def track(self, input: PerceptionInput) -> list[Detection]:
        return []


class WithoutMethod:
    def perceive(self, input: PerceptionInput) -> list[PerceivedTrack]:
        return []


cc.campaign("low-thw-overtake", perception=OfAnotherType)
cc.campaign("low-thw-overtake", perception=WithoutMethod())
cc.run("low-thw-overtake", perception=7)
