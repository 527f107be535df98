"""Judges the exported Mask R-CNN on held-out images of `closecall tool render`, and writes its model card.

    python xtask/training/mask_rcnn_evaluate.py --images DIR --empty DIR --crowded DIR --model sensors/models/rear-mask-rcnn.onnx \
                                          --card sensors/models/MASK_RCNN_CARD.md

Average precisions come from `pycocotools` at an overlap of one half. A vehicle counts from 20 px of visible width on, and
what is found narrower and matches none does not count. In a band of distances, light or weather, vehicles outside of it neither
count nor make a match wrong; false alarms count in every band of distances.

How the shipped weights were trained stands in `mask_rcnn_training.txt`, so that the card is the script's output as a whole.
"""

import argparse
import contextlib
import copy
import hashlib
import io
import json
import pathlib

import numpy as np
import onnxruntime
from PIL import Image
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

import mask_rcnn_model as model

WANTED = {"bbox": 0.90, "segm": 0.85}
LEAST_WIDTH = 20
DISTANCES = (0, 20, 40, 60, 80, 130)
MASK_THRESHOLD = 0.5
# Score from which a detection counts as a false alarm.
ALARM = 0.5
TRAINING = pathlib.Path(__file__).with_name("mask_rcnn_training.txt")


def session_of(path):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(path, options)


def read(path):
    """Returns an image as the network takes it: [3, rows, columns], 0 to 1."""
    return np.asarray(Image.open(path).convert("RGB"), np.float32).transpose(2, 0, 1) / 255.0


def pasted(box, cells, shape):
    """Returns the pixels of an instance: linear between the centres of the cells, which divide the box evenly."""
    result = np.zeros(shape, np.uint8)
    rows, columns = np.arange(shape[0]) + 0.5, np.arange(shape[1]) + 0.5
    left, top, right, bottom = box
    inside_u, inside_v = (columns >= left) & (columns < right), (rows >= top) & (rows < bottom)
    if not (inside_u.any() and inside_v.any()):
        return result

    def place(at, low, high, count):
        position = np.clip((at - low) / (high - low) * count - 0.5, 0.0, count - 1.0)
        lower = np.floor(position).astype(int)
        return lower, np.minimum(lower + 1, count - 1), (position - lower)[:, None]

    i, next_i, part_u = place(columns[inside_u], left, right, cells.shape[1])
    j, next_j, part_v = place(rows[inside_v], top, bottom, cells.shape[0])
    across = cells[:, i] + part_u[:, 0] * (cells[:, next_i] - cells[:, i])
    values = across[j] + part_v * (across[next_j] - across[j])
    result[np.ix_(inside_v, inside_u)] = values >= MASK_THRESHOLD
    return result


def found_in(session, path, image_id):
    """Returns the detections of an image as COCO results."""
    pixels = read(path)
    boxes, labels, scores, masks = session.run(None, {"image": pixels})
    results = []
    for box, label, score, cells in zip(boxes.astype(float), labels, scores, masks[:, 0]):
        pixels_of = pasted(box, cells, pixels.shape[1:])
        results.append(
            {
                "image_id": image_id,
                "category_id": int(label),
                "bbox": [box[0], box[1], box[2] - box[0], box[3] - box[1]],
                "score": float(score),
                "segmentation": coco_mask.encode(np.asfortranarray(pixels_of)),
            }
        )
    return results


def quiet(call, *arguments):
    with contextlib.redirect_stdout(io.StringIO()):
        return call(*arguments)


def precision(truth, results, kind, images, least_width, counts=lambda annotation: True):
    """Returns the mean of the average precisions of the classes, each of them, and the number of vehicles."""
    truth = copy.deepcopy(truth)
    truth["images"] = [image for image in truth["images"] if image["id"] in images]
    truth["annotations"] = [one for one in truth["annotations"] if one["image_id"] in images]
    for one in truth["annotations"]:
        # The range of areas selects by width: pycocotools then leaves out narrow vehicles and narrow detections alike.
        one["area"] = one["bbox"][2] ** 2
        if not counts(one):
            one["area"] = 0.0
    count = sum(one["area"] >= least_width**2 for one in truth["annotations"])
    results = [one for one in results if one["image_id"] in images]
    if count == 0 or not results:
        return float("nan"), [float("nan")] * 3, count
    coco = COCO()
    coco.dataset = truth
    quiet(coco.createIndex)
    found = quiet(coco.loadRes, copy.deepcopy(results))
    for one in found.anns.values():
        one["area"] = one["bbox"][2] ** 2
    judge = COCOeval(coco, found, kind)
    judge.params.iouThrs = np.array([0.5])
    judge.params.areaRng, judge.params.areaRngLbl = [[least_width**2, 1e10]], ["wide"]
    judge.params.maxDets = [100]
    judge.params.imgIds = sorted(images)
    quiet(judge.evaluate)
    quiet(judge.accumulate)
    curves = judge.eval["precision"][0, :, :, 0, 0]
    each = [float(curve[curve > -1].mean()) if (curve > -1).any() else float("nan") for curve in curves.T]
    return float(np.nanmean(each)), each, count


