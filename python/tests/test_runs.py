"""Runs, scenarios, traces and trajectory files."""

from __future__ import annotations

import json
from pathlib import Path

import pandas
import polars
import pyarrow
import pyarrow.parquet
import pytest
from support import SCENARIO, command

import closecall as cc


def test_a_run_is_that_of_the_command_line() -> None:
    outcome = cc.run(SCENARIO, controller="mis", seed=4, sample=2, sensors="object")
    done = command("run", SCENARIO, "--seed", "4", "--sample", "2", "--sensors", "object", "--format", "json")
    printed = json.loads(done.stdout)
    assert {key: printed[key] for key in outcome.to_dict()} == outcome.to_dict()
    assert outcome.margins.min_thw_rear_s == printed["margins"]["min_thw_rear_s"]
    assert outcome.mis.engaged_at_s == printed["mis"]["engaged_at_s"]


def test_an_absent_value_names_its_reason() -> None:
    outcome = cc.run(SCENARIO, controller="acc", sensors="object")
    assert outcome.mis.engaged_at_s is None
    assert outcome.mis.absent["engaged_at_s"]


def test_a_trace_is_read_without_pyarrow_in_between(tmp_path: Path) -> None:
    outcome = cc.run(SCENARIO, controller="mis", seed=4, sample=2, sensors="object")
    trace = outcome.trace()
    table = pyarrow.table(trace)
    file = tmp_path / "trace.parquet"
    command("run", SCENARIO, "--seed", "4", "--sample", "2", "--sensors", "object", "--trace", file)
    assert table.to_pylist() == pandas.read_parquet(file).replace({float("nan"): None}).to_dict("records")
    assert polars.DataFrame(trace).shape == pandas.DataFrame.from_arrow(trace).shape == (len(trace), 9)
    assert table.schema.field("gap_front_m").metadata == {b"unit": b"m"}
    assert table.column("time_s").to_pylist()[:: len(set(table.column("actor").to_pylist()))][1] == 0.04


def test_tracks_and_clusters_are_those_of_the_command_line(tmp_path: Path) -> None:
    scenario = cc.Scenario.load(SCENARIO, set={"duration-s": 2, "sensors.rear-camera.pipeline": "off"})
    outcome = cc.run(scenario, controller="mis", seed=4, sample=2, sensors="full")
    tracks, clusters = tmp_path / "tracks.parquet", tmp_path / "clusters.parquet"
    settings = ["--set", "duration-s=2", "--set", "sensors.rear-camera.pipeline=off"]
    run = ["run", SCENARIO, "--seed", "4", "--sample", "2", "--sensors", "full", *settings]
    command(*run, "--tracks", tracks, "--clusters", clusters)
    for table, file in [(outcome.tracks(), tracks), (outcome.clusters(), clusters)]:
        assert pyarrow.table(table).equals(pyarrow.parquet.read_table(file))
        assert len(table) > 50
    assert pyarrow.table(outcome.tracks()).schema.field("cov_x_vx").metadata == {b"unit": b"m\xc2\xb2/s"}


def test_a_notebook_shows_the_figure(tmp_path: Path) -> None:
    outcome = cc.run(SCENARIO, controller="mis", seed=4, sample=2, sensors="object")
    file = tmp_path / "figure.svg"
    command("plot", SCENARIO, "--seed", "4", "--sample", "2", "--sensors", "object", "-o", file)
    assert outcome._repr_html_() == outcome.figure() == file.read_text()


def test_samples_are_those_of_a_run() -> None:
    scenario = cc.Scenario.load(SCENARIO, set={"brake-mps2": 6})
    samples = scenario.sample(seed=4, n=3)
    assert samples[2] == cc.run(scenario, "acc", seed=4, sample=2, sensors="object").parameters
    assert samples[2]["brake-mps2"] == 6.0
    assert sorted(samples[0]) == sorted(scenario.parameters)
    assert SCENARIO in cc.Scenario.library()
    assert scenario.sample(n=0) == []
    for seed, n in [(-1, 1), (0, -3), (0.5, 1), (0, "three")]:
        with pytest.raises(cc.UsageError, match="expected a whole number from 0"):
            scenario.sample(seed=seed, n=n)  # type: ignore[arg-type]


