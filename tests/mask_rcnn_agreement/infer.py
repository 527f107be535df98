"""Prints what Python's ONNX Runtime finds in whole images, one line of JSON for each.

    python mask_rcnn_python.py MODEL.onnx IMAGE.rgb...

An image has 800 rows of 1280 pixels of three bytes: red, green and blue.
"""

import json
import sys

import numpy as np
import onnxruntime

ROWS, COLUMNS = 800, 1280

session = onnxruntime.InferenceSession(sys.argv[1], providers=["CPUExecutionProvider"])
for path in sys.argv[2:]:
    pixels = np.fromfile(path, np.uint8).reshape(ROWS, COLUMNS, 3).transpose(2, 0, 1).astype(np.float32) / 255.0
    boxes, labels, scores, masks = session.run(["boxes", "labels", "scores", "masks"], {"image": pixels})
    answer = {"boxes": boxes.tolist(), "labels": labels.tolist(), "scores": scores.tolist()}
    cells = [instance.reshape(-1).tolist() for instance in masks]
    print(json.dumps({"version": onnxruntime.__version__, "masks": cells, **answer}))
