"""Reads the crops that `render_dataset` writes: pixels from crops.rgb, labels from crops.csv."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SIDE_PX = 32
CLASSES = ("car", "truck", "motorcycle", "background")


@dataclass
class Crops:
    """Crops as 8-bit (n, 3, 32, 32) with a row of labels for each."""

    pixels: np.ndarray
    label: np.ndarray
    distance_m: np.ndarray
    light: np.ndarray
    weather: np.ndarray

    def __len__(self):
        return len(self.label)

    def where(self, chosen):
        """The crops for which `chosen` is true, or those at the given places."""
        return Crops(*(column[chosen] for column in vars(self).values()))


def read(folder):
    """Reads one folder."""
    folder = Path(folder)
    with open(folder / "crops.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    pixels = np.fromfile(folder / "crops.rgb", dtype=np.uint8).reshape(-1, SIDE_PX, SIDE_PX, 3)
    if len(rows) != len(pixels):
        raise ValueError(f"{folder}: {len(pixels)} crops, but {len(rows)} rows of labels")
    return Crops(
        pixels=np.ascontiguousarray(pixels.transpose(0, 3, 1, 2)),
        label=np.array([int(row["label"]) for row in rows]),
        distance_m=np.array([float(row["distance_m"]) for row in rows]),
        light=np.array([row["light"] for row in rows]),
        weather=np.array([row["weather"] for row in rows]),
    )
