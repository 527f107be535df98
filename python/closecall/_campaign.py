"""Campaigns."""

from __future__ import annotations

import html
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict

if TYPE_CHECKING:
    from typing_extensions import Unpack

from . import _host, _native
from ._command import call
from ._controller import ControllerLike, registered
from ._errors import UsageError
from ._perceive import perceiving
from ._run import SensorsLike
from ._scenario import Scenario, whole
from .perception import PerceptionLike

ScenarioLike = Scenario | str | os.PathLike[str]


@dataclass(frozen=True)
class CampaignResult:
    """The result of a campaign, as ``closecall campaign --format json`` prints it."""

    #: The exit code of the command line: 0 pass, 1 fail, 4 inconclusive or not judged, 5 a sample ended in an error, 7 invalid.
    exit_code: int
    #: The verdict, such as ``PASS`` or ``FAIL``; ``ENDED EARLY`` if ``fail_fast`` or ``max_errors`` has ended the campaign, and
    #: ``measured, not judged`` with ``no_gate``.
    verdict: str = field(repr=False)
    #: The verdict in a sentence, as the command line prints it: it says how many gates are not checked.
    sentence: str
    #: Number of samples.
    samples: int
    #: Number of samples that ended in an error.
    errors: int
    #: Why: the first message of each kind of failure, with its count and the first sample.
    failures: list[dict[str, Any]]
    #: All keys of the output.
    report: dict[str, Any] = field(repr=False)
    #: The folder of the campaign that ``out`` names, if it does.
    folder: Path | None = None
    #: The outcomes and the report of a campaign without ``out``, for as long as the result lives.
    _kept: tempfile.TemporaryDirectory[str] | None = field(default=None, repr=False, compare=False)

    def outcomes(self) -> _native.Table:
        """Returns the outcomes, with a row for each sample and controller, as ``outcomes.parquet`` has them."""
        return _native.read_table(self._file("outcomes.parquet"))

    def _file(self, name: str) -> Path:
        folder = self.folder if self._kept is None else Path(self._kept.name)
        if folder is None or not (folder / name).exists():
            raise UsageError(f"the campaign has no {name}: it has ended early ({self.verdict})")
        return folder / name

    def _repr_html_(self) -> str:
        """Shows the verdict in a sentence with its reasons, the counts of each controller, and the outcome map."""
        heads = ("controller", "collisions", "rate", "95 % interval", "harm", "errors")
        rows = [_row(name, counts, self.samples) for name, counts in self.report.get("controllers", {}).items()]
        table = "".join(f"<tr>{''.join(f'<td>{_escaped(cell)}</td>' for cell in row)}</tr>" for row in rows)
        reasons = "".join(f"<li>{_escaped(str(reason))}</li>" for reason in self.report.get("reasons", []))
        head = "".join(f"<th>{name}</th>" for name in heads)
        samples = "1 sample" if self.samples == 1 else f"{self.samples} samples"
        return (
            f"<p><strong>{_escaped(self.sentence)}</strong> ({samples})</p><ul>{reasons}</ul>"
            f"<table><thead><tr>{head}</tr></thead><tbody>{table}</tbody></table>{self._outcome_map()}"
        )

    def _outcome_map(self) -> str:
        """Returns the outcome map of the report as SVG; nothing if there is none, as of one varying parameter."""
        try:
            page = self._file("report.html").read_text(encoding="utf-8")
        except UsageError:
            return ""
        _, _, rest = page.partition("Outcome map</h3>")
        drawing = re.search(r"<svg.*?</svg>", rest, re.DOTALL)
        return "" if drawing is None else f"<figure>{drawing.group()}<figcaption>Outcome map</figcaption></figure>"


def _escaped(text: str) -> str:
    """Returns a text for a page, without control characters of others."""
    return html.escape(_native.shown(text))


def _row(name: str, counts: dict[str, Any], samples: int) -> tuple[str, ...]:
    """Returns the cells of a controller in the table of a result."""
    low, high = counts.get("interval_95") or (None, None)
    interval = "" if low is None or high is None else f"{100 * low:.3g} to {100 * high:.3g} %"
    rate = counts.get("collision_rate")
    shown = "" if rate is None else f"{100 * rate:.3g} %"
    return name, f"{counts['collisions']} of {samples - counts['errors']}", shown, interval, f"{counts['harm']:.3g}", str(counts["errors"])


