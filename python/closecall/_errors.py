"""The exceptions of Closecall."""

from __future__ import annotations

from ._native import shown


class ClosecallError(Exception):
    """A call without a result.

    ``exit_code`` is the exit code that the command line has. ``file``, ``line`` (from 1) and ``key`` say where the error
    is, or are ``None``. Control characters that a file or a name brings into the message are shown as their numbers.
    """

    def __init__(
        self,
        message: str,
        *,
        exit_code: int = 2,
        file: str | None = None,
        line: int | None = None,
        key: str | None = None,
    ) -> None:
        super().__init__(shown(message))
        self.exit_code = exit_code
        self.file = file
        self.line = line
        self.key = key


class UsageError(ClosecallError, ValueError):
    """An argument is wrong (exit code 2)."""


class InputError(ClosecallError, ValueError):
    """A scenario, trajectory file or network cannot be used (exit code 3). Nothing was run."""


class SampleError(ClosecallError, RuntimeError):
    """A sample has no outcome (exit code 5). The exception of a controller in Python is the ``__cause__``."""


class FileError(ClosecallError, OSError):
    """A file or folder cannot be read or written (exit code 6)."""


_BY_EXIT_CODE: dict[int, type[ClosecallError]] = {2: UsageError, 3: InputError, 5: SampleError, 6: FileError}


def make(message: str, *, exit_code: int, file: str | None, line: int | None, key: str | None) -> ClosecallError:
    """Returns the exception of an exit code. The native module calls it."""
    kind = _BY_EXIT_CODE.get(exit_code, ClosecallError)
    return kind(message, exit_code=exit_code, file=file, line=line, key=key)
