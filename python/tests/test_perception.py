"""Perceptions that are Python objects: they drive the headline, and whatever one does wrong costs its samples only."""

from __future__ import annotations

import ctypes
import os
import re
import time
from pathlib import Path
from typing import Any

import pyarrow
import pytest
from support import SCENARIO, command

import closecall as cc
from closecall.perception import ClassProbabilities, Detection, PerceivedTrack, PerceptionInput, PerceptionSetup

OFF = {"sensors.rear-camera.pipeline": "off", "expects": "[]"}
SHORT = {**OFF, "duration-s": 2}
COMMON: dict[str, Any] = {"seed": 1, "sensors": "full", "no_gate": True, "no_validity_checks": True, "record": "failures:0"}
LENGTH_M = 4.6
COVARIANCE = [[0.04, 0.0, 0.0, 0.0], [0.0, 0.04, 0.0, 0.0], [0.0, 0.0, 0.25, 0.0], [0.0, 0.0, 0.0, 0.25]]


def face(input: PerceptionInput, setup: PerceptionSetup) -> tuple[float, float, float, int] | None:
    """The face of the nearest vehicle in the lanes: its middle, the mean age of its points, and their number."""
    road, odometry = setup.road, input.odometry
    left_m = sum(road.lane_widths_m[: odometry.lane]) - 0.5 * road.lane_width_m - odometry.lane_offset_m
    right_m = left_m - sum(road.lane_widths_m)
    for scan in input.scans:
        ends = zip(scan.x_m, scan.y_m, scan.z_m, scan.offset_ns, strict=True)
        points = [
            (x_m, y_m, 1e-9 * (scan.end_ns - scan.start_ns - offset_ns))
            for x_m, y_m, z_m, offset_ns in ends
            if 0.35 < z_m < 1.6 and right_m + 0.3 < y_m < left_m - 0.3
        ]
        front_m = max((x_m for x_m, _, _ in points), default=0.0)
        near = [point for point in points if point[0] > front_m - 0.8]
        if len(near) >= 3:
            across = [y_m for _, y_m, _ in near]
            return front_m, 0.5 * (min(across) + max(across)), sum(age_s for _, _, age_s in near) / len(near), len(near)
    return None


class Follows:
    """Follows the nearest vehicle. Its speed is the mean over half a second."""

    def __init__(self, memory_s: float = 0.5) -> None:
        self.memory_s = memory_s
        self.places: dict[float, float] = {}

    def start(self, setup: PerceptionSetup) -> None:
        self.setup = setup
        assert [lidar.name for lidar in setup.lidars] == ["rear-lidar"] and not setup.radars and setup.camera is None
        print("what it prints is no answer")

    def track(self, input: PerceptionInput) -> list[PerceivedTrack]:
        nearest = face(input, self.setup)
        if nearest is None:
            return []
        x_m, y_m, age_s, _ = nearest
        at_s, at_m = input.time_s - age_s, input.pose.x_m + x_m
        if self.places and abs(at_m - self.places[max(self.places)]) > 10.0:
            self.places.clear()
        self.places[at_s] = at_m
        self.places = {past_s: past_m for past_s, past_m in self.places.items() if at_s - past_s < self.memory_s}
        first_s = min(self.places)
        if at_s - first_s <= 0.2:
            return []
        speed_mps = (at_m - self.places[first_s]) / (at_s - first_s)
        return [made(x_m=x_m + age_s * speed_mps - 0.5 * LENGTH_M, y_m=y_m, vx_mps=speed_mps)]


def made(**changes: Any) -> PerceivedTrack:
    values: dict[str, Any] = {"id": 7, "status": "confirmed", "x_m": -50.0, "y_m": 0.0, "vx_mps": 30.0, "vy_mps": 0.0}
    values |= {"covariance": COVARIANCE, "length_m": LENGTH_M, "width_m": 1.85, "existence": 0.95}
    values |= {"class_probabilities": {"car": 0.9, "background": 0.1}}
    return PerceivedTrack(**{**values, **changes})