class CampaignOptions(TypedDict, total=False):
    """The further keywords of :func:`campaign`. The help of ``closecall campaign`` explains them: they are its options."""

    preset: Literal["pr", "nightly"] | None
    until_certain: bool
    time_budget: str | None
    judge_seed: int | str | None
    check_share: float | None
    check_at_most: int | None
    no_validity_checks: bool
    controller_timeout_ms: int | None
    controller_memory_mib: int | None
    onnxruntime: str | None
    ray: str | None
    sample_timeout_s: float | None
    retry_crashed: int | None
    partition: str | None
    fail_fast: bool
    max_errors: int | None
    retry_errors: bool
    failures_first: str | None
    fidelity: str | None
    strict_artifacts: bool
    record: str | None
    no_gate: bool
    max_collisions: int | None
    max_other_collisions: int | None
    max_probability: float | None
    confidence: float | None
    max_induced: int | None
    min_prevented: float | None
    max_harm: float | None
    min_rear_thw: float | None
    max_engagement_rate: float | None
    max_speed_deficit_mps: float | None
    max_jerk: float | None
    max_flip_rate: float | None
    max_flaky: int | None
    ensemble: str | Sequence[str] | None
    fitted: str | None


def campaign(
    scenarios: ScenarioLike | Sequence[ScenarioLike],
    n: int | None = None,
    *,
    controller: ControllerLike | None = None,
    arms: Sequence[ControllerLike] | None = None,
    paired: bool = False,
    seed: int = 0,
    design: Literal["random", "sobol", "grid", "coverage"] = "random",
    sensors: SensorsLike | None = None,
    jobs: int | None = None,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    gate: Sequence[str] = (),
    progress: bool | Callable[[int, int], Any] = False,
    isolate: bool = False,
    perception: PerceptionLike | None = None,
    **options: Unpack[CampaignOptions],
) -> CampaignResult:
    """Runs many samples of scenarios, and judges the result, as ``closecall campaign`` does.

    The folder, the verdict and the exit code are the same as from the command line. ``n`` is the number of samples of each scenario.
    ``controller`` is as in :func:`run`; ``paired`` compares it with ``acc`` on the same samples. ``arms`` names
    several controllers, the baseline first. ``gate`` lists criteria such as ``"upper(induced) <= 0.01"``. ``options`` are
    further keywords such as ``max_collisions=3``, ``sample_timeout_s=10``, ``no_gate=True``; see :class:`CampaignOptions`.

    Without ``out`` the outcomes and the report live as long as the result does, and the call can be repeated.

    ``progress`` is called with the number of samples that are done and of all; ``True`` shows a bar of ``tqdm``.

    A controller that raises, or answers no finite number, costs its sample: it counts as an error, and the exit code is 5.
    ``isolate=True`` runs objects in worker processes, one for each job: a crash, a step that takes longer than
    ``controller_timeout_ms`` (1000) and a process that needs more than ``controller_memory_mib`` (1024) cost the sample only, too, and
    several jobs use several cores. It needs ``cloudpickle``.

    ``perception`` takes the place of the built-in chain behind the rear LiDARs in mode ``full``: see :mod:`closecall.perception`. An object
    runs in a process of its own for each sample, under the limits ``sensors.perception-timeout-ms`` and ``sensors.perception-memory-mib`` of
    the scenario, and needs ``cloudpickle``. What it does wrong costs its sample.

    Ctrl-C raises ``KeyboardInterrupt`` after the samples that are running, and a second one at once. With ``out``, ``resume=True`` goes on from there.
    """
    for name in set(options) - set(CampaignOptions.__annotations__):
        similar = get_close_matches(name, CampaignOptions.__annotations__, n=1)
        raise UsageError(f"campaign() has no keyword `{name}`" + (f"; did you mean `{similar[0]}`?" if similar else ""))
    several = [scenarios] if isinstance(scenarios, (Scenario, str, os.PathLike)) else scenarios
    named: list[str] = []
    changes: list[list[str]] = []
    for scenario in several:
        if isinstance(scenario, Scenario):
            named.append(scenario._native.source)
            changes.append(scenario._native.settings)
        else:
            named.append(os.fspath(scenario))
            changes.append([])
    if not named:
        raise UsageError("scenarios: none is named")
    settings = changes[0]
    if any(other != settings for other in changes):
        raise UsageError("the scenarios of a campaign are changed by the same settings (`set`), or by none")
    if arms is not None and (controller is not None or paired):
        raise UsageError("`arms` names all controllers: leave out `controller` and `paired`")
    if arms is not None and (isinstance(arms, str) or not arms):
        raise UsageError(f"arms: expected a list of controllers, not {arms!r}")
    chosen: list[ControllerLike] = list(arms) if arms is not None else [] if controller is None else [controller]
    # On a cluster, objects run in worker processes, whatever they do to them.
    is_remote = "ray" in options
    limits = _limits(options) if isolate or is_remote else None
    if limits is None and set(LIMITS) & set(options) and not any(isinstance(one, str) and ":" in one for one in chosen):
        raise UsageError("`controller_timeout_ms` and `controller_memory_mib` limit processes: add `isolate=True`, or name one")
    if is_remote and perception is not None and not isinstance(perception, str):
        raise UsageError("perception: an object runs on this machine only; on a cluster, name a command or a library")
    timeout_s = options.get("sample_timeout_s")
    # What is no number is refused below.
    limit_s = timeout_s if isinstance(timeout_s, (int, float)) else _native.SAMPLE_TIMEOUT_S
    with (
        registered(chosen, limits, is_remote, limit_s) as names,
        perceiving(perception) as of_perception,
        _reporter(progress) as report,
    ):
        settings = [*settings, *of_perception]
        if out is None and resume:
            raise UsageError("resume: name the folder of the campaign with `out`")
        # A selection of no recordings needs no folder. The campaign refuses a text that is no selection.
        keeps = {"record": re.search(r"each-kind|:0*[1-9]|^0*[1-9]\d*$", str(options.get("record", ""))), "partition": options.get("partition")}
        for name, value in keeps.items():
            if out is None and value is not None:
                raise UsageError(f"{name}: the files are kept in the folder of the campaign: name one with `out`")
        kept = tempfile.TemporaryDirectory(prefix="closecall-") if out is None else None
        folder = Path(kept.name, "results") if kept is not None else Path(os.fspath(out or ""))
        keywords: dict[str, object] = {"scenarios": named, "n": n, "out": folder, "resume": resume}
        keywords |= {"arms": names} if arms is not None else {"controller": names[0] if names else None}
        # The seed of a judgement takes the place of the default.
        keywords["seed"] = None if seed == 0 and options.get("judge_seed") is not None else whole("seed", seed)
        keywords |= {"paired": paired, "design": design, "sensors": sensors, "jobs": jobs}
        keywords |= {"gate": _several(gate), "set": settings or None}
        if kept is not None:
            # Nobody could look at the recordings.
            keywords["record"] = "0"
        more = {**options, "ensemble": _several(options.get("ensemble"))}
        code, keys = call("campaign", {**keywords, **more}, report)
    if kept is not None:
        _keep_results(folder)
    verdict = keys.get("verdict", "ENDED EARLY") or "measured, not judged"
    result = (code, verdict, keys.get("sentence", verdict), keys["samples"], keys["errors"], keys["failures"], keys)
    return CampaignResult(*result, None if kept is not None else folder, kept)


