"""The outcome of a run, with typed fields. Units are part of the names."""

from __future__ import annotations

import html
import importlib
import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from . import _native
from ._errors import UsageError

Side = Literal["front", "rear", "left", "right"]
Phase = Literal["approach", "critical", "overtaking", "after"]


class _Readable:
    """Shows its numbers with five digits. Attributes have all of them."""

    def __repr__(self) -> str:
        return _short(self)


def _short(value: object) -> str:
    """Returns the ``repr`` of a value, with five digits of each number."""
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_short(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_short, value))}{',' if len(value) == 1 else ''})"
    if isinstance(value, _Readable):
        shown = (one.name for one in fields(value) if one.repr)  # type: ignore[arg-type]
        return f"{type(value).__name__}({', '.join(f'{name}={_short(getattr(value, name))}' for name in shown)})"
    return repr(value)


@dataclass(frozen=True, repr=False)
class Collision(_Readable):
    """The first contact of two vehicles."""

    #: Time of the first contact (s).
    time_s: float
    #: The names of the two vehicles.
    between: tuple[str, str]
    #: The side of each vehicle that was struck.
    struck_side: tuple[Side, Side]
    #: Which of the two closed the gap.
    closed_by: Literal["first", "second", "both"]
    #: The phase of the encounter.
    phase: Phase
    #: Relative speed at the contact (m/s).
    relative_speed_mps: float
    #: Change of velocity of each vehicle by the impact (m/s).
    delta_v_mps: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class Moment(_Readable):
    """A moment of the encounter, with its letter in the paper's figure."""

    moment: str
    letter: str | None
    #: Time (s).
    time_s: float
    #: The vehicle besides the ego: the vehicle ahead if it brakes, else the vehicle behind.
    vehicle: str | None = None


