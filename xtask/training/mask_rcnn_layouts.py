"""Writes small ONNX files with the inputs and outputs of other detectors, for the tests that load such networks.

    python xtask/training/mask_rcnn_layouts.py sensors/tests/mask_rcnn_layouts

None is trained: all find a car, a truck and a motorcycle in fixed boxes, whose scores are the values that the input has for the
first pixel, as shares of full brightness. A test thereby sees what the network was given.

- `model-zoo.onnx` has the names, the order and the dynamic sides of `MaskRCNN-10.onnx` of the ONNX model zoo, masks of 28 x 28 cells, and
  undoes its normalisation: the scores are of blue, green and red.
- `torchvision.onnx` has a batch of one image and the names of torchvision, and masks of the size of the image: the scores are of red, green and
  blue.
- `boxes.onnx` has no masks, and otherwise the outputs of `torchvision.onnx`.
- `rows.onnx` has the output of YOLO after non-maximum suppression: box, score and label in each row, and an empty row at the end.
"""

import pathlib
import sys

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
# Means of blue, green and red: section "Preprocessing steps" of vision/object_detection_segmentation/mask-rcnn in github.com/onnx/models.
MEANS = (102.9801, 115.9465, 122.7717)
FULL = 255.0
ROWS, COLUMNS, CELLS = 800, 1280, 28
# Left, top, right, bottom (px).
BOXES = ((600, 400, 640, 440), (700, 380, 800, 480), (500, 400, 520, 440))
# Car, truck and motorcycle among the labels of COCO, in which 0 is the background.
LABELS = (3, 8, 4)


def weight(name, values, kind=np.float32):
    return numpy_helper.from_array(np.asarray(values, kind), name)


def model(name, batch, names, mask, means, scale):
    """Returns a model with an input of rank 4 if `batch`, outputs of these names, and masks [3, 1, *mask].

    Three names are boxes, labels and scores alone. One name is their rows.
    """
    boxes, labels, scores, masks = names if len(names) == 4 else (*names, None) if len(names) == 3 else (None, None, "scores", None)
    first = ([1] if batch else []) + [3, 1, 1]
    start, end = [0] * len(first), first
    sides = ([1] if batch else []) + [3, "height", "width"]
    nodes = [
        helper.make_node("Slice", ["image", "start", "end"], ["pixel"]),
        helper.make_node("Reshape", ["pixel", "three"], ["values"]),
        helper.make_node("Add", ["values", "means"], ["raw"]),
        helper.make_node("Mul", ["raw", "scale"], [scores]),
    ]
    weights = [
        weight("start", start, np.int64),
        weight("end", end, np.int64),
        weight("three", [3], np.int64),
        weight("means", means),
        weight("scale", scale),
        weight("box_values", BOXES),
    ]
    found = "found"
    if boxes:
        nodes.append(helper.make_node("Identity", ["box_values"], [boxes]))
        nodes.append(helper.make_node("Identity", ["label_values"], [labels]))
        weights.append(weight("label_values", LABELS, np.int64))
        outputs = [
            helper.make_tensor_value_info(boxes, TensorProto.FLOAT, [found, 4]),
            helper.make_tensor_value_info(labels, TensorProto.INT64, [found]),
            helper.make_tensor_value_info(scores, TensorProto.FLOAT, [found]),
        ]
    else:
        nodes.append(helper.make_node("Reshape", [scores, "column"], ["score_column"]))
        nodes.append(helper.make_node("Concat", ["box_values", "score_column", "label_column"], ["filled"], axis=1))
        nodes.append(helper.make_node("Concat", ["filled", "empty"], ["all"], axis=0))
        nodes.append(helper.make_node("Unsqueeze", ["all", "first"], [names[0]]))
        weights.append(weight("column", [3, 1], np.int64))
        weights.append(weight("label_column", [[label] for label in LABELS]))
        weights.append(weight("empty", [[0.0] * 6]))
        weights.append(weight("first", [0], np.int64))
        outputs = [helper.make_tensor_value_info(names[0], TensorProto.FLOAT, [1, found, 6])]
    if masks:
        nodes.append(helper.make_node("Expand", ["one", "mask_shape"], [masks]))
        weights.append(weight("one", [[[[1.0]]]]))
        weights.append(weight("mask_shape", [3, 1, *mask], np.int64))
        outputs.append(helper.make_tensor_value_info(masks, TensorProto.FLOAT, [found, 1, "mask_height", "mask_width"]))
    image = helper.make_tensor_value_info("image", TensorProto.FLOAT, sides)
    graph = helper.make_graph(nodes, name, [image], outputs, weights)
    result = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="closecall")
    result.ir_version = 8
    onnx.checker.check_model(result)
    return result


def main():
    out = pathlib.Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    zoo = model("model-zoo", False, ("6568", "6570", "6572", "6887"), (CELLS, CELLS), MEANS, 1.0 / FULL)
    torchvision = model("torchvision", True, ("boxes", "labels", "scores", "masks"), (ROWS, COLUMNS), (0.0, 0.0, 0.0), 1.0)
    boxes = model("boxes", True, ("boxes", "labels", "scores"), None, (0.0, 0.0, 0.0), 1.0)
    rows = model("rows", True, ("output0",), None, (0.0, 0.0, 0.0), 1.0)
    onnx.save(zoo, out / "model-zoo.onnx")
    onnx.save(torchvision, out / "torchvision.onnx")
    onnx.save(boxes, out / "boxes.onnx")
    onnx.save(rows, out / "rows.onnx")


if __name__ == "__main__":
    main()
