"""Trains a small policy in minutes, and has it judged by a campaign.

    pip install "closecall[gym]"
    python train.py [GENERATIONS] [SAMPLES]

The policy follows the lead vehicle at a time gap of 0.7 s, and slows the ego down while a vehicle comes from behind: by up to
2 m/s², a function of four numbers that the ego perceives. The cross-entropy method (Rubinstein and Kroese 2004) searches
its weights: it draws candidates from a normal distribution, steps each in the same sampled encounters, and moves the
distribution to the best ones. The campaign that judges the result samples with another seed.
"""

from __future__ import annotations

import functools
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import closecall as cc
import closecall.gym as ccgym

SCENARIO = "low-thw-overtake"
#: Largest deceleration for a vehicle from behind (m/s²), time gap to the lead vehicle (s), and smallest gap to it (m).
LARGEST_MPS2, TIME_GAP_S, STANDSTILL_GAP_M = 2.0, 0.7, 3.0
#: Candidates of a generation, those that are kept, and the encounters in which each is stepped.
CANDIDATES, KEPT, ENCOUNTERS = 16, 4, 32
TRAINING_SEED, JUDGEMENT_SEED = 1, 2
LIMITS_MPS2 = (-9.0, 1.5)

Array = NDArray[np.float64]


def required(speed_mps: Any, room_m: Any, lead_mps: Any, braking_mps2: Any) -> Any:
    """Returns the constant deceleration (m/s²) that keeps the ego behind a lead vehicle that goes on braking."""
    removing = np.maximum(speed_mps - lead_mps, 0.0) ** 2 / (2.0 * room_m)
    lead_stops_in_m = lead_mps**2 / (2.0 * np.maximum(braking_mps2, 1e-6))
    to_stop = speed_mps**2 / (2.0 * (room_m + lead_stops_in_m))
    before_it_stops = np.where(speed_mps > lead_mps, braking_mps2 + removing, 0.0)
    moving = np.where(speed_mps * braking_mps2 >= lead_mps * to_stop, to_stop, before_it_stops)
    return np.where((braking_mps2 > 0.0) & (lead_mps > 0.0), moving, removing)


def policy(weights: Array, observation: ccgym.Observation) -> Any:
    """Returns the acceleration (m/s²). All arrays may have one more axis in front, of several runs."""
    has_lead, lead_gap_m, lead_mps, lead_mps2 = (observation["lead"][..., index] for index in range(4))
    speed_mps, limit_mps = observation["odometry"][..., 0], observation["road"][..., 2]
    column = {name: observation["tracks"][..., index] for index, name in enumerate(ccgym.TRACK)}
    # Cruise control, and emergency braking if a gap of 2 m cannot be kept by less than 1.5 m/s².
    cruise = 0.5 * (limit_mps - speed_mps)
    follow = 0.3 * (lead_gap_m - np.maximum(TIME_GAP_S * speed_mps, STANDSTILL_GAP_M)) + 1.0 * (lead_mps - speed_mps)
    needed = required(speed_mps, np.maximum(lead_gap_m - 2.0, 0.1), lead_mps, np.maximum(-lead_mps2, 0.0))
    follow = np.where(needed > 1.5, -1.15 * needed, np.maximum(follow, -3.5))
    acceleration = np.where(has_lead > 0.0, np.minimum(cruise, follow), cruise)
    # The nearest confirmed vehicle behind in the lane of the ego.
    gap_m = -column["x_m"] - 0.5 * (column["length_m"] + observation["odometry"][..., 5:6])
    is_behind = (column["x_m"] < 0.0) & (column["lane_own"] >= 0.5) & (column["confirmed"] > 0.0)
    nearest = np.where(is_behind, gap_m, np.inf).argmin(axis=-1)[..., None]
    rear_gap_m, rear_mps = (np.take_along_axis(of, nearest, -1)[..., 0] for of in (gap_m, column["vx_mps"]))
    closing_mps = rear_mps - speed_mps
    headway_s = np.where(has_lead > 0.0, lead_gap_m / np.maximum(speed_mps, 1.0), 3.0)
    features = np.stack([np.ones_like(speed_mps), closing_mps / 10.0, rear_gap_m / 100.0, headway_s], axis=-1)
    eased = LARGEST_MPS2 / (1.0 + np.exp(-np.clip((weights * features).sum(axis=-1), -50.0, 50.0)))
    eased = np.where(is_behind.any(axis=-1) & (closing_mps > 0.0), eased, 0.0)
    return np.clip(np.where(eased > 0.05, np.minimum(acceleration, -eased), acceleration), *LIMITS_MPS2)


def returns(envs: ccgym.EncounterVectorEnv, candidates: Array, samples: range) -> Array:
    """Returns the mean reward of each candidate, stepped in the same encounters as the others."""
    weights = np.repeat(candidates, len(samples), axis=0)
    observation, _ = envs.reset(seed=TRAINING_SEED, options={"sample": list(samples) * len(candidates)})
    total, is_running = np.zeros(len(weights)), np.ones(len(weights), dtype=bool)
    while is_running.any():
        observation, rewards, terminated, truncated, _ = envs.step(policy(weights, observation)[:, None])
        total += np.where(is_running, rewards, 0.0)
        is_running &= ~(terminated | truncated)
    mean: Array = total.reshape(len(candidates), -1).mean(axis=1)
    return mean


def main() -> None:
    generations = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    judged = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    envs = ccgym.EncounterVectorEnv(CANDIDATES * ENCOUNTERS, SCENARIO, action_limits_mps2=LIMITS_MPS2)
    generator = np.random.default_rng(0)
    mean, deviation = np.zeros(4), np.full(4, 3.0)
    started = time.monotonic()
    for generation in range(generations):
        samples = range(generation * ENCOUNTERS, (generation + 1) * ENCOUNTERS)
        candidates = generator.normal(mean, deviation, (CANDIDATES, 4))
        reward = returns(envs, candidates, samples)
        best = candidates[np.argsort(-reward)[:KEPT]]
        # The floor keeps the search from ending at the first good candidate.
        mean, deviation = best.mean(axis=0), best.std(axis=0) + 0.2
        spent_s = time.monotonic() - started
        print(f"generation {generation}: reward {reward.min():.2f} to {reward.max():.2f}, {spent_s:.0f} s", flush=True)
    print("weights", [round(float(weight), 3) for weight in mean])
    result = cc.campaign(
        SCENARIO,
        n=judged,
        seed=JUDGEMENT_SEED,
        sensors="object",
        controller=ccgym.PolicyController(functools.partial(policy, mean)),
        paired=True,
        gate=["upper(induced) <= 0.05"],
        out=Path("trained"),
    )
    paired = result.report["paired"]
    print(f"{result.verdict}: {paired['prevented']} prevented, {paired['induced']} induced of {judged} samples")


if __name__ == "__main__":
    main()
