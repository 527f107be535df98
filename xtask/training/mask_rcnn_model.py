"""The Mask R-CNN of the rear camera: torchvision's, with a small backbone and small heads, and the graph that is exported.

Positions are positions of pixel centres: column 0 is at 0, so that a picture reaches from −0.5 to its width −0.5. With them the
cells of the feature maps, RoIAlign without half-pixel shift, and the masks agree.
"""

from collections import OrderedDict

import numpy as np
import torch
from torch import nn
from torchvision.models.detection import MaskRCNN
from torchvision.models.detection.anchor_utils import AnchorGenerator
from torchvision.models.detection.mask_rcnn import MaskRCNNPredictor
from torchvision.ops import FeaturePyramidNetwork, MultiScaleRoIAlign, nms, roi_align

import mask_rcnn_sampling as sampling

# Names of the labels 1, 2, 3; 0 is the background. The order is the order of the categories of `closecall tool render`.
CLASSES = ("car", "truck", "motorcycle")
# Channels of the levels of the backbone, whose cells are 2, 4, 8, 16 and 32 px wide, and of the pyramid.
CHANNELS, PYRAMID = (16, 24, 48, 96, 128), 40
# Square roots of the areas of the anchors on each level of the pyramid (px of the sampled picture), and height over width.
ANCHORS, ASPECTS = ((6, 11), (18, 28), (44, 70), (110, 180)), (0.85, 1.7)
STRIDES = (4, 8, 16, 32)
BOX_BINS, MASK_BINS = 7, 14
MASK_CHANNELS, BOX_UNITS = 24, 128
# Normalisation of the pixels.
MEAN, DEVIATION = 0.45, 0.25
# Proposals before and after the suppression of overlaps, detections, and least score, of the exported graph.
PROPOSALS, KEPT, DETECTIONS, LEAST_SCORE = 150, 32, 12, 0.05
PROPOSAL_OVERLAP, DETECTION_OVERLAP = 0.7, 0.5


def unit(inputs, outputs, stride=1):
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


