"""From recorded traffic to distributions."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any, Literal, overload

from . import _native
from ._command import call
from ._errors import UsageError
from ._scenario import whole

PathLike = str | os.PathLike[str]
#: The layout of a trajectory file. By default it is recognised by the content.
Layout = Literal["ngsim", "highd", "commonroad", "csv", "in-car", "sumo", "vissim", "i24", "openlabel", "osi"]


class Rows(list[dict[str, Any]]):
    """Rows of a table, as dictionaries. ``pyarrow.table(rows.table())``, ``polars.DataFrame(rows.table())`` and
    ``pandas.DataFrame.from_arrow(rows.table())`` make a table of them."""

    def table(self) -> _native.Table:
        """Returns the rows as a table. A nested key such as ``metrics`` gives columns such as ``metrics.thw_s``."""
        return _native.rows_table(json.dumps([_flat(row) for row in self]))


def _flat(row: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Returns a row whose nested dictionaries have become keys with dots."""
    flat: dict[str, Any] = {}
    for key, value in row.items():
        flat |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return flat


@overload
def lane_changes(
    file: PathLike,
    *,
    criterion: Literal["peak", "distance", "gradient"] = "peak",
    lanes: Literal["recorded", "none"] = "recorded",
    reference: None = None,
    layout: Layout | None = None,
    drop_bad_rows: bool = False,
) -> Rows: ...


@overload
def lane_changes(
    file: PathLike,
    *,
    criterion: Literal["peak", "distance", "gradient"] = "peak",
    lanes: Literal["recorded", "none"] = "recorded",
    reference: PathLike,
    layout: Layout | None = None,
    drop_bad_rows: bool = False,
) -> dict[str, Any]: ...


def lane_changes(
    file: PathLike,
    *,
    criterion: Literal["peak", "distance", "gradient"] = "peak",
    lanes: Literal["recorded", "none"] = "recorded",
    reference: PathLike | None = None,
    layout: Layout | None = None,
    drop_bad_rows: bool = False,
) -> Rows | dict[str, Any]:
    """Finds the lane changes in a trajectory file, as ``closecall traffic lane-changes`` does.

    The result has a dictionary for each, and can be read as a table (:class:`Rows`). Each has ``track_id``, ``direction``, ``start_s``, ``crossing_s``, ``end_s``, ``duration_s``, ``speed_mps`` (m/s), ``complete`` and
    more. With ``reference``, a list of known lane changes (CSV), the result is a dictionary with recall and precision.

    Raises :class:`InputError` with file, line and column (``key``) if the file cannot be used.
    """
    named = {"file": file, "criterion": criterion, "lanes": lanes, "reference": reference}
    _, result = call("lane_changes", {**named, "layout": layout, "drop_bad_rows": drop_bad_rows})
    return Rows(result) if isinstance(result, list) else dict(result)


def criticality(
    file: PathLike,
    *,
    speed_limit_mps: float | None = None,
    ttce_alone: bool = False,
    curvilinear: bool = False,
    layout: Layout | None = None,
    drop_bad_rows: bool = False,
) -> Rows:
    """Computes how critical each lane change of a trajectory file is, as ``closecall traffic criticality`` does.

    ``speed_limit_mps`` (m/s) is 120 km/h by default. Each lane change has the keys of :func:`lane_changes` and ``metrics``
    with ``distance_m``, ``speed_mps``, ``a_lon_mps2``, ``a_lat_mps2``, ``thw_s``, ``dce_m``, ``ttce_s``. With ``curvilinear``, the
    key ``curvilinear`` has the closest encounter along the lanes, ``dce_curvilinear_m`` and ``ttce_curvilinear_s``. The result can be
    read as a table (:class:`Rows`).
    """
    named = {"file": file, "speed_limit_mps": speed_limit_mps, "ttce_alone": ttce_alone, "curvilinear": curvilinear}
    _, result = call("criticality", {**named, "layout": layout, "drop_bad_rows": drop_bad_rows})
    return Rows(result)


def fit(
    files: PathLike | Sequence[PathLike],
    *,
    output: PathLike | None = None,
    provenance: str = "",
    correlations: bool = False,
    seed: int = 0,
    layout: Layout | None = None,
    drop_bad_rows: bool = False,
) -> dict[str, Any]:
    """Fits the distributions of a logical scenario to trajectory files, as ``closecall traffic fit`` does.

    ``output`` is the scenario part to write (TOML). The result has ``fitted``: for each parameter ``name``, ``median``,
    ``interval_95``, ``quantiles``, ``n`` and ``goodness_of_fit``.
    """
    several = [files] if isinstance(files, (str, os.PathLike)) else list(files)
    if not several:
        raise UsageError("files: expected at least one trajectory file, not an empty list")
    named = {"files": several, "output": output, "provenance": provenance, "correlations": correlations, "seed": whole("seed", seed)}
    _, result = call("fit", {**named, "layout": layout, "drop_bad_rows": drop_bad_rows})
    return dict(result)
