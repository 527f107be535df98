"""Trains the rear camera's classifier, calibrates it, and exports it to ONNX.

    python xtask/training/train.py --crops DIR --out sensors/models/rear-classifier.onnx

The network is deliberately small, because it runs on one core for every LiDAR cluster of every scan. It has four
convolutions and one linear layer with about 50,000 weights in total. The export folds batch normalisation and the
scaling of the pixels into the convolutions, and the calibration temperature into the last layer. The exported graph
therefore takes pixel values from 0 to 255 (red, green and blue planes) and returns the probabilities of car, truck,
motorcycle and background.
"""

import argparse

import numpy as np
import torch
from torch import nn

import crops
from export import Exporter

# Output channels, kernel size and stride of each convolution.
LAYERS = ((16, 5, 2), (32, 3, 2), (48, 3, 1), (64, 3, 2))
CELLS = 4 * 4


class Network(nn.Module):
    """The classifier in the form that is trained."""

    def __init__(self):
        super().__init__()
        layers = []
        channels = 3
        for out, kernel, stride in LAYERS:
            layers += [nn.Conv2d(channels, out, kernel, stride, kernel // 2, bias=False), nn.BatchNorm2d(out), nn.ReLU()]
            channels = out
        self.features = nn.Sequential(*layers)
        self.dropout = nn.Dropout(0.3)
        self.head = nn.Linear(channels * CELLS, len(crops.CLASSES))

    def forward(self, pixels):
        """Returns the logits for pixel values from 0 to 1."""
        return self.head(self.dropout(self.features(pixels).flatten(1)))


def augment(pixels, generator):
    """Mirrors crops at random, and makes them brighter or darker by up to a fifth."""
    mirrored = torch.rand(len(pixels), generator=generator) < 0.5
    pixels = torch.where(mirrored[:, None, None, None], pixels.flip(3), pixels)
    gain = 0.8 + 0.4 * torch.rand(len(pixels), 1, 1, 1, generator=generator)
    return (pixels * gain).clamp(0.0, 1.0)


def train(network, data, epochs, generator):
    """Fits the weights with a one-cycle schedule of the learning rate."""
    batch = 128
    steps = epochs * (len(data) // batch)
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=4e-3, total_steps=steps)
    pixels, labels = torch.from_numpy(data.pixels), torch.from_numpy(data.label)
    for epoch in range(epochs):
        network.train()
        order = torch.randperm(len(data), generator=generator)
        total = 0.0
        for first in range(0, len(data) // batch * batch, batch):
            selected = order[first : first + batch]
            logits = network(augment(pixels[selected].float() / 255.0, generator))
            loss = nn.functional.cross_entropy(logits, labels[selected])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item() * batch
        print(f"epoch {epoch + 1}/{epochs}: loss {total / len(data):.4f}", flush=True)


@torch.no_grad()
def logits_of(network, data):
    """Returns the logits of all crops."""
    network.eval()
    parts = torch.from_numpy(data.pixels).split(1024)
    return torch.cat([network(part.float() / 255.0) for part in parts])


def fit_temperature(logits, labels):
    """Returns the temperature of maximum likelihood (Guo et al., On calibration of modern neural networks, 2017)."""
    log_temperature = torch.zeros(1, requires_grad=True)
    optimizer = torch.optim.LBFGS([log_temperature], max_iter=50)

    def loss():
        optimizer.zero_grad()
        value = nn.functional.cross_entropy(logits / log_temperature.exp(), labels)
        value.backward()
        return value

    optimizer.step(loss)
    return float(log_temperature.detach().exp())


def write(network, temperature, path):
    """Writes the ONNX graph: four times convolution and rectifier, then a linear layer and softmax."""
    network.eval()
    exporter = Exporter()
    exporter.convolutions(network.features, [(*layer, 1) for layer in LAYERS])
    exporter.node("Flatten", [exporter.value], "flat", axis=1)
    head = network.head
    matrix = exporter.constant("matrix", (head.weight / temperature).detach().numpy().T)
    offset = exporter.constant("offset", (head.bias / temperature).detach())
    exporter.node("Gemm", ["flat", matrix, offset], "logits")
    exporter.node("Softmax", ["logits"], "scores", axis=1)
    side = crops.SIDE_PX
    exporter.save("rear-classifier", [1, 3, side, side], [1, len(crops.CLASSES)], path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--crops", required=True, help="folder of training crops")
    parser.add_argument("--out", required=True, help="ONNX file to write")
    parser.add_argument("--epochs", type=int, default=24)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    generator = torch.Generator().manual_seed(arguments.seed)
    data = crops.read(arguments.crops)
    # The last tenth of the crops, from the last scenes, is held back for the calibration.
    split = len(data) * 9 // 10
    network = Network()
    train(network, data.select(slice(None, split)), arguments.epochs, generator)
    calibration = data.select(slice(split, None))
    logits, labels = logits_of(network, calibration), torch.from_numpy(calibration.label)
    temperature = fit_temperature(logits, labels)
    accuracy = float((logits.argmax(1) == labels).float().mean())
    print(f"kept tenth: accuracy {accuracy:.4f}, temperature {temperature:.3f}")
    write(network, temperature, arguments.out)


if __name__ == "__main__":
    main()
