"""The native module."""

import os
from collections.abc import Callable, Mapping
from typing import Any, Literal, final

VERSION: str
PYTHON_PREFIX: str
SAMPLE_TIMEOUT_S: float
CONTROLLER_TIMEOUT_MS: int
CONTROLLER_MEMORY_MIB: int
ODOMETRY_KEYS: list[str]
TRACK_KEYS: list[str]

def main(arguments: list[str]) -> int: ...
def version() -> str:
    """Returns the version of the program with the identifier of its build."""

def set_engine(engine: object) -> None:
    """Sets what runs the samples of a campaign elsewhere: an object with a method ``connect(address, shipment)``."""

@final
class BlockRunner:
    """A campaign, ready to run blocks of its samples."""

    def __init__(self, version: str, manifest: str, files: list[tuple[str, bytes, bool]]) -> None: ...
    def run(self, work: int, samples: list[int]) -> bytes:
        """Runs samples of the scenario with index ``work`` in one thread, and returns their records."""

def set_program(path: str, words: list[str]) -> None: ...
def call(
    function: str, keywords: str, spelled: str, progress: Callable[[int, int], Any] | None = None
) -> tuple[int, str, list[str]]: ...
def shown(text: str) -> str:
    """Returns a text with its control and bidirectional characters as numbers."""

def refuse(name: str, reason: str) -> None: ...
def register_perception(name: str, words: list[str]) -> None: ...
def unregister_perception(name: str) -> None: ...
def read_table(path: str | os.PathLike[str]) -> Table: ...
def rows_table(rows: str) -> Table: ...
def run(
    scenario: Scenario, controller: str | PythonController, seed: int, sample: int, sensors: str | None = None
) -> Run: ...

@final
class Table:
    """A table. ``pyarrow.table(t)``, ``polars.DataFrame(t)`` and ``pandas.DataFrame.from_arrow(t)`` read it without copying.

    The metadata of a column holds its unit (``unit``).
    """

    @property
    def column_names(self) -> list[str]:
        """The names of the columns."""
    @property
    def num_rows(self) -> int:
        """The number of rows."""
    def __len__(self) -> int: ...
    def __arrow_c_schema__(self) -> object: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

@final
class Scenario:
    @staticmethod
    def load(source: str, settings: list[str]) -> Scenario: ...
    @staticmethod
    def library() -> list[str]: ...
    @property
    def source(self) -> str: ...
    @property
    def settings(self) -> list[str]: ...
    @property
    def name(self) -> str: ...
    @property
    def path(self) -> os.PathLike[str]: ...
    @property
    def text(self) -> str: ...
    @property
    def parameters(self) -> list[str]: ...
    def sample(self, seed: int, n: int, design: str) -> list[dict[str, float | str]]: ...

@final
class Run:
    def json(self) -> str: ...
    def trace(self) -> Table: ...
    def tracks(self) -> Table: ...
    def clusters(self) -> Table: ...
    def record(self, path: str) -> None: ...
    def figure(self) -> str: ...

@final
class PythonController:
    def __new__(
        cls, name: str, create: Callable[[], Any], process: tuple[list[str], int, int] | None = None
    ) -> PythonController: ...
    @property
    def name(self) -> str: ...
    def register(self) -> None: ...
    def unregister(self) -> list[int]: ...
    def late(self, limit_s: float) -> list[int]: ...
    @property
    def is_busy(self) -> bool: ...

@final
class Episode:
    def __new__(cls, scenario: Scenario, sensors: str | None, max_tracks: int) -> Episode: ...
    def reset(self, seed: int, sample: int) -> bytes: ...
    def step(self, acceleration_mps2: float) -> tuple[bytes, int]: ...
    def truth(self) -> dict[str, float | None]: ...
    def outcome(self) -> str | None: ...

@final
class Episodes:
    def __new__(cls, scenario: Scenario, sensors: str | None, max_tracks: int, count: int) -> Episodes: ...
    def step(
        self, accelerations_mps2: list[float], starts: list[tuple[int, int] | None]
    ) -> tuple[bytes, bytes]: ...
    def truth(self, index: int) -> dict[str, float | None]: ...
    def outcome(self, index: int) -> str | None: ...

