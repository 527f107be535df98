"""Trains the Mask R-CNN of the rear camera on sampled pictures, calibrates it, and exports it to ONNX.

    python xtask/training/mask_rcnn_train.py --pictures DIR [DIR …] --out sensors/models/rear-mask-rcnn.onnx

Pictures are mirrored, stretched, and changed in colour and brightness at random, and vehicles of other pictures are pasted into them
(Ghiasi et al., Simple Copy-Paste, CVPR 2021), so that the network learns vehicles of other proportions, and hidden ones.
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

# A vehicle with fewer visible pixels in the sampled picture is not learned.
LEAST_PIXELS, LEAST_COLUMNS = 10, 4
# One of so many scenes of the last folder is held back for the calibration; not a multiple of the period of empty and crowded scenes, 10.
HELD_BACK = 21
# Copy-paste: share of the pictures, and the largest difference between the mean brightnesses of both pictures.
PASTED, SAME_LIGHT = 0.5, 0.15
# Share of the pictures that are stretched, and the largest stretch of each axis.
STRETCHED, STRETCH = 0.5, 1.25
# Shares of the pictures whose channels change places, and whose colours fade.
SHUFFLED, FADED = 0.2, 0.2
# Largest change of the brightness, and of the brightness of one channel.
BRIGHTER, TINTED = 0.2, 0.1
# Overlap from which a proposal shows a vehicle, as in the training of the heads.
SAME_VEHICLE = 0.5


class Pictures:
    """The sampled pictures of the folders that `render_dataset` has written."""

    def __init__(self, folders):
        shape = (-1, sampling.ROWS, sampling.COLUMNS)
        self.pixels, self.instances, self.labels = [], [], []
        for folder in map(pathlib.Path, folders):
            self.last_folder = len(self.pixels)
            self.pixels.extend(np.fromfile(folder / "pixels.rgb", np.uint8).reshape(*shape, 3))
            self.instances.extend(np.fromfile(folder / "instances.u8", np.uint8).reshape(shape))
            labels = [{} for _ in range(len(self.pixels) - len(self.labels))]
            with open(folder / "vehicles.csv", encoding="ascii") as file:
                for row in csv.DictReader(file):
                    labels[int(row["scene"])][int(row["instance"])] = int(row["class"]) + 1
            self.labels += labels
        self.brightness = np.array([pixels.mean() / 255.0 for pixels in self.pixels])

    def __len__(self):
        return len(self.pixels)

    def get(self, index):
        """Returns the pixels [3, rows, columns] from 0 to 1 and the target of one picture."""
        return prepared(self.pixels[index], self.instances[index], self.labels[index])

    def varied(self, index, generator):
        """Returns what `get` returns, changed at random."""
        pixels, instances, labels = self.pixels[index], self.instances[index], self.labels[index]
        if generator.random() < PASTED:
            pixels, instances, labels = self.pasted(index, generator)
        if generator.random() < 0.5:
            pixels, instances = pixels[:, ::-1], instances[:, ::-1]
        if generator.random() < STRETCHED:
            pixels, instances = stretched(pixels, instances, generator)
        pixels, target = prepared(pixels, instances, labels)
        if generator.random() < SHUFFLED:
            pixels = pixels[torch.from_numpy(generator.permutation(3))]
        if generator.random() < FADED:
            pixels = pixels + generator.random() * (pixels.mean(0, keepdim=True) - pixels)
        gains = generator.uniform(1.0 - BRIGHTER, 1.0 + BRIGHTER) * generator.uniform(1.0 - TINTED, 1.0 + TINTED, (3, 1, 1))
        return (pixels * torch.from_numpy(gains).float()).clamp(0.0, 1.0), target

    def pasted(self, index, generator):
        """Returns a picture with vehicles of another one of similar brightness, each hidden by those that stand lower."""
        pixels, instances, labels = self.pixels[index].copy(), self.instances[index].copy(), dict(self.labels[index])
        other = int(generator.integers(len(self)))
        if abs(self.brightness[other] - self.brightness[index]) > SAME_LIGHT:
            return pixels, instances, labels
        lowest = {one: lowest_row(instances == one) for one in labels}
        next_instance = max(labels, default=0) + 1
        for one, label in self.labels[other].items():
            mask = self.instances[other] == one
            if generator.random() < 0.5 or not mask.any():
                continue
            row = lowest_row(mask)
            for present, its_row in lowest.items():
                if its_row > row:
                    mask &= instances != present
            pixels[mask], instances[mask] = self.pixels[other][mask], next_instance
            labels[next_instance], lowest[next_instance] = label, row
            next_instance += 1
        return pixels, instances, labels


def lowest_row(mask):
    return int(np.flatnonzero(mask.any(1)).max(initial=-1))


def stretched(pixels, instances, generator):
    """Returns a picture that is stretched or shrunk along each axis about a random point; beyond its edge it is grey."""
    places = []
    for count in instances.shape:
        scale, middle = STRETCH ** generator.uniform(-1.0, 1.0), generator.uniform(0.0, count)
        at = middle + (np.arange(count) + 0.5 - middle) / scale
        places.append((np.clip(np.floor(at), 0, count - 1).astype(int), (at >= 0.0) & (at < count)))
    (rows, inside_rows), (columns, inside_columns) = places
    inside = inside_rows[:, None] & inside_columns[None]
    return np.where(inside[..., None], pixels[rows][:, columns], np.uint8(255 * model.MEAN)), instances[rows][:, columns] * inside


def prepared(pixels, instances, labels):
    """Returns pixels [3, rows, columns] from 0 to 1 and the target of a picture."""
    boxes, kept, masks = [], [], []
    for instance, label in labels.items():
        mask = instances == instance
        if mask.sum() < LEAST_PIXELS:
            continue
        columns, rows = np.flatnonzero(mask.any(0)), np.flatnonzero(mask.any(1))
        if columns[-1] - columns[0] + 1 < LEAST_COLUMNS:
            continue
        boxes.append([columns[0] - 0.5, rows[0] - 0.5, columns[-1] + 0.5, rows[-1] + 0.5])
        kept.append(label)
        masks.append(mask)
    target = {
        "boxes": torch.tensor(boxes, dtype=torch.float32).reshape(-1, 4),
        "labels": torch.tensor(kept, dtype=torch.int64),
        "masks": torch.from_numpy(np.stack(masks).astype(np.uint8) if masks else np.zeros((0, *instances.shape), np.uint8)),
    }
    return torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1))).float() / 255.0, target


def train(network, pictures, chosen, arguments, generator):
    """Fits the weights with a one-cycle schedule of the learning rate."""
    batch = arguments.batch
    steps = arguments.epochs * (len(chosen) // batch)
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, max_lr=arguments.rate, total_steps=steps, pct_start=0.15)
    network.train()
    sums, step, began = np.zeros(5), 0, time.monotonic()
    for _ in range(arguments.epochs):
        order = generator.permutation(chosen)
        for first in range(0, len(order) // batch * batch, batch):
            losses = network(*zip(*(pictures.varied(index, generator) for index in order[first : first + batch])))
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
    parser.add_argument("--pictures", required=True, nargs="+", help="folders of sampled pictures")
    parser.add_argument("--out", required=True, help="ONNX file to write; the weights stand beside it, with .pt at the end")
    parser.add_argument("--epochs", type=int, default=16, help="0: only calibrate and export")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--rate", type=float, default=2e-3, help="highest learning rate")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--weights", help="file of weights to begin with")
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    pictures = Pictures(arguments.pictures)
    held_back = np.arange(pictures.last_folder, len(pictures), HELD_BACK)
    network = model.create()
    print(f"{len(pictures)} pictures, {sum(part.numel() for part in network.parameters())} weights", flush=True)
    if arguments.weights:
        network.load_state_dict(torch.load(arguments.weights))
    if arguments.epochs > 0:
        chosen = np.setdiff1d(np.arange(len(pictures)), held_back)
        train(network, pictures, chosen, arguments, np.random.default_rng(arguments.seed))
    network.eval()
    temperature = fit_temperature(network, pictures, held_back)
    print(f"temperature {temperature:.3f}")
    model.export(network, temperature, arguments.out)


if __name__ == "__main__":
    main()
