"""Reads data sets of aerial pictures, as `closecall tool render --aerial` writes them, and compares oriented boxes."""

import json
import pathlib

import numpy as np
from PIL import Image

CLASSES = ("car", "truck")
# Pixels for each cell of the network's output, along each axis.
STRIDE = 8
# Sizes are stated as logarithms of their ratio to these (px).
LENGTH_PX, WIDTH_PX = 32.0, 16.0


class Picture:
    """A picture: pixels [height, width, 3], and a row for each box: column, row, length, width, angle, class, difficult."""

    def __init__(self, folder, name):
        folder = pathlib.Path(folder)
        self.name = name
        with Image.open(folder / "images" / f"{name}.png") as image:
            self.pixels = np.asarray(image.convert("RGB"))
        self.pose = json.loads((folder / "labels" / f"{name}.json").read_text())
        rows = [line.split() for line in (folder / "labels" / f"{name}.txt").read_text().splitlines()]
        self.boxes = np.array([box_of(row) for row in rows], dtype=np.float64).reshape(-1, 7)


def box_of(row):
    """Returns a box from a line of labels. The corners are front left, rear left, rear right, front right."""
    corners = np.array(row[:8], dtype=np.float64).reshape(4, 2)
    along = corners[0] - corners[1]
    across = corners[2] - corners[1]
    centre = corners.mean(0)
    angle = np.arctan2(along[1], along[0])
    size = [np.hypot(*along), np.hypot(*across)]
    return [*centre, *size, angle, CLASSES.index(row[8]), int(row[9])]


def read(folder):
    """Reads all pictures of a data set, in the order of their names."""
    names = sorted(path.stem for path in (pathlib.Path(folder) / "images").glob("*.png"))
    if not names:
        raise SystemExit(f"{folder}: no pictures found in `images`; `closecall tool render --aerial` writes them")
    return [Picture(folder, name) for name in names]


def corners_of(box):
    """Returns the corners of a box (column, row, length, width, angle), in order around it."""
    cos, sin = np.cos(box[4]), np.sin(box[4])
    half_along, half_across = 0.5 * box[2] * np.array([cos, sin]), 0.5 * box[3] * np.array([-sin, cos])
    centre = box[:2]
    return np.array([
        centre + half_along + half_across,
        centre - half_along + half_across,
        centre - half_along - half_across,
        centre + half_along - half_across,
    ])


def overlap(a, b):
    """Returns the intersection over union of two boxes."""
    if np.hypot(*(a[:2] - b[:2])) > 0.5 * (np.hypot(a[2], a[3]) + np.hypot(b[2], b[3])):
        return 0.0
    polygon, clip = list(corners_of(a)), corners_of(b)
    centre = clip.mean(0)
    for start, end in zip(clip, np.roll(clip, -1, axis=0)):
        edge = end - start
        sign = np.sign(edge[0] * (centre - start)[1] - edge[1] * (centre - start)[0])
        side = [sign * (edge[0] * (p - start)[1] - edge[1] * (p - start)[0]) for p in polygon]
        kept = []
        for index, point in enumerate(polygon):
            following = (index + 1) % len(polygon)
            if side[index] >= 0.0:
                kept.append(point)
            if side[index] * side[following] < 0.0:
                share = side[index] / (side[index] - side[following])
                kept.append(point + share * (polygon[following] - point))
        polygon = kept
        if not polygon:
            return 0.0
    points = np.array(polygon)
    following = np.roll(points, -1, axis=0)
    common = 0.5 * abs(np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]))
    return common / (a[2] * a[3] + b[2] * b[3] - common)


def decode(output, threshold=0.1):
    """Returns the boxes of an output [8, rows, columns], best first: column, row, length, width, angle, class, score."""
    heat = 1.0 / (1.0 + np.exp(-output[:2]))
    padded = np.pad(heat, ((0, 0), (1, 1), (1, 1)))
    rows, columns = heat.shape[1:]
    neighbours = [padded[:, dy : dy + rows, dx : dx + columns] for dy in range(3) for dx in range(3)]
    peaks = np.argwhere((heat >= np.max(neighbours, axis=0)) & (heat > threshold))
    found = []
    for kind, row, column in peaks:
        dx, dy, length, width, sin, cos = output[2:, row, column]
        found.append([
            (column + 0.5 + dx) * STRIDE,
            (row + 0.5 + dy) * STRIDE,
            LENGTH_PX * np.exp(length),
            WIDTH_PX * np.exp(width),
            0.5 * np.arctan2(sin, cos),
            kind,
            heat[kind, row, column],
        ])
    found.sort(key=lambda box: -box[6])
    kept = []
    for box in map(np.array, found):
        if all(overlap(box, other) < 0.3 for other in kept):
            kept.append(box)
    return kept
