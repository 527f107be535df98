"""The stepping interface: a Gymnasium environment of one encounter, and a vectorised one.

>>> import gymnasium, closecall.gym
>>> env = gymnasium.make("closecall/Encounter-v0", scenario="low-thw-overtake")
>>> observation, info = env.reset(seed=1, options={"sample": 7})
>>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

The observation is what a controller is given: odometry and tracks. The truth is in ``info["truth"]`` only. A step is a control
step of 0.04 s. ``reset(seed=S, options={"sample": K})`` is the sample of ``closecall run --seed S --sample K``; without ``sample``, one
is drawn. Commands that a controller gave in ``closecall run`` lead to the same outcome, down to the last bit.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

try:
    import gymnasium
    import numpy as np
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
    from numpy.typing import NDArray
except ImportError as error:
    raise ImportError(f'closecall.gym needs Gymnasium and NumPy ({error}): pip install "closecall[gym]"') from error

from . import _native
from ._errors import UsageError
from ._outcome import Outcome
from ._run import SensorsLike
from ._scenario import Scenario, loaded, whole

__all__ = [
    "CONTROL_STEP_S",
    "EncounterEnv",
    "EncounterVectorEnv",
    "PolicyController",
    "ODOMETRY",
    "ROAD",
    "SENSORS",
    "LEAD",
    "TRACK",
    "default_reward",
    "observation_space",
]

#: Time of a control step (s).
CONTROL_STEP_S = 0.04
#: The numbers of ``observation["odometry"]``, with their units.
ODOMETRY: tuple[str, ...] = tuple(_native.ODOMETRY_KEYS[:7])
#: The numbers of ``observation["road"]``.
ROAD: tuple[str, ...] = tuple(_native.ODOMETRY_KEYS[7:11])
#: The numbers of ``observation["sensors"]``: 1 for a group of sensors that works.
SENSORS: tuple[str, ...] = tuple(_native.ODOMETRY_KEYS[11:14])
#: The numbers of ``observation["lead"]``: the lead vehicle, all 0 if there is none.
LEAD: tuple[str, ...] = tuple(_native.ODOMETRY_KEYS[14:])
#: The columns of ``observation["tracks"]``, nearest track first; rows without a track are 0.
#: ``source`` is 0 (front), 1 (surround) or 2 (rear); the last seven are probabilities.
TRACK: tuple[str, ...] = tuple(_native.TRACK_KEYS)

_X, _VX, _LENGTH, _CONFIRMED, _LANE_OWN = map(TRACK.index, ("x_m", "vx_mps", "length_m", "confirmed", "lane_own"))

#: The true margins, with their units.
_TRUTH = ("gap_front_m", "thw_front_s", "gap_rear_m", "thw_rear_s", "ttc_rear_s")

#: A bound that no quantity reaches (m, m/s, m/s²).
_BOUND = 1.0e4
#: What the action of one run is, for messages.
_ONE = "one acceleration (m/s²)"
#: The numbers between 0 and 1.
_SHARES = {"front_works", "surround_works", "rear_works", "has_lead", "present", "existence", "confirmed", "coasting"}
_SHARES |= {"lane_left", "lane_own", "lane_right", "car", "truck", "motorcycle", "background"}

#: Why a run has ended, as the native module counts.
_DURATION, _CRASH = 1, 3

Observation = dict[str, NDArray[np.float64]]
#: Returns the reward of a step from the observation after it, the commanded acceleration (m/s²), and whether the ego has
#: crashed. With a vectorised environment all three have one more axis in front.
Reward = Callable[[Observation, Any, Any], Any]


def _box(keys: Sequence[str], rows: int | None = None) -> spaces.Box:
    shares = np.array([key in _SHARES for key in keys])
    low, high = np.where(shares, 0.0, -_BOUND), np.where(shares, 1.0, _BOUND)
    if rows is not None:
        low, high = np.tile(low, (rows, 1)), np.tile(high, (rows, 1))
    return spaces.Box(low, high, dtype=np.float64)


def _check_max_tracks(max_tracks: int) -> None:
    if max_tracks < 1:
        raise UsageError(f"max_tracks: {max_tracks} is too few: an observation has at least one row of tracks")


def observation_space(max_tracks: int = 16) -> spaces.Dict:
    """Returns the space of an observation. Its parts are named by :data:`ODOMETRY`, :data:`ROAD`, :data:`SENSORS`,
    :data:`LEAD` and :data:`TRACK`; ``tracks`` has the shape (``max_tracks``, 19)."""
    _check_max_tracks(max_tracks)
    named = {"odometry": ODOMETRY, "road": ROAD, "sensors": SENSORS, "lead": LEAD}
    parts: dict[str, spaces.Space[Any]] = {name: _box(keys) for name, keys in named.items()}
    return spaces.Dict({**parts, "tracks": _box(TRACK, max_tracks)})


def default_reward(observation: Observation, acceleration_mps2: Any, crashed: Any) -> Any:
    """Returns a reward that needs no truth: an example, to be replaced by the reward of your question.

    Per second it takes 0.05 for each (m/s²)² of the command, and up to 1 for each time headway below 1 s, of the ego to
    its lead vehicle and of the vehicle behind to the ego. A crash, which the ego feels, costs 20. The weights are
    assumptions.
    """
    own, lead, tracks = observation["odometry"], observation["lead"], observation["tracks"]
    if own.ndim == 1:
        return _reward_of_one(own, lead, tracks, acceleration_mps2**2, crashed)
    if len(own) == 1:
        squared, crash = float((acceleration_mps2**2).item()), np.asarray(crashed).item()
        return np.array([_reward_of_one(own[0], lead[0], tracks[0], squared, crash)])
    speed_mps = np.maximum(own[..., 0], 1.0)
    short_front = lead[..., 0] * np.minimum(np.maximum(1.0 - lead[..., 1] / speed_mps, 0.0), 1.0)
    x_m = tracks[..., _X]
    gap_m = -x_m - 0.5 * (tracks[..., _LENGTH] + own[..., 5:6])
    is_behind = (x_m < 0.0) & (tracks[..., _LANE_OWN] >= 0.5) & (tracks[..., _CONFIRMED] > 0.0)
    headway_s = np.where(is_behind, gap_m / np.maximum(tracks[..., _VX], 1.0), np.inf)
    short_rear = np.minimum(np.maximum(1.0 - headway_s.min(axis=-1), 0.0), 1.0)
    return -CONTROL_STEP_S * (0.05 * acceleration_mps2**2 + short_front + short_rear) - 20.0 * crashed


def _reward_of_one(
    odometry: NDArray[np.float64], lead: NDArray[np.float64], tracks: NDArray[np.float64], squared: Any, crashed: Any
) -> Any:
    """Returns the default reward of one run, to the last bit. NumPy takes longer for so few numbers."""
    own, (has_lead, lead_gap_m, *_) = odometry.tolist(), lead.tolist()
    short_front = has_lead * min(max(1.0 - lead_gap_m / max(own[0], 1.0), 0.0), 1.0)
    headway_s = np.inf
    for track in tracks.tolist():
        if not track[0]:
            # The rows without a track come last.
            break
        if track[_X] < 0.0 and track[_LANE_OWN] >= 0.5 and track[_CONFIRMED] > 0.0:
            gap_m = -track[_X] - 0.5 * (track[_LENGTH] + own[5])
            headway_s = min(headway_s, gap_m / max(track[_VX], 1.0))
    short_rear = min(max(1.0 - headway_s, 0.0), 1.0)
    return -CONTROL_STEP_S * (0.05 * squared + short_front + short_rear) - 20.0 * crashed


def _split(values: NDArray[np.float64], max_tracks: int) -> Observation:
    """Returns the parts of observations that lie one behind the other; the last axis is an observation."""
    tracks = values[..., 18:].reshape(*values.shape[:-1], max_tracks, len(TRACK))
    return {
        "odometry": values[..., 0:7],
        "road": values[..., 7:11],
        "sensors": values[..., 11:14],
        "lead": values[..., 14:18],
        "tracks": tracks,
    }


#: The bounds of an action if none are given (m/s²).
ACTION_LIMITS_MPS2 = (-9.0, 3.0)


class _Actions:
    """The action space of an environment, and the accelerations of its actions."""

    def __init__(self, limits_mps2: tuple[float, float], normalized: bool) -> None:
        low, high = limits_mps2
        if not low < high:
            raise UsageError(f"action_limits_mps2: expected two numbers, the smaller first, not {limits_mps2!r}")
        self._middle, self._half = (0.5 * (low + high), 0.5 * (high - low)) if normalized else (0.0, 1.0)
        self.space = spaces.Box(*((-1.0, 1.0) if normalized else (low, high)), (1,), dtype=np.float64)

    def mps2(self, actions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Returns the accelerations (m/s²) of actions."""
        return self._middle + self._half * actions

    def one_mps2(self, action: Any) -> float:
        """Returns the acceleration (m/s²) of one action."""
        number = float(action if isinstance(action, (float, int)) else _numbers(action, 1, _ONE).item())
        return self._middle + self._half * number


