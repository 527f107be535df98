"""Trains the detector of vehicles in aerial pictures, and exports it to ONNX.

    python xtask/training/aerial_train.py --pictures DIR --out recorded/models/aerial-detector.onnx

The network is fully convolutional and has no anchors (in the manner of X. Zhou et al., *Objects as Points*, 2019). For each
cell of 8 px it returns eight numbers: the logits that the centre of a car or of a truck lies there, the offset of the centre
from the middle of the cell (cells), the logarithms of length / 32 px and width / 16 px, and sine and cosine of twice the angle,
because front and rear look alike from above. The export folds batch normalisation and the scaling of the pixels into the
convolutions. The graph takes pixel values from 0 to 255 of any picture whose sides are multiples of 8.
"""

import argparse

import numpy as np
import torch
from torch import nn

import aerial_data as data
from export import Exporter

# Output channels, kernel size, stride and dilation of each convolution.
LAYERS = (
    (16, 5, 2, 1),
    (32, 3, 2, 1),
    (48, 3, 2, 1),
    (48, 3, 1, 1),
    (48, 3, 1, 2),
    (48, 3, 1, 4),
    (48, 3, 1, 8),
    (48, 3, 1, 4),
    (48, 3, 1, 2),
    (48, 3, 1, 1),
)
OUTPUTS = 8
# Rows and columns of a training tile (px): of a square picture, and of a strip.
TILES = ((256, 256), (192, 320))
# Share of the batches that come from square pictures, which show roads in all directions (-).
SQUARES = 0.65
# Standard deviation of the target around a centre (cells), and the largest distance at which sizes are learned (cells).
SPREAD, NEAR = 0.8, 1.1


