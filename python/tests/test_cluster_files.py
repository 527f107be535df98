"""The files that `docs/how-to/cluster.md` shows, and how it reads outcomes of many campaigns."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import duckdb
import polars
import pytest
import yaml
from support import SCENARIO, command

import closecall as cc

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "how-to" / "cluster"


def manifests() -> dict[str, Any]:
    """The manifests for Kubernetes, by kind."""
    return {one["kind"]: one for one in yaml.safe_load_all((FOLDER / "rayjob.yaml").read_text())}


#: The keys of a RayJob that the manifest has, with their types: an excerpt of the schema of KubeRay's `ray.io/v1`. Other keys are
#: refused.
CONTAINER = {"name": str, "image": str, "resources": dict, "volumeMounts": list}
POD = {"containers": [CONTAINER], "volumes": list, "tolerations": list}
START = dict
JOB: dict[str, Any] = {
    "entrypoint": str,
    "backoffLimit": int,
    "shutdownAfterJobFinishes": bool,
    "ttlSecondsAfterFinished": int,
    "rayClusterSpec": {
        "rayVersion": str,
        "enableInTreeAutoscaling": bool,
        "autoscalerOptions": {"idleTimeoutSeconds": int},
        "headGroupSpec": {"rayStartParams": START, "template": {"spec": POD}},
        "workerGroupSpecs": [
            {"groupName": str, "replicas": int, "minReplicas": int, "maxReplicas": int, "rayStartParams": START, "template": {"spec": POD}}
        ],
    },
}


def wrong(value: Any, shape: Any, path: str = "spec") -> list[str]:
    """Returns what a manifest has that its schema has not."""
    if isinstance(shape, type):
        return [] if type(value) is shape else [f"{path} is no {shape.__name__}"]
    if isinstance(shape, list):
        return [text for index, one in enumerate(value) for text in wrong(one, shape[0], f"{path}[{index}]")]
    unknown = [f"{path}.{key} is unknown" for key in value if key not in shape]
    return unknown + [text for key, one in value.items() if key in shape for text in wrong(one, shape[key], f"{path}.{key}")]


def test_the_manifest_has_the_keys_of_kuberay() -> None:
    job = manifests()["RayJob"]
    assert (job["apiVersion"], wrong(job["spec"], JOB)) == ("ray.io/v1", [])
    job["spec"]["rayClusterSpec"]["workerGroupSpecs"][0]["maxReplica"] = "3"
    assert wrong(job["spec"], JOB) == ["spec.rayClusterSpec.workerGroupSpecs[0].maxReplica is unknown"]
    # Ray reads the parameters of a start as texts.
    cluster = job["spec"]["rayClusterSpec"]
    for group in [cluster["headGroupSpec"], *cluster["workerGroupSpecs"]]:
        assert all(isinstance(value, str) for value in group["rayStartParams"].values())
    head = cluster["headGroupSpec"]["template"]["spec"]
    claim = head["volumes"][0]["persistentVolumeClaim"]["claimName"]
    assert claim == manifests()["PersistentVolumeClaim"]["metadata"]["name"]
    assert head["volumes"][0]["name"] == head["containers"][0]["volumeMounts"][0]["name"]
    images = {group["template"]["spec"]["containers"][0]["image"] for group in [cluster["headGroupSpec"], *cluster["workerGroupSpecs"]]}
    assert len(images) == 1, "all machines have the same image"


def test_the_version_of_ray_is_the_one_that_is_tested() -> None:
    version = manifests()["RayJob"]["spec"]["rayClusterSpec"]["rayVersion"]
    assert f"FROM rayproject/ray:{version}\n" in (FOLDER / "Dockerfile").read_text()
    assert f"ray=={version}" in (ROOT / ".ci" / "run").read_text()


def test_the_command_of_the_manifest_is_one(tmp_path: Path) -> None:
    words = [word.strip('"') for word in re.findall(r'"[^"]*"|\S+', manifests()["RayJob"]["spec"]["entrypoint"])]
    assert words[:3] == ["closecall", "campaign", SCENARIO]
    at = words.index("--ray")
    changed = [*words[1:at], *words[at + 2 :]]
    changed[changed.index("-n") + 1] = "4"
    changed[changed.index("--out") + 1] = str(tmp_path / "out")
    # Too few samples for its gate: the folder is there, and the verdict is none that passes.
    for _ in range(2):
        done = command(*changed)
        assert done.returncode in (1, 4), done.stderr


def test_the_workflows_have_the_keys_of_github() -> None:
    program = Path(sys.executable).with_name("check-jsonschema")
    files = [FOLDER / "github.yml", *(ROOT / ".github" / "workflows").glob("*.yml")]
    done = subprocess.run([program, "--builtin-schema", "vendor.github-workflows", *files], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_parts_of_the_workflow_are_those_of_one_machine(tmp_path: Path) -> None:
    workflow = yaml.safe_load((FOLDER / "github.yml").read_text())
    parts = workflow["jobs"]["part"]["strategy"]["matrix"]["part"]
    runs = [step["run"] for step in workflow["jobs"]["part"]["steps"] if "run" in step]
    assert any(f"--partition ${{{{ matrix.part }}}}/{len(parts)} " in run for run in runs) and parts == [1, 2, 3, 4]
    words = [SCENARIO, "-n", "20", "--seed", "1", "--sensors", "object", "--paired"]
    for part in parts:
        out = str(tmp_path / f"part-{part}")
        assert command("campaign", *words, "--no-gate", "--partition", f"{part}/{len(parts)}", "--out", out).returncode == 0
    folders = [str(tmp_path / f"part-{part}") for part in parts]
    merged = command("tool", "merge", *folders, "--gate", "upper(induced) <= 0.9", "--out", str(tmp_path / "merged"))
    whole = command("campaign", *words, "--gate", "upper(induced) <= 0.9", "--out", str(tmp_path / "whole"))
    # The gates of the scenario itself need more samples than these.
    assert merged.returncode == whole.returncode == 4, merged.stderr + whole.stderr
    assert (tmp_path / "merged" / "outcomes.parquet").read_bytes() == (tmp_path / "whole" / "outcomes.parquet").read_bytes()


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Outcomes of several campaigns, laid out as `docs/how-to/cluster.md` says."""
    folder = tmp_path_factory.mktemp("store")
    for scenario in (SCENARIO, "low-thw-overtake-at-cut-out"):
        for seed in (1, 2):
            out = folder / "out"
            cc.campaign(scenario, 10, seed=seed, sensors="object", paired=True, no_gate=True, out=out)
            target = folder / "outcomes" / f"scenario={scenario}" / f"seed={seed}"
            target.mkdir(parents=True)
            (out / "outcomes.parquet").rename(target / "outcomes.parquet")
            for file in sorted(out.rglob("*"), reverse=True):
                file.rmdir() if file.is_dir() else file.unlink()
            out.rmdir()
    return folder


def blocks(language: str) -> list[str]:
    """The examples of `docs/how-to/cluster.md` in a language."""
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / "docs" / "how-to" / "cluster.md").read_text(), re.DOTALL)


def test_duckdb_and_polars_read_the_outcomes_of_many_campaigns(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(store)
    (query,) = blocks("sql")
    rows = duckdb.sql(query).fetchall()
    (program,) = [block for block in blocks("python") if "scan_parquet" in block]
    names: dict[str, Any] = {}
    exec(program, names)
    frame: polars.DataFrame = names["rates"]
    assert [tuple(row) for row in frame.rows()] == rows
    assert len(rows) == 4 and all(row[2] == 20 for row in rows)
    assert {row[0] for row in rows} == {SCENARIO, "low-thw-overtake-at-cut-out"}
    # One seed of one scenario is read from one file.
    plan = duckdb.sql(
        "EXPLAIN ANALYZE SELECT count(*) FROM read_parquet('outcomes/*/*/*.parquet', hive_partitioning = true) "
        f"WHERE scenario = '{SCENARIO}' AND seed = 2"
    ).fetchall()
    assert "1/4" in json.dumps(plan) or "Total Files Read: 1" in json.dumps(plan)
