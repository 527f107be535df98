"""The stepping interface."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support import SCENARIO

import closecall as cc
import closecall.gym as ccgym

from acc import Acc  # isort: skip (support finds the examples)


def test_gymnasium_accepts_the_environment(recwarn: pytest.WarningsRecorder) -> None:
    check_env(gymnasium.make("closecall/Encounter-v0", scenario=SCENARIO).unwrapped)
    # The action is an acceleration in m/s², and no share of one: wrappers rescale it where a learner needs that.
    others = [text for text in (str(warning.message) for warning in recwarn) if "symmetric and normalized" not in text]
    assert others == []


class Recorder:
    """Drives as `acc`, and keeps what it has commanded."""

    commands: list[float] = []

    def __init__(self) -> None:
        self.acc = Acc()
        self.start = self.acc.start
        Recorder.commands = []

    def step(self, input: cc.ControllerInput) -> float:
        acceleration: float = self.acc.step(input)[0]
        Recorder.commands.append(acceleration)
        return acceleration


@pytest.mark.parametrize("sample", [0, 1, 2])
def test_the_same_commands_lead_to_the_same_outcome(sample: int) -> None:
    expected = cc.run(SCENARIO, Recorder, seed=6, sample=sample, sensors="object")
    env = ccgym.EncounterEnv(SCENARIO)
    _, info = env.reset(seed=6, options={"sample": sample})
    assert (info["seed"], info["sample"]) == (6, sample)
    for index, command in enumerate(Recorder.commands):
        _, _, terminated, truncated, info = env.step(command)
        assert (terminated or truncated) == (index + 1 == len(Recorder.commands))
    outcome = info["outcome"]
    for name in ("parameters", "collisions", "moments", "margins", "duration_s", "end"):
        assert getattr(outcome, name) == getattr(expected, name), name
    assert terminated == (outcome.end != "duration")


def test_the_observation_is_what_a_controller_is_given() -> None:
    seen: list[tuple[float, float, int, float]] = []

    class Looks:
        def step(self, input: cc.ControllerInput) -> float:
            gap_m = 0.0 if input.front is None else input.front.gap_m
            nearest = min(input.tracks, key=lambda track: (track.x_m**2 + track.y_m**2) ** 0.5)
            seen.append((input.odometry.speed_mps, gap_m, len(input.tracks), nearest.x_m))
            return 0.0

    cc.run(SCENARIO, Looks, seed=1, sample=3, sensors="object")
    env = ccgym.EncounterEnv(SCENARIO, max_tracks=8)
    observation, _ = env.reset(seed=1, options={"sample": 3})
    for speed_mps, gap_m, count, x_m in seen:
        tracks = observation["tracks"]
        assert tracks.shape == (8, len(ccgym.TRACK))
        assert observation["odometry"][ccgym.ODOMETRY.index("speed_mps")] == speed_mps
        assert observation["lead"][ccgym.LEAD.index("lead_gap_m")] == gap_m
        assert tracks[:, ccgym.TRACK.index("present")].sum() == min(count, 8)
        assert tracks[0, ccgym.TRACK.index("x_m")] == x_m
        assert observation in env.observation_space
        observation = env.step(0.0)[0]


def test_a_policy_drives_a_campaign_as_it_was_trained() -> None:
    def policy(observation: ccgym.Observation) -> float:
        tracks = observation["tracks"]
        return float(np.tanh(tracks[:, 1:5].sum() / 1000.0) - 0.5 * observation["lead"][0])

    expected = cc.run(SCENARIO, ccgym.PolicyController(policy), seed=1, sample=5, sensors="object")
    env = ccgym.EncounterEnv(SCENARIO)
    observation, _ = env.reset(seed=1, options={"sample": 5})
    is_over = False
    while not is_over:
        observation, _, terminated, truncated, info = env.step(policy(observation))
        is_over = terminated or truncated
    assert info["outcome"].margins == expected.margins and info["outcome"].collisions == expected.collisions


def test_the_truth_is_in_the_info_only() -> None:
    env = ccgym.EncounterEnv(SCENARIO)
    observation, info = env.reset(seed=1, options={"sample": 3})
    assert set(info["truth"]) == {"gap_front_m", "thw_front_s", "gap_rear_m", "thw_rear_s", "ttc_rear_s"}
    # The radar is noisy: what the ego perceives is not the truth.
    perceived = observation["lead"][ccgym.LEAD.index("lead_gap_m")]
    assert perceived != info["truth"]["gap_front_m"] and abs(perceived - info["truth"]["gap_front_m"]) < 3.0
    assert "truth" not in ccgym.EncounterEnv(SCENARIO, truth=False).reset(seed=1)[1]


def test_the_reward_of_one_run_is_that_of_several() -> None:
    rewards: dict[int, list[float]] = {}
    for count in (1, 3):
        envs = ccgym.EncounterVectorEnv(count, SCENARIO)
        envs.reset(seed=9, options={"sample": range(count)})
        generator = np.random.default_rng(3)
        actions = [generator.uniform(-4.0, 2.0) for _ in range(1200)]
        rewards[count] = [float(envs.step(np.full((count, 1), action))[1][0]) for action in actions]
    first = next(index for index, pair in enumerate(zip(*rewards.values(), strict=True)) if pair[0] != pair[1])
    # They are equal to the last bit until the first run has ended, after which each draws another sample.
    assert first > 300 and rewards[3][first - 1] == 0.0
    # Some of them are for headways, and not for the command alone.
    assert sum(reward < -0.04 * 0.05 * 16.0 for reward in rewards[1][:first]) > 10


def test_wrong_steps_are_refused() -> None:
    env = ccgym.EncounterEnv(SCENARIO)
    with pytest.raises(cc.UsageError, match="reset"):
        env.step(0.0)
    env.reset(seed=1)
    with pytest.raises(cc.SampleError, match="NaN"):
        env.step(float("nan"))
    with pytest.raises(cc.UsageError, match="reset"):
        env.step(0.0)
    env.reset(seed=1)
    with pytest.raises(cc.UsageError, match=r"shape \(2,\)"):
        env.step(np.zeros(2))
    for sample in (-1, 2**64, 0.5):
        with pytest.raises(cc.UsageError, match="expected a whole number from 0"):
            env.reset(options={"sample": sample})
    with pytest.raises(cc.UsageError, match="expected a whole number from 0"):
        cc.run(SCENARIO, sample=-1)
    for make in (ccgym.EncounterEnv, ccgym.EncounterVectorEnv):
        with pytest.raises(cc.UsageError, match="max_tracks: 0 is too few"):
            make(scenario=SCENARIO, max_tracks=0)


def test_an_action_is_a_number_an_array_without_axes_or_one_of_one() -> None:
    env = ccgym.EncounterEnv(SCENARIO)
    speeds = []
    for action in (-0.5, np.float64(-0.5), np.array(-0.5), np.array([-0.5]), [-0.5]):
        env.reset(seed=1, options={"sample": 0})
        for _ in range(10):
            observation = env.step(action)[0]  # type: ignore[arg-type]
        speeds.append(observation["odometry"][0])
    assert len(set(speeds)) == 1


def test_a_vectorised_run_in_error_goes_on_only_after_a_reset() -> None:
    envs = ccgym.EncounterVectorEnv(3, SCENARIO)
    with pytest.raises(cc.UsageError, match="run 0 has ended or not begun: call `reset`"):
        envs.step(np.zeros((3, 1)))
    envs.reset(seed=1)
    with pytest.raises(cc.SampleError, match="NaN"):
        envs.step(np.array([[0.0], [float("nan")], [0.0]]))
    with pytest.raises(cc.UsageError, match="run 1 has ended or not begun: call `reset`"):
        envs.step(np.zeros((3, 1)))
    envs.reset(seed=1)
    envs.step(np.zeros((3, 1)))
    with pytest.raises(cc.UsageError, match=r"expected \(3, 1\)"):
        envs.step(np.zeros((2, 1)))


def test_vectorised_runs_have_the_truth_that_single_ones_have() -> None:
    envs = gymnasium.make_vec("closecall/Encounter-v0", num_envs=2, scenario=SCENARIO, truth=True)
    single = ccgym.EncounterEnv(SCENARIO)
    _, info = envs.reset(seed=1, options={"sample": [3, 4]})
    _, expected = single.reset(seed=1, options={"sample": 4})
    for _ in range(20):
        assert set(info["truth"]) == set(expected["truth"])
        for name, value in expected["truth"].items():
            np.testing.assert_equal(info["truth"][name][1], np.nan if value is None else value)
        info, expected = envs.step(np.zeros((2, 1)))[4], single.step(0.0)[4]
    without = gymnasium.make_vec("closecall/Encounter-v0", num_envs=2, scenario=SCENARIO, truth=False)
    assert "truth" not in without.reset(seed=1)[1]


FORKED = """
import os, signal, numpy as np, closecall.gym as ccgym

