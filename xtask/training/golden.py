"""Writes a few crops and the shipped network's scores for them, for the tests that compare backends.

    python xtask/training/golden.py --crops DIR --model sensors/models/rear-classifier.onnx --out sensors/tests/onnx_golden

For each class, it selects the two least certain and the two most certain crops among the first thousand.
"""

import argparse
from pathlib import Path

import numpy as np

import crops
import infer


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--crops", required=True, help="folder of held-out crops")
    parser.add_argument("--model", required=True, help="ONNX file")
    parser.add_argument("--out", required=True, help="folder to write crops.rgb and scores.csv into")
    arguments = parser.parse_args()
    data = crops.read(arguments.crops).select(slice(0, 1000))
    scores = infer.scores(arguments.model, data.pixels)
    selected = []
    for label in range(len(crops.CLASSES)):
        indices = np.flatnonzero(data.label == label)
        by_certainty = indices[np.argsort(scores[indices].max(axis=1), kind="stable")]
        selected += [*by_certainty[:2], *by_certainty[-2:]]
    out = Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    data.pixels[selected].transpose(0, 2, 3, 1).tofile(out / "crops.rgb")
    lines = [",".join(crops.CLASSES)] + [",".join(f"{score:.9f}" for score in scores[index]) for index in selected]
    (out / "scores.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
