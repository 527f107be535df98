"""Campaigns on a Ray cluster.

>>> import closecall.ray
>>> result = closecall.ray.campaign("low-thw-overtake", n=20_000, paired=True, out="results", address="auto")

The campaign itself stays in this process: its folder, its journal, its gates and its verdict are the same
as with :func:`closecall.campaign`, byte for byte. Blocks of samples run as tasks of Ray, which runs a task again if its worker or its
machine fails, and adds machines as far as it may.

Every machine needs the same wheel of Closecall. Scenarios, recorded traffic, controllers in Python and files that the command of a
controller names by a relative path are shipped.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib
import os
import pickle
import signal
import socket
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from . import _host, _native
from . import _campaign as _campaigns
from ._campaign import CampaignResult, ScenarioLike
from ._controller import REGISTERED
from ._errors import ClosecallError, FileError, InputError

__all__ = ["campaign"]

#: Number of times that a block runs again after its worker or its machine has failed.
RETRIES = 5
#: Interval at which the size of the cluster is looked at (s).
CAPACITY_INTERVAL_S = 2.0
#: Time that the cluster has to accept a connection (s).
CONNECT_TIMEOUT_S = 10.0
#: More than the size of `struct sigaction` on any system (bytes).
SIGACTION_BYTES = 1_024

#: The version, the manifest, the names of the controllers, and the files: name, content, whether it is a program.
Shipment = tuple[str, str, list[str], list[tuple[str, bytes, bool]]]
#: What a task is given: a hash of all, the version, the manifest, the files, and the pickled controllers.
Shipped = tuple[str, str, str, list[tuple[str, bytes, bool]], bytes]


def campaign(
    scenarios: ScenarioLike | Sequence[ScenarioLike], n: int | None = None, *, address: str = "auto", **options: Any
) -> CampaignResult:
    """Runs a campaign on a Ray cluster. All but ``address`` is as in :func:`closecall.campaign`, and so is the result.

    ``address`` is ``"auto"`` (the cluster of this machine, or of ``RAY_ADDRESS``), ``"HOST:PORT"``, ``"ray://HOST:PORT"``, or
    ``"local"`` (a cluster is started on this machine for the campaign). If the program has called ``ray.init``, that cluster is
    used.

    Raises :class:`InputError` if Ray is not installed, or if a machine has another version of Closecall; :class:`FileError` if there
    is no such cluster, or if a block fails for good. The journal keeps what came before, and ``resume=True`` goes on from there, also
    after this process was killed.
    """
    return _campaigns.campaign(scenarios, n, ray=address, **options)


def connect(address: str, shipment: Shipment) -> Cluster:
    """Connects to a cluster that is to run blocks of one campaign. The native module calls it."""
    try:
        ray = importlib.import_module("ray")
    except ImportError as error:
        raise InputError(f'Ray is not installed ({error}): pip install "closecall[ray]"', exit_code=3) from error
    end = _nothing if ray.is_initialized() else _initialise(ray, address)
    try:
        return Cluster(ray, shipment, end)
    except BaseException:
        end()
        raise


def _nothing() -> None:
    """Ends nothing: the program itself has made the connection."""


def _initialise(ray: Any, address: str) -> Callable[[], None]:
    """Connects this process to a cluster, or starts one. Returns what ends the connection, or the cluster."""
    _check_reachable(address)
    options: dict[str, Any] = {"include_dashboard": False} if address == "local" else {}
    raised: list[BaseException] = []
    is_ready, is_over = threading.Event(), threading.Event()

    def initialise() -> None:
        try:
            ray.init(address=address, log_to_driver=False, logging_level="ERROR", **options)
        except BaseException as error:
            raised.append(error)
        is_ready.set()
        # The system ends the processes of a cluster that this thread has started, when the thread ends.
        if not raised:
            is_over.wait()

    def end() -> None:
        ray.shutdown()
        is_over.set()

    # Ray would take over SIGTERM, which stops a campaign in order: in the main thread by Python, and in any by its own library.
    with _kept_signals():
        threading.Thread(target=initialise, name="ray.init", daemon=True).start()
        is_ready.wait()
    for error in raised:
        message = f"failed to connect to the cluster `{address}`: {error}"
        if isinstance(error, ValueError):
            message += "; expected `auto`, `local`, `HOST:PORT` or `ray://HOST:PORT`"
        # Ray refuses a cluster with another version of Ray or Python by a RuntimeError.
        if isinstance(error, RuntimeError) and "ersion" in str(error):
            raise InputError(message, exit_code=3) from error
        raise FileError(message, exit_code=6) from error
    return end


@contextmanager
def _kept_signals() -> Iterator[None]:
    """Lets SIGINT and SIGTERM have the handlers after the context that they have before, whichever language has set them."""
    if os.name != "posix":
        yield
        return
    library = ctypes.CDLL(None)
    kept = {number: ctypes.create_string_buffer(SIGACTION_BYTES) for number in (signal.SIGINT, signal.SIGTERM)}
    for number, action in kept.items():
        library.sigaction(int(number), None, action)
    try:
        yield
    finally:
        for number, action in kept.items():
            library.sigaction(int(number), action, None)


def _check_reachable(address: str) -> None:
    """Refuses an address at which nothing listens, which Ray tries for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if address in ("auto", "local") or not port.isdecimal():
        return
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT_TIMEOUT_S).close()
    except (OSError, OverflowError) as error:
        raise FileError(f"there is no cluster at `{address}`: {error}", exit_code=6) from error