class Detects:
    """Answers the nearest face as a detection."""

    def start(self, setup: PerceptionSetup) -> None:
        self.setup = setup

    def detect(self, input: PerceptionInput) -> tuple[Detection, ...]:
        nearest = face(input, self.setup)
        if nearest is None:
            return ()
        x_m, y_m, age_s, points = nearest
        covariance = [[0.02, 0.0], [0.0, 0.04]]
        time_ns = input.time_ns - round(1e9 * age_s)
        classes: ClassProbabilities = {"car": 0.9, "background": 0.1}
        return (
            Detection(
                x_m, y_m, covariance, LENGTH_M, 1.85, points, time_ns=time_ns, class_probabilities=classes
            ),
        )


def in_a_line(text: str) -> str:
    """A message without the frame and the line breaks of a terminal."""
    return " ".join(text.replace("│", " ").split())


def following() -> Follows:
    return Follows()


@pytest.mark.parametrize("perception", [Follows, Detects])
def test_an_object_drives_the_headline(perception: Any) -> None:
    scenario = cc.Scenario.load(SCENARIO, set={**OFF, "duration-s": 12})
    outcome = cc.run(scenario, seed=1, sensors="full", perception=perception)
    assert outcome.mis.engaged_at_s is not None and outcome.mis.engaged_at_s > 1.0
    rows = pyarrow.table(outcome.tracks()).to_pylist()
    of_rear = [row for row in rows if row["source"] == "rear" and row["actor"] == "rear" and row["status"] != "tentative"]
    errors = [row["error_vx_mps"] for row in of_rear if row["time_s"] >= 5.0]
    assert len(errors) > 100 and (sum(error * error for error in errors) / len(errors)) ** 0.5 < 1.5


def test_a_class_an_object_and_a_function_are_the_same_and_no_run_has_the_memory_of_another() -> None:
    scenario = cc.Scenario.load(SCENARIO, set={**OFF, "duration-s": 6})
    kept = Follows()
    outcomes = [cc.run(scenario, seed=1, sensors="full", perception=one) for one in (Follows, kept, kept, following)]
    assert all(outcome.margins == outcomes[0].margins and outcome.mis == outcomes[0].mis for outcome in outcomes)
    assert cc.run(scenario, seed=1, sensors="full").mis != outcomes[0].mis, "the perception decides"
    assert not kept.places


def test_an_object_gets_images_and_the_scans_of_radars() -> None:
    class Looks(Follows):
        images = 0
        scans = 0

        def start(self, setup: PerceptionSetup) -> None:
            self.setup = setup
            assert setup.camera is not None and [radar.side for radar in setup.radars] == ["left", "right"]

        def track(self, input: PerceptionInput) -> list[PerceivedTrack]:
            if input.image is not None:
                self.images += 1
                assert self.setup.camera is not None and input.image.width == self.setup.camera.width
                assert len(input.image.rgb) == 3 * input.image.width * input.image.height
                [left], [image] = self.setup.additional_cameras, input.additional_images
                assert (left.name, left.y_m, image.camera) == ("left", 0.5, "left")
                assert (image.width, image.height) == (left.width, left.height) and input.image.camera == "rear-camera"
            self.scans += len(input.radar_scans)
            assert all(abs(one.radial_mps) < 80.0 for scan in input.radar_scans for one in scan.detections)
            if input.time_s > 1.5:
                raise RuntimeError(f"{self.images} images, {self.scans > 30} scans")
            return super().track(input)

    more = {"sensors.perception-image-hz": 5, "sensors.perception-image-step": 8, "sensors.rear-radar": "{ range-m = 300 }"}
    more["sensors.additional-rear-cameras"] = '[{ name = "left", left-m = 0.5, resolution = { width-px = 2000 } }]'
    with pytest.raises(cc.SampleError, match="RuntimeError: 13 images, True scans"):
        cc.run(cc.Scenario.load(SCENARIO, set={**SHORT, **more}), seed=1, sensors="full", perception=Looks)


