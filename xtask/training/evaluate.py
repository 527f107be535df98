"""Evaluates the exported network on held-out crops and writes its model card.

    python xtask/training/evaluate.py --crops DIR --model sensors/models/rear-classifier.onnx \\
        --card sensors/models/MODEL_CARD.md

The held-out crops use body shapes, bands of paint, and seeds that the training crops do not use. The exit code is 1 if
a target of the card is missed.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

import crops
import infer

BANDS_M = ((0, 30), (30, 60), (60, 100), (100, 130))
LIGHTS = ("day", "dusk", "night")
WEATHERS = ("dry", "rain", "fog")
BINS = 15

INTRODUCTION = """# Model card: rear-classifier.onnx

Says what a LiDAR cluster behind the ego vehicle looks like in the rear camera: car, truck, motorcycle or background.

- **Input** `pixels`, float32 [1, 3, 32, 32]: red, green, blue planes of a crop, 0 to 255.
- **Output** `scores`, float32 [1, 4]: calibrated probabilities of car, truck, motorcycle, background.
- **Network**: four convolutions (16, 32, 48, 64 channels) and one linear layer; {weights} bytes, SHA-256 `{digest}`.
- **Trained on** crops that Closecall's own renderer draws (`xtask/training/README.md` has the commands), with boxes off by as
  much as the boxes of LiDAR clusters. It has seen no photograph, and what it says of photographs is not known.
- **Calibration**: one temperature, fitted on a tenth of the training scenes.
- **Judged on** {count} held-out crops: body shapes, bands of paint and seeds that training never saw, in the
  `onnxruntime` wheel, one crop at a time. A vehicle that is hidden by more than 45 % is not counted.
- **Not for** anything but simulation.
"""


def expected_calibration_error(probabilities, labels):
    """Returns the mean gap between certainty and accuracy over equal bins of certainty, weighted by crop count."""
    certainty, right = probabilities.max(axis=1), probabilities.argmax(axis=1) == labels
    bins = np.minimum((certainty * BINS).astype(int), BINS - 1)
    gaps = [abs(certainty[bins == b].mean() - right[bins == b].mean()) * (bins == b).sum() for b in np.unique(bins)]
    return sum(gaps) / len(labels)


def matrix(answers, labels):
    """Returns the confusion matrix as a Markdown table."""
    lines = ["| truth | " + " | ".join(crops.CLASSES) + " | right |", "|---" * (len(crops.CLASSES) + 2) + "|"]
    for label, name in enumerate(crops.CLASSES):
        counts = np.bincount(answers[labels == label], minlength=len(crops.CLASSES))
        if counts.sum():
            cells = " | ".join(str(count) for count in counts)
            lines.append(f"| {name} | {cells} | {100 * counts[label] / counts.sum():.1f} % |")
    return "\n".join(lines)


def targets(data, answers, probabilities):
    """Returns a tuple (what, found, wanted, met) for each target."""
    right = answers == data.label
    by_day = (data.light == "day") & (data.weather == "dry")
    near, middle = data.distance_m <= 60, (data.distance_m > 60) & (data.distance_m <= 100)
    rows = []
    for what, selected, wanted in (
        ("dry day, to 60 m", by_day & near, 0.99),
        ("dry day, 60 to 100 m", by_day & middle, 0.95),
        ("night, to 60 m", (data.light == "night") & near, 0.90),
        ("rain, to 60 m", (data.weather == "rain") & near, 0.90),
        ("night and rain, to 60 m", (data.light == "night") & (data.weather == "rain") & near, 0.90),
    ):
        found, vehicles = right[selected].mean(), selected & (data.label < crops.CLASSES.index("background"))
        text = f"{100 * found:.2f} % (vehicles alone {100 * right[vehicles].mean():.2f} % of {vehicles.sum()})"
        rows.append((f"right, {what} ({chosen.sum()} crops)", text, f"≥ {100 * wanted:.0f} %", found >= wanted))
    error = expected_calibration_error(probabilities, data.label)
    rows.append(("expected calibration error, all", f"{error:.4f}", "≤ 0.05", error <= 0.05))
    return rows


def card(data, probabilities, model):
    """Returns the text of the model card, and the list of targets (see `targets`)."""
    import hashlib

    answers = probabilities.argmax(axis=1)
    content = Path(model).read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    parts = [INTRODUCTION.format(weights=len(content), digest=digest, count=len(data))]
    rows = targets(data, answers, probabilities)
    parts.append("## Targets\n\n| what | found | wanted | met |\n|---|---|---|---|")
    parts[-1] += "".join(f"\n| {what} | {found} | {wanted} | {'yes' if met else '**no**'} |" for what, found, wanted, met in rows)
    parts.append("## All held-out crops\n\n" + matrix(answers, data.label))
    parts.append("## By light, weather and distance")
    for light in LIGHTS:
        for weather in WEATHERS:
            for low, high in BANDS_M:
                selected = (data.light == light) & (data.weather == weather) & (data.distance_m > low) & (data.distance_m <= high)
                if selected.sum():
                    right = 100 * (answers[selected] == data.label[selected]).mean()
                    error = expected_calibration_error(probabilities[selected], data.label[selected])
                    title = f"### {light}, {weather}, {low} to {high} m: {right:.1f} % right, calibration error {error:.3f}"
                    parts.append(title + "\n\n" + matrix(answers[selected], data.label[selected]))
    return "\n\n".join(parts) + "\n", rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--crops", required=True, help="folder of held-out crops")
    parser.add_argument("--model", required=True, help="ONNX file")
    parser.add_argument("--card", help="Markdown file to write")
    arguments = parser.parse_args()
    data = crops.read(arguments.crops)
    text, rows = card(data, infer.scores(arguments.model, data.pixels), arguments.model)
    for what, found, wanted, met in rows:
        print(f"{what}: {found} (wanted {wanted}){'' if met else '  MISSED'}")
    if arguments.card:
        Path(arguments.card).write_text(text, encoding="utf-8")
    sys.exit(0 if all(met for *_, met in rows) else 1)


if __name__ == "__main__":
    main()
