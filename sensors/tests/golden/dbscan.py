"""Labels point sets with scikit-learn's DBSCAN, as a reference for the clustering of the LiDAR.

    python -m venv venv && venv/bin/pip install scikit-learn==1.9.1
    venv/bin/python sensors/tests/golden/dbscan.py > sensors/tests/golden/dbscan.csv

The tests of `lidar::clustering` read the file, and only this script writes it. Coordinates have three decimals, so
that both sides read the same numbers. A label of -1 is noise.
"""

import numpy as np
from sklearn.cluster import DBSCAN


def vehicles(rng, count):
    """Returns fronts and sides of vehicles as a scan shows them in the stretched plane, with stray points."""
    parts = []
    for _ in range(count):
        centre = rng.uniform([0, -12], [90, 12])
        front = np.column_stack([rng.normal(0, 0.1, 40), rng.uniform(-1.8, 1.8, 40)])
        side = np.column_stack([rng.uniform(0, 6, 25), rng.normal(1.8, 0.05, 25)])
        parts += [centre + front, centre + side]
    parts.append(rng.uniform([0, -15], [90, 15], (60, 2)))
    return np.concatenate(parts)


def main():
    rng = np.random.default_rng(20)
    sets = {
        "vehicles": (vehicles(rng, 8), 1.0, 3),
        "uniform": (rng.uniform(0, 20, (300, 2)), 1.0, 4),
        "bridges": (np.cumsum(rng.normal(0, 0.45, (300, 2)), axis=0), 0.5, 3),
        "dense": (rng.normal(0, 3, (250, 2)), 0.6, 8),
    }
    print("set,radius,core_points,x,y,label")
    for name, (points, radius, core_points) in sets.items():
        points = np.round(points, 3)
        points = points[rng.permutation(len(points))]
        labels = DBSCAN(eps=radius, min_samples=core_points, algorithm="brute").fit_predict(points)
        for (x, y), label in zip(points, labels):
            print(f"{name},{radius},{core_points},{x:.3f},{y:.3f},{label}")


if __name__ == "__main__":
    main()
