"""Reads the crops that `render_dataset` writes: the pixels from crops.rgb, the labels from crops.csv."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SIDE_PX = 32
CLASSES = ("car", "truck", "motorcycle", "background")


@dataclass
class Crops:
    """n crops: 8-bit pixels of shape (n, 3, 32, 32), and label columns of length n."""

    pixels: np.ndarray
    label: np.ndarray
    distance_m: np.ndarray
    light: np.ndarray
    weather: np.ndarray

    def __len__(self):
        return len(self.label)

    def select(self, selection):
        """Returns the crops that `selection` selects: a Boolean mask, an index array or a slice."""
        return Crops(*(column[selection] for column in vars(self).values()))


def read(folder):
    """Reads the crops of one folder."""
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