def overlap(a, b):
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    common = max(width, 0.0) * max(height, 0.0)
    return common / (a[2] * a[3] + b[2] * b[3] - common)


def calibration(truth, results):
    """Returns rows (low, high, detections, mean score, share that is right), and the expected calibration error."""
    by_image = {}
    for one in truth["annotations"]:
        by_image.setdefault(one["image_id"], []).append(one)
    pairs = []
    for one in results:
        same = [other for other in by_image.get(one["image_id"], []) if other["category_id"] == one["category_id"]]
        pairs.append((one["score"], any(overlap(one["bbox"], other["bbox"]) >= 0.5 for other in same)))
    pairs = np.array(pairs, float)
    rows, error = [], 0.0
    for low in np.arange(0.0, 1.0, 0.1):
        chosen = pairs[(pairs[:, 0] >= low) & (pairs[:, 0] < low + 0.1 + 1e-9 * (low > 0.85))]
        if len(chosen):
            rows.append((low, low + 0.1, len(chosen), chosen[:, 0].mean(), chosen[:, 1].mean()))
            error += len(chosen) / len(pairs) * abs(chosen[:, 0].mean() - chosen[:, 1].mean())
    return rows, error


def missed(truth, results, images, least_width):
    """Returns the share of the vehicles that no detection of any class with a score of one half overlaps by one half."""
    by_image = {}
    for one in results:
        if one["score"] >= 0.5:
            by_image.setdefault(one["image_id"], []).append(one["bbox"])
    wanted = [one for one in truth["annotations"] if one["image_id"] in images and one["bbox"][2] >= least_width]
    found = [any(overlap(one["bbox"], box) >= 0.5 for box in by_image.get(one["image_id"], [])) for one in wanted]
    return 1.0 - float(np.mean(found)) if wanted else float("nan")


def loaded(folder):
    """Returns the annotations of a folder of images, with their masks in the form of `pycocotools`."""
    truth = json.loads((folder / "annotations.json").read_text())
    for one in truth["annotations"]:
        counts = one["segmentation"]
        one["segmentation"] = coco_mask.frPyObjects(counts, *counts["size"])
    return truth


def judged(session, folder):
    """Returns the annotations of a folder of images, and what the network finds in them."""
    truth = loaded(folder)
    results = []
    for image in truth["images"]:
        results += found_in(session, folder / image["file_name"], image["id"])
    return truth, results


def empty_and_crowded(session, empty, crowded):
    """Returns the sections of the card on roads without any vehicle, and on crowded ones."""
    truth, results = judged(session, empty)
    assert not truth["annotations"], "roads without vehicles have annotations"
    alarms = sum(one["score"] >= ALARM for one in results)
    count = len(truth["images"])
    text = f"\nDetections with a score from {ALARM} on in {count} images of empty roads, in all lights and weathers: {alarms}.\n"
    truth, results = judged(session, crowded)
    images = {image["id"] for image in truth["images"]}
    precisions = [precision(truth, results, kind, images, LEAST_WIDTH) for kind in ("bbox", "segm")]
    each = len(truth["annotations"]) / len(images)
    title = f"crowded roads ({len(images)} images, {each:.1f} vehicles in each), from 20 px on"
    share = 100 * missed(truth, results, images, LEAST_WIDTH)
    return text + f"\n{table(title, [('all lights and weathers', *precisions)])}\n\nThere it misses {share:.1f} % at a score of 0.5.\n"


def weather(image):
    if image["rain_mm_per_h"] > 0:
        return "rain"
    return "fog" if image["visibility_m"] < 1000 else "dry"


