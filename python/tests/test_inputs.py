"""What a user gets wrong: each is an exception of the right class, and says what is expected."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pyarrow
import pytest
from support import SCENARIO, command

import closecall as cc
import closecall.gym as ccgym


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n": -3}, "`-3` is negative: a whole number of 1 or more is needed"),
        ({"n": 2.5}, "`2.5` is not a whole number"),
        ({"seed": -1}, "seed: expected a whole number from 0 to 2\\^64 - 1, not -1"),
        ({"seed": True}, "seed: expected a whole number"),
        ({"seed": "one"}, "seed: expected a whole number"),
        ({"arms": []}, "arms: expected a list of controllers"),
        ({"arms": "acc"}, "arms: expected a list of controllers"),
        ({"progress": 3}, "progress: expected a function of two numbers"),
        ({"gate": "upper(inducd) <= 0.01"}, "`inducd` is not a measure"),
        ({"controller": 3}, "controller: expected a name, an object with a method `step`"),
        ({"sample_timeout_s": float("nan")}, "sample_timeout_s: expected a text, a finite number.*not nan"),
        ({"sample_timeout_s": "10"}, "sample_timeout_s=: `\"10\"` is not a finite number above 0"),
        ({"sample_timeout_s": 0}, "sample_timeout_s=: `0` is not a finite number above 0"),
        ({"sensors": "lidar"}, "sensors=: `lidar`, expected one of `full`, `object`, `ground-truth`"),
        ({"design": "subset"}, "design=: `subset` is not a sampling design"),
        ({"jobs": 0}, "jobs=: `0` is not a whole number from 1 to 1024"),
        ({"preset": "weekly"}, "preset=: `weekly`, expected `pr` or `nightly`"),
        ({"time_budget": "soon"}, "time_budget=: `soon` is not a time above 0"),
        ({"record": "best"}, "record=: `best` is not"),
        ({"record": "worst:2"}, "record: the files are kept in the folder of the campaign: name one with `out`"),
        ({"partition": "1/2"}, "partition: the files are kept in the folder of the campaign: name one with `out`"),
        ({"check_share": 1.5}, "check_share=: `1.5` is not a number above 0 and up to 1"),
        ({"retry_crashed": 101}, "retry_crashed=: `101` is not a whole number from 0 to 100"),
        ({"paired": "yes"}, "paired=: \"yes\" is not allowed: expected True or False"),
        ({"max_induced": -1}, "max_induced=: `-1` is not allowed: expected a whole number, 0 or more"),
        ({"max_collisions": 2.5}, "max_collisions=: `2.5` is not allowed: expected a whole number, 0 or more"),
        ({"max_induced": {1}}, "max_induced: expected a text"),
        ({"until_certain": True}, "until_certain= needs max_probability="),
        ({"confidence": 0.9}, "confidence= needs max_probability="),
        ({"retry_errors": True}, "retry_errors= needs resume="),
        ({"no_gate": True, "max_harm": 1}, "no_gate= cannot be used with max_harm="),
        ({"judge_seed": 3, "seed": 4}, "judge_seed= cannot be used with seed="),
        ({"no_validity_checks": True, "check_at_most": 3}, "no_validity_checks= cannot be used with check_at_most="),
        ({"ray": "local", "jobs": 2}, "ray= cannot be used with jobs="),
        ({"partition": "1/2", "time_budget": "9s", "out": "unused"}, "time_budget= cannot be used with partition="),
    ],
)
def test_a_wrong_argument_of_a_campaign_is_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(cc.UsageError, match=message) as raised:
        cc.campaign(SCENARIO, **{"n": 2, "sensors": "object", **arguments})
    assert raised.value.exit_code == 2 and "--help" not in str(raised.value)


def test_numbers_of_numpy_and_paths_are_keywords(tmp_path: Path) -> None:
    result = cc.campaign(SCENARIO, np.int64(2), sensors="object", check_share=np.float32(0.5), judge_seed=7, out=tmp_path / "out")  # type: ignore[arg-type]
    assert result.samples == 2 and result.report["seed"] == 7
    again = cc.campaign(SCENARIO, 2, sensors="object", check_share=0.5, seed=7, out=tmp_path / "again")
    assert pyarrow.table(result.outcomes()).equals(pyarrow.table(again.outcomes()))


def test_a_report_names_the_call(tmp_path: Path) -> None:
    cc.campaign(SCENARIO, 2, sensors="object", no_gate=True, out=tmp_path / "out")
    call = f"closecall.campaign(scenarios=['{SCENARIO}'], n=2, out='{tmp_path}/out', seed=0, design='random', sensors='object', no_gate=True)"
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["command"] == [call]


def test_a_list_of_a_scenario_is_replaced_and_its_elements_are_set() -> None:
    cameras = [{"name": "left", "yaw-deg": 40, "pipeline": "off"}, {"name": "right", "yaw-deg": -40.5}]
    settings = {"sensors.additional-rear-cameras": cameras, "sensors.additional-rear-cameras[1].yaw-deg": -30}
    text = cc.Scenario.load("low-thw-overtake", set=settings).text
    assert '"pipeline" = "off"' in text and "-30" in text and "-40.5" not in text
    with pytest.raises(cc.UsageError, match="the list `actor` has the elements 0 to 2, named `ego`, `front`, `rear`"):
        cc.Scenario.load("low-thw-overtake", set={"actor[3].id": "x"})
    with pytest.raises(cc.InputError, match="unknown field `yaw`"):
        cc.Scenario.load("low-thw-overtake", set={"sensors.additional-rear-cameras": [{"name": "left", "yaw": 40}]})


def test_a_campaign_needs_a_scenario() -> None:
    with pytest.raises(cc.UsageError, match="scenarios: none is named"):
        cc.campaign([], 2)
    with pytest.raises(cc.UsageError, match="set: expected a dictionary"):
        cc.Scenario.load(SCENARIO, set=["brake-mps2=6"])  # type: ignore[arg-type]


def test_one_gate_may_be_given_as_a_text() -> None:
    gate = "count(ego_collided) <= 2"
    reports = [cc.campaign(SCENARIO, 2, sensors="object", gate=given).report for given in (gate, [gate])]
    assert "ego_collided" in str(reports[0]) and {**reports[0], "wall_s": None} == {**reports[1], "wall_s": None}


def test_a_folder_that_exists_is_not_written_over(tmp_path: Path) -> None:
    options: dict[str, Any] = {"sensors": "object", "no_gate": True, "out": tmp_path / "out"}
    cc.campaign(SCENARIO, 2, **options)
    with pytest.raises(cc.UsageError, match="it holds the results of another campaign"):
        cc.campaign(SCENARIO, 3, seed=7, **options)


def test_a_program_that_cannot_be_started_is_refused_by_a_run_as_by_the_command() -> None:
    with pytest.raises(cc.InputError, match="`no-such-program` could not be started"):
        cc.run(SCENARIO, controller="exec:no-such-program", sensors="object")
    assert command("run", SCENARIO, "--controller", "exec:no-such-program").returncode == 3


def test_the_seed_of_the_command_is_explained() -> None:
    done = command("campaign", SCENARIO, "--seed=-1")
    assert done.returncode == 2 and "`-1` is not a whole number from 0 to 18446744073709551615" in done.stderr


def test_without_gymnasium_the_error_says_how_to_install_it() -> None:
    program = "import sys; sys.modules['gymnasium'] = None; import closecall.gym"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and 'pip install "closecall[gym]"' in done.stderr


@pytest.fixture
def env() -> ccgym.EncounterEnv:
    made = ccgym.EncounterEnv(SCENARIO)
    made.reset(seed=1, options={"sample": 7})
    return made


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([0.0, 1.0], "the action has the shape \\(2,\\): expected one acceleration"),
        ([], "the action has the shape \\(0,\\)"),
        ("fast", "the action 'fast' is not a number: expected one acceleration"),
        ({"a": 1.0}, "is not a number"),
    ],
)
def test_a_wrong_action_changes_nothing(env: ccgym.EncounterEnv, action: Any, message: str) -> None:
    with pytest.raises(cc.UsageError, match=message):
        env.step(action)
    other = ccgym.EncounterEnv(SCENARIO)
    other.reset(seed=1, options={"sample": 7})
    assert np.array_equal(env.step(np.array([0.5]))[0]["odometry"], other.step(0.5)[0]["odometry"])


def test_an_action_that_is_not_finite_ends_the_run(env: ccgym.EncounterEnv) -> None:
    with pytest.raises(cc.SampleError, match="acceleration of NaN m/s² at 0.00 s"):
        env.step([float("nan")])
    with pytest.raises(cc.UsageError, match="call `reset` before `step`"):
        env.step([0.0])
    env.reset()
    env.step([0.0])


def test_a_closed_environment_says_so(env: ccgym.EncounterEnv) -> None:
    several = gymnasium.make_vec("closecall/Encounter-v0", num_envs=2, scenario=SCENARIO)
    several.reset(seed=1)
    for one, action in ((env, np.zeros(1)), (several, np.zeros((2, 1)))):
        one.close()
        one.close()
        for call in (one.reset, lambda one=one, action=action: one.step(action)):
            with pytest.raises(cc.UsageError, match="the environment is closed"):
                call()


def test_wrong_options_of_reset_are_named(env: ccgym.EncounterEnv) -> None:
    with pytest.raises(cc.UsageError, match="there is no 'smaple', only 'sample'"):
        env.reset(options={"smaple": 7})
    for wrong in (-1, 1.5, "7", None):
        if wrong is not None:
            with pytest.raises(cc.UsageError, match="sample: expected a whole number"):
                env.reset(options={"sample": wrong})
    several = ccgym.EncounterVectorEnv(3, SCENARIO)
    with pytest.raises(cc.UsageError, match="seed: 2 are given for 3 runs"):
        several.reset(seed=[1, 2])
    with pytest.raises(cc.UsageError, match="sample: 4 are given for 3 runs"):
        several.reset(options={"sample": [1, 2, 3, 4]})
    with pytest.raises(cc.UsageError, match="num_envs: expected 1 or more, not 0"):
        ccgym.EncounterVectorEnv(0, SCENARIO)


def test_a_policy_may_answer_an_action_of_the_environment() -> None:
    def margins(policy: Any) -> Any:
        return cc.run(SCENARIO, ccgym.PolicyController(policy), sample=7, sensors="object").margins

    number = margins(lambda observation: -0.25)
    assert margins(lambda observation: np.array([-0.25])) == number == margins(lambda observation: np.array([[-0.25]]))
    with pytest.raises(cc.SampleError, match="the action has the shape \\(2,\\): expected one acceleration"):
        margins(lambda observation: np.zeros(2))
    with pytest.raises(cc.UsageError, match="policy: 3 cannot be called"):
        ccgym.PolicyController(3)  # type: ignore[arg-type]


def test_a_campaign_without_out_keeps_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert cc.campaign(SCENARIO, 2, sensors="object", no_gate=True).folder is None
    assert not list(tmp_path.iterdir())
    with pytest.raises(cc.UsageError, match="name the folder of the campaign with"):
        cc.campaign(SCENARIO, 2, sensors="object", resume=True)