def _numbers(action: Any, count: int, shape: str) -> NDArray[np.float64]:
    """Returns the accelerations of an action as an array of the shape (``count``,)."""
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise UsageError(f"the action {action!r} is not a number: expected {shape}") from None
    if values.size != count:
        raise UsageError(f"the action has the shape {values.shape}: expected {shape}")
    return values.reshape(count)


def _sample_of(options: dict[str, Any] | None) -> Any:
    """Returns the sample that the options of ``reset`` name, or ``None``."""
    for name in set(options or {}) - {"sample"}:
        raise UsageError(f"options: there is no {name!r}, only 'sample'")
    return (options or {}).get("sample")


def _check_open(is_closed: bool) -> None:
    if is_closed:
        raise UsageError("the environment is closed")


class EncounterEnv(gymnasium.Env[Observation, NDArray[np.float64]]):
    """One encounter of a scenario, stepped by its caller.

    ``scenario`` is a scenario, a path, or a name of the library. ``sensors`` is the depth of the sensor simulation (``"object"``
    by default). ``max_tracks`` is the number of tracks in an observation. ``action_limits_mps2`` are the
    bounds of ``action_space``, an acceleration (m/s², shape (1,)): a step does not clip, as a campaign does not clip the same
    command; ``gymnasium.wrappers.ClipAction`` does. With ``normalized_actions`` an action is a number from -1 to 1, which stands for
    the accelerations between the limits, as most learning algorithms expect. ``reward`` replaces :func:`default_reward`. With ``truth``, ``info["truth"]`` holds the ego's true
    margins: ``gap_front_m``, ``thw_front_s``, ``gap_rear_m``, ``thw_rear_s``, ``ttc_rear_s``, each ``None`` if absent. At the end
    ``info["outcome"]`` is the :class:`closecall.Outcome`, which is the truth, too.

    A run is *terminated* by a collision or by a standstill, and *truncated* at the end of the scenario's time.
    """

    metadata: dict[str, Any] = {"render_modes": [], "render_fps": 25}

    def __init__(
        self,
        scenario: Scenario | str | os.PathLike[str] = "low-thw-overtake",
        *,
        sensors: SensorsLike | None = "object",
        max_tracks: int = 16,
        action_limits_mps2: tuple[float, float] = ACTION_LIMITS_MPS2,
        normalized_actions: bool = False,
        reward: Reward = default_reward,
        truth: bool = True,
        render_mode: str | None = None,
    ) -> None:
        self.scenario = loaded(scenario)
        self.observation_space: Any = observation_space(max_tracks)
        self._actions = _Actions(action_limits_mps2, normalized_actions)
        self.action_space: Any = self._actions.space
        self.render_mode = render_mode
        self._episode = _native.Episode(self.scenario._native, sensors, max_tracks)
        self._max_tracks = max_tracks
        self._reward = reward
        self._truth = truth
        self._seed = 0
        self._is_closed = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts a sample: ``options["sample"]`` (from 0), or one that is drawn. ``seed`` is the seed of the campaign."""
        _check_open(self._is_closed)
        drawn = _sample_of(options)
        super().reset(seed=seed)
        if seed is not None:
            self._seed = seed
        sample = int(self.np_random.integers(2**31)) if drawn is None else whole("sample", drawn)
        observed = self._observation(self._episode.reset(self._seed, sample))
        return observed, {"seed": self._seed, "sample": sample, **self._true_margins()}

    def step(
        self, action: NDArray[np.float64] | float
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Commands an acceleration for 0.04 s: in m/s², or normalized."""
        _check_open(self._is_closed)
        acceleration_mps2 = self._actions.one_mps2(action)
        observed_bytes, end = self._episode.step(acceleration_mps2)
        observed = self._observation(observed_bytes)
        info = self._true_margins()
        if end:
            info["outcome"] = self.outcome()
        reward = float(self._reward(observed, acceleration_mps2, end == _CRASH))
        return observed, reward, end > _DURATION, end == _DURATION, info

    def close(self) -> None:
        """Ends the use of the environment."""
        self._is_closed = True

    def outcome(self) -> Outcome | None:
        """Returns the outcome of the run; ``None`` as long as it goes on."""
        text = self._episode.outcome()
        return None if text is None else Outcome.from_json(text)

    def _observation(self, values: bytes) -> Observation:
        return _split(np.frombuffer(values, dtype=np.float64), self._max_tracks)

    def _true_margins(self) -> dict[str, Any]:
        return {"truth": self._episode.truth()} if self._truth else {}


