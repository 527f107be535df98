"""Runs ASAM's quality checkers on the OpenSCENARIO and OpenDRIVE files below the given folders. Prints each issue.

A checker that ended in an error counts as an issue; the last line is the number of files and of completed checks.
"""
import contextlib
import functools
import io
import logging
import sys
from pathlib import Path

import qc_opendrive.main
import qc_openscenario.main
import xmlschema
from qc_baselib import Configuration, Result, StatusType

logging.disable(logging.CRITICAL)
# The checker of OpenDRIVE reads the schema for each file, which takes longer than the check.
xmlschema.XMLSchema11 = functools.cache(xmlschema.XMLSchema11)
BUNDLES = {".xosc": (qc_openscenario, "xoscBundle"), ".xodr": (qc_opendrive, "xodrBundle")}


def check(path):
    module, _ = BUNDLES[path.suffix]
    bundle = module.constants.BUNDLE_NAME
    config, result = Configuration(), Result()
    config.set_config_param("InputFile", str(path))
    result.register_checker_bundle(name=bundle, build_date="", description="", version="1", summary="")
    if hasattr(result, "set_result_version"):
        result.set_result_version(version="1")
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        module.main.run_checks(config, result)
    found, completed = [], 0
    for checker in result.get_checker_results(bundle):
        completed += checker.status == StatusType.COMPLETED
        found += [f"{path}: {checker.checker_id}: {issue.description} {issue.locations}" for issue in checker.issues]
        if checker.status == StatusType.ERROR:
            found.append(f"{path}: {checker.checker_id}: {checker.summary}")
    return found, completed


def main():
    files = sorted(path for root in sys.argv[1:] for path in Path(root).rglob("*") if path.suffix in BUNDLES)
    issues, checks = [], 0
    for path in files:
        found, completed = check(path)
        issues, checks = issues + found, checks + completed
    print("\n".join([*issues, f"{len(files)} files, {checks} checks, {len(issues)} issues"]))


main()
