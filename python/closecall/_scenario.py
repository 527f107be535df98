"""Scenario files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Literal

from . import _native
from ._errors import UsageError


class Scenario:
    """A scenario that has been read and checked: what is sampled, and what each sample is."""

    def __init__(self, native: _native.Scenario) -> None:
        self._native = native

    @classmethod
    def load(cls, source: str | os.PathLike[str], set: Mapping[str, object] | None = None) -> Scenario:
        """Reads a scenario file, or the scenario of the library with that name.

        ``set`` changes values, named by a path of keys (``"actor.rear.start.behind.gap-m"``) or by a parameter
        (``"brake-mps2"``). A list replaces a whole list (``{"fault.rear-lidar": [{"dead": True}]}``).

        Raises :class:`InputError` with file, line and key if the scenario cannot be used, :class:`UsageError` if a
        setting cannot be applied, :class:`FileError` if the file cannot be read.
        """
        if set is not None and not isinstance(set, Mapping):
            raise UsageError(f"set: expected a dictionary such as {{'brake-mps2': 6}}, not {set!r}")
        settings = [f"{key}={_toml(value)}" for key, value in (set or {}).items()]
        return cls(_native.Scenario.load(os.fspath(source), settings))

    @staticmethod
    def library() -> list[str]:
        """Returns the names of the scenarios that are part of the program."""
        return _native.Scenario.library()

    @property
    def name(self) -> str:
        """The name in reports."""
        return self._native.name

    @property
    def path(self) -> str:
        """The path of the file."""
        return str(self._native.path)

    @property
    def text(self) -> str:
        """The text of the file (TOML)."""
        return self._native.text

    @property
    def parameters(self) -> list[str]:
        """The names of the sampled parameters, in alphabetical order."""
        return self._native.parameters

    def sample(
        self, seed: int = 0, n: int = 1, design: Literal["random", "sobol", "grid", "coverage"] = "random"
    ) -> list[dict[str, float | str]]:
        """Returns the parameters of the samples 0 to ``n`` − 1, with the units that their names state.

        ``campaign(scenario, n=n, seed=seed, design=design)`` runs the same samples. A grid may have fewer samples.
        """
        return self._native.sample(whole("seed", seed), whole("n", n), design)

    def __repr__(self) -> str:
        return f"Scenario({self.name!r}, {len(self.parameters)} parameters)"


def _toml(value: object) -> str:
    """Returns a value as ``--set`` takes it."""
    return value if isinstance(value, str) else _inner_toml(value)


def _inner_toml(value: object) -> str:
    """Returns a value as TOML, in which texts have quotes."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(key))} = {_inner_toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_inner_toml(inner) for inner in value) + "]"
    return str(value)


def whole(name: str, value: int) -> int:
    """Returns a seed, the number of a sample, or a number of samples, which is a whole number from 0 to 2^64 - 1."""
    try:
        number = int(value)
    except (TypeError, ValueError, OverflowError):
        number = -1
    if isinstance(value, bool) or number != value or not 0 <= number < 2**64:
        raise UsageError(f"{name}: expected a whole number from 0 to 2^64 - 1, not {value!r}")
    return number


def loaded(scenario: Scenario | str | os.PathLike[str], settings: Sequence[str] = ()) -> Scenario:
    """Returns the scenario, which is read if it is a path or a name, or if it is changed by further settings."""
    read = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
    if not settings:
        return read
    return Scenario(_native.Scenario.load(read._native.source, [*read._native.settings, *settings]))
