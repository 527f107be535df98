"""One run."""

from __future__ import annotations

import os
from typing import Literal

from . import _native
from ._controller import ControllerLike, end_steps, native
from ._outcome import Outcome
from ._perceive import perceiving
from ._scenario import Scenario, loaded, whole
from .perception import PerceptionLike

#: The depth of the sensor simulation.
SensorsLike = Literal["full", "object", "ground-truth"]


def run(
    scenario: Scenario | str | os.PathLike[str],
    controller: ControllerLike = "mis",
    *,
    sample: int = 0,
    seed: int = 0,
    sensors: SensorsLike | None = None,
    perception: PerceptionLike | None = None,
) -> Outcome:
    """Runs one sample of a scenario, as ``closecall run`` does, and returns its outcome.

    ``controller`` is the name of a built-in controller (``"acc"``, ``"mis"``, ``"gap-1.6"`` …), ``"exec:COMMAND"``, an object
    with a method ``step``, or a class or function that creates one. ``sensors`` is the depth of the sensor simulation,
    by default the scenario's. ``perception`` takes the place of the built-in chain behind the rear LiDARs in mode ``full``:
    see :mod:`closecall.perception`. An object runs in a process of its own, and needs ``cloudpickle``.

    Raises :class:`SampleError` if the sample has no outcome. Its ``__cause__`` is the exception of the controller.
    """
    chosen = native(controller)
    try:
        with perceiving(perception) as settings:
            native_scenario = loaded(scenario, settings)._native
            done = _native.run(native_scenario, chosen, whole("seed", seed), whole("sample", sample), sensors)
    finally:
        if not isinstance(chosen, str):
            end_steps(chosen)
    return Outcome.from_json(done.json(), done)