class Cluster:
    """The machines that run the blocks of one campaign. The native module calls its methods."""

    def __init__(self, ray: Any, shipment: Shipment, end: Callable[[], None]) -> None:
        version, manifest, names, files = shipment
        self._ray = ray
        self._end = end
        pickled = pickle.dumps(_parcel(names))
        digest = hashlib.sha256(repr((version, manifest, files)).encode() + pickled).hexdigest()
        shipped: Shipped = (digest, version, manifest, files, pickled)
        self._shipped = ray.put(shipped)
        self._task = ray.remote(num_cpus=1, max_retries=0, retry_exceptions=False)(_task())
        # A block: its number, the index of its scenario, its samples, and how often it may run again. Ray itself would start a task
        # without end whose worker needs too much memory.
        self._awaited: dict[Any, tuple[int, int, list[int], int]] = {}
        errors = ray.exceptions
        self._lost = (
            errors.WorkerCrashedError,
            errors.NodeDiedError,
            errors.OutOfMemoryError,
            errors.ObjectLostError,
            errors.LocalRayletDiedError,
        )
        self._slots = 0
        self._asked_s = -CAPACITY_INTERVAL_S

    def capacity(self) -> int:
        """Returns the number of blocks that can run at the same time."""
        if time.monotonic() >= self._asked_s + CAPACITY_INTERVAL_S:
            self._slots = int(self._ray.cluster_resources().get("CPU", 0))
            self._asked_s = time.monotonic()
        return self._slots

    def submit(self, block: int, work: int, samples: list[int]) -> None:
        """Submits a block."""
        self._submit(block, work, samples, RETRIES)

    def _submit(self, block: int, work: int, samples: list[int], left: int) -> None:
        self._awaited[self._task.remote(self._shipped, work, samples)] = block, work, samples, left

    def wait(self, timeout_s: float) -> list[tuple[int, bytes]]:
        """Returns the blocks that are done within a time."""
        awaited = list(self._awaited)
        ready, _ = self._ray.wait(awaited, num_returns=1, timeout=timeout_s)
        if ready:
            ready, _ = self._ray.wait(awaited, num_returns=len(awaited), timeout=0)
        answers = [self._answer(ref) for ref in ready]
        return [answer for answer in answers if answer is not None]

    def _answer(self, ref: Any) -> tuple[int, bytes] | None:
        """Returns a block with its answer, or ``None`` if its worker was lost and it runs again."""
        block, work, samples, left = self._awaited.pop(ref)
        try:
            kind, answer = self._ray.get(ref)
        except self._ray.exceptions.RayError as error:
            first = f"{len(samples)} samples from {samples[0]} on"
            if left > 0 and isinstance(error, self._lost):
                # A controller may have ended its worker: what runs again is never silent.
                warnings.warn(f"block {block} ({first}) runs again, because its worker was lost: {type(error).__name__}", stacklevel=1)
                self._submit(block, work, samples, left - 1)
                return None
            raise FileError(f"block {block} ({first}) has failed for good: {error}", exit_code=6) from error
        if kind == "refused":
            raise InputError(answer, exit_code=3)
        if kind == "failed":
            raise FileError(answer, exit_code=6)
        return block, answer

    def cancel(self) -> None:
        """Gives up the blocks that are not done."""
        for ref in self._awaited:
            self._ray.cancel(ref, force=True)
        self._awaited.clear()

    def close(self) -> None:
        """Ends the connection, if it was made for this campaign."""
        self._end()