class Residual(nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.first = unit(channels, channels)
        self.second = nn.Sequential(nn.Conv2d(channels, channels, 3, 1, 1, bias=False), nn.BatchNorm2d(channels))

    def forward(self, x):
        return torch.relu(x + self.second(self.first(x)))


class Backbone(nn.Module):
    """A residual network with a pyramid of features."""

    def __init__(self):
        super().__init__()
        c = CHANNELS
        self.stem = unit(3, c[0], 2)
        self.levels = nn.ModuleList(
            nn.Sequential(unit(c[i], c[i + 1], 2), *[Residual(c[i + 1]) for _ in range(blocks)])
            for i, blocks in enumerate((1, 1, 2, 1))
        )
        self.pyramid = FeaturePyramidNetwork(list(c[1:]), PYRAMID)
        self.out_channels = PYRAMID

    def forward(self, x):
        x = self.stem(x)
        levels = OrderedDict()
        for i, level in enumerate(self.levels):
            x = level(x)
            levels[str(i)] = x
        return self.pyramid(levels)


class ProposalHead(nn.Module):
    """The head of the region proposal network, with a depthwise convolution."""

    def __init__(self):
        super().__init__()
        anchors = len(ANCHORS[0]) * len(ASPECTS)
        self.shared = nn.Sequential(
            nn.Conv2d(PYRAMID, PYRAMID, 3, 1, 1, groups=PYRAMID), nn.Conv2d(PYRAMID, PYRAMID, 1), nn.ReLU(inplace=True)
        )
        self.logits, self.shifts = nn.Conv2d(PYRAMID, anchors, 1), nn.Conv2d(PYRAMID, 4 * anchors, 1)
        for layer in (self.logits, self.shifts):
            nn.init.normal_(layer.weight, std=0.01)
            nn.init.zeros_(layer.bias)

    def forward(self, levels):
        shared = [self.shared(level) for level in levels]
        return [self.logits(x) for x in shared], [self.shifts(x) for x in shared]


class BoxHead(nn.Sequential):
    def __init__(self):
        units = BOX_UNITS
        super().__init__(
            nn.Flatten(), nn.Linear(PYRAMID * BOX_BINS**2, units), nn.ReLU(inplace=True), nn.Linear(units, units), nn.ReLU(inplace=True)
        )


class BoxPredictor(nn.Module):
    def __init__(self):
        super().__init__()
        self.cls_score = nn.Linear(BOX_UNITS, len(CLASSES) + 1)
        self.bbox_pred = nn.Linear(BOX_UNITS, 4 * (len(CLASSES) + 1))

    def forward(self, x):
        return self.cls_score(x), self.bbox_pred(x)


def mask_head():
    layers, inputs = [], PYRAMID
    for _ in range(2):
        layers += [nn.Conv2d(inputs, MASK_CHANNELS, 3, 1, 1), nn.ReLU(inplace=True)]
        inputs = MASK_CHANNELS
    return nn.Sequential(*layers)


def create():
    """Returns the network with random weights."""
    network = MaskRCNN(
        Backbone(),
        num_classes=None,
        image_mean=[MEAN] * 3,
        image_std=[DEVIATION] * 3,
        rpn_anchor_generator=AnchorGenerator(ANCHORS, (ASPECTS,) * len(ANCHORS)),
        rpn_head=ProposalHead(),
        rpn_pre_nms_top_n_train=200,
        rpn_post_nms_top_n_train=150,
        rpn_pre_nms_top_n_test=PROPOSALS,
        rpn_post_nms_top_n_test=KEPT,
        rpn_batch_size_per_image=128,
        box_roi_pool=MultiScaleRoIAlign(["0"], BOX_BINS, 2),
        box_head=BoxHead(),
        box_predictor=BoxPredictor(),
        box_batch_size_per_image=64,
        mask_roi_pool=MultiScaleRoIAlign(["0"], MASK_BINS, 2),
        mask_head=mask_head(),
        mask_predictor=MaskRCNNPredictor(MASK_CHANNELS, MASK_CHANNELS, len(CLASSES) + 1),
    )
    # The pictures have the size of the network already.
    network.transform.resize = lambda image, target=None: (image, target)
    network.transform.size_divisible = 16
    return network


def piecewise(at, knots, values):
    """Returns the piecewise linear function through (knots, values), for a tensor of positions."""
    result = values[0]
    for low, high, start, end in zip(knots, knots[1:], values, values[1:]):
        result = result + (at.clamp(low, high) - low) * ((end - start) / (high - low))
    return result


def decode(anchors, shifts, weights):
    """Returns the boxes that the shifts of torchvision's box coder describe."""
    sizes = anchors[:, 2:] - anchors[:, :2]
    middles = anchors[:, :2] + 0.5 * sizes
    middles = middles + shifts[:, :2] / weights[0] * sizes
    # torchvision's limit of a size's logarithm: log(1000 / 16).
    sizes = sizes * torch.exp((shifts[:, 2:] / weights[1]).clamp(max=4.135))
    low = (middles - 0.5 * sizes).clamp(min=-0.5)
    high = middles + 0.5 * sizes
    high = torch.stack([high[:, 0].clamp(max=sampling.COLUMNS - 0.5), high[:, 1].clamp(max=sampling.ROWS - 0.5)], 1)
    return torch.cat([low, torch.maximum(high, low)], 1)


class Exported(nn.Module):
    """The network from the image to boxes, labels, scores and masks, in torchvision's layout.

    The input is the image [3, 800, 1280], red, green and blue from 0 to 1, and reads the sampled pixels. The exported file also
    takes these pixels alone (`take_sampled`). Boxes are in px of
    the image; masks have 28 × 28 cells that divide the box evenly, as in the ONNX model zoo.
    """

    def __init__(self, network, temperature=1.0):
        super().__init__()
        self.network, self.temperature = network.eval(), temperature
        sizes = []
        rows, columns = sampling.ROWS, sampling.COLUMNS
        for stride in STRIDES:
            sizes.append((-(-rows // stride), -(-columns // stride)))
        cells = network.rpn.anchor_generator.cell_anchors
        anchors = []
        for stride, size, cell in zip(STRIDES, sizes, cells):
            y, x = torch.meshgrid(torch.arange(size[0]) * float(stride), torch.arange(size[1]) * float(stride), indexing="ij")
            shift = torch.stack([x, y, x, y], 2).reshape(-1, 1, 4)
            anchors.append((shift + cell[None]).reshape(-1, 4))
        self.register_buffer("anchors", torch.cat(anchors), persistent=False)
        self.sizes = sizes
        self.register_buffer("rows", torch.from_numpy(sampling.pixels(sampling.ROW_KNOTS)), persistent=False)
        self.register_buffer("columns", torch.from_numpy(sampling.pixels(sampling.COLUMN_KNOTS)), persistent=False)

    def forward(self, image):
        return self.from_sampled(image.index_select(1, self.rows).index_select(2, self.columns))

    def proposals(self, pixels):
        """Returns the finest features and the proposals of a sampled picture."""
        network = self.network
        levels = list(network.backbone((pixels[None] - MEAN) / DEVIATION).values())
        logits, shifts = network.rpn.head(levels)
        logits = torch.cat([x.permute(0, 2, 3, 1).reshape(-1) for x in logits])
        shifts = torch.cat([x.reshape(-1, 4, *size).permute(2, 3, 0, 1).reshape(-1, 4) for x, size in zip(shifts, self.sizes)])
        best, chosen = logits.topk(PROPOSALS)
        boxes = decode(self.anchors[chosen], shifts[chosen], (1.0, 1.0))
        return levels[0], boxes[nms(boxes, best, PROPOSAL_OVERLAP)[:KEPT]]

    def classify(self, features, boxes):
        """Returns the logits of the classes of proposals, and the shifts of their boxes."""
        heads = self.network.roi_heads
        pooled = roi_align(features, [boxes], BOX_BINS, 1.0 / STRIDES[0], 2)
        return heads.box_predictor(heads.box_head(pooled))

    def from_sampled(self, pixels):
        features, proposals = self.proposals(pixels)
        logits, shifts = self.classify(features, proposals)
        classes = len(CLASSES)
        scores = (logits / self.temperature).softmax(1)[:, 1:].reshape(-1)
        repeated = proposals[:, None].expand(-1, classes, 4).reshape(-1, 4)
        boxes = decode(repeated, shifts.reshape(-1, classes + 1, 4)[:, 1:].reshape(-1, 4), (10.0, 5.0))
        labels = (torch.arange(1, classes + 1)[None] + torch.zeros_like(proposals[:, :1], dtype=torch.int64)).reshape(-1)
        good = (scores > LEAST_SCORE).nonzero()[:, 0]
        boxes, scores, labels = boxes[good], scores[good], labels[good]
        # Boxes of different classes do not suppress each other: they are moved apart.
        apart = boxes + (labels * (2.0 * sampling.COLUMNS)).to(boxes.dtype)[:, None]
        kept = nms(apart, scores, DETECTION_OVERLAP)[:DETECTIONS]
        boxes, scores, labels = boxes[kept], scores[kept], labels[kept]
        heads = self.network.roi_heads
        pooled = roi_align(features, [boxes], MASK_BINS, 1.0 / STRIDES[0], 2)
        masks = heads.mask_predictor(heads.mask_head(pooled)).sigmoid()
        masks = masks.gather(1, labels[:, None, None, None].expand(-1, 1, 2 * MASK_BINS, 2 * MASK_BINS))
        return self.in_image(boxes, labels, scores, masks)

    def in_image(self, boxes, labels, scores, masks):
        """Transforms boxes and masks from the sampled picture to the image."""
        column_knots, row_knots = sampling.COLUMN_KNOTS, sampling.ROW_KNOTS
        x = piecewise(boxes[:, 0::2] + 0.5, *column_knots)
        y = piecewise(boxes[:, 1::2] + 0.5, *row_knots)
        cells = 2 * MASK_BINS
        parts = (torch.arange(cells) + 0.5) / cells
        columns = piecewise(x[:, :1] + parts * (x[:, 1:] - x[:, :1]), *column_knots[::-1]) - 0.5
        rows = piecewise(y[:, :1] + parts * (y[:, 1:] - y[:, :1]), *row_knots[::-1]) - 0.5
        sizes = (boxes[:, 2:] - boxes[:, :2]).clamp(min=1e-3)
        u = 2.0 * (columns - boxes[:, :1]) / sizes[:, :1] - 1.0
        v = 2.0 * (rows - boxes[:, 1:2]) / sizes[:, 1:] - 1.0
        grid = torch.stack([u[:, None, :].expand(-1, cells, cells), v[:, :, None].expand(-1, cells, cells)], 3)
        masks = nn.functional.grid_sample(masks, grid, mode="bilinear", padding_mode="border", align_corners=False)
        return torch.stack([x[:, 0], y[:, 0], x[:, 1], y[:, 1]], 1), labels, scores, masks


def take_sampled(model):
    """Lets a graph that begins with the selection of the sampled pixels also take a picture [3, 144, 320] of these pixels alone.

    Reading them from the whole image, 12 MB that no cache holds, takes a third of the time of the network.
    """
    import onnx
    from onnx import TensorProto, helper

    graph, size = model.graph, [3, sampling.ROWS, sampling.COLUMNS]
    first, second = [node for node in graph.node if node.op_type == "Gather"][:2]
    assert first.input[0] == graph.input[0].name and second.input[0] == first.output[0]
    indices = [node for node in graph.node if node.output[0] in (first.input[1], second.input[1])]
    for node in (*indices, first, second):
        graph.node.remove(node)
    picture, second.output[0] = second.output[0], "selected"
    selected = helper.make_tensor_value_info("selected", TensorProto.FLOAT, size)
    given = helper.make_tensor_value_info("given", TensorProto.FLOAT, None)
    image = first.input[0]
    choice = {
        "then_branch": helper.make_graph([helper.make_node("Identity", [image], ["given"])], "take", [], [given]),
        "else_branch": helper.make_graph([*indices, first, second], "select", [], [selected]),
    }

    def constant(name, values):
        return helper.make_node("Constant", [], [name], value=onnx.numpy_helper.from_array(np.array(values, np.int64)))

    nodes = [
        helper.make_node("Shape", [image], ["rows_of_image"], start=1, end=2),
        constant("rows_of_sampled", [sampling.ROWS]),
        helper.make_node("Equal", ["rows_of_image", "rows_of_sampled"], ["are_sampled"]),
        helper.make_node("Squeeze", ["are_sampled"], ["is_sampled"]),
        helper.make_node("If", ["is_sampled"], ["either"], **choice),
        constant("size_of_sampled", size),
        helper.make_node("Reshape", ["either", "size_of_sampled"], [picture]),
    ]
    for node in reversed(nodes):
        graph.node.insert(0, node)
    for side, name in zip(graph.input[0].type.tensor_type.shape.dim[1:], ("rows", "columns")):
        side.dim_param = name


def export(network, temperature, path):
    """Writes the ONNX file, with the sampled pixels and the names of the labels as its metadata."""
    import onnx

    torch.onnx.export(
        Exported(network, temperature),
        (torch.rand(3, sampling.HEIGHT_PX, sampling.WIDTH_PX),),
        path,
        opset_version=17,
        dynamo=False,
        input_names=["image"],
        output_names=["boxes", "labels", "scores", "masks"],
        dynamic_axes={name: {0: "detections"} for name in ("boxes", "labels", "scores", "masks")},
    )
    model = onnx.load(path)
    take_sampled(model)
    words = {
        "closecall.takes-sampled": "yes",
        "closecall.columns": sampling.words(sampling.COLUMN_KNOTS),
        "closecall.rows": sampling.words(sampling.ROW_KNOTS),
        "closecall.labels": " ".join(f"{label}={name}" for label, name in enumerate(CLASSES, 1)),
    }
    onnx.helper.set_model_props(model, words)
    onnx.checker.check_model(model)
    onnx.save(model, path)
