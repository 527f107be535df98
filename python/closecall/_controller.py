"""Controllers that are Python objects."""

from __future__ import annotations

import copy
import ctypes
import hashlib
import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Literal, Protocol, runtime_checkable

from . import _native
from ._errors import UsageError

#: What the ego stack does, for the summary of the margin increase system.
State = Literal["following", "increasing", "holding", "releasing", "emergency-braking"]


@runtime_checkable
class Controller(Protocol):
    """A controller of the ego vehicle: any object with a method ``step``.

    It may also have a method ``start(self, setup: Setup) -> None``, which is called before the first step.
    """

    def step(self, input: _native.ControllerInput, /) -> float | tuple[float, State]:
        """Returns the acceleration (m/s²) for the next 0.04 s, or a pair of it and a state."""


#: A name of a built-in controller, ``exec:COMMAND``, an object with ``step`` (copied for each sample), or a class or function
#: that creates one without arguments (called for each sample).
ControllerLike = str | Controller | Callable[[], Controller]


def native(controller: ControllerLike) -> str | _native.PythonController:
    """Returns the name, or the native controller that creates an object for each sample."""
    if isinstance(controller, str):
        return controller
    if not isinstance(controller, type) and callable(getattr(controller, "step", None)):
        # Each sample starts without the memory of another one.
        return _native.PythonController(_name(type(controller)), lambda: copy.deepcopy(controller))
    if callable(controller):
        return _native.PythonController(_name(controller), controller)
    raise UsageError(
        f"controller: {controller!r} is none: expected a name, an object with a method `step`, or a class or function that creates one"
    )


def _name(creator: Any) -> str:
    """Returns ``python:NAME@VERSION``. The version changes with the source text of the module that defines the controller."""
    name = getattr(creator, "__qualname__", type(creator).__name__).rpartition(".<locals>.")[2]
    try:
        module = inspect.getmodule(creator)
        source = inspect.getsource(module if module is not None else creator)
    except (OSError, TypeError):
        source = ""
    version = hashlib.sha256(source.encode()).hexdigest()[:12]
    word = "".join(letter if letter.isalnum() or letter in "._-" else "-" for letter in name)
    return f"{_native.PYTHON_PREFIX}:{word}@{version}"


@contextmanager
def registered(controllers: list[ControllerLike]) -> Iterator[list[str]]:
    """Gives every controller a name that the commands of the program know, for as long as the context lasts."""
    names: list[str] = []
    own: list[_native.PythonController] = []
    try:
        for controller in controllers:
            made = native(controller)
            if isinstance(made, str):
                names.append(made)
            else:
                made.register()
                own.append(made)
                names.append(made.name)
        yield names
    finally:
        for made in own:
            for thread in made.unregister():
                # A step that never returns would keep its thread, and with it the interpreter, busy.
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(SystemExit))
