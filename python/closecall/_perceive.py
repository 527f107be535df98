"""Perceptions that are Python objects run in processes of their own, which speak the protocol of perception processes.

Closecall starts a process for each sample. The object is pickled by value, as a controller with ``isolate=True``. A process that
crashes, ends, hangs or needs too much memory costs its sample.
"""

from __future__ import annotations

import base64
import json
import math
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from typing import Any, TypeVar, cast

from . import _host, _native
from ._controller import hosted_name
from ._errors import UsageError
from .perception import (
    Camera,
    Detection,
    EgoMotion,
    Image,
    Lidar,
    LidarScan,
    PerceivedTrack,
    PerceptionInput,
    PerceptionLike,
    PerceptionSetup,
    Pose,
    Radar,
    RadarDetection,
    RadarScan,
    Road,
)

#: Starts the process of a run, whose first argument is the file of the object. The working folder holds no modules for it.
START = "import sys; sys.path[:] = filter(None, sys.path); from closecall._perceive import main; raise SystemExit(main())"

Known = TypeVar("Known")

#: The version of the protocol.
PROTOCOL = 1

#: What each method answers: the key of the list, and the type of its elements.
METHODS: dict[str, tuple[str, type[Detection] | type[PerceivedTrack]]] = {
    "detect": ("detections", Detection),
    "track": ("tracks", PerceivedTrack),
}


def methods(perception: object) -> list[str]:
    """Returns the methods of a perception that answer scans. It must have one."""
    return [name for name in METHODS if callable(getattr(perception, name, None))]


@contextmanager
def perceiving(perception: PerceptionLike | None) -> Iterator[list[str]]:
    """Gives a perception a name, for as long as the context lasts, and returns the settings of a scenario that name it."""
    if perception is None:
        yield []
    elif isinstance(perception, str):
        yield [_setting(perception)]
    else:
        _check(perception)
        name = hosted_name(perception)
        parcel = _host.parcel({name: perception}, _host.Limits(), "a perception", "an object as perception")
        with parcel.file(START) as words:
            _native.register_perception(name, words)
            try:
                yield [_setting(name)]
            finally:
                _native.unregister_perception(name)


def _setting(perception: str) -> str:
    # A text of JSON is one of TOML.
    return f"sensors.perception={json.dumps(perception)}"


def _check(perception: object) -> None:
    """Refuses what cannot perceive. What a function creates is seen in the process of a run only."""
    found = methods(perception)
    is_creator = callable(perception) and not isinstance(perception, type)
    if len(found) != 1 and not (is_creator and not found):
        raise UsageError(
            "perception: expected a name, an object with a method `detect` or a method `track`, or a class or function that creates "
            f"one, not {perception!r}"
        )


def main() -> int:
    """Answers the messages of a run with the object of the file that the first argument names."""
    _host.prepare()
    # What the object prints must not be taken for an answer. A text may hold a lone surrogate, which UTF-8 cannot.
    with os.fdopen(os.dup(1), "w", encoding="utf-8", errors="replace") as answers:
        os.dup2(2, 1)
        own = _Own(sys.argv[1])
        sys.argv[:] = [""]
        for line in sys.stdin.buffer:
            answers.write(json.dumps(own.answer(json.loads(line)), ensure_ascii=False) + "\n")
            answers.flush()
    return 0


