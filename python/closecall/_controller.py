"""Controllers that are Python objects."""

from __future__ import annotations

import copy
import ctypes
import functools
import hashlib
import inspect
import io
import os
import pickle
import sys
import sysconfig
import threading
import time
import types
import uuid
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, Literal, Protocol, runtime_checkable

from . import _host, _native
from ._errors import UsageError

#: Time that a hanging step has to end after the campaign (s).
END_TIMEOUT_S = 5.0
#: Interval at which steps that hang are looked for (s), and the time after which the campaign has certainly given up their sample (s).
WATCH_INTERVAL_S, GIVEN_UP_S = 0.25, 1.0

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

#: The controllers of the campaigns that run, by their names, with their limits in processes of their own.
REGISTERED: dict[str, tuple[ControllerLike, _host.Limits]] = {}


def native(controller: ControllerLike) -> str | _native.PythonController:
    """Returns the name, or the native controller that creates an object for each sample."""
    if isinstance(controller, str):
        return controller
    return _native.PythonController(hosted_name(controller), factory(controller))


def factory(controller: ControllerLike) -> Callable[[], Controller]:
    """Returns a function that creates an object for each sample."""
    if not isinstance(controller, (str, type)) and callable(getattr(controller, "step", None)):
        # Each sample starts without the memory of another one.
        kept: Any = controller
        return lambda: copy.deepcopy(kept)
    if callable(controller):
        return controller
    raise UsageError(
        f"controller: expected a name, an object with a method `step`, or a class or function that creates one, not {controller!r}"
    )


def hosted_name(controller: Any) -> str:
    """Returns ``python:NAME@VERSION``, in which the version identifies the code and the state of a controller or a perception."""
    own = controller if isinstance(controller, (type, types.FunctionType)) else type(controller)
    name = own.__qualname__.rpartition(".<locals>.")[2]
    word = "".join(letter if letter.isalnum() or letter in "._-" else "-" for letter in name)
    return f"{_native.PYTHON_PREFIX}:{word}@{_version(controller)}"


def _version(controller: Any) -> str:
    """Returns a hash of the code and the state of a controller, or a unique word if the state cannot be pickled."""
    try:
        return _digest(controller)[:12]
    except Exception:
        # Nothing says whether such a controller has changed: no campaign is resumed with it.
        return f"unidentified-{uuid.uuid4().hex[:12]}"


def _digest(obj: Any) -> str:
    """Returns a hash of the code and the state of an object."""
    described = io.BytesIO()
    _Describer(described).dump(obj)
    return hashlib.sha256(described.getvalue()).hexdigest()


class _Describer(pickle.Pickler):
    """Pickles an object for its hash: with the code of its functions and classes, not only their names.

    Installed packages are left to their names. The source text of a module stands for its other functions and constants.
    """

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, protocol=4)
        self._seen: set[int] = set()

    def persistent_id(self, obj: Any) -> Any:
        # The order of a set differs from process to process.
        if isinstance(obj, (set, frozenset)):
            return type(obj), sorted(_digest(member) for member in obj), getattr(obj, "__dict__", None)
        return None

    def reducer_override(self, obj: Any) -> Any:
        if not isinstance(obj, (type, types.FunctionType)):
            return NotImplemented
        is_installed = _is_installed(obj)
        if is_installed and (isinstance(obj, type) or _is_importable(obj)):
            return NotImplemented
        if id(obj) in self._seen:
            return str, (obj.__qualname__,)
        self._seen.add(id(obj))
        if isinstance(obj, types.FunctionType):
            cells = tuple(cell.cell_contents for cell in obj.__closure__ or ())
            if is_installed:
                # Such as a wrapper, which may enclose a function of the controller.
                return _described, (obj.__module__, obj.__qualname__, cells)
            return _described, (_module_source(obj), _code(obj.__code__), obj.__defaults__, obj.__kwdefaults__, cells)
        return _described, (obj.__qualname__, _module_source(obj), obj.__bases__, _members(obj))


def _described(*parts: Any) -> tuple[Any, ...]:
    """Returns its arguments: what a pickle of the describer would be read as."""
    return parts


def _members(own: type) -> tuple[tuple[Any, ...], ...]:
    """Returns the functions and attributes of a class. Of the names with two underscores, only functions are its author's."""
    members: list[tuple[Any, ...]] = []
    for name, value in vars(own).items():
        if isinstance(value, property):
            members.append((name, value.fget, value.fset, value.fdel))
        elif isinstance(value, functools.cached_property):
            members.append((name, value.func))
        elif isinstance(value, (staticmethod, classmethod)):
            members.append((name, value.__func__))
        elif isinstance(value, types.FunctionType) or not (name.startswith("__") or name == "_abc_impl"):
            members.append((name, value))
    return tuple(members)


