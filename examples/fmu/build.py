"""Builds the example FMU `acc` with a C compiler, as FMI 2.0 or FMI 3.0.

    python3 examples/fmu/build.py 2 acc.fmu
"""
import argparse
import pathlib
import platform
import subprocess
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("fmi", choices=["2", "3"], help="version of FMI")
parser.add_argument("fmu", type=pathlib.Path, help="the FMU that is written")
parser.add_argument("--source", type=pathlib.Path, default=HERE / "acc.c", help="another source, for tests")
parser.add_argument("--description", type=pathlib.Path, help="another description, for tests")
parser.add_argument("--platform", help="another name of the platform, for tests")
given = parser.parse_args()

system, machine = platform.system(), platform.machine().replace("AMD64", "x86_64").replace("arm64", "aarch64")
name, suffix = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}[system]
folder = f"{machine}-{name}"
if given.fmi == "2" and machine == "x86_64":
    folder = {"linux": "linux64", "darwin": "darwin64", "windows": "win64"}[name]

with tempfile.TemporaryDirectory() as temporary:
    binary = pathlib.Path(temporary) / f"acc{suffix}"
    # Without contraction, the last bits are the same on every processor.
    options = ["-std=c11", "-O2", "-ffp-contract=off", "-shared", "-fPIC", f"-DFMI={given.fmi}"]
    include = HERE.parent.parent / "controllers/include"
    subprocess.run(["cc", *options, "-I", include, "-o", binary, given.source, "-lm"], check=True)
    with zipfile.ZipFile(given.fmu, "w", zipfile.ZIP_DEFLATED) as archive:
        description = given.description or HERE / f"modelDescription-fmi{given.fmi}.xml"
        archive.write(description, "modelDescription.xml")
        archive.write(binary, f"binaries/{given.platform or folder}/acc{suffix}")
