"""Computes criticality measures of CriMe on a CommonRoad file, and prints them as JSON.

CriMe is the CommonRoad criticality toolbox (Y. Lin, M. Althoff, "CommonRoad-CriMe: A toolbox for criticality
measures of autonomous vehicles", IV 2023; package `commonroad-crime`). The formulas below are the ones of its
version 0.4.5 (`measure/distance/hw.py`, `measure/time/thw.py`, `measure/time/ttc.py`) for a road along the x axis.
Its dependencies exclude the dependencies of the other checkers: commonroad-io 2024.3 needs protobuf 3.20.2, and betterosi needs
6.30 or later. Where the package is installed, its own values are printed beside the formulas, without its rounding to
0.01 s.

`alike` says whether a measure of CriMe means the same as the one of Closecall, which assumes constant speeds:
CriMe's THW follows the motion in the file, and its TTC assumes constant accelerations from 0.1 m/s² of difference on.
With commonroad-io 2024.3, the package takes the velocity of a file for the component along the road and adds the
component across: a vehicle with the heading θ is faster there by √(1 + sin² θ).

Usage: criticality.py FILE LIST; LIST is a JSON file of [step, follower, lead] with the numbers of obstacles.
"""
import json
import logging
import math
import pathlib
import sys
import warnings

warnings.simplefilter("ignore")
logging.disable(logging.CRITICAL)
# Files of this folder have the names of packages, and the folder is searched first.
sys.path.pop(0)

import numpy
from commonroad.common.file_reader import CommonRoadFileReader

try:
    from commonroad_crime.data_structure.configuration import CriMeConfiguration
    from commonroad_crime.measure import HW, THW, TTC
    from commonroad_crime.utility import general
except ImportError:
    general = None

# Heading (rad) and change of speed (m/s) that count as none: numerical.
NONE = 1e-7
# Difference of the accelerations up to which CriMe's TTC assumes that both vehicles keep their speeds (m/s²).
CONSTANT_MPS2 = 0.1


class Track:
    """The motion of one obstacle, whose initial state is step 0."""

    def __init__(self, obstacle, step_s):
        states = [obstacle.initial_state, *obstacle.prediction.trajectory.state_list]
        self.x_m = numpy.array([state.position[0] for state in states])
        self.speed_mps = numpy.array([state.velocity for state in states])
        self.heading_rad = numpy.array([state.orientation for state in states])
        self.speed_in_package_mps = self.speed_mps * numpy.sqrt(1 + numpy.sin(self.heading_rad) ** 2)
        self.acceleration_mps2 = numpy.gradient(self.speed_mps, step_s)
        self.half_m = obstacle.obstacle_shape.length / 2


def headway_m(follower, lead, step):
    """HW: from the front of the follower to the rear of the vehicle ahead."""
    return (lead.x_m[step] - lead.half_m) - (follower.x_m[step] + follower.half_m)


def headway_s(follower, lead, step, step_s):
    """THW: the time of the first step in which the front of the follower has passed the present rear of the vehicle
    ahead, and the time between two steps at which it passes it; infinite if that is not in the file."""
    rear_m = lead.x_m[step] - lead.half_m
    front_m = follower.x_m + follower.half_m
    passed = numpy.nonzero(front_m[step + 1:] > rear_m)[0]
    if len(passed) == 0:
        return math.inf, math.inf
    later = step + 1 + int(passed[0])
    share = (rear_m - front_m[later - 1]) / (front_m[later] - front_m[later - 1])
    return (later - step) * step_s, (later - 1 - step + share) * step_s


def time_to_collision_s(follower, lead, step, opening_mps):
    """TTC with constant accelerations. The acceleration of the vehicle ahead has no sign in CriMe."""
    gap_m = headway_m(follower, lead, step)
    opening_mps2 = abs(lead.acceleration_mps2[step]) - follower.acceleration_mps2[step]
    under_root = opening_mps**2 - 2 * gap_m * opening_mps2
    if opening_mps < 0 and abs(opening_mps2) <= CONSTANT_MPS2:
        return -gap_m / opening_mps
    if under_root < 0:
        return math.inf
    if (opening_mps < 0 and opening_mps2 != 0) or opening_mps2 < 0:
        return -opening_mps / opening_mps2 - math.sqrt(under_root) / opening_mps2
    return math.inf


def finite(value):
    return float(value) if math.isfinite(value) else None


class Package:
    """The measures of CriMe itself, for one follower after the other."""

    def __init__(self, path):
        general.int_round = lambda value, *_: value
        self.scenario, _ = CommonRoadFileReader(path).open(lanelet_assignment=True)
        self.measures = {}

    def values(self, step, follower, lead):
        if follower not in self.measures:
            configuration = CriMeConfiguration()
            configuration.update(ego_id=follower, sce=self.scenario)
            self.measures[follower] = [measure(configuration) for measure in (HW, THW, TTC)]
        return [finite(measure.compute(lead, step, verbose=False)) for measure in self.measures[follower]]


scenario, _ = CommonRoadFileReader(sys.argv[1]).open()
tracks = {obstacle.obstacle_id: Track(obstacle, scenario.dt) for obstacle in scenario.dynamic_obstacles}
package = Package(sys.argv[1]) if general else None
results = []
for step, follower, lead in json.loads(pathlib.Path(sys.argv[2]).read_text()):
    behind, ahead = tracks[follower], tracks[lead]
    thw_s, passes_s = headway_s(behind, ahead, step, scenario.dt)
    passing = slice(step, step + 1 + (round(thw_s / scenario.dt) if math.isfinite(thw_s) else 0))
    is_steady = numpy.ptp(behind.speed_mps[passing]) < NONE and numpy.max(abs(behind.heading_rad[passing])) < NONE
    opening_mps = ahead.speed_mps[step] - behind.speed_mps[step]
    opening_in_package_mps = ahead.speed_in_package_mps[step] - behind.speed_in_package_mps[step]
    difference_mps2 = abs(ahead.acceleration_mps2[step]) - behind.acceleration_mps2[step]
    results.append({
        "hw_m": finite(headway_m(behind, ahead, step)),
        "thw_s": finite(thw_s),
        "passes_s": finite(passes_s),
        "thw_alike": bool(is_steady and math.isfinite(thw_s)),
        "ttc_s": finite(time_to_collision_s(behind, ahead, step, opening_mps)),
        "ttc_alike": bool(abs(difference_mps2) <= CONSTANT_MPS2),
        "ttc_in_package_s": finite(time_to_collision_s(behind, ahead, step, opening_in_package_mps)),
        "package": package and package.values(step, follower, lead),
    })
print(json.dumps({"step_s": scenario.dt, "results": results}))