def table(title, rows):
    lines = [f"| {title} | vehicles | box AP50 | mask AP50 | car | truck | motorcycle |", "|---|---|---|---|---|---|---|"]
    number = lambda value: "-" if np.isnan(value) else f"{value:.3f}"
    for name, boxes, masks in rows:
        cells = [number(boxes[0]), number(masks[0])] + [f"{number(b)}, {number(m)}" for b, m in zip(boxes[1], masks[1])]
        lines.append(f"| {name} | {boxes[2]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--images", required=True, help="folder of held-out images")
    parser.add_argument("--model", required=True, help="ONNX file")
    parser.add_argument("--card", required=True, help="model card to write")
    parser.add_argument("--empty", required=True, type=pathlib.Path, help="folder of images without vehicles (render --vehicles 0)")
    parser.add_argument("--crowded", required=True, type=pathlib.Path, help="folder of images with many (render --vehicles 8..12)")
    arguments = parser.parse_args()
    session = session_of(arguments.model)
    truth, results = judged(session, pathlib.Path(arguments.images))

    def row(name, chosen=lambda image: True, least_width=LEAST_WIDTH, counts=lambda annotation: True):
        images = {image["id"] for image in truth["images"] if chosen(image)}
        return (name, *[precision(truth, results, kind, images, least_width, counts) for kind in ("bbox", "segm")])

    by_day = row("day, from 20 px on", lambda image: image["light"] == "day")
    rows = [by_day, row("all, from 20 px on"), row("all, of any width", least_width=0)]
    lights = [row(f"{light}, {sky}", lambda image: (image["light"], weather(image)) == (light, sky))
              for light in ("day", "dusk", "night") for sky in ("dry", "rain", "fog")]
    far = [row(f"{low} to {high} m", counts=lambda one: low <= one["distance_m"] < high) for low, high in zip(DISTANCES, DISTANCES[1:])]
    reliability, error = calibration(truth, results)
    images = {image["id"] for image in truth["images"]}
    share_missed = missed(truth, results, images, LEAST_WIDTH)
    data = pathlib.Path(arguments.model).read_bytes()
    met = {"bbox": by_day[1][0] >= WANTED["bbox"], "segm": by_day[2][0] >= WANTED["segm"]}
    word = {True: "yes", False: "no"}
    card = f"""# Model card: rear-mask-rcnn.onnx

Finds cars, trucks and motorcycles in the image of the rear camera: boxes, classes, scores and masks.

- **Input** `image`, float32 [3, 800, 1280]: red, green and blue planes, 0 to 1. It reads 320 columns and 144 rows of it, which its metadata
  name: every second pixel near the middle of the horizon, and fewer towards the edges. It also takes a picture [3, 144, 320] of these alone.
- **Output** `boxes`, float32 [n, 4]: left, top, right, bottom (px); `labels`, int64 [n]: 1 car, 2 truck, 3 motorcycle; `scores`, float32 [n];
  `masks`, float32 [n, 1, 28, 28]: cells that divide the box evenly. n is {model.DETECTIONS} at most.
- **Network**: torchvision's Mask R-CNN with a residual backbone of {model.CHANNELS} channels, a pyramid of {model.PYRAMID} channels on four levels,
  {model.KEPT} proposals, and small heads; {len(data)} bytes, SHA-256 `{hashlib.sha256(data).hexdigest()}`.
- **Trained on** pictures that Closecall's own renderer draws (`xtask/training/README.md` has the commands), a tenth of them of empty roads and a
  tenth crowded. {TRAINING.read_text(encoding="utf-8").strip()}
- **Calibration**: one temperature, fitted on training scenes that were held back. Expected calibration error on the held-out images: {error:.3f}.
- **Judged on** {len(truth["images"])} held-out images with {len(truth["annotations"])} vehicles: body shapes, paints and seeds that training never saw.
  The tables are for one seed, {truth["info"]["seed"]}; `docs/evidence/mask-rcnn.md` has four further seeds.
- **Misses** {100 * share_missed:.1f} % of the vehicles from 20 px on at a score of 0.5, in all lights and weathers.
- **Has never seen**: a photograph; a lens with distortion, a rolling shutter; signs and trees; the gantries that a scenario file
  places (`road.roadside`; the training pictures have gantries of another form); buses other than coaches, trailers behind cars,
  bicycles, pedestrians; snow, tunnels. What it says of photographs is not known.
- **Not for** anything but simulation.

| by day, from 20 px of visible width on | found | wanted | met |
|---|---|---|---|
| box AP50 | {by_day[1][0]:.3f} | ≥ {WANTED["bbox"]:.2f} | {word[met["bbox"]]} |
| mask AP50 | {by_day[2][0]:.3f} | ≥ {WANTED["segm"]:.2f} | {word[met["segm"]]} |

Classes: box AP50, mask AP50.

{table("images", rows)}

{table("light and weather, from 20 px on", lights)}

{table("distance between the centres, from 20 px on", far)}

| score | detections | mean score | right (%) |
|---|---|---|---|
"""
    for low, high, count, score, right in reliability:
        card += f"| {low:.1f} to {high:.1f} | {count} | {score:.2f} | {100 * right:.0f} |\n"
    card += empty_and_crowded(session, arguments.empty, arguments.crowded)
    pathlib.Path(arguments.card).write_text(card, encoding="utf-8")
    print(f"by day: box AP50 {by_day[1][0]:.3f}, mask AP50 {by_day[2][0]:.3f}; missed {100 * share_missed:.1f} %")
    if not all(met.values()):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
