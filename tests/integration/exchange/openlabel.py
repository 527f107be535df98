"""Validates OpenLABEL files that Closecall wrote, and prints what they hold as JSON.

Usage: openlabel.py FILE.json…: each file is validated by the JSON schema of OpenLABEL 1.0.0 that the package `vcd` has. Then its
pointers are compared: frames, objects, actions and relations have to agree.
"""
import json
import sys
from pathlib import Path

import jsonschema
from vcd.schema import openlabel_schema


def contiguous(numbers):
    """Returns the intervals of frame numbers without one missing."""
    intervals = []
    for number in sorted(numbers):
        if intervals and intervals[-1]["frame_end"] + 1 == number:
            intervals[-1]["frame_end"] = number
        else:
            intervals.append({"frame_start": number, "frame_end": number})
    return intervals


def refuse_twice(pairs):
    names = [name for name, _ in pairs]
    assert len(set(names)) == len(names), f"a member stands there twice: {names}"
    return dict(pairs)


summaries = []
for path in map(Path, sys.argv[1:]):
    document = json.loads(path.read_text(), object_pairs_hook=refuse_twice)
    errors = [
        f"{error.json_path}: {error.message[:200]}"
        for error in jsonschema.Draft7Validator(openlabel_schema).iter_errors(document)
    ]
    file = document["openlabel"]
    frames = {int(number): frame for number, frame in file["frames"].items()}
    wrong = []
    for kind in ("objects", "actions"):
        present = {}
        for number, frame in frames.items():
            for uid in frame.get(kind, {}):
                present.setdefault(uid, []).append(number)
        stated = {uid: element["frame_intervals"] for uid, element in file.get(kind, {}).items()}
        wrong += [f"{kind} {uid}" for uid in stated if stated[uid] != contiguous(present.get(uid, []))]
        wrong += [f"{kind} {uid} is not stated" for uid in present if uid not in stated]
    if file["frame_intervals"] != contiguous(frames):
        wrong.append("frame_intervals")
    of_kind = {"object": file["objects"], "action": file.get("actions", {})}
    for uid, relation in file.get("relations", {}).items():
        agents = relation["rdf_subjects"] + relation["rdf_objects"]
        wrong += [f"relation {uid}" for agent in agents if agent["uid"] not in of_kind[agent["type"]]]
    summaries.append(
        {
            "errors": errors,
            "wrong": wrong,
            "objects": len(file["objects"]),
            "frames": len(frames),
            "rows": sum(len(frame["objects"]) for frame in frames.values()),
            "actions": [action["type"] for action in file.get("actions", {}).values()],
            "relations": len(file.get("relations", {})),
            "tags": {tag["type"]: tag.get("tag_data") for tag in file.get("tags", {}).values()},
        }
    )
print(json.dumps(summaries))
