"""Runs the exported network in ONNX Runtime, one crop at a time, as the simulator does."""

import numpy as np
import onnxruntime


def scores(model, pixels):
    """Returns the class probabilities, of shape (n, 4), for 8-bit crops of shape (n, 3, 32, 32)."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(model), options, providers=["CPUExecutionProvider"])
    return np.concatenate([session.run(None, {"pixels": crop[None].astype(np.float32)})[0] for crop in pixels])
