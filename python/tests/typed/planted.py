# Each line that calls the package has a mistake that a type checker finds. Nothing here is run.
import closecall as cc

cc.campaign("low-thw-overtake", n="many")
cc.campaign("low-thw-overtake", max_collision=3)
cc.campaign("low-thw-overtake", max_collisions="three")
cc.campaign("low-thw-overtake", design="latin")
cc.run("low-thw-overtake", sensors="lidar")
cc.campaign("low-thw-overtake").outcomes().rows
cc.campaign("low-thw-overtake", preset="weekly")
cc.lane_changes("traffic.csv", layout="gps")
