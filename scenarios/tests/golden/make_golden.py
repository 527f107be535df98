"""Makes scipy.csv, the reference values for the filter and the peaks.

Run: pip install scipy==1.16.3 numpy && python scenarios/tests/golden/make_golden.py
Signals are given by formula, so that both sides compute them alike.
"""

import pathlib

import numpy as np
from scipy.signal import butter, filtfilt, find_peaks, peak_prominences, peak_widths

OUT = pathlib.Path(__file__).with_name("scipy.csv")
REL_HEIGHT = 0.75


def signal(n):
    k = np.arange(n)
    return np.sin(0.11 * k) + 0.4 * np.sin(0.57 * k + 1.0) + 0.2 * np.cos(2.3 * k) + 0.01 * k


def main():
    rows = ["# kind,samples,values"]
    b, a = butter(2, 1.3, fs=10.0)
    for n in (2, 5, 9, 10, 11, 40, 120):
        filtered = filtfilt(b, a, signal(n), padlen=min(9, n - 1))
        rows.append(f"filtfilt,{n}," + ",".join(repr(float(v)) for v in filtered))
    for n in (40, 120):
        x = signal(n)
        peaks, _ = find_peaks(x, prominence=0.3)
        prominence = peak_prominences(x, peaks)[0]
        # Heights are counted from zero: the peak's own height stands for its prominence.
        positive = peaks[x[peaks] > 0]
        ends = (x[positive], np.zeros_like(positive), np.full_like(positive, n - 1))
        _, _, left, right = peak_widths(x, positive, rel_height=REL_HEIGHT, prominence_data=ends)
        for name, values in (("peaks", peaks), ("prominences", prominence), ("left", left), ("right", right)):
            rows.append(f"{name},{n}," + ",".join(repr(float(v)) for v in values))
    OUT.write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
