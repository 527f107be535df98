"""Judges the exported detector on held-out aerial pictures, and writes the model card.

    python xtask/training/aerial_evaluate.py --pictures DIR --model recorded/models/aerial-detector.onnx --card recorded/models/MODEL_CARD.md

A box counts as found if a box of the same class overlaps with it by at least half (intersection over union). The average
precision is the area below the interpolated curve of precision over recall. Difficult vehicles are neither wanted nor wrong.
"""

import argparse
import hashlib
import pathlib

import numpy as np
import onnxruntime

import aerial_data as data

WANTED = 0.9
# Bounds of the bins of the angle from the nadir, and of the angle of a box in the picture (degrees).
OFF_NADIR, TURNED = (0, 10, 20, 30, 35), (0, 15, 45, 75, 90)


def found_in(session, picture):
    pixels = picture.pixels.astype(np.float32).transpose(2, 0, 1)[None]
    return data.decode(session.run(None, {"pixels": pixels})[0][0], threshold=0.05)


def match(picture, boxes):
    """Returns a row for each counted box that was found (class, score, is right, angle), and the wanted boxes' rows."""
    free = list(range(len(picture.boxes)))
    rows, wanted = [], picture.boxes[picture.boxes[:, 6] == 0]
    errors = []
    for box in boxes:
        same = [(data.overlap(box[:5], picture.boxes[index, :5]), index) for index in free if picture.boxes[index, 5] == box[5]]
        best, index = max(same, default=(0.0, -1))
        if best >= 0.5:
            free.remove(index)
            if picture.boxes[index, 6]:
                continue
            truth = picture.boxes[index]
            rows.append((box[5], box[6], 1.0, truth[4]))
            errors.append((box[5], *(box[:2] - truth[:2])))
        elif not any(data.overlap(box[:5], other[:5]) > 0.2 for other in picture.boxes[picture.boxes[:, 6] == 1]):
            rows.append((box[5], box[6], 0.0, box[4]))
    return rows, wanted, errors


def average_precision(rows, wanted):
    """Returns the area below the interpolated curve, for rows of (score, is right)."""
    if wanted == 0:
        return float("nan")
    rows = sorted(rows, key=lambda row: -row[0])
    right = np.cumsum([row[1] for row in rows])
    recall, precision = right / wanted, right / np.arange(1, len(rows) + 1)
    precision = np.maximum.accumulate(precision[::-1])[::-1]
    return float(np.sum(np.diff(recall, prepend=0.0) * precision))


def degrees(angle):
    """Returns the angle between a box and the columns' axis, 0 to 90 degrees."""
    turned = np.degrees(angle) % 180.0
    return min(turned, 180.0 - turned)


def table(title, bounds, per_bin):
    lines = [f"| {title} | cars | AP50 | trucks | AP50 |", "|---|---|---|---|---|"]
    for low, high in zip(bounds, bounds[1:]):
        cells = []
        for kind in range(2):
            rows, wanted = per_bin(kind, low, high)
            cells += [str(wanted), f"{average_precision(rows, wanted):.3f}" if wanted else "-"]
        lines.append(f"| {low} to {high}° | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", required=True, help="folder of held-out pictures")
    parser.add_argument("--model", required=True, help="ONNX file")
    parser.add_argument("--card", required=True, help="model card to write")
    arguments = parser.parse_args()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(arguments.model, options)
    pictures = data.read(arguments.pictures)
    all_rows, all_wanted, errors = [], [], []
    for picture in pictures:
        nu = np.degrees(picture.pose["off_nadir_rad"])
        rows, wanted, found = match(picture, found_in(session, picture))
        all_rows += [(*row, nu) for row in rows]
        all_wanted += [(box[5], box[4], nu) for box in wanted]
        errors += found

    def by_nadir(kind, low, high):
        rows = [(row[1], row[2]) for row in all_rows if row[0] == kind and low <= row[4] < high]
        return rows, sum(1 for box in all_wanted if box[0] == kind and low <= box[2] < high)

    def by_angle(kind, low, high):
        rows = [(row[1], row[2]) for row in all_rows if row[0] == kind and low <= degrees(row[3]) <= high]
        return rows, sum(1 for box in all_wanted if box[0] == kind and low <= degrees(box[1]) <= high)

    scores = [average_precision(*by_nadir(kind, 0, 90)) for kind in range(2)]
    bytes_of = pathlib.Path(arguments.model).read_bytes()
    count = [sum(1 for box in all_wanted if box[0] == kind) for kind in range(2)]
    spread = [np.sqrt(np.mean([e[1] ** 2 + e[2] ** 2 for e in errors if e[0] == kind])) for kind in range(2)]
    card = f"""# Model card: aerial-detector.onnx

Finds cars and trucks in oblique aerial pictures, as oriented boxes around the visible body.

- **Input** `pixels`, float32 [1, 3, height, width]: red, green, blue planes, 0 to 255; both sides multiples of 8.
- **Output** `boxes`, float32 [1, 8, height / 8, width / 8]: for each cell the logits of car and truck, the offset of the centre
  (cells), the logarithms of length / 32 px and width / 16 px, sine and cosine of twice the angle.
- **Network**: ten convolutions and a head, no anchors; {len(bytes_of)} bytes, SHA-256 `{hashlib.sha256(bytes_of).hexdigest()}`.
- **Trained on** pictures that Closecall renders (`xtask/training/README.md` has the commands): dry roads by day, 0.11 to 0.17 m per
  pixel at the optical axis, 0 to 35° from the nadir, 80 to 120 m altitude.
- **Judged on** {len(pictures)} held-out pictures with {count[0]} cars and {count[1]} trucks: body shapes and seeds that training never saw.
- **Has never seen**: a photograph; motorcycles, buses apart from coaches, trailers behind cars; night, rain, snow, fog; bridges,
  trees above the road, crossings, parked cars; haze, motion blur, compression. What it says of photographs is not known.
- **Boxes enclose the visible body**, not its footprint: roofs lean away from the nadir. `docs/explanation/aerial.md` has the bias.
- **Not for** anything but simulation.

| class | AP50 | wanted | met | distance of the centres, RMS |
|---|---|---|---|---|
| car | {scores[0]:.3f} | ≥ {WANTED} | {"yes" if scores[0] >= WANTED else "no"} | {spread[0]:.2f} px |
| truck | {scores[1]:.3f} | ≥ {WANTED} | {"yes" if scores[1] >= WANTED else "no"} | {spread[1]:.2f} px |

{table("angle of the optical axis from the nadir", OFF_NADIR, by_nadir)}

{table("angle of the box in the picture", TURNED, by_angle)}
"""
    pathlib.Path(arguments.card).write_text(card)
    print(f"AP50: car {scores[0]:.3f}, truck {scores[1]:.3f}; centres {spread[0]:.2f} and {spread[1]:.2f} px RMS")
    if min(scores) < WANTED:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