def test_a_recording_has_the_name_of_one(tmp_path: Path) -> None:
    outcome = cc.run(SCENARIO, controller="mis", seed=4, sample=2, sensors="object")
    file = tmp_path / "run.txt"
    with pytest.raises(cc.UsageError, match="must end with .rrd"):
        outcome.record(file)
    assert not file.exists()


def test_a_bad_scenario_names_file_line_and_key(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    text = cc.Scenario.load(SCENARIO).text
    file.write_text(text.replace("duration-s = ", "duration-s = -", 1))
    with pytest.raises(cc.InputError) as raised:
        cc.Scenario.load(file)
    line = 1 + text[: text.index("duration-s")].count("\n")
    assert (raised.value.file, raised.value.line, raised.value.key) == (str(file), line, "duration-s")
    assert raised.value.exit_code == 3 and "duration-s" in str(raised.value)
    with pytest.raises(cc.FileError):
        cc.Scenario.load(tmp_path / "none.toml")
    with pytest.raises(cc.UsageError):
        cc.Scenario.load(SCENARIO, set={"no-such-key": 1})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"controller": "miss"}, "did you mean `mis`"),
        ({"controller": 3}, "expected a name"),
        ({"controller": "python:none@0"}, "controller of a Python program"),
        ({"sensors": "none"}, "expected `full`, `object` or `ground-truth`"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(cc.UsageError, match=message):
        cc.run(SCENARIO, **arguments)  # type: ignore[arg-type]


def test_trajectory_files_are_read_as_by_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "traffic.csv"
    assert command("traffic", "record", SCENARIO, "-n", "3", "--seed", "1", "--sensors", "object", "-o", file).returncode == 0
    for found, words in [
        (cc.lane_changes(file), ["traffic", "lane-changes"]),
        (cc.criticality(file, speed_limit_mps=30.0), ["traffic", "criticality", "--speed-limit-mps", "30"]),
        (cc.criticality(file, curvilinear=True), ["traffic", "criticality", "--curvilinear"]),
        (cc.fit(file, seed=2), ["traffic", "fit", "--seed", "2"]),
    ]:
        assert found == json.loads(command(*words, file, "--format", "json").stdout)
    for call, message in [
        (lambda: cc.lane_changes(file, criterion="jump"), "criterion=: `jump`, expected one of `peak`, `distance`, `gradient`"),  # type: ignore[arg-type]
        (lambda: cc.lane_changes(file, criterion="gradient"), "use `peak` or `distance` as criterion="),
        (lambda: cc.criticality(file, speed_limit_mps=-3), "speed_limit_mps=: `-3` is not a finite number above 0"),
        (lambda: cc.fit(file, seed=-1), "seed: expected a whole number"),
        (lambda: cc.fit([]), "files: expected at least one trajectory file"),
    ]:
        with pytest.raises(cc.UsageError, match=message):
            call()
    rows = file.read_text().splitlines()
    rows[3] = rows[3].replace(rows[3].split(",")[2], "x", 1)
    file.write_text("\n".join(rows) + "\n")
    with pytest.raises(cc.InputError) as raised:
        cc.lane_changes(file)
    assert raised.value.file == str(file) and raised.value.line == 4 and raised.value.key
    assert "drop_bad_rows= skips such rows" in str(raised.value) and "--" not in str(raised.value)
    with pytest.raises(cc.FileError):
        cc.criticality(tmp_path / "none.csv")


def test_fitted_distributions_name_the_call(tmp_path: Path) -> None:
    file, fitted = tmp_path / "traffic.csv", tmp_path / "fitted.toml"
    assert command("traffic", "record", SCENARIO, "-n", "3", "--seed", "1", "--sensors", "object", "-o", file).returncode == 0
    cc.fit([file], output=fitted)
    assert f"closecall.fit(files=['{file}'], output='{fitted}'" in fitted.read_text()
