"""What a notebook needs: results without a folder, cells that run twice, tables, keywords that are checked."""

from __future__ import annotations

import gc
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pyarrow
import pytest
from support import SCENARIO, command

import closecall as cc
from closecall import _campaign, _traffic

TYPED = Path(__file__).with_name("typed")


def small(**options: object) -> cc.CampaignResult:
    return cc.campaign(SCENARIO, n=20, seed=1, sensors="object", paired=True, **options)  # type: ignore[arg-type]


def test_a_cell_without_a_folder_runs_twice_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = small(), small()
    expected = small(out="kept")
    tables = [pyarrow.table(result.outcomes()) for result in (first, second, expected)]
    assert tables[0].equals(tables[1]) and tables[0].equals(tables[2]) and tables[0].num_rows == 40
    assert first.folder is None and expected.folder == Path("kept")
    assert os.listdir(tmp_path) == ["kept"]
    assert first._kept is not None
    kept = Path(first._kept.name)
    assert sorted(os.listdir(kept)) == ["outcomes.parquet", "report.html"]
    del first
    gc.collect()
    assert not kept.exists()


def test_the_text_of_a_result_is_short() -> None:
    result = small(no_gate=True)
    assert len(repr(result)) < 400 and "0x" not in repr(result)


def test_a_result_says_beside_its_verdict_what_is_not_checked() -> None:
    unpaired = cc.campaign(SCENARIO, n=200, seed=5, sensors="object", max_collisions=100)
    sentence = "PASS: 5 of 8 gates are met, 3 not checked"
    assert (unpaired.verdict, unpaired.sentence) == ("PASS", sentence)
    assert f"<strong>{sentence}</strong>" in unpaired._repr_html_()
    assert f"sentence='{sentence}'" in repr(unpaired) and "'PASS'" not in repr(unpaired)
    measured = small(no_gate=True)
    assert measured.sentence == measured.verdict == "measured, not judged"


def test_a_campaign_without_a_folder_cannot_be_resumed() -> None:
    with pytest.raises(cc.UsageError, match="name the folder of the campaign with `out`"):
        small(resume=True)


def test_lane_changes_and_criticality_are_tables(tmp_path: Path) -> None:
    file = tmp_path / "traffic.csv"
    assert command("traffic", "record", SCENARIO, "-n", "3", "--seed", "1", "--sensors", "object", "-o", file).returncode == 0
    changes, critical = cc.lane_changes(file), cc.criticality(file)
    assert isinstance(changes, cc.Rows)
    table = pyarrow.table(changes.table())
    assert table.num_rows == len(changes) > 0
    assert table.column("track_id").to_pylist() == [row["track_id"] for row in changes]
    assert table.schema.field("start_s").type == pyarrow.float64() and table.schema.field("complete").type == pyarrow.bool_()
    metrics = pyarrow.table(critical.table())
    flat = [_traffic._flat(row) for row in critical]
    assert set(metrics.column_names) == {key for row in flat for key in row}
    assert metrics.column("track_id").to_pylist() == [row["track_id"] for row in flat]
    nested = pyarrow.table(cc.Rows([{"metrics": {"thw_s": 0.5}}, {"metrics": {"thw_s": None}}]).table())
    assert nested.column("metrics.thw_s").to_pylist() == [0.5, None]
    empty = pyarrow.table(cc.Rows([{"metrics": {"thw_s": None}}]).table())
    assert empty.schema.field("metrics.thw_s").type == pyarrow.null()
    assert pyarrow.concat_tables([empty, nested], promote_options="default").column(0).to_pylist() == [None, 0.5, None]
    assert len(cc.Rows().table()) == 0


def test_messages_name_keywords() -> None:
    with pytest.raises(cc.UsageError, match="no keyword `max_collision`; did you mean `max_collisions`") as raised:
        small(max_collision=3)
    with pytest.raises(cc.UsageError, match="max_collisions=") as raised:
        small(max_collisions="three")
    assert "--" not in str(raised.value)
    with pytest.raises(cc.UsageError) as raised:
        small(partition="3/2")
    assert "--" not in str(raised.value)


def test_the_keywords_of_a_campaign_are_the_options_of_the_command() -> None:
    shown = re.findall(r"^ +(?:-[a-z], )?--([a-z-]+)", command("campaign", "--help").stdout, re.MULTILINE)
    options = {name.replace("-", "_") for name in shown}
    explicit = {"samples", "controller", "arms", "paired", "seed", "design", "sensors", "jobs", "out", "resume", "gate"}
    settings_of_scenarios, of_the_command_line = {"set"}, {"help", "format", "no_out", "event", "guide", "relative_width"}
    assert set(_campaign.CampaignOptions.__annotations__) == options - explicit - settings_of_scenarios - of_the_command_line