def _is_installed(obj: Any) -> bool:
    """Returns whether a function or class belongs to Python or to an installed package."""
    path = getattr(sys.modules.get(obj.__module__), "__file__", None)
    return obj.__module__ == "builtins" or (path is not None and is_installed_file(path))


def is_installed_file(path: str) -> bool:
    """Returns whether a file belongs to Python or to an installed package, be it outside of the virtual environment."""
    whole = os.path.abspath(path)
    if {"site-packages", "dist-packages"} & set(whole.split(os.sep)):
        return True
    places = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
    return any(whole.startswith(place + os.sep) for place in places)


def _is_importable(obj: types.FunctionType) -> bool:
    """Returns whether a function is found by its name in its module."""
    found: object = sys.modules.get(obj.__module__)
    for name in obj.__qualname__.split("."):
        found = getattr(found, name, None)
    return found is obj


def _module_source(obj: Any) -> str:
    try:
        module = inspect.getmodule(obj)
        return "" if module is None else inspect.getsource(module)
    except (OSError, TypeError):
        # A notebook is no file: its functions stand for themselves.
        return ""


def _code(code: types.CodeType) -> tuple[Any, ...]:
    """Returns what a function does, without the place where it is written."""
    return code.co_code, code.co_names, tuple(map(_constant, code.co_consts))


def _constant(value: object) -> Any:
    """Returns a constant of a function as text, and code as what it does."""
    if isinstance(value, types.CodeType):
        return _code(value)
    if isinstance(value, tuple):
        return tuple(map(_constant, value))
    if isinstance(value, frozenset):
        return "frozenset", sorted(repr(_constant(item)) for item in value)
    return repr(value)


def _end(thread: int) -> None:
    """Raises ``SystemExit`` in a thread, as soon as it runs Python code."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(SystemExit))


def end_steps(controller: _native.PythonController) -> None:
    """Ends the steps that hang: they would keep their threads busy, and the interpreter could not end in order."""
    hanging, raised = controller.unregister(), set[int]()
    deadline_s = time.monotonic() + END_TIMEOUT_S
    while controller.is_busy and time.monotonic() < deadline_s:
        for thread in hanging:
            if thread not in raised:
                _end(thread)
                raised.add(thread)
        time.sleep(0.005)
        hanging = controller.unregister()
    if controller.is_busy:
        warnings.warn(f"{len(hanging)} steps of the controller hang in a call that cannot be interrupted", stacklevel=4)


@contextmanager
def _watched(controllers: list[_native.PythonController], sample_timeout_s: float) -> Iterator[None]:
    """Ends steps whose sample was given up, for as long as the context lasts: each would take its share of the interpreter."""
    is_over = threading.Event()

    def watch() -> None:
        while not is_over.wait(WATCH_INTERVAL_S):
            for controller in controllers:
                for thread in controller.late(sample_timeout_s + GIVEN_UP_S):
                    _end(thread)

    watching = threading.Thread(target=watch, name="closecall watch", daemon=True)
    watching.start()
    try:
        yield
    finally:
        is_over.set()
        watching.join()


@contextmanager
def registered(
    controllers: list[ControllerLike], limits: _host.Limits | None = None, is_remote: bool = False, timeout_s: float = _native.SAMPLE_TIMEOUT_S
) -> Iterator[list[str]]:
    """Gives every controller a name that the commands of the program know, for as long as the context lasts.

    With ``limits``, the samples of objects run in worker processes that keep to them: of this program, or of a cluster. Without,
    steps end that hang for longer than ``timeout_s``, the time limit of a sample.
    """
    names = [one if isinstance(one, str) else hosted_name(one) for one in controllers]
    objects = {name: one for name, one in zip(names, controllers) if not isinstance(one, str)}
    own: list[_native.PythonController] = []
    process: tuple[list[str], int, int] | None = None
    with ExitStack() as ends:
        if limits is not None and objects:
            words: list[str] = []
            if not is_remote:
                words = ends.enter_context(_host.parcel(objects, limits).file())
            process = (words, *limits)
        try:
            for name, controller in objects.items():
                made = _native.PythonController(name, factory(controller), process)
                made.register()
                own.append(made)
                REGISTERED[name] = controller, limits or _host.Limits()
            if own and limits is None:
                ends.enter_context(_watched(own, timeout_s))
            yield names
        finally:
            for made in own:
                REGISTERED.pop(made.name, None)
                end_steps(made)