@dataclass(frozen=True, repr=False)
class Margins(_Readable):
    """The smallest margins of the ego, from the truth. An absent value is ``None``, and ``absent`` names the reason."""

    #: Smallest front time headway (s).
    min_thw_front_s: float | None
    #: Smallest rear time headway (s).
    min_thw_rear_s: float | None
    #: Smallest front gap, bumper to bumper (m).
    min_gap_front_m: float | None
    #: Smallest rear gap, bumper to bumper (m).
    min_gap_rear_m: float | None
    #: Smallest time to collision of the rear vehicle (s).
    min_ttc_rear_s: float | None
    #: Smallest time to collision with the lead vehicle (s).
    min_ttc_front_s: float | None
    #: When the ego's automatic emergency braking began for the first time (s).
    emergency_braking_at_s: float | None
    #: Largest deceleration (m/s²).
    max_deceleration_mps2: float
    #: Largest jerk (m/s³).
    max_jerk_mps3: float
    #: Largest speed deficit to the lead vehicle (m/s).
    max_speed_deficit_mps: float
    absent: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class MisSummary(_Readable):
    """What the margin increase system did. An absent value is ``None``, and ``absent`` names the reason."""

    #: Time of the first engagement (s).
    engaged_at_s: float | None
    #: Time of the release (s).
    released_at_s: float | None
    #: Front time headway at the engagement (s).
    thw_front_at_engagement_s: float | None
    #: Front time headway when the rear vehicle is at the critical distance (s).
    thw_front_at_critical_s: float | None
    #: Mean deceleration from the engagement to the critical distance (m/s²).
    mean_deceleration_mps2: float | None
    #: Whether the goal was in reach.
    goal_in_reach: bool | None
    #: Why the system engaged or, if it never did, the reason that held longest while it could have.
    reason: str
    #: All reasons in order of time: ``reason``, ``from_s``, ``until_s``.
    reasons: tuple[Mapping[str, Any], ...] = ()
    #: From when to when the reason of a system that never engaged was sought (s).
    decided_s: tuple[float, float] | None = None
    #: When and why the system was not available: ``from_s``, ``lasted_s``, ``reason``.
    unavailable: Mapping[str, Any] | None = None
    absent: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Promise(_Readable):
    """What became of the method's promise, from the true states. An absent value is ``None``, and ``absent`` names the reason."""

    #: What became of the gain of 2 s of front time headway, in words; ``None`` if nothing was promised.
    goal: str | None
    #: Whether the gain was in reach when a vehicle behind was near for the first time.
    in_reach: bool | None
    #: Front time headway at the critical distance, minus the smallest one until the vehicle behind was near (s).
    thw_raised_s: float | None
    #: Hardest braking of the ego within 2 s of the crossing of the vehicle behind (m/s²).
    crossing_braking_mps2: float | None
    absent: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Outcome(_Readable):
    """The outcome of a run. In a notebook it shows itself in the viewer of Rerun if ``rerun-sdk[notebook]`` is installed, and otherwise
    the figure that ``closecall plot`` draws."""

    scenario: str
    seed: int
    sample: int
    controller: str
    end: Literal["duration", "standstill", "collision"]
    #: Simulated time (s).
    duration_s: float
    #: The sampled values, with the units that their names state.
    parameters: Mapping[str, float | str]
    collisions: tuple[Collision, ...]
    moments: tuple[Moment, ...]
    margins: Margins
    mis: MisSummary
    promise: Promise | None = None
    #: Contacts of bumpers that are too slow to be collisions.
    touches: tuple[Collision, ...] = ()
    _json: str = field(repr=False, compare=False, default="")
    _run: _native.Run | None = field(repr=False, compare=False, default=None)

    @classmethod
    def from_json(cls, text: str, run: _native.Run | None = None) -> Outcome:
        """Returns the outcome that ``closecall run --format json`` prints."""
        keys = json.loads(text)
        return cls(
            **{key: keys[key] for key in ("scenario", "seed", "sample", "controller", "end", "duration_s", "parameters")},
            collisions=tuple(_collision(one) for one in keys["collisions"]),
            moments=tuple(Moment(**one) for one in keys["moments"]),
            margins=Margins(**_split(keys["margins"])),
            mis=MisSummary(**_tuples(_split(keys["mis"]))),
            touches=tuple(_collision(one) for one in keys.get("touches", [])),
            promise=None if keys["promise"] is None else Promise(**_split(keys["promise"])),
            _json=text,
            _run=run,
        )

    @property
    def collided(self) -> bool:
        """Whether any two vehicles collided."""
        return bool(self.collisions)

    def to_dict(self) -> dict[str, Any]:
        """Returns the keys of ``closecall run --format json``."""
        keys: dict[str, Any] = json.loads(self._json)
        return keys

    def trace(self) -> _native.Table:
        """Returns a table with a row for each control step (25 Hz) and actor.

        Its columns: ``time_s``, ``actor``, ``lane``, ``s_m``, ``d_m``, ``speed_mps``, ``acceleration_mps2``, ``gap_front_m``,
        ``thw_front_s``. ``pyarrow.table(t)``, ``polars.DataFrame(t)`` and ``pandas.DataFrame.from_arrow(t)`` read it
        without copying.
        """
        return self._of_run().trace()

    def tracks(self) -> _native.Table:
        """Returns a table with a row for each control step and track: the columns of ``closecall run --tracks``."""
        return self._of_run().tracks()

    def clusters(self) -> _native.Table:
        """Returns a table with a row for each cluster and each box of a scan: the columns of ``closecall run --clusters``.

        It has no rows if no LiDAR is simulated.
        """
        return self._of_run().clusters()

    def figure(self) -> str:
        """Returns the figure of the encounter (SVG), as ``closecall plot`` draws it."""
        return self._of_run().figure()

    def record(self, path: str | os.PathLike[str]) -> None:
        """Writes a recording (Rerun file), as ``closecall run --record`` does, without the raw data of the sensors.

        Raises :class:`UsageError` if the name of the file does not end with ``.rrd``.
        """
        if Path(path).suffix != ".rrd":
            raise UsageError(f"path: `{os.fspath(path)}` must end with .rrd")
        self._of_run().record(os.fspath(path))

    def viewer(self) -> Any:
        """Returns the viewer of Rerun with the recording, a widget for notebooks; ``None`` if ``rerun-sdk[notebook]`` is not installed."""
        try:
            rerun, notebook = map(importlib.import_module, ("rerun", "rerun.notebook"))
            widget = notebook.Viewer(use_global_recording=False)
        except ImportError:
            # The exception of a viewer that lacks its own packages is one, too.
            return None
        stream = rerun.RecordingStream("closecall")
        widget.add_recording(stream)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "run.rrd")
            self.record(file)
            stream.log_file_from_contents(file, file.read_bytes())
        stream.flush()
        return widget

    def _of_run(self) -> _native.Run:
        if self._run is None:
            raise ValueError("this outcome was read from JSON: only `closecall.run` leaves a trace and a figure")
        return self._run

    def _ipython_display_(self) -> None:
        widget = None if self._run is None else self.viewer()
        if widget is None:
            # IPython then asks for the HTML.
            raise NotImplementedError
        widget.display()

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self))}</pre>" if self._run is None else self.figure()


def _collision(keys: dict[str, Any]) -> Collision:
    between, struck = tuple(keys["between"]), tuple(keys["struck_side"])
    return Collision(**{**keys, "between": between, "struck_side": struck})


def _tuples(keys: dict[str, Any]) -> dict[str, Any]:
    """Makes tuples of lists."""
    return {key: tuple(value) if isinstance(value, list) else value for key, value in keys.items()}


def _split(keys: dict[str, Any]) -> dict[str, Any]:
    """Moves the reasons of absent values, whose keys end with ``_absent``, into a dictionary of their own."""
    suffix = "_absent"
    absent = {key.removesuffix(suffix): value for key, value in keys.items() if key.endswith(suffix)}
    return {**{key: value for key, value in keys.items() if not key.endswith(suffix)}, "absent": absent}