@final
class Setup:
    """What a controller is told before its first step."""

    @property
    def control_step_s(self) -> float:
        """Time between two steps (s): 0.04."""
    @property
    def settings(self) -> Mapping[str, Any]:
        """The settings of the scenario's ego stack: ``acc``, ``aeb``, ``mis`` (``None`` where absent), ``automated``."""
    @property
    def road(self) -> Mapping[str, Any]:
        """``lanes``, ``lane_width_m`` (of the ego's lane), ``lane_widths_m`` (of each lane, from lane 1 on; of
        ``road.cross-sections`` the greatest ones), ``curvature_per_m`` (``None`` if it changes along the road),
        ``speed_limit_mps``, ``overtaking_side``."""

@final
class Odometry:
    """The ego's measurement of its own motion."""

    @property
    def speed_mps(self) -> float:
        """Speed (m/s)."""
    @property
    def acceleration_mps2(self) -> float:
        """Longitudinal acceleration (m/s²)."""
    @property
    def yaw_rate_radps(self) -> float:
        """Yaw rate (rad/s)."""
    @property
    def lane(self) -> int:
        """The lane of the ego; 1 is the leftmost."""
    @property
    def lane_offset_m(self) -> float:
        """Lateral offset from the centre of that lane (m), positive to the left."""
    @property
    def length_m(self) -> float:
        """Length of the ego (m)."""
    @property
    def width_m(self) -> float:
        """Width of the ego (m)."""

@final
class LeadVehicle:
    """The lead vehicle, selected among the tracks as the built-in controllers do."""

    @property
    def track(self) -> int:
        """Number of its track."""
    @property
    def gap_m(self) -> float:
        """Gap, bumper to bumper (m)."""
    @property
    def speed_mps(self) -> float:
        """Speed (m/s)."""
    @property
    def acceleration_mps2(self) -> float:
        """Acceleration, smoothed from the speed (m/s²)."""

@final
class Sensors:
    """The groups of sensors that work."""

    @property
    def front(self) -> bool:
        """The front radar."""
    @property
    def surround(self) -> bool:
        """The short-range sensors on both sides."""
    @property
    def rear(self) -> bool:
        """The rear sensors."""

@final
class Track:
    """The perceived state of another vehicle, in the ego's frame at ``time_s``."""

    @property
    def id(self) -> int:
        """The number of the track, constant over its life."""
    @property
    def source(self) -> Literal["front", "surround", "rear"]:
        """The group of sensors that reports the track."""
    @property
    def status(self) -> Literal["tentative", "confirmed", "coasting"]:
        """The maturity of the track."""
    @property
    def time_s(self) -> float:
        """The time at which the state holds (s)."""
    @property
    def x_m(self) -> float:
        """Position of its centre (m), positive ahead."""
    @property
    def y_m(self) -> float:
        """Position of its centre (m), positive to the left."""
    @property
    def vx_mps(self) -> float:
        """Speed over ground along the axis of the ego (m/s)."""
    @property
    def vy_mps(self) -> float:
        """Speed over ground to the left of the ego (m/s)."""
    @property
    def covariance(self) -> list[list[float]]:
        """Covariance of ``x_m``, ``y_m``, ``vx_mps``, ``vy_mps`` (4 × 4)."""
    @property
    def heading_rad(self) -> float:
        """Heading relative to the ego's heading (rad)."""
    @property
    def length_m(self) -> float:
        """Length (m)."""
    @property
    def width_m(self) -> float:
        """Width (m)."""
    @property
    def class_probabilities(self) -> tuple[float, float, float, float]:
        """Probabilities of car, truck, motorcycle and background."""
    @property
    def existence(self) -> float:
        """Probability that the track belongs to a real object."""
    @property
    def lane(self) -> tuple[float, float, float]:
        """Probabilities of being in the lane left of the ego, in the ego's lane, and in the lane right of it."""

@final
class ControllerInput:
    """The input of a control step: the ego's odometry and the tracks of its sensors, never the truth."""

    @property
    def time_s(self) -> float:
        """Time (s)."""
    @property
    def time_ns(self) -> int:
        """Time (ns)."""
    @property
    def odometry(self) -> Odometry:
        """The motion of the ego."""
    @property
    def front(self) -> LeadVehicle | None:
        """The lead vehicle, or ``None`` if there is none."""
    @property
    def tracks(self) -> tuple[Track, ...]:
        """All tracks, including tentative ones."""
    @property
    def sensors(self) -> Sensors:
        """The groups of sensors that work."""
    def observation(self, max_tracks: int) -> bytes:
        """What the stepping interface observes, as 64-bit floats. ``closecall.gym.PolicyController`` reads it."""