def _task() -> Callable[[Shipped, int, list[int]], tuple[str, Any]]:
    """Returns the task. A function within a function is shipped as such: the machine need not have this module."""

    def run_block(shipped: Shipped, work: int, samples: list[int]) -> tuple[str, Any]:
        import socket

        node, version = socket.gethostname(), shipped[1]
        try:
            import closecall

            native = getattr(closecall, "_native", closecall)
            found = native.version() if hasattr(native, "version") else closecall.__version__
        except ImportError as error:
            return "refused", f"{node} has no Closecall, and the campaign was started by {version}: {error}"
        if found != version:
            return "refused", f"{node} has Closecall {found}, and the campaign was started by {version}: install the same wheel"
        from closecall.ray import answer

        kind, result = answer(shipped, work, samples)
        return kind, result if kind == "done" else f"{node}: {result}"

    return run_block


def _parcel(names: list[str]) -> _host.Parcel:
    """Returns the controllers of the campaign that is to run, as the workers need them."""
    controllers = {name: REGISTERED[name] for name in names}
    limits = next((limits for _, limits in controllers.values()), _host.Limits())
    return _host.parcel({name: one for name, (one, _) in controllers.items()}, limits)


class _Prepared:
    """A campaign that a worker has prepared. Controllers run in processes of their own, which stay from block to block."""

    def __init__(self, shipped: Shipped) -> None:
        self.digest, version, manifest, files, pickled = shipped
        parcel: _host.Parcel = pickle.loads(pickled)
        self._ends = ExitStack()
        words = self._ends.enter_context(parcel.file()) if parcel.names else []
        self._controllers = [_native.PythonController(name, _absent, (words, *parcel.limits)) for name in parcel.names]
        for controller in self._controllers:
            controller.register()
        try:
            self.runner = _native.BlockRunner(version, manifest, files)
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        for controller in self._controllers:
            controller.unregister()
        self._ends.close()


def _absent() -> Any:
    """Stands for a controller that the processes of this one have."""
    raise RuntimeError("the controller runs in processes of its own")


_prepared: _Prepared | None = None


def answer(shipped: Shipped, work: int, samples: list[int]) -> tuple[str, Any]:
    """Runs a block in a worker of the cluster. Returns ``"done"`` and the records, or ``"refused"`` or ``"failed"`` and why."""
    global _prepared
    try:
        if _prepared is None or _prepared.digest != shipped[0]:
            if _prepared is not None:
                _prepared.end()
                _prepared = None
            _prepared = _Prepared(shipped)
        return "done", _prepared.runner.run(work, samples)
    except ClosecallError as error:
        return "refused" if error.exit_code == 3 else "failed", str(error)
