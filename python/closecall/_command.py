"""The command ``closecall``, and calls of its functions."""

from __future__ import annotations

import json
import numbers
import os
import signal
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any

from . import _native
from ._errors import UsageError

PROGRAM = "closecall"

#: Starts the program in a process of its own. The working folder holds no modules for it: `-m` would search there first.
START = "import sys; sys.path[:] = filter(None, sys.path); from closecall._command import main; raise SystemExit(main())"

if _native.__file__:
    _native.set_program(_native.__file__, [sys.executable, "-c", START])


class _RayEngine:
    """Runs the samples of a campaign on Ray, which is loaded only then."""

    def connect(self, address: str, shipment: Any) -> object:
        from . import ray

        return ray.connect(address, shipment)


_native.set_engine(_RayEngine())


def main() -> int:
    """Runs the program with the arguments of the process, and returns its exit code."""
    # The program has handlers of its own. Python's would raise KeyboardInterrupt after a campaign that was stopped.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main([PROGRAM, *sys.argv[1:]])


def call(function: str, keywords: Mapping[str, object], progress: Callable[[int, int], Any] | None = None) -> tuple[int, Any]:
    """Calls a function of the program, and returns its exit code and its result. Its warnings become Python's.

    Keywords that are ``None`` or ``False`` have their defaults.
    """
    given = {name: _plain(name, value) for name, value in keywords.items() if value is not None and value is not False}
    spelled = ", ".join(f"{name}={value!r}" for name, value in given.items())
    code, result, messages = _native.call(function, json.dumps(given), f"{PROGRAM}.{function}({spelled})", progress)
    for message in messages:
        warnings.warn(message, stacklevel=3)
    return code, json.loads(result)


def _plain(name: str, value: object) -> Any:
    """Returns a value as JSON has it: a number of NumPy as one of Python, a path as text, a tuple as a list."""
    try:
        return json.loads(json.dumps(value, default=_simple, allow_nan=False, ensure_ascii=False).encode())
    except (TypeError, ValueError) as error:
        raise UsageError(f"{name}: expected a text, a finite number, a path, or a list of them, not {value!r}") from error


def _simple(value: Any) -> int | float | str:
    """Returns a number or a path that JSON does not know."""
    if isinstance(value, numbers.Integral):
        return int(value)
    return float(value) if isinstance(value, numbers.Real) else os.fspath(value)
