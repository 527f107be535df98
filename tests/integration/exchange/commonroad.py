"""Reads a CommonRoad file with commonroad-io, and prints what it has as JSON."""
import json
import sys
import warnings

warnings.simplefilter("ignore")
# This file has the name of the package, and its folder is searched first.
sys.path.pop(0)

from commonroad.common.file_reader import CommonRoadFileReader

scenario, problems = CommonRoadFileReader(sys.argv[1]).open()
problem = next(iter(problems.planning_problem_dict.values()))
print(json.dumps({
    "step_s": scenario.dt,
    "lanelets": len(scenario.lanelet_network.lanelets),
    "obstacles": {str(one.obstacle_id): one.prediction.trajectory.final_state.time_step for one in scenario.dynamic_obstacles},
    "start": [*map(float, problem.initial_state.position), problem.initial_state.velocity],
    "on_lanelet": [
        lanelet.lanelet_id
        for lanelet in scenario.lanelet_network.lanelets
        if lanelet.polygon.contains_point(problem.initial_state.position)
    ],
}))
