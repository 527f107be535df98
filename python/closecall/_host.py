"""Worker processes that run whole samples with a controller that is a Python object.

The object is pickled by value: with the code of all modules that are not installed packages. A process that crashes, ends, hangs or
needs too much memory costs the sample that it runs.
"""

from __future__ import annotations

import faulthandler
import importlib
import importlib.util
import linecache
import os
import pickle
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from . import _native
from ._errors import InputError, UsageError

#: Starts a worker process, whose first argument is the file of the controllers. The working folder holds no modules for it.
START = "import sys; sys.path[:] = filter(None, sys.path); from closecall._host import main; raise SystemExit(main())"

#: The first version whose fault handler can leave out addresses of C functions, which it writes otherwise.
HAS_C_STACK = (3, 14)


class Limits(NamedTuple):
    """The limits of a worker process: the time of an answer (ms), and the memory (MiB)."""

    timeout_ms: int = _native.CONTROLLER_TIMEOUT_MS
    memory_mib: int = _native.CONTROLLER_MEMORY_MIB


class Parcel(NamedTuple):
    """Controllers or a perception for other processes: their names, the library that reads them, how it reads them, and their limits."""

    names: list[str]
    library: str
    pickled: bytes
    limits: Limits

    @contextmanager
    def file(self, start: str = START) -> Iterator[list[str]]:
        """Writes a file, for as long as the context lasts, and returns the words that start a worker process with it.

        ``start`` is the code with which the process begins.
        """
        content = pickle.dumps((sys.path, self.names, self.library, self.pickled))
        with ExitStack() as ends:
            if sys.platform == "linux":
                # The system frees it with this process, which may end without notice, as processes of Ray do.
                number = os.memfd_create("closecall-controllers")
                ends.callback(os.close, number)
                file = Path(f"/proc/{os.getpid()}/fd/{number}")
            else:
                file = Path(ends.enter_context(tempfile.TemporaryDirectory(prefix="closecall-")), "controllers.pickle")
            file.write_bytes(content)
            yield [sys.executable, "-c", start, str(file)]


def pickle_library(who: str = "isolate=True") -> str:
    """Returns the name of the library that pickles code by value. ``who`` needs it."""
    for name in ("cloudpickle", "ray.cloudpickle"):
        try:
            if importlib.util.find_spec(name) is not None:
                return name
        except ImportError:
            continue
    raise UsageError(f'{who} needs cloudpickle: pip install "closecall[isolate]"')


def parcel(controllers: dict[str, Any], limits: Limits, what: str = "a controller", who: str = "isolate=True") -> Parcel:
    """Pickles controllers with the code of all modules that are not installed, and with their source text.

    ``what`` they are, and ``who`` needs a library to pickle them, stand in messages.
    """
    if not controllers:
        return Parcel([], "", b"", limits)
    library = pickle_library(who)
    cloudpickle = importlib.import_module(library)
    own = [module for module in list(sys.modules.values()) if _is_own(module)]
    for module in own:
        cloudpickle.register_pickle_by_value(module)
    files = [getattr(module, "__file__", None) for module in [*own, sys.modules["__main__"]]]
    sources = {file: linecache.getlines(file) for file in files if file is not None}
    try:
        return Parcel(list(controllers), library, cloudpickle.dumps((controllers, sources)), limits)
    except Exception as error:
        raise InputError(
            f"{what} cannot be given to another process, since it cannot be pickled: {error}", exit_code=3
        ) from error
    finally:
        for module in own:
            cloudpickle.unregister_pickle_by_value(module)


def main() -> int:
    """Serves samples with the controllers of the file that the first argument names."""
    prepare()
    file, *words = sys.argv[1:]
    kept = _load(file)
    sys.argv[:] = [""]
    code = _native.main(["closecall", *words])
    del kept
    return code


def prepare() -> None:
    """Prepares a process that a program of Closecall has started."""
    # The process lives as long as its standard input: Ctrl-C is for the program that has started it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The message of a crash has the lines of Python, and no addresses, which would differ each time.
    if sys.version_info >= HAS_C_STACK:
        faulthandler.enable(all_threads=False, c_stack=False)  # type: ignore[call-arg,unused-ignore]
    else:
        faulthandler.enable(all_threads=False)


def unpacked(file: str) -> dict[str, Any]:
    """Returns the objects of a file, by their names. Whatever their code raises is raised."""
    # The file was written by the process that has started this one.
    path, _, library, pickled = pickle.loads(Path(file).read_bytes())
    sys.path[:] = path
    objects, sources = importlib.import_module(library).loads(pickled)
    _remember(sources)
    return dict(objects)


def _remember(sources: dict[str, list[str]]) -> None:
    """Keeps the source text of files, so that a traceback quotes their lines as in the process that has them."""
    for name, lines in sources.items():
        linecache.cache[name] = (sum(map(len, lines)), None, lines, name)


def _load(file: str) -> list[_native.PythonController]:
    """Registers the controllers of a file under their names. Samples of those that cannot be loaded are refused."""
    from ._controller import factory

    # The file was written by the process that has started this one.
    path, names, library, pickled = pickle.loads(Path(file).read_bytes())
    sys.path[:] = path
    try:
        controllers, sources = importlib.import_module(library).loads(pickled)
    except ImportError as error:
        reason = f"a controller needs a package that is not installed there: {error}"
    except BaseException as error:
        reason = f"a controller cannot be read there: {type(error).__name__}: {error}"
    else:
        _remember(sources)
        made = [_native.PythonController(name, factory(one)) for name, one in controllers.items()]
        for controller in made:
            controller.register()
        return made
    for name in names:
        _native.refuse(name, reason)
    return []


def _is_own(module: Any) -> bool:
    """Returns whether a module is a file of the user, and belongs to no installed package."""
    from ._controller import is_installed_file

    file, name = getattr(module, "__file__", None), getattr(module, "__name__", "")
    if file is None or name == "__main__" or name.partition(".")[0] in ("closecall", "ray"):
        return False
    return name in sys.modules and not is_installed_file(file)