class Network(nn.Module):
    """The detector in the form that is trained."""

    def __init__(self):
        super().__init__()
        layers = []
        channels = 3
        for out, kernel, stride, dilation in LAYERS:
            padding = dilation * (kernel // 2)
            layers += [nn.Conv2d(channels, out, kernel, stride, padding, dilation, bias=False), nn.BatchNorm2d(out), nn.ReLU()]
            channels = out
        self.features = nn.Sequential(*layers)
        self.head = nn.Conv2d(channels, OUTPUTS, 1)
        with torch.no_grad():
            self.head.bias[:2] = -4.0

    def forward(self, pixels):
        """Returns the output for pixel values from 0 to 1."""
        return self.head(self.features(pixels))


def tile(picture, size, generator):
    """Returns a random tile of this size, mirrored at random, with its boxes."""
    height, width = picture.pixels.shape[:2]
    top = generator.integers(0, height - size[0] + 1)
    left = generator.integers(0, width - size[1] + 1)
    pixels = picture.pixels[top : top + size[0], left : left + size[1]]
    boxes = picture.boxes.copy()
    boxes[:, :2] -= [left, top]
    if size[0] == size[1] and generator.random() < 0.5:
        pixels, boxes[:, :2], boxes[:, 4] = pixels.transpose(1, 0, 2), boxes[:, 1::-1], 0.5 * np.pi - boxes[:, 4]
    if generator.random() < 0.5:
        pixels, boxes[:, 0], boxes[:, 4] = pixels[:, ::-1], size[1] - boxes[:, 0], np.pi - boxes[:, 4]
    if generator.random() < 0.5:
        pixels, boxes[:, 1], boxes[:, 4] = pixels[::-1], size[0] - boxes[:, 1], -boxes[:, 4]
    gain = generator.uniform(0.75, 1.25) * generator.uniform(0.92, 1.08, 3)
    return np.clip(pixels * gain, 0.0, 255.0).astype(np.float32).transpose(2, 0, 1) / 255.0, boxes


def target(boxes, size):
    """Returns the target of a tile of this size: heat [2], regression [6], weight of the regression, weight of the heat."""
    rows, columns = size[0] // data.STRIDE, size[1] // data.STRIDE
    heat, weight = np.zeros((2, rows, columns), np.float32), np.zeros((rows, columns), np.float32)
    regression, counted = np.zeros((6, rows, columns), np.float32), np.ones((rows, columns), np.float32)
    middle_row, middle_column = np.mgrid[0:rows, 0:columns] + 0.5
    for column, row, length, width, angle, kind, difficult in boxes:
        dx, dy = column / data.STRIDE - middle_column, row / data.STRIDE - middle_row
        distance = np.hypot(dx, dy)
        if difficult:
            counted[distance < 3.0] = 0.0
            continue
        if not (0 <= column < size[1] and 0 <= row < size[0]):
            continue
        # The cell that contains the centre has the target 1.
        peak = np.exp(-0.5 * (distance / SPREAD) ** 2)
        peak[int(row // data.STRIDE), int(column // data.STRIDE)] = 1.0
        heat[int(kind)] = np.maximum(heat[int(kind)], peak)
        near = (distance < NEAR) & (1.0 / (distance + 0.1) > weight)
        weight[near] = 1.0 / (distance[near] + 0.1)
        shape = [np.log(length / data.LENGTH_PX), np.log(width / data.WIDTH_PX), np.sin(2 * angle), np.cos(2 * angle)]
        regression[:, near] = np.stack([dx[near], dy[near], *[np.full(near.sum(), value) for value in shape]])
    return heat, regression, (weight > 0).astype(np.float32), counted


def loss_of(output, heat, regression, weight, counted):
    """Returns the focal loss of the heat (Zhou et al., 2019) and the smooth absolute error of the boxes."""
    score = torch.sigmoid(output[:, :2]).clamp(1e-5, 1.0 - 1e-5)
    is_centre = heat == 1.0
    found = -((1.0 - score) ** 2) * torch.log(score) * is_centre
    false = -((1.0 - heat) ** 4) * score**2 * torch.log(1.0 - score) * ~is_centre
    centres = is_centre.sum().clamp(min=1)
    boxes = nn.functional.smooth_l1_loss(output[:, 2:], regression, reduction="none", beta=0.1)
    return ((found + false) * counted[:, None]).sum() / centres, (boxes * weight[:, None]).sum() / weight.sum().clamp(min=1)


def train(network, pictures, steps, batch, generator):
    """Fits the weights with a one-cycle schedule of the learning rate."""
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=4e-3, total_steps=steps)
    network.train()
    sums = np.zeros(2)
    is_square = [picture.pixels.shape[0] == picture.pixels.shape[1] for picture in pictures]
    kinds = [[one for one, square in zip(pictures, is_square) if square == wanted] for wanted in (True, False)]
    for step in range(steps):
        kind = 0 if generator.random() < SQUARES else 1
        chosen = generator.integers(0, len(kinds[kind]), batch)
        tiles = [tile(kinds[kind][index], TILES[kind], generator) for index in chosen]
        targets = zip(*[target(boxes, TILES[kind]) for _, boxes in tiles])
        pixels = torch.from_numpy(np.stack([pixels for pixels, _ in tiles]))
        heat, boxes = loss_of(network(pixels), *[torch.from_numpy(np.stack(part)) for part in targets])
        optimizer.zero_grad()
        (heat + 2.0 * boxes).backward()
        nn.utils.clip_grad_norm_(network.parameters(), 10.0)
        optimizer.step()
        schedule.step()
        sums += [heat.item(), boxes.item()]
        if (step + 1) % 100 == 0:
            print(f"step {step + 1}/{steps}: heat {sums[0] / 100:.3f}, boxes {sums[1] / 100:.3f}", flush=True)
            sums[:] = 0.0


def write(network, path):
    """Writes the ONNX graph: convolutions with rectifiers, then the convolution of the head."""
    network.eval()
    exporter = Exporter()
    exporter.convolutions(network.features, LAYERS)
    head = [exporter.constant("head", network.head.weight.detach()), exporter.constant("offset", network.head.bias.detach())]
    exporter.node("Conv", [exporter.value, *head], "boxes", kernel_shape=[1, 1])
    exporter.save("aerial-detector", [1, 3, "height", "width"], [1, OUTPUTS, "rows", "columns"], path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", required=True, help="folder of training pictures")
    parser.add_argument("--out", required=True, help="ONNX file to write")
    parser.add_argument("--steps", type=int, default=2_400)
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    network = Network()
    train(network, data.read(arguments.pictures), arguments.steps, arguments.batch, np.random.default_rng(arguments.seed))
    write(network, arguments.out)


if __name__ == "__main__":
    main()
