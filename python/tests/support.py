"""What the tests share."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCENARIO = "low-thw-overtake"

sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in ("examples", "benches")]


def command(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs the command that the package has installed."""
    program = Path(sys.executable).with_name("closecall")
    return subprocess.run([program, *words], capture_output=True, text=True, timeout=300)
