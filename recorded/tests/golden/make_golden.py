"""Generates scipy.json, the reference values for the low-pass filter and the peak detection.

Run: pip install scipy==1.16.3 numpy && python scenarios/tests/golden/make_golden.py
Every case contains its signal, so that SciPy and Closecall process the same bits.
"""

import json
import pathlib

import numpy as np
from scipy.signal import butter, filtfilt, find_peaks, peak_prominences, peak_widths

OUT = pathlib.Path(__file__).with_name("scipy.json")
CORNER_HZ = 1.3
# Vehicle width divided by lane width: car, narrow car on a wide lane, truck, motorcycle, and a vehicle as wide as its
# lane.
WIDTH_SHARES = (1.85 / 3.75, 1.4 / 4.2, 2.55 / 3.4, 0.8 / 3.75, 1.0)


def waves(n):
    k = np.arange(n)
    return np.sin(0.11 * k) + 0.4 * np.sin(0.57 * k + 1.0) + 0.2 * np.cos(2.3 * k) + 0.01 * k


def lateral_speed(n, rate_hz, rng):
    """Returns the lateral speed of consecutive quintic lane changes, with noise."""
    t = np.arange(n) / rate_hz
    speed = 0.05 * rng.standard_normal(n)
    start = 2.0
    while start < t[-1]:
        duration, shift = rng.uniform(2.5, 9.0), rng.choice([-3.75, -3.4, 3.4, 3.75, 7.5])
        tau = np.clip((t - start) / duration, 0.0, 1.0)
        speed += shift * 30.0 * tau**2 * (1.0 - tau) ** 2 / duration
        start += duration + rng.uniform(-1.0, 4.0)
    return speed


def filter_cases(rng):
    cases = []
    for rate_hz in (5.0, 10.0, 25.0, 100.0):
        b, a = butter(2, CORNER_HZ, fs=rate_hz)
        for padding in (9, round(1.8 * rate_hz)):
            for n in (1, 2, 3, 9, 10, 11, 40, 100):
                for name, signal in (("waves", waves(n)), ("walk", np.cumsum(rng.standard_normal(n)))):
                    padlen = min(padding, n - 1)
                    # SciPy requires a signal longer than the filter's padding. A single value is its own steady state.
                    filtered = signal if n == 1 else filtfilt(b, a, signal, padlen=padlen)
                    cases.append(
                        {
                            "name": f"{name}, {n} at {rate_hz} Hz, {padding}",
                            "rate_hz": rate_hz,
                            "padding": padding,
                            "signal": signal.tolist(),
                            "filtered": filtered.tolist(),
                        }
                    )
    return cases


def peak_signals(rng):
    yield "empty", []
    yield "one", [1.0]
    yield "two", [1.0, 2.0]
    yield "constant", [2.0] * 7
    yield "rising", list(range(6))
    yield "falling", list(range(6, 0, -1))
    yield "single", [0.0, 1.0, 0.0]
    yield "flat top, odd", [0.0, 2.0, 2.0, 2.0, 1.0]
    yield "flat top, even", [0.0, 2.0, 2.0, 2.0, 2.0, 1.0]
    yield "flat top at the left end", [2.0, 2.0, 2.0, 1.0, 0.0]
    yield "flat top at the right end", [0.0, 1.0, 2.0, 2.0]
    yield "highest at both ends", [5.0, 1.0, 2.0, 0.5, 3.0, 1.0, 5.0]
    yield "flat base", [0.0, 0.0, 0.0, 1.0, 3.0, 1.0, 0.0, 0.0, 0.0]
    yield "ties of peaks", [0.0, 2.0, 1.0, 2.0, 0.5, 2.0, 0.0]
    yield "ties of bases", [1.0, 0.0, 1.0, 0.0, 3.0, 0.0, 1.0, 0.0, 2.0]
    yield "stairs", [0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 2.0, 2.0, 1.0, 1.0, 0.0]
    yield "plateau under a peak", [0.0, 1.0, 1.0, 3.0, 3.0, 1.0, 1.0, 2.0, 0.0]
    yield "all negative", [-5.0, -1.0, -4.0, -2.0, -3.0, -2.5, -6.0]
    yield "signed zeros", [-0.0, 0.0, -0.0, 1.0, -0.0, 0.0, -0.0]
    yield "tiny and huge", [0.0, 1e-300, 0.0, 1e300, 1e-300, 5e299, 0.0]
    yield "denormal steps", [0.0, 5e-324, 0.0, 1e-323, 5e-324, 0.0]
    yield "infinite base", [-np.finfo(float).max, 0.0, -np.finfo(float).max]
    for n in (40, 200):
        yield f"waves {n}", waves(n)
        yield f"noise {n}", rng.standard_normal(n)
        yield f"quantised {n}", np.round(3.0 * rng.standard_normal(n)) / 2.0
        yield f"coarse {n}", np.round(rng.standard_normal(n))
        yield f"lateral speed {n}", lateral_speed(n, 5.0, rng)
        yield f"rectified {n}", np.maximum(lateral_speed(n, 5.0, rng), 0.0)


def peak_cases(rng):
    cases = []
    for name, signal in peak_signals(rng):
        signal = np.asarray(signal, dtype=float)
        for min_prominence in (0.0, 0.15, 1.0):
            peaks, _ = find_peaks(signal, prominence=min_prominence)
            prominence, left_bases, right_bases = peak_prominences(signal, peaks)
            case = {
                "name": f"{name}, prominence {min_prominence}",
                "signal": signal.tolist(),
                "min_prominence": min_prominence,
                "peaks": peaks.tolist(),
                "prominences": prominence.tolist(),
                "left_bases": left_bases.tolist(),
                "right_bases": right_bases.tolist(),
                "widths": [],
            }
            # The prominence threshold only selects among the peaks and changes no width.
            for share in (*WIDTH_SHARES, 0.0, 2.0) if min_prominence == 0.0 else ():
                rel_height = 1.0 - share / 2.0
                widths, levels, left, right = peak_widths(signal, peaks, rel_height=rel_height)
                case["widths"].append(
                    {
                        "rel_height": rel_height,
                        "widths": widths.tolist(),
                        "levels": levels.tolist(),
                        "left": left.tolist(),
                        "right": right.tolist(),
                    }
                )
            cases.append(case)
    return cases


def main():
    rng = np.random.default_rng(20260101)
    golden = {"filter": filter_cases(rng), "peaks": peak_cases(rng)}
    lines = [
        json.dumps(kind) + ": [\n" + ",\n".join(json.dumps(case) for case in cases) + "\n]"
        for kind, cases in golden.items()
    ]
    OUT.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main()