def test_the_words_that_a_type_checker_knows_are_those_of_the_command() -> None:
    preset = get_type_hints(_campaign.CampaignOptions)["preset"]
    for words, option, known in [(["campaign", SCENARIO], "--preset", get_args(preset)[0]), (["traffic", "fit", "a.csv"], "--layout", _traffic.Layout)]:
        refused = command(*words, option, "no-such").stderr
        allowed = re.search(r"possible values: ([a-z0-9, -]+)]", refused)
        assert allowed is not None and set(allowed.group(1).split(", ")) == set(get_args(known)), refused


def findings(file: Path) -> dict[int, str]:
    """Returns the errors of pyright in strict mode, by line."""
    settings = {"typeCheckingMode": "strict", "include": [str(file)], "pythonVersion": "3.11"}
    project = file.parent / "pyrightconfig.json"
    project.write_text(json.dumps(settings))
    words = [sys.executable, "-m", "basedpyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(project)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300)
    errors = [one for one in json.loads(done.stdout)["generalDiagnostics"] if one["severity"] == "error"]
    return {one["range"]["start"]["line"] + 1: one["message"] for one in errors}


@pytest.mark.parametrize("name", ["clean.py", "planted.py", "perceiving.py", "perceiving_planted.py"])
def test_pyright_is_clean_on_good_code_and_finds_planted_mistakes(name: str, tmp_path: Path) -> None:
    pytest.importorskip("basedpyright")
    file = tmp_path / name
    text = (TYPED / name).read_text()
    file.write_text(text)
    calls = {number for number, line in enumerate(text.splitlines(), 1) if line.startswith("cc.")}
    assert set(findings(file)) == (calls if "planted" in name else set())


def test_a_normalized_action_is_an_acceleration_between_the_limits() -> None:
    gym = pytest.importorskip("closecall.gym")
    plain, scaled = gym.EncounterEnv(), gym.EncounterEnv(normalized_actions=True)
    assert (scaled.action_space.low, scaled.action_space.high) == (-1.0, 1.0)
    for env in (plain, scaled):
        env.reset(seed=1, options={"sample": 3})
    ends = [False, False]
    while not any(ends):
        observed = [plain.step(np.array([-1.5])), scaled.step(np.array([0.25]))]
        ends = [step[2] or step[3] for step in observed]
        assert observed[0][1] == observed[1][1]
    assert ends[0] == ends[1] and plain.outcome() == scaled.outcome()
    vector = gym.EncounterVectorEnv(2, normalized_actions=True)
    assert (vector.action_space.low == -1.0).all() and (vector.action_space.high == 1.0).all()
    with pytest.raises(cc.UsageError, match="the smaller first"):
        gym.EncounterEnv(action_limits_mps2=(3.0, -9.0))


def test_a_policy_with_normalized_actions_is_judged_as_it_was_trained() -> None:
    gym = pytest.importorskip("closecall.gym")
    outcomes = [
        cc.run(SCENARIO, gym.PolicyController(lambda _: -1.5), sensors="object", sample=3),
        cc.run(SCENARIO, gym.PolicyController(lambda _: 0.25, normalized_actions=True), sensors="object", sample=3),
    ]
    assert outcomes[0].margins == outcomes[1].margins


def test_a_measured_campaign_shows_itself_without_control_characters() -> None:
    result = cc.campaign("slow-approach", n=2, sensors="object", no_gate=True)
    assert result.verdict == "measured, not judged"
    assert "measured, not judged" in result._repr_html_()
    failing = cc.campaign("slow-approach", n=2, sensors="object", controller="exec:printf '\\033[31m\\342\\200\\256x\\n'")
    shown = failing._repr_html_()
    assert not any(character in shown for character in ("\x1b", "\u202e")), shown


def test_an_exception_shows_no_control_characters(tmp_path: Path) -> None:
    file = tmp_path / "traffic.csv"
    file.write_text("track_id,frame\x1b[31m\n1,2\n")

    class Raises:
        def step(self, input: cc.ControllerInput) -> float:
            raise ValueError("\x1b[31m\x9b31m\u202e")

    calls = [
        lambda: cc.lane_changes(file),
        lambda: cc.run("no\x1b[31m"),
        lambda: cc.campaign(SCENARIO, **{"n\x1b": 3}),
        lambda: cc.run(SCENARIO, Raises(), sensors="object"),
    ]
    for call in calls:
        with pytest.raises(cc.ClosecallError, match=r"\\u001b") as raised:
            call()
        assert not re.search("[\x1b\x9b\u202e]", str(raised.value)), raised.value


@pytest.mark.parametrize("keyword", [{"record": "failures:1"}, {"partition": "1/2"}])
def test_what_is_kept_in_a_folder_needs_one(keyword: dict[str, str]) -> None:
    with pytest.raises(cc.UsageError, match="name one with `out`"):
        cc.campaign("slow-approach", n=2, **keyword)  # type: ignore[arg-type]


def test_an_outcome_shows_numbers_that_can_be_read() -> None:
    outcome = cc.run("low-thw-overtake", sample=3, sensors="object")
    assert not re.search(r"\d\.\d{9,}", repr(outcome)), repr(outcome)
    assert re.search(r"\d\.\d{9,}", str(dict(outcome.parameters))), "the attributes have all digits"
