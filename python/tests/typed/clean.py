from __future__ import annotations

import closecall as cc

result = cc.campaign("low-thw-overtake", n=200, paired=True, max_collisions=3, ensemble=["typical"])
print(result.verdict, result.outcomes().num_rows)
changes = cc.lane_changes("traffic.csv", layout="openlabel")
print(changes.table(), changes[0]["track_id"], cc.lane_changes("traffic.csv", reference="known.csv")["recall"])
nightly = cc.campaign("low-thw-overtake", preset="nightly", out="nightly")
outcome = cc.run("low-thw-overtake", "mis", sample=3)
print(outcome.margins.min_thw_rear_s)