class Misbehaves:
    """Misbehaves at the 30th question, at 0.16 s."""

    def __init__(self, fault: str) -> None:
        self.fault = fault
        self.asked = 0

    def start(self, setup: PerceptionSetup) -> None:
        if self.fault == "starts-not":
            raise ValueError("no licence")

    def track(self, input: PerceptionInput) -> Any:
        self.asked += 1
        if self.asked < 30:
            return []
        if self.fault == "raises":
            raise ZeroDivisionError("of the perception")
        if self.fault == "surrogate":
            raise ValueError("a name with \udcff")
        if self.fault == "exit-0":
            raise SystemExit(0)
        if self.fault == "exit-9":
            os._exit(9)
        if self.fault == "crash":
            ctypes.string_at(0)
        if self.fault == "hang":
            time.sleep(3_600.0)
        if self.fault == "leak":
            kept = [bytearray(b"x" * (1 << 20)) for _ in range(1 << 20)]
            del kept
        if self.fault == "many":
            return [made(id=number) for number in range(257)]
        if self.fault == "twice":
            return [made(), made()]
        nan = [list(row) for row in COVARIANCE]
        nan[2][1] = float("nan")
        changes: dict[str, Any] = {
            "nan": {"covariance": nan},
            "infinite": {"vx_mps": float("-inf")},
            "size": {"covariance": COVARIANCE[:3]},
            "status": {"status": "sure"},
            "class": {"class_probabilities": {"bus": 1.0}},
            "object": {"x_m": object},
        }
        return {"none": None, "number": [3.0]}.get(self.fault, [made(**changes.get(self.fault, {}))])


