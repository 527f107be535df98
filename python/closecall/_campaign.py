"""Campaigns."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import tempfile
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from . import _host, _native
from ._command import call, option
from ._controller import SAMPLE_TIMEOUT_S, ControllerLike, registered
from ._errors import UsageError
from ._run import SensorsLike
from ._scenario import Scenario, whole

ScenarioLike = Scenario | str | os.PathLike[str]


@dataclass(frozen=True)
class CampaignResult:
    """The result of a campaign, as ``closecall campaign --format json`` prints it."""

    #: The exit code of the command line: 0 pass, 1 fail, 4 inconclusive or not judged, 5 a sample ended in an error, 7 invalid.
    exit_code: int
    #: The verdict, such as ``PASS`` or ``FAIL``; ``ENDED EARLY`` if ``fail_fast`` or ``max_errors`` has ended the campaign.
    verdict: str
    #: Number of samples.
    samples: int
    #: Number of samples that ended in an error.
    errors: int
    #: Why: the first message of each kind of failure, with its count and the first sample.
    failures: list[dict[str, Any]]
    #: All keys of the output.
    report: dict[str, Any] = field(repr=False)
    #: The folder of the campaign, if ``out`` has named one.
    folder: Path | None = None
    #: The files of a campaign without ``out``.
    _kept: _Kept | None = field(default=None, repr=False, compare=False)

    def outcomes(self) -> _native.Table:
        """Returns ``outcomes.parquet``: a row for each sample and controller. A campaign needs no ``out`` for it."""
        return _native.read_table(self._files() / "outcomes.parquet")

    def _files(self) -> Path:
        if self.folder is not None:
            return self.folder
        if self._kept is None:
            raise UsageError("a campaign on a cluster keeps its outcomes in a folder: name one with `out`")
        return self._kept.results

    def _repr_html_(self) -> str:
        """Shows the verdict with its reasons, the counts of each controller, and the outcome map."""
        heads = ("controller", "collisions", "rate", "95 % interval", "harm", "errors")
        rows = [_row(name, counts, self.samples) for name, counts in self.report.get("controllers", {}).items()]
        table = "".join(f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
        reasons = "".join(f"<li>{html.escape(str(reason))}</li>" for reason in self.report.get("reasons", []))
        head = "".join(f"<th>{name}</th>" for name in heads)
        return (
            f"<p><strong>{html.escape(self.verdict)}</strong>: {self.samples} samples</p><ul>{reasons}</ul>"
            f"<table><thead><tr>{head}</tr></thead><tbody>{table}</tbody></table>{self._outcome_map()}"
        )

    def _outcome_map(self) -> str:
        """Returns the outcome map of the report as SVG; nothing if there is none, as of one varying parameter."""
        try:
            page = (self._files() / "report.html").read_text(encoding="utf-8")
        except (OSError, UsageError):
            return ""
        _, _, rest = page.partition("Outcome map</h3>")
        found = re.search(r"<svg.*?</svg>", rest, re.DOTALL)
        return "" if found is None else f"<figure>{found.group()}<figcaption>Outcome map</figcaption></figure>"


class _Kept:
    """A folder that is removed with its last user, or at the end of the program."""

    def __init__(self) -> None:
        place = tempfile.mkdtemp(prefix="closecall-")
        self.results = Path(place) / "results"
        weakref.finalize(self, shutil.rmtree, place, ignore_errors=True)


def _row(name: str, counts: dict[str, Any], samples: int) -> tuple[str, ...]:
    low, high = counts.get("interval_95") or (None, None)
    interval = "" if low is None or high is None else f"{100 * low:.3g} to {100 * high:.3g} %"
    rate = counts.get("collision_rate")
    shown = "" if rate is None else f"{100 * rate:.3g} %"
    return name, f"{counts['collisions']} of {samples - counts['errors']}", shown, interval, f"{counts['harm']:.3g}", str(counts["errors"])


def campaign(
    scenarios: ScenarioLike | Sequence[ScenarioLike],
    n: int | None = None,
    *,
    controller: ControllerLike | None = None,
    arms: Sequence[ControllerLike] | None = None,
    paired: bool = False,
    seed: int = 0,
    design: Literal["random", "sobol", "grid"] = "random",
    sensors: SensorsLike | None = None,
    jobs: int | None = None,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    gate: Sequence[str] = (),
    progress: bool | Callable[[int, int], Any] = False,
    isolate: bool = False,
    **options: str | float | bool | Sequence[str] | None,
) -> CampaignResult:
    """Runs many samples of scenarios, and judges the result, as ``closecall campaign`` does.

    The folder, the verdict and the exit code are those of the command line. ``n`` is the number of samples of each scenario.
    ``controller`` is as in :func:`run`; ``paired`` compares it with ``acc`` on the same samples. ``arms`` names
    several controllers, the baseline first. ``gate`` lists criteria such as ``"upper(induced) <= 0.01"``. ``options`` are
    further options of the command line, with underscores: ``max_collisions=3``, ``sample_timeout_s=10``, ``no_gate=True``.

    ``progress`` is called with the number of samples that are done and of all; ``True`` shows a bar of ``tqdm``.

    A controller that raises, or answers no finite number, costs its sample: it counts as an error, and the exit code is 5.
    ``isolate=True`` runs objects in worker processes, one for each job: a crash, a step that takes longer than
    ``controller_timeout_ms`` (1000) and a process that needs more than ``controller_memory_mib`` (1024) cost the sample only, too, and
    several jobs use several cores. It needs ``cloudpickle``.

    Ctrl-C raises ``KeyboardInterrupt`` after the samples that are running, and a second one at once. With ``out``, ``resume=True`` goes on from there.
    """
    several = [scenarios] if isinstance(scenarios, (Scenario, str, os.PathLike)) else scenarios
    words: list[str] = []
    changes: list[list[str]] = []
    for scenario in several:
        if isinstance(scenario, Scenario):
            words.append(scenario._native.source)
            changes.append(scenario._native.settings)
        else:
            words.append(os.fspath(scenario))
            changes.append([])
    if not words:
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
    timeout_s = options.get("sample_timeout_s")
    # What is no number, the command line refuses.
    limit_s = timeout_s if isinstance(timeout_s, (int, float)) else SAMPLE_TIMEOUT_S
    with registered(chosen, limits, is_remote, limit_s) as names, _reporter(progress) as report:
        which = option("arms" if arms is not None else "controller", names)
        named: dict[str, object] = {"samples": n, "paired": paired, "seed": whole("seed", seed), "design": design, "sensors": sensors, "jobs": jobs}
        # Without `out` the results last as long as the object. No sample runs again for a recording.
        kept = _Kept() if out is None and not is_remote and not resume else None
        if kept is not None:
            named |= {"record": "0"} if not {"record", "recordings"} & set(options) else {}
        place = out if kept is None else kept.results
        named |= {"out": None if place is None else os.fspath(place), "resume": resume, "gate": [gate] if isinstance(gate, str) else list(gate), "set": settings}
        further = [word for name, value in {**named, **options}.items() for word in option(name, value)]
        code, output = call(["campaign", "--format=json", *which, *further, "--", *words], report)
    keys = json.loads(output)
    folder = None if out is None else Path(out)
    return CampaignResult(code, keys.get("verdict", "ENDED EARLY"), keys["samples"], keys["errors"], keys["failures"], keys, folder, kept)


#: The options that limit worker processes, with their largest values.
LIMITS = {"controller_timeout_ms": 600_000, "controller_memory_mib": 1_048_576}


def _limits(options: dict[str, Any]) -> _host.Limits:
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
