"""Draws the pictures of docs/how-to/looking again: in the real viewer, off screen. A test fails when they are older than the
code that draws them.

Needs the Rerun viewer with its Python package (`pip install rerun-sdk==0.36.3`) and Pillow. CLOSECALL_RERUN names the viewer's
program, WAIT_S the time that it gets to load a recording (s; 15 unless set).
"""
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

ROOT = Path(__file__).resolve().parent.parent
CLOSECALL = ROOT / "target/release/closecall"
FOLDER = ROOT / "docs/how-to/looking"
SIZE = "1456x819"
FULL = ["--sensors", "full"]
# The name of each picture, and the arguments that record what it shows.
RECORDED = {
    "paper-figure": ["run", "paper-figure"],
    "pair": ["run", "paper-figure", "--paired"],
    "fog": ["run", "low-thw-overtake", *FULL, "--set", "environment.visibility-m=60"],
    "empty-wet-road": ["run", "empty-wet-road", *FULL],
}


def call(*arguments):
    subprocess.run([CLOSECALL, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def shoot(recording, picture):
    """Takes a screenshot of the viewer with a recording."""
    port = random.randint(20000, 60000)
    command = [os.environ.get("CLOSECALL_RERUN", "rerun"), recording, "--headless", "--window-size", SIZE, "--port", str(port)]
    viewer = subprocess.Popen([*command, "--hide-welcome-screen"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              start_new_session=True)
    try:
        time.sleep(float(os.environ.get("WAIT_S", "15")))
        ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy").save_screenshot(str(picture))
        time.sleep(2)
    finally:
        os.killpg(viewer.pid, signal.SIGTERM)
    shrink(picture)


def shrink(picture):
    """Reduces the colours of a picture to 256: a third of the bytes."""
    Image.open(picture).convert("RGB").quantize(256).save(picture, optimize=True)


def fingerprint():
    """Returns the CRC-32 of the code that draws: without comments, blank lines and tests."""
    total = 0
    for path in sorted((ROOT / "report/src/run").rglob("*.rs"), key=lambda path: path.relative_to(ROOT).as_posix()):
        if path.name == "tests.rs":
            continue
        for line in path.read_text().splitlines():
            if line.strip() and not line.strip().startswith("//"):
                total = zlib.crc32(line.strip().encode(), total)
    return f"{total:08x}"


def main():
    chosen = set(sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name, arguments in RECORDED.items():
            if not chosen or name in chosen:
                call(*arguments, "--record", folder / f"{name}.rrd")
                shoot(folder / f"{name}.rrd", FOLDER / f"{name}.png")
        if not chosen or "beside" in chosen:
            traffic = folder / "own.csv"
            call("traffic", "record", "overtake-without-brake", "-n", 20, "--controller", "acc", "-o", traffic)
            call("traffic", "reenact", traffic, "--record", folder / "beside.rrd")
            shoot(folder / "beside.rrd", FOLDER / "beside.png")
        if not chosen or "figure" in chosen:
            call("plot", "paper-figure", "--paired", "-o", folder / "figure.png")
            picture = Image.open(folder / "figure.png")
            picture = picture.resize((1000, round(picture.height * 1000 / picture.width)))
            picture.save(FOLDER / "figure.png")
            shrink(FOLDER / "figure.png")
    if not chosen:
        (FOLDER / "drawn-by.txt").write_text(f"{fingerprint()}\n")


main()