#: The faults, and what the message of each holds.
FAULTS = {
    "starts-not": "ValueError: no licence",
    "raises": "ZeroDivisionError: of the perception",
    "surrogate": "ValueError: a name with ?",
    "exit-0": "the perception ended its process (exit status: 0)",
    "exit-9": "the perception ended its process (exit status: 9)",
    "crash": "the perception ended its process (signal: 11 (SIGSEGV)); it last wrote: ",
    "hang": "hangs: no answer in twice the 500 ms allowed",
    "leak": "holds more than the 256 MiB of memory allowed",
    "many": "the perception answered: `tracks` must be a list of at most 256",
    "twice": "`tracks[1].id` must be a number that no other track of the answer has",
    "nan": "the perception answered: `tracks[0].covariance[2][1]` must be a number, it is NaN",
    "infinite": "`tracks[0].vx_mps` must be a number from -150 to 150, it is -inf",
    "size": "`tracks[0].covariance` must be a list of 4 lists of 4 numbers",
    "status": '`tracks[0].status` must be "tentative", "confirmed" or "coasting", it is sure',
    "class": "`tracks[0].class.bus` must be a class",
    "object": "TypeError: `x_m` is <class 'object'>: it must be a number",
    "none": "TypeError: `track` answered None: it must be a list of `closecall.perception.PerceivedTrack`",
    "number": "TypeError: `track` answered 3.0 in its list",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_costs_its_sample_and_is_named(fault: str) -> None:
    limits = {"sensors.perception-timeout-ms": 500 if fault == "hang" else 60_000, "sensors.perception-memory-mib": 256 if fault == "leak" else 1_024}
    scenario = cc.Scenario.load(SCENARIO, set={**SHORT, **limits})
    with pytest.raises(cc.SampleError) as raised:
        cc.run(scenario, seed=1, sensors="full", perception=Misbehaves(fault))
    text = str(raised.value)
    assert FAULTS[fault] in text and "`python:Misbehaves@" in text, text
    assert f"failed to perceive at {'-1.00' if fault == 'starts-not' else '0.16'} s" in text, text
    if fault == "raises":
        # The traceback names the line, and no frame of the package.
        assert 'raise ZeroDivisionError("of the perception")' in text and "_perceive.py" not in text


class Late(Follows):
    """Fails at 0.52 s in samples in which the ego is fast at the start."""

    is_fast: bool | None = None

    def track(self, input: PerceptionInput) -> list[PerceivedTrack]:
        if self.is_fast is None:
            self.is_fast = input.odometry.speed_mps > 32.2
        if self.is_fast and input.time_s > 0.5:
            os.abort()
        return super().track(input)


def constant() -> Any:
    class Constant:
        def step(self, input: cc.ControllerInput) -> float:
            return 0.0

    return Constant()


def test_a_campaign_has_the_same_bytes_whoever_runs_its_samples(tmp_path: Path) -> None:
    scenario = cc.Scenario.load(SCENARIO, set=SHORT)
    kinds: dict[str, dict[str, Any]] = {"one": {"jobs": 1}, "two": {"jobs": 2}, "isolated": {"jobs": 2, "isolate": True}}
    results = {}
    for name, options in kinds.items():
        results[name] = cc.campaign(scenario, 8, controller=constant(), perception=Late, out=tmp_path / name, **options, **COMMON)
    assert {result.exit_code for result in results.values()} == {5}
    assert 0 < results["one"].errors < 8
    tables = [pyarrow.table(result.outcomes()) for result in results.values()]
    assert tables[0].equals(tables[1]) and tables[0].equals(tables[2])


def test_a_campaign_is_resumed_with_the_same_perception_only(tmp_path: Path) -> None:
    scenario = cc.Scenario.load(SCENARIO, set=SHORT)
    out = tmp_path / "out"
    assert cc.campaign(scenario, 2, perception=Follows(), out=out, **COMMON).errors == 0
    assert cc.campaign(scenario, 2, perception=Follows(), out=out, resume=True, **COMMON).errors == 0
    with pytest.raises(cc.UsageError, match="python:Follows@"):
        cc.campaign(scenario, 2, perception=Follows(0.4), out=out, resume=True, **COMMON)
    # Without its program the folder can be read, and its samples cannot be run again.
    replayed = command("replay", out, "1")
    assert replayed.returncode == 5 and "can be run from there only" in in_a_line(replayed.stderr), replayed.stderr


def test_what_cannot_perceive_is_refused() -> None:
    wrong: list[Any] = [7, object(), constant(), type("Both", (Follows, Detects), {})]
    for perception in wrong:
        with pytest.raises(cc.UsageError, match="an object with a method `detect` or a method `track`"):
            cc.run(SCENARIO, sensors="full", perception=perception)
    with pytest.raises(cc.InputError, match="a program perceives in mode `full` only") as raised:
        cc.run(SCENARIO, sensors="object", perception=Follows)
    assert raised.value.exit_code == 3
    with pytest.raises(cc.UsageError, match="on a cluster, name a command or a library"):
        cc.campaign(SCENARIO, 2, ray="local", perception=Follows, **COMMON)
    with pytest.raises(cc.FileError, match=re.escape("failed to read /no/such.so")):
        cc.run(SCENARIO, sensors="full", perception="lib:/no/such.so")
    with pytest.raises(cc.SampleError, match="must have a method `detect` or a method `track`"):
        cc.run(SCENARIO, sensors="full", perception=lambda: 7)  # type: ignore[arg-type]
    refused = command("run", SCENARIO, "--set", 'sensors.perception="python:Mine@1"')
    assert refused.returncode == 3 and "this program has none" in in_a_line(refused.stderr), refused.stderr


class Unpicklable(Follows):
    def __reduce__(self) -> Any:
        raise TypeError("it holds a device")


def test_an_object_that_cannot_be_given_to_another_process_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(cc.InputError, match="a perception cannot be given to another process.*it holds a device"):
        cc.run(SCENARIO, sensors="full", perception=Unpicklable())
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(cc.UsageError, match=r"an object as perception needs cloudpickle: pip install"):
        cc.run(SCENARIO, sensors="full", perception=Follows)
