"""Writes a few pictures and what the exported Mask R-CNN finds in the whole images, for the test that compares it with Rust.

    python xtask/training/mask_rcnn_golden.py --images DIR --model sensors/models/rear-mask-rcnn.onnx --out sensors/tests/mask_rcnn_golden
"""

import argparse
import json
import pathlib

import numpy as np

import mask_rcnn_sampling as sampling
from mask_rcnn_evaluate import read, session_of

IMAGES = 4


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--images", required=True, help="folder of held-out images")
    parser.add_argument("--model", required=True, help="ONNX file")
    parser.add_argument("--out", required=True, help="folder to write into")
    arguments = parser.parse_args()
    session, out = session_of(arguments.model), pathlib.Path(arguments.out)
    rows, columns = sampling.pixels(sampling.ROW_KNOTS), sampling.pixels(sampling.COLUMN_KNOTS)
    out.mkdir(parents=True, exist_ok=True)
    pictures, all_masks, answers = [], [], []
    for path in sorted(pathlib.Path(arguments.images).glob("image-*.png"))[:IMAGES]:
        pixels = read(path)
        boxes, labels, scores, masks = session.run(None, {"image": pixels})
        picture = pixels[:, rows][:, :, columns].transpose(1, 2, 0)
        pictures.append(np.round(picture * 255.0).astype(np.uint8).tobytes())
        all_masks.append(masks.astype("<f4").tobytes())
        answers.append({"boxes": boxes.tolist(), "labels": labels.tolist(), "scores": scores.tolist()})
    (out / "pictures.rgb").write_bytes(b"".join(pictures))
    (out / "masks.f32").write_bytes(b"".join(all_masks))
    (out / "answers.json").write_text(json.dumps(answers) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
