"""The columns and rows of the rear camera's image that the Mask R-CNN reads, and how positions in both pictures correspond.

    python xtask/training/mask_rcnn_sampling.py FILE      # writes the columns and the rows

The network reads a *sampled picture* of 320 × 144 px. Near the middle of the horizon, where far vehicles are, it takes every
second pixel of the image (1280 × 800 px); towards the edges it takes fewer, because what appears there is near and large.
Between the knots, both axes correspond linearly.
"""

import sys

import numpy as np

WIDTH_PX, HEIGHT_PX = 1280, 800
# Positions in the sampled picture, and those in the image that correspond to them (px).
COLUMN_KNOTS = ((0, 48, 96, 224, 272, 320), (0, 320, 512, 768, 960, 1280))
ROW_KNOTS = ((0, 17, 29, 89, 112, 144), (0, 250, 310, 430, 522, 800))
COLUMNS, ROWS = COLUMN_KNOTS[0][-1], ROW_KNOTS[0][-1]


def to_image(at, knots):
    """Returns the position in the image (px) of a position in the sampled picture (px)."""
    return np.interp(at, *knots)


def to_sampled(at, knots):
    """Returns the position in the sampled picture (px) of a position in the image (px)."""
    return np.interp(at, knots[1], knots[0])


def pixels(knots):
    """Returns the pixels of the image that are sampled along one axis: those in the middle of their cells."""
    cells = np.arange(knots[0][-1]) + 0.5
    return np.floor(to_image(cells, knots)).astype(np.int64)


def words(knots):
    """Returns the sampled pixels along one axis as text."""
    return " ".join(str(pixel) for pixel in pixels(knots))


if __name__ == "__main__":
    with open(sys.argv[1], "w", encoding="ascii") as file:
        file.write(words(COLUMN_KNOTS) + "\n" + words(ROW_KNOTS) + "\n")
