"""Writes a convolutional network as an ONNX model, with batch normalisation and the scale of the pixels folded into the weights."""

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
# 8-bit pixels are divided by this number.
PIXEL_SCALE = 255.0


class Exporter:
    """The nodes and weights of a model so far, and the name of the value that the next node takes."""

    def __init__(self):
        self.nodes, self.weights, self.value = [], [], "pixels"

    def constant(self, name, values):
        """Adds a weight, and returns its name."""
        self.weights.append(numpy_helper.from_array(np.ascontiguousarray(values, dtype=np.float32), name))
        return name

    def node(self, kind, inputs, output, **attributes):
        """Adds a node. The next one takes its output."""
        self.nodes.append(helper.make_node(kind, inputs, [output], **attributes))
        self.value = output

    def convolutions(self, features, layers):
        """Adds the layers (outputs, kernel, stride, dilation), each a convolution, a batch normalisation and a rectifier of `features`."""
        for index, (_, kernel, stride, dilation) in enumerate(layers):
            convolution, norm = features[3 * index], features[3 * index + 1]
            gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
            weight = convolution.weight * gain[:, None, None, None]
            if index == 0:
                weight = weight / PIXEL_SCALE
            bias = norm.bias - norm.running_mean * gain
            inputs = [self.value, self.constant(f"weight{index}", weight.detach()), self.constant(f"bias{index}", bias.detach())]
            padding = [dilation * (kernel // 2)] * 4
            shape = {"kernel_shape": [kernel] * 2, "strides": [stride] * 2, "dilations": [dilation] * 2, "pads": padding}
            self.node("Conv", inputs, f"sum{index}", **shape)
            self.node("Relu", [f"sum{index}"], f"layer{index}")

    def save(self, name, shape, output_shape, path):
        """Checks the model and writes it. It takes `pixels` of `shape` and returns its last value."""
        graph = helper.make_graph(
            self.nodes,
            name,
            [helper.make_tensor_value_info("pixels", TensorProto.FLOAT, shape)],
            [helper.make_tensor_value_info(self.value, TensorProto.FLOAT, output_shape)],
            self.weights,
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="closecall")
        model.ir_version = 8
        onnx.checker.check_model(model)
        onnx.save(model, path)