class _Own:
    """The object of a run. Whatever it raises is the answer to the next question."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._failure: str | None = None
        self._method: Callable[[PerceptionInput], Any] | None = None
        self._name = "track"

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the answer to a message."""
        if message["type"] == "hello":
            return self._greeted(message)
        answer: dict[str, Any] = {"time_ns": message["time_ns"]}
        key, kind = METHODS[self._name]
        try:
            if self._failure is None and self._method is not None:
                objects = self._method(_input(message))
                return answer | {key: _list(self._name, objects, kind)}
        except Exception as error:
            self._failure = described(error)
        return answer | {"error": self._failure}

    def _greeted(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Creates the object, and returns the greeting."""
        name, version = "", ""
        try:
            [(full, given)] = _host.unpacked(self._file).items()
            name, _, version = full.partition(":")[2].partition("@")
            perception = given if methods(given) and not isinstance(given, type) else given()
            found = methods(perception)
            if len(found) != 1:
                raise TypeError(f"{perception!r} must have a method `detect` or a method `track`")
            [self._name] = found
            start = getattr(perception, "start", None)
            if callable(start):
                start(_setup(message))
            self._method = getattr(perception, self._name)
        except Exception as error:
            self._failure = described(error)
        greeting = {"type": "hello", "protocol": PROTOCOL, "answers": METHODS[self._name][0]}
        return greeting | {"name": name, "version": version}


def described(error: Exception) -> str:
    """Returns an exception as text: its type and message, then the traceback without the frames of this module."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename != __file__]
    lines = traceback.format_exception_only(type(error), error)
    shown = ["Traceback (most recent call last):\n", *traceback.format_list(frames), *lines] if frames else lines
    return f"{''.join(lines).strip()}\n{''.join(shown).rstrip()}"


def _setup(message: Mapping[str, Any]) -> PerceptionSetup:
    camera = message.get("camera")
    return PerceptionSetup(
        control_step_s=message["control_step_s"],
        latency_s=message["latency_s"],
        ego_length_m=message["ego"]["length_m"],
        ego_width_m=message["ego"]["width_m"],
        road=_known(Road, message["road"]),
        lidars=tuple(_known(Lidar, one) for one in message["lidars"]),
        radars=tuple(_known(Radar, one) for one in message.get("radars") or ()),
        camera=None if camera is None else _known(Camera, camera),
        additional_cameras=tuple(_known(Camera, one) for one in message.get("additional_cameras") or ()),
    )


def _input(message: Mapping[str, Any]) -> PerceptionInput:
    image = message.get("image")
    return PerceptionInput(
        time_s=message["time_s"],
        time_ns=message["time_ns"],
        odometry=_known(EgoMotion, message["odometry"]),
        pose=_known(Pose, message["pose"]),
        scans=tuple(map(_scan, message["scans"])),
        radar_scans=tuple(map(_radar_scan, message.get("radar_scans") or ())),
        image=None if image is None else _image(image),
        additional_images=tuple(map(_image, message.get("additional_images") or ())),
    )


def _image(message: Mapping[str, Any]) -> Image:
    return _known(Image, {**message, "rgb": base64.b64decode(message["rgb"])})


def _scan(message: Mapping[str, Any]) -> LidarScan:
    singles = ("x_m", "y_m", "z_m", "intensity", "echo_pulse_width_ns")
    codes = {**dict.fromkeys(singles, "f"), "beam": "H", "offset_ns": "I"}
    arrays = {name: memoryview(base64.b64decode(message[name])).cast(cast(Any, code)) for name, code in codes.items()}
    return _known(LidarScan, {**message, **arrays})


def _radar_scan(message: Mapping[str, Any]) -> RadarScan:
    detections = tuple(_known(RadarDetection, one) for one in message["detections"])
    return _known(RadarScan, {**message, "detections": detections})


def _known(kind: Callable[..., Known], message: Mapping[str, Any]) -> Known:
    """Returns an object of the keys that its class has: Closecall may add others."""
    return kind(**{field.name: message[field.name] for field in fields(cast(Any, kind))})


def _list(method: str, objects: Any, kind: type) -> list[dict[str, Any]]:
    """Returns the objects of an answer as the protocol has them."""
    try:
        listed = list(objects)
    except TypeError:
        raise TypeError(f"`{method}` answered {objects!r}: it must be a list of `closecall.perception.{kind.__name__}`") from None
    for one in listed:
        if not isinstance(one, kind):
            raise TypeError(f"`{method}` answered {one!r} in its list: it must be a `closecall.perception.{kind.__name__}`")
    return [_object(one) for one in listed]


def _object(one: Any) -> dict[str, Any]:
    """Returns a detection or a track as the protocol has it. What is ``None`` is left out."""
    values = {field.name: getattr(one, field.name) for field in fields(one)}
    values["class"] = values.pop("class_probabilities")
    return {name: _plain(name, value) for name, value in values.items() if value is not None}


def _plain(name: str, value: Any) -> Any:
    """Returns a value as JSON has it. A number that is not finite becomes a word, which is refused with its place."""
    if isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(name, item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        # An array or a number of NumPy.
        return _plain(name, value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(name, item) for item in cast("list[Any]", value)]
    if isinstance(value, float):
        return value if math.isfinite(value) else {math.inf: "inf", -math.inf: "-inf"}.get(value, "NaN")
    raise TypeError(f"`{name}` is {value!r}: it must be a number, a text, a truth value, or a list of numbers")
