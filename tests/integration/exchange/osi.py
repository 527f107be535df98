"""Reads OSI messages that Closecall wrote with other programs, and prints what they find as JSON.

Usage: osi.py FILE.mcap TRACE.osi…: the MCAP file is loaded and validated by omega-prime; each trace is read by osi3 strictly: no
field may be unknown. Then betterosi reads it by its name.
"""
import json
import struct
import sys
import warnings
from pathlib import Path

warnings.simplefilter("ignore")

import betterosi
import omega_prime
from google.protobuf import unknown_fields
from mcap.reader import make_reader
from osi3 import osi_groundtruth_pb2, osi_sensordata_pb2

TYPES = {
    "osi3.GroundTruth": osi_groundtruth_pb2.GroundTruth,
    "osi3.SensorData": osi_sensordata_pb2.SensorData,
}


def unknown(message):
    """Returns how many fields of a message and of those inside it have no name in the published definition."""
    count = len(unknown_fields.UnknownFieldSet(message))
    for field, value in message.ListFields():
        if field.message_type is not None:
            count += sum(map(unknown, value if field.is_repeated else [value]))
    return count


def frames(path):
    data, at = path.read_bytes(), 0
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        yield data[at + 4 : at + 4 + length]
        at += 4 + length


def vectors(base):
    return [base.position.x, base.position.y, base.position.z, base.orientation.yaw]


mcap, *traces = map(Path, sys.argv[1:])
recording = omega_prime.Recording.from_file(str(mcap), validate=True, parse_map=True, step_size=1.0)
found = {
    "objects": recording.df["idx"].n_unique(),
    "instants": recording.df["total_nanos"].n_unique(),
    "host": recording.host_vehicle_idx,
    "map_lanes": len(recording.map.lanes),
    "channels": {},
    "traces": {},
}
with mcap.open("rb") as file:
    for schema, channel, message in make_reader(file).iter_messages():
        entry = found["channels"].setdefault(channel.topic, {"messages": 0, "unknown": 0})
        entry["messages"] += 1
        # The package osi3 has no message for the map: omega-prime reads it above.
        if schema.name in TYPES:
            entry["unknown"] += unknown(TYPES[schema.name].FromString(message.data))
for trace in traces:
    kind = TYPES["osi3.GroundTruth" if "_gt_" in trace.name else "osi3.SensorData"]
    messages = [kind.FromString(frame) for frame in frames(trace)]
    first = messages[0]
    entry = {
        "messages": len(messages),
        "unknown": sum(map(unknown, messages)),
        "version": [first.version.version_major, first.version.version_minor, first.version.version_patch],
        "betterosi": sum(1 for _ in betterosi.read(str(trace), osi_message_type=kind.DESCRIPTOR.name)),
    }
    if "_gt_" in trace.name:
        entry["named"] = sum(1 for _ in betterosi.read(str(trace), return_ground_truth=True))
        entry["lanes"] = [len(message.lane) for message in messages]
        entry["boundaries"] = len(first.lane_boundary)
        entry["centres"] = [
            [message.timestamp.seconds + 1e-9 * message.timestamp.nanos, [vectors(one.base) for one in message.moving_object]]
            for message in messages
        ]
    else:
        entry["tracks"] = sum(len(message.moving_object) for message in messages)
        entry["rmse"] = min(
            (one.base_rmse.position.x for message in messages for one in message.moving_object), default=None
        )
    found["traces"]["gt" if "_gt_" in trace.name else "sd"] = entry
print(json.dumps(found))
