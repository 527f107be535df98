"""Perceptions that are Python objects, in place of the built-in chain behind the rear LiDARs.

>>> import closecall as cc
>>> from closecall.perception import PerceivedTrack, PerceptionInput
>>> class Mine:
...     def track(self, input: PerceptionInput) -> list[PerceivedTrack]:
...         return []
>>> result = cc.campaign("low-thw-overtake", n=10, sensors="full", perception=Mine, no_gate=True)

The arrays of a scan are memory views, which ``numpy.asarray`` reads without copying. Positions are in the ego's frame: x ahead, y
to the left, z up, origin in the middle of the ego on the ground. ``docs/reference/perception.md`` explains every value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

__all__ = [
    "Camera",
    "ClassProbabilities",
    "Detection",
    "Detector",
    "EgoMotion",
    "Image",
    "Lidar",
    "LidarScan",
    "PerceivedTrack",
    "PerceptionInput",
    "PerceptionLike",
    "PerceptionSetup",
    "Pose",
    "Radar",
    "RadarDetection",
    "RadarScan",
    "Road",
    "Tracker",
]

#: A side of the ego, or of the road.
Side = Literal["left", "right"]

#: Probabilities of the classes, whose sum is 1. A class that is left out has 0.
ClassProbabilities = Mapping[Literal["car", "truck", "motorcycle", "background"], float]


@dataclass(frozen=True)
class Lidar:
    """A LiDAR that looks back."""

    name: str
    #: Mounting in the ego's frame (m).
    x_m: float
    y_m: float
    z_m: float
    #: Azimuth of the axis (rad): 0 is straight behind, positive to the ego's left.
    azimuth_rad: float
    #: Half of the horizontal field of view (rad).
    half_field_rad: float
    #: Range beyond which the sensor reports nothing of use (m).
    range_m: float
    #: Number of layers: beam = column · layers + layer.
    layers: int
    #: Number of columns.
    columns: int
    #: Time from a scan to the next (s).
    period_s: float


@dataclass(frozen=True)
class Radar:
    """A rear radar."""

    side: Side
    #: Mounting in the ego's frame (m).
    x_m: float
    y_m: float
    #: Azimuth of the axis (rad): 0 is straight behind, positive to the ego's left.
    azimuth_rad: float
    half_field_rad: float
    range_m: float
    #: Time from a scan to the next (s).
    period_s: float
    #: Standard deviations of a detection (m, rad, m/s).
    range_sd_m: float
    azimuth_sd_rad: float
    radial_sd_mps: float


@dataclass(frozen=True)
class Camera:
    """A rear camera, as its images have it."""

    name: str
    #: Lens in the ego's frame (m).
    x_m: float
    y_m: float
    z_m: float
    #: Positive if it looks down (rad).
    pitch_rad: float
    #: From straight behind, positive if it looks to the ego's left (rad).
    yaw_rad: float
    focal_px: float
    distortion_k1: float
    distortion_k2: float
    width: int
    height: int
    #: Time from an image to the next (s).
    period_s: float


@dataclass(frozen=True)
class Road:
    """The road, as the map shows it."""

    #: Number of lanes; lane 1 is the leftmost.
    lanes: int
    #: Width of the ego's lane (m).
    lane_width_m: float
    #: Width of each lane, from lane 1 on (m).
    lane_widths_m: Sequence[float]
    #: Curvature (1/m), positive to the left; ``None`` if it changes along the road.
    curvature_per_m: float | None
    speed_limit_mps: float
    overtaking_side: Side


@dataclass(frozen=True)
class PerceptionSetup:
    """What a perception is told before its first scan."""

    #: Time between two control steps (s): 0.04.
    control_step_s: float
    #: Time from a scan to the tracks that the controller gets (s).
    latency_s: float
    ego_length_m: float
    ego_width_m: float
    road: Road
    lidars: tuple[Lidar, ...]
    #: The left and the right rear radar, or none.
    radars: tuple[Radar, ...]
    #: The first rear camera; ``None`` without images.
    camera: Camera | None
    #: Further rear cameras; none without images.
    additional_cameras: tuple[Camera, ...]


@dataclass(frozen=True)
class EgoMotion:
    """The odometry of the ego, and its place on the map."""

    speed_mps: float
    acceleration_mps2: float
    yaw_rate_radps: float
    #: The lane of the ego; 1 is the leftmost.
    lane: int
    #: Offset from the centre of the lane (m), positive to the left.
    lane_offset_m: float


@dataclass(frozen=True)
class Pose:
    """The place of the ego in the frame of its first pose (m, m, rad), of the same odometry."""

    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(frozen=True)
class LidarScan:
    """A complete scan of a LiDAR. Each array has one element for each point."""

    #: Name of the LiDAR.
    sensor: str
    #: Sweep (ns).
    start_ns: int
    end_ns: int
    #: Side of the mirror that deflected the scan; ``None`` without a two-sided mirror.
    mirror_side: Literal["plus", "minus"] | None
    #: Positions in the ego's frame at the end of the scan (m, 32-bit floats).
    x_m: memoryview[float]
    y_m: memoryview[float]
    z_m: memoryview[float]
    #: Received power times the square of the range, with the losses of the window (32-bit floats).
    intensity: memoryview[float]
    #: Time for which the echo exceeds the detection threshold (ns, 32-bit floats).
    echo_pulse_width_ns: memoryview[float]
    #: Column · layers + layer (16-bit numbers).
    beam: memoryview[int]
    #: Time of the measurement after ``start_ns`` (ns, 32-bit numbers).
    offset_ns: memoryview[int]

    def __len__(self) -> int:
        return len(self.x_m)


@dataclass(frozen=True)
class RadarDetection:
    """A detection of a radar, which may be a mirror image in a guard rail."""

    #: Range from the radar (m).
    range_m: float
    #: 0 is straight behind, positive to the ego's left (rad).
    azimuth_rad: float
    #: Rate of change of the range (m/s), negative if the vehicle approaches.
    radial_mps: float


@dataclass(frozen=True)
class RadarScan:
    """A scan of a rear radar."""

    side: Side
    time_ns: int
    detections: tuple[RadarDetection, ...]


@dataclass(frozen=True)
class Image:
    """An image of a rear camera."""

    #: Name of the camera.
    camera: str
    time_ns: int
    width: int
    height: int
    #: Red, green and blue of each pixel, row by row from the top left.
    rgb: bytes


@dataclass(frozen=True)
class PerceptionInput:
    """The question of one control step: what the sensors have measured, never the truth."""

    #: Time of the control step, the end of its scans. The first 25 are negative.
    time_s: float
    time_ns: int
    odometry: EgoMotion
    pose: Pose
    #: The scans that have arrived, in the order of the LiDARs; a lost or dead one is missing.
    scans: tuple[LidarScan, ...]
    #: The scans of the rear radars that have arrived since the last question.
    radar_scans: tuple[RadarScan, ...]
    #: The image of the first rear camera; ``None`` if none is due.
    image: Image | None
    #: The images of further rear cameras that are due.
    additional_images: tuple[Image, ...]


@dataclass
class Detection:
    """A box for the built-in tracker, which follows the middle of the face that is nearest to the ego."""

    #: Middle of that face (m), -500 to 500.
    x_m: float
    y_m: float
    #: Of the two, 2 × 2, symmetric and positive definite (m²).
    covariance: Sequence[Sequence[float]]
    #: 0.1 to 40 m.
    length_m: float
    #: 0.1 to 5 m.
    width_m: float
    #: Number of points, at least 1.
    points: int
    #: Relative to the ego's heading, within ±π/2.
    heading_rad: float = 0.0
    #: Whether the extent is measured or assumed.
    length_is_seen: bool = False
    width_is_seen: bool = False
    #: Height of the highest point (m).
    top_m: float = 1.5
    #: Time at which the position holds, at most 0.2 s before the question; by default the question's time.
    time_ns: int | None = None
    #: By default nothing is known.
    class_probabilities: ClassProbabilities | None = None


@dataclass
class PerceivedTrack:
    """A track at the time of the question."""

    #: Whole number from 0, the same for the whole life of a track.
    id: int
    #: A controller acts on ``confirmed`` and ``coasting`` tracks.
    status: Literal["tentative", "confirmed", "coasting"]
    #: Centre of the box (m), -500 to 500.
    x_m: float
    y_m: float
    #: Velocity over ground along the ego's axes (m/s), -150 to 150.
    vx_mps: float
    vy_mps: float
    #: Of the four, 4 × 4, symmetric and positive definite.
    covariance: Sequence[Sequence[float]]
    #: 0.1 to 40 m.
    length_m: float
    #: 0.1 to 5 m.
    width_m: float
    #: Probability that there is an object.
    existence: float
    #: Relative to the ego's heading, within ±π.
    heading_rad: float = 0.0
    #: By default nothing is known.
    class_probabilities: ClassProbabilities | None = None


@runtime_checkable
class Detector(Protocol):
    """A perception that answers detections for the built-in tracker: any object with a method ``detect``.

    It may also have a method ``start(self, setup: PerceptionSetup) -> None``, which is called before the first scan.
    """

    def detect(self, input: PerceptionInput, /) -> Sequence[Detection]:
        """Returns the detections in the scans of a control step."""


@runtime_checkable
class Tracker(Protocol):
    """A perception that answers tracks: any object with a method ``track``.

    It may also have a method ``start(self, setup: PerceptionSetup) -> None``, which is called before the first scan.
    """

    def track(self, input: PerceptionInput, /) -> Sequence[PerceivedTrack]:
        """Returns the tracks at the time of a control step."""


#: ``built-in``, ``exec:COMMAND``, ``lib:PATH``, an object with ``detect`` or ``track``, or a class or function that creates one
#: without arguments. Each sample has a process with an object of its own.
PerceptionLike = str | Detector | Tracker | Callable[[], Detector | Tracker]