envs = ccgym.EncounterVectorEnv(4, "low-thw-overtake")
envs.reset(seed=1, options={"sample": range(4)})
child = os.fork()
signal.alarm(40)
observed = envs.step(np.full((4, 1), -0.5))[0]
# In one piece each, for both write to the same pipe.
os.write(1, f"{observed['odometry'].sum()}\\n".encode())
if child == 0:
    os._exit(0)
os.write(1, f"{os.waitpid(child, 0)[1]}\\n".encode())
"""


def test_a_forked_process_has_threads_of_its_own() -> None:
    done = subprocess.run([sys.executable, "-c", FORKED], capture_output=True, text=True, timeout=60)
    first, second, status = done.stdout.split()
    assert (first == second, status, done.returncode) == (True, "0", 0)


def test_vectorised_runs_are_those_of_single_ones() -> None:
    count, steps = 5, 1600
    envs = gymnasium.make_vec("closecall/Encounter-v0", num_envs=count, scenario=SCENARIO)
    singles = [ccgym.EncounterEnv(SCENARIO) for _ in range(count)]
    observation, info = envs.reset(seed=9, options={"sample": range(count)})
    for index, single in enumerate(singles):
        first = single.reset(seed=9, options={"sample": index})[0]
        assert all((observation[name][index] == first[name]).all() for name in first)
    assert list(info["sample"]) == list(range(count))
    ended: list[Any] = [None] * count
    generator = np.random.default_rng(3)
    restarts = 0
    for _ in range(steps):
        actions = generator.uniform(-1.0, 0.5, (count, 1))
        was_over = [outcome is not None for outcome in ended]
        observation, rewards, terminated, truncated, info = envs.step(actions)
        for index, single in enumerate(singles):
            if was_over[index]:
                continue
            expected, reward, is_terminated, is_truncated, single_info = single.step(actions[index])
            assert all((observation[name][index] == expected[name]).all() for name in expected)
            assert (rewards[index], terminated[index], truncated[index]) == (reward, is_terminated, is_truncated)
            if is_terminated or is_truncated:
                ended[index] = info["outcome"][index]
                assert ended[index] == single_info["outcome"]
        restarts += sum(was_over)
    assert all(outcome is not None for outcome in ended) and restarts > 0
    assert observation in envs.observation_space
