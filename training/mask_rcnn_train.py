"""Trains the Mask R-CNN of the rear camera on sampled pictures, calibrates it, and exports it to ONNX.

    python training/mask_rcnn_train.py --pictures DIR --out camera/models/rear-mask-rcnn.onnx
"""

import argparse
import csv
import pathlib
import time

import numpy as np
import torch
from torch import nn
from torchvision.ops import box_iou

import mask_rcnn_model as model
import mask_rcnn_sampling as sampling

# Vehicles of which fewer pixels of the sampled picture are seen are not learned.
LEAST_PIXELS, LEAST_COLUMNS = 10, 4
# One of so many scenes is held back for the calibration.
HELD_BACK = 20
# Overlap from which a proposal shows a vehicle, as in the training of the heads.
SAME_VEHICLE = 0.5


class Pictures:
    """The sampled pictures of a folder that `render_dataset` has written."""

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        shape = (-1, sampling.ROWS, sampling.COLUMNS)
        self.pixels = np.fromfile(folder / "pixels.rgb", np.uint8).reshape(*shape, 3)
        self.instances = np.fromfile(folder / "instances.u8", np.uint8).reshape(shape)
        self.labels = [{} for _ in range(len(self.pixels))]
        with open(folder / "vehicles.csv", encoding="ascii") as file:
            for row in csv.DictReader(file):
                self.labels[int(row["scene"])][int(row["instance"])] = int(row["class"]) + 1

    def __len__(self):
        return len(self.pixels)

    def get(self, index, mirrored=False):
        """Returns the pixels [3, rows, columns] from 0 to 1 and the target of one picture."""
        pixels, instances = self.pixels[index], self.instances[index]
        if mirrored:
            pixels, instances = pixels[:, ::-1], instances[:, ::-1]
        boxes, labels, masks = [], [], []
        for instance, label in self.labels[index].items():
            mask = instances == instance
            columns, rows = np.flatnonzero(mask.any(0)), np.flatnonzero(mask.any(1))
            if mask.sum() < LEAST_PIXELS or columns[-1] - columns[0] + 1 < LEAST_COLUMNS:
                continue
            boxes.append([columns[0] - 0.5, rows[0] - 0.5, columns[-1] + 0.5, rows[-1] + 0.5])
            labels.append(label)
            masks.append(mask)
        target = {
            "boxes": torch.tensor(boxes, dtype=torch.float32).reshape(-1, 4),
            "labels": torch.tensor(labels, dtype=torch.int64),
            "masks": torch.from_numpy(np.stack(masks).astype(np.uint8) if masks else np.zeros((0, *instances.shape), np.uint8)),
        }
        return torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1))).float() / 255.0, target


def batch_of(pictures, indices, generator):
    """Returns pictures, mirrored at random and brighter or darker by up to a fifth, with their targets."""
    batch = [pictures.get(index, generator.random() < 0.5) for index in indices]
    return [(pixels * generator.uniform(0.8, 1.2)).clamp(0.0, 1.0) for pixels, _ in batch], [target for _, target in batch]


def train(network, pictures, chosen, arguments, generator):
    """Fits the weights with a one-cycle schedule of the learning rate, for a number of epochs or of minutes."""
    batch = arguments.batch
    steps = arguments.epochs * (len(chosen) // batch)
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=2e-3, total_steps=steps, pct_start=0.15)
    network.train()
    sums, step, began = np.zeros(5), 0, time.monotonic()
    for _ in range(arguments.epochs):
        order = generator.permutation(chosen)
        for first in range(0, len(order) // batch * batch, batch):
            losses = network(*batch_of(pictures, order[first : first + batch], generator))
            optimizer.zero_grad()
            sum(losses.values()).backward()
            nn.utils.clip_grad_norm_(network.parameters(), 10.0)
            optimizer.step()
            schedule.step()
            sums += [loss.item() for loss in losses.values()]
            step += 1
            if step % 50 == 0:
                words = ", ".join(f"{name.removeprefix('loss_')} {value / 50:.3f}" for name, value in zip(losses, sums))
                print(f"step {step}/{steps}, {time.monotonic() - began:.0f} s: {words}", flush=True)
                sums[:] = 0.0
        torch.save(network.state_dict(), arguments.out + ".pt")


@torch.no_grad()
def fit_temperature(network, pictures, chosen):
    """Returns the temperature of maximum likelihood of the classes of proposals (Guo et al., 2017)."""
    exported = model.Exported(network)
    logits, labels = [], []
    for index in chosen:
        pixels, target = pictures.get(index)
        features, boxes = exported.proposals(pixels)
        logits.append(exported.classify(features, boxes)[0])
        overlap = box_iou(boxes, target["boxes"]) if len(target["boxes"]) else torch.zeros(len(boxes), 1)
        best, which = overlap.max(1)
        shown = target["labels"][which] if len(target["boxes"]) else torch.zeros(len(boxes), dtype=torch.int64)
        labels.append(torch.where(best >= SAME_VEHICLE, shown, torch.zeros_like(shown)))
    logits, labels = torch.cat(logits), torch.cat(labels)
    temperatures = torch.linspace(0.5, 3.0, 101)
    losses = [nn.functional.cross_entropy(logits / temperature, labels).item() for temperature in temperatures]
    return float(temperatures[int(np.argmin(losses))])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", required=True, help="folder of sampled pictures")
    parser.add_argument("--out", required=True, help="ONNX file to write; the weights stand beside it, with .pt at the end")
    parser.add_argument("--epochs", type=int, default=16)
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--weights", help="file of weights: do not train, calibrate and export these")
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    pictures = Pictures(arguments.pictures)
    held_back = np.arange(HELD_BACK - 1, len(pictures), HELD_BACK)
    network = model.create()
    print(f"{len(pictures)} pictures, {sum(part.numel() for part in network.parameters())} weights", flush=True)
    if arguments.weights:
        network.load_state_dict(torch.load(arguments.weights))
    else:
        chosen = np.setdiff1d(np.arange(len(pictures)), held_back)
        train(network, pictures, chosen, arguments, np.random.default_rng(arguments.seed))
    network.eval()
    temperature = fit_temperature(network, pictures, held_back)
    print(f"temperature {temperature:.3f}")
    model.export(network, temperature, arguments.out)


if __name__ == "__main__":
    main()
