"""The command ``closecall``, and calls of its commands."""

from __future__ import annotations

import re
import signal
import sys
import warnings
from collections.abc import Callable, Iterable
from typing import Any

from . import _native
from ._errors import ClosecallError

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


def call(arguments: Iterable[str], progress: Callable[[int, int], Any] | None = None) -> tuple[int, str]:
    """Runs a command, and returns its exit code and its output. Its warnings become Python's. Messages name keywords."""
    try:
        code, output, messages = _native.call([PROGRAM, *arguments], progress)
    except ClosecallError as error:
        error.args = (keywords(str(error)), *error.args[1:])
        raise
    for message in messages:
        if message.startswith("warning: "):
            warnings.warn(keywords(message.removeprefix("warning: ")), stacklevel=3)
    return code, output


#: An option of the command line in a text, and its value.
OPTION = re.compile(r"(?<![\w/-])--([a-z][a-z0-9]*(?:-[a-z0-9]+)*)(?: <[^>]*>| [A-Z]+\b)?")
#: The keywords whose options have other names.
RENAMED = {"samples": "n", "record": "record"}


def keywords(text: str) -> str:
    """Returns a text of the command line that names keywords instead of options: ``--max-collisions`` is ``max_collisions=``."""
    return OPTION.sub(lambda option: RENAMED.get(option[1], option[1].replace("-", "_")) + "=", text)


def option(name: str, value: object) -> list[str]:
    """Returns the words of an option: ``max_collisions=3`` is ``--max-collisions 3``.

    ``None`` and ``False`` leave it out, ``True`` is an option without a value, a list repeats it.
    """
    word = "--" + name.rstrip("_").replace("_", "-")
    if value is None or value is False:
        return []
    if value is True:
        return [word]
    if isinstance(value, (list, tuple)):
        return [part for item in value for part in option(name, item)]
    return [f"{word}={value}"]
