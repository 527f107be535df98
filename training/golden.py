"""Writes a few crops and the shipped network's answers to them, for the tests that compare backends.

    python training/golden.py --crops DIR --model sensors/models/rear-classifier.onnx --out sensors/tests/onnx_golden

The crops are the two least certain and the two most certain of each class among the first thousand.
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
    data = crops.read(arguments.crops).where(slice(0, 1000))
    scores = infer.scores(arguments.model, data.pixels)
    chosen = []
    for label in range(len(crops.CLASSES)):
        places = np.flatnonzero(data.label == label)
        by_certainty = places[np.argsort(scores[places].max(axis=1), kind="stable")]
        chosen += [*by_certainty[:2], *by_certainty[-2:]]
    out = Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    data.pixels[chosen].transpose(0, 2, 3, 1).tofile(out / "crops.rgb")
    lines = [",".join(crops.CLASSES)] + [",".join(f"{score:.9f}" for score in scores[place]) for place in chosen]
    (out / "scores.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
