"""Trains the rear camera's classifier, calibrates it, and exports it to ONNX.

    python training/train.py --crops DIR --out sensors/models/rear-classifier.onnx

The network is small on purpose: it runs for every LiDAR cluster of every scan on one core. Four convolutions and one
linear layer, about 50,000 weights. Batch normalisation and the scale of the pixels are folded into the convolutions on
export, the calibration's temperature into the last layer, so that the graph takes bytes as numbers (0 to 255, red,
green, blue planes) and gives probabilities of car, truck, motorcycle, background.
"""

import argparse

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

import crops

# Channels out, kernel, stride of each convolution.
LAYERS = ((16, 5, 2), (32, 3, 2), (48, 3, 1), (64, 3, 2))
CELLS = 4 * 4
OPSET = 17


class Network(nn.Module):
    """The classifier before export."""

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
        """Logits of pixels 0 to 1."""
        return self.head(self.dropout(self.features(pixels).flatten(1)))


def augmented(pixels, generator):
    """Mirrored at random, and brighter or darker by up to a fifth."""
    mirrored = torch.rand(len(pixels), generator=generator) < 0.5
    pixels = torch.where(mirrored[:, None, None, None], pixels.flip(3), pixels)
    gain = 0.8 + 0.4 * torch.rand(len(pixels), 1, 1, 1, generator=generator)
    return (pixels * gain).clamp(0.0, 1.0)


def train(network, data, epochs, generator):
    """Fits the weights; the learning rate rises and falls once."""
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
            chosen = order[first : first + batch]
            logits = network(augmented(pixels[chosen].float() / 255.0, generator))
            loss = nn.functional.cross_entropy(logits, labels[chosen])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item() * batch
        print(f"epoch {epoch + 1}/{epochs}: loss {total / len(data):.4f}", flush=True)


@torch.no_grad()
def logits_of(network, data):
    """Logits of all crops."""
    network.eval()
    parts = torch.from_numpy(data.pixels).split(1024)
    return torch.cat([network(part.float() / 255.0) for part in parts])


def temperature(logits, labels):
    """The temperature that makes the probabilities most likely (Guo et al., On calibration of modern neural networks, 2017)."""
    log_temperature = torch.zeros(1, requires_grad=True)
    optimizer = torch.optim.LBFGS([log_temperature], max_iter=50)

    def loss():
        optimizer.zero_grad()
        value = nn.functional.cross_entropy(logits / log_temperature.exp(), labels)
        value.backward()
        return value

    optimizer.step(loss)
    return float(log_temperature.detach().exp())


def export(network, heat, path):
    """Writes the graph: convolution and rectifier four times, one matrix, softmax."""
    network.eval()
    nodes, weights = [], []

    def constant(name, values):
        weights.append(numpy_helper.from_array(np.ascontiguousarray(values, dtype=np.float32), name))
        return name

    value = "pixels"
    for place, (_, kernel, stride) in enumerate(LAYERS):
        convolution, norm = network.features[3 * place], network.features[3 * place + 1]
        gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        weight = convolution.weight * gain[:, None, None, None]
        bias = norm.bias - norm.running_mean * gain
        if place == 0:
            weight = weight / 255.0
        inputs = [value, constant(f"weight{place}", weight.detach()), constant(f"bias{place}", bias.detach())]
        shape = {"kernel_shape": [kernel, kernel], "strides": [stride, stride], "pads": [kernel // 2] * 4}
        nodes.append(helper.make_node("Conv", inputs, [f"sum{place}"], **shape))
        nodes.append(helper.make_node("Relu", [f"sum{place}"], [f"layer{place}"]))
        value = f"layer{place}"
    nodes.append(helper.make_node("Flatten", [value], ["flat"], axis=1))
    head = network.head
    matrix = constant("matrix", (head.weight / heat).detach().numpy().T)
    offset = constant("offset", (head.bias / heat).detach())
    nodes.append(helper.make_node("Gemm", ["flat", matrix, offset], ["logits"]))
    nodes.append(helper.make_node("Softmax", ["logits"], ["scores"], axis=1))
    side = crops.SIDE_PX
    graph = helper.make_graph(
        nodes,
        "rear-classifier",
        [helper.make_tensor_value_info("pixels", TensorProto.FLOAT, [1, 3, side, side])],
        [helper.make_tensor_value_info("scores", TensorProto.FLOAT, [1, len(crops.CLASSES)])],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="closecall")
    model.ir_version = 8
    onnx.checker.check_model(model)
    onnx.save(model, path)


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
    # The last tenth of the scenes is kept for the calibration.
    kept = len(data) * 9 // 10
    network = Network()
    train(network, data.where(slice(None, kept)), arguments.epochs, generator)
    calibration = data.where(slice(kept, None))
    logits, labels = logits_of(network, calibration), torch.from_numpy(calibration.label)
    heat = temperature(logits, labels)
    accuracy = float((logits.argmax(1) == labels).float().mean())
    print(f"kept tenth: accuracy {accuracy:.4f}, temperature {heat:.3f}")
    export(network, heat, arguments.out)


if __name__ == "__main__":
    main()