def _several(values: str | os.PathLike[str] | Sequence[str] | None) -> list[str | os.PathLike[str]] | None:
    """Returns a list of texts. A single text may be given as it is; ``None`` if there are none."""
    return [values] if isinstance(values, (str, os.PathLike)) else list(values or ()) or None


def _keep_results(folder: Path) -> None:
    """Moves the outcomes and the report out of a folder, and removes what else is in it."""
    for name in ("outcomes.parquet", "report.html"):
        if (folder / name).exists():
            (folder / name).rename(folder.parent / name)
    shutil.rmtree(folder, ignore_errors=True)


#: The options that limit worker processes, with their largest values.
LIMITS = {"controller_timeout_ms": 600_000, "controller_memory_mib": 1_048_576}


def _limits(options: CampaignOptions) -> _host.Limits:
    """Returns the limits of worker processes that the options give."""
    values = []
    for (name, largest), default in zip(LIMITS.items(), _host.Limits()):
        value = options.get(name)
        value = default if value is None else value
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= largest:
            raise UsageError(f"{name}: expected a whole number from 1 to {largest}, not {value!r}")
        values.append(value)
    return _host.Limits(*values)


class _reporter:
    """Calls a function, or shows a bar of tqdm, for as long as the context lasts."""

    def __init__(self, progress: bool | Callable[[int, int], Any]) -> None:
        self._progress = progress
        self._bar: Any = None

    def __enter__(self) -> Callable[[int, int], Any] | None:
        if self._progress is False:
            return None
        if callable(self._progress):
            return self._progress
        if self._progress is not True:
            raise UsageError(f"progress: expected a function of two numbers, or True, not {self._progress!r}")
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
        except ImportError as error:
            raise UsageError("progress=True needs tqdm: `pip install tqdm`, or give a function") from error
        self._bar = tqdm(unit="sample")
        return self._show

    def _show(self, done: int, total: int) -> None:
        self._bar.total = total
        self._bar.update(done - self._bar.n)

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