class EncounterVectorEnv(VectorEnv[Observation, NDArray[np.float64], NDArray[Any]]):
    """Several encounters of a scenario, stepped at once on all cores. Arguments are as in :class:`EncounterEnv`.
    ``truth`` is left out by default. ``info["truth"]`` has an array for each margin, with NaN for an absent one.

    ``reset(seed=S, options={"sample": [K, …]})`` starts these samples; without ``sample``, they are drawn. A run that has
    ended starts anew at the next step (``AutoresetMode.NEXT_STEP``), with a sample that is drawn. ``info["outcome"]`` holds
    the outcomes of the runs that have ended.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Scenario | str | os.PathLike[str] = "low-thw-overtake",
        *,
        sensors: SensorsLike | None = "object",
        max_tracks: int = 16,
        action_limits_mps2: tuple[float, float] = ACTION_LIMITS_MPS2,
        normalized_actions: bool = False,
        reward: Reward = default_reward,
        truth: bool = False,
        render_mode: str | None = None,
    ) -> None:
        if num_envs < 1:
            raise UsageError(f"num_envs: expected 1 or more, not {num_envs}")
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.scenario = loaded(scenario)
        self.single_observation_space = observation_space(max_tracks)
        self._actions = _Actions(action_limits_mps2, normalized_actions)
        self.single_action_space = self._actions.space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._episodes = _native.Episodes(self.scenario._native, sensors, max_tracks, num_envs)
        self._max_tracks = max_tracks
        self._reward = reward
        self._truth = truth
        self._seeds = [0] * num_envs
        self._has_ended = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts a sample in each run. ``seed`` is the seed of the campaign, or a list with one for each run."""
        _check_open(self.closed)
        given = _sample_of(options)
        for name, several in (("seed", seed), ("sample", given)):
            if not (isinstance(several, int) or several is None) and len(several) != self.num_envs:
                raise UsageError(f"{name}: {len(several)} are given for {self.num_envs} runs")
        first = seed if isinstance(seed, int) or seed is None else seed[0]
        super().reset(seed=first)
        if isinstance(seed, int):
            self._seeds = [seed] * self.num_envs
        elif seed is not None:
            self._seeds = [own if one is None else one for own, one in zip(self._seeds, seed, strict=True)]
        samples = self._draw() if given is None else [whole("sample", sample) for sample in given]
        starts: list[tuple[int, int] | None] = list(zip(self._seeds, samples, strict=True))
        values, _ = self._episodes.step([0.0] * self.num_envs, starts)
        self._has_ended[:] = False
        return self._observation(values), {"sample": np.array(samples), **self._true_margins()}

    def step(
        self, actions: NDArray[np.float64]
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Commands an acceleration to each run, in m/s² or normalized; ``actions`` has the shape (``num_envs``, 1)."""
        _check_open(self.closed)
        accelerations = self._actions.mps2(_numbers(actions, self.num_envs, f"({self.num_envs}, 1)"))
        starts: list[tuple[int, int] | None] = [None] * self.num_envs
        restarted, has_restarted = self._has_ended, self._has_ended.any()
        if has_restarted:
            for index, sample in enumerate(self._draw()):
                if restarted[index]:
                    starts[index] = (self._seeds[index], sample)
        values, codes = self._episodes.step(accelerations.tolist(), starts)
        ends = np.frombuffer(codes, dtype=np.uint8)
        observed = self._observation(values)
        rewards = self._reward(observed, accelerations, ends == _CRASH)
        if has_restarted:
            rewards = np.where(restarted, 0.0, rewards)
        self._has_ended = ends > 0
        info: dict[str, Any] = self._true_margins()
        for ended in np.flatnonzero(ends) if any(codes) else ():
            text = self._episodes.outcome(int(ended))
            if text is not None:
                info = self._add_info(info, {"outcome": Outcome.from_json(text)}, int(ended))
        return observed, rewards, ends > _DURATION, ends == _DURATION, info

    def truth(self, index: int) -> dict[str, float | None]:
        """Returns the true margins of the ego of one run."""
        return self._episodes.truth(index)

    def _true_margins(self) -> dict[str, Any]:
        if not self._truth:
            return {}
        truths = [self._episodes.truth(index) for index in range(self.num_envs)]
        # NumPy reads None as NaN.
        return {"truth": {name: np.array([truth.get(name) for truth in truths], dtype=np.float64) for name in _TRUTH}}

    def _draw(self) -> list[int]:
        drawn: list[int] = self.np_random.integers(2**31, size=self.num_envs).tolist()
        return drawn

    def _observation(self, values: bytes) -> Observation:
        rows = np.frombuffer(values, dtype=np.float64).reshape(self.num_envs, -1)
        return _split(rows, self._max_tracks)


class PolicyController:
    """A policy as a controller, for :func:`closecall.run` and :func:`closecall.campaign`: how a policy that was trained by
    stepping is judged.

    ``policy(observation)`` returns the acceleration (m/s²), or an action of the environment, for an observation of
    :class:`EncounterEnv` with the same ``max_tracks``, ``action_limits_mps2`` and ``normalized_actions``.
    A policy with a memory is given as a function that creates one: ``campaign(controller=lambda: PolicyController(Mine()))``.
    """

    def __init__(
        self,
        policy: Callable[[Observation], Any],
        max_tracks: int = 16,
        *,
        action_limits_mps2: tuple[float, float] = ACTION_LIMITS_MPS2,
        normalized_actions: bool = False,
    ) -> None:
        _check_max_tracks(max_tracks)
        if not callable(policy):
            raise UsageError(f"policy: {policy!r} cannot be called with an observation")
        self.policy = policy
        self.max_tracks = max_tracks
        self._actions = _Actions(action_limits_mps2, normalized_actions)

    def step(self, input: _native.ControllerInput) -> float:
        """Returns the acceleration (m/s²) that the policy answers."""
        values = np.frombuffer(input.observation(self.max_tracks), dtype=np.float64)
        return self._actions.one_mps2(self.policy(_split(values, self.max_tracks)))


gymnasium.register(
    id="closecall/Encounter-v0",
    entry_point="closecall.gym:EncounterEnv",
    vector_entry_point="closecall.gym:EncounterVectorEnv",
)
