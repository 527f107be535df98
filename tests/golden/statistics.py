"""Golden values of the statistics, from SciPy: python3 tests/golden/statistics.py > tests/golden/statistics.csv

Each line: quantity, hits, samples, parameter (confidence, or p of the tail), value.
"""
import scipy
from scipy.optimize import brentq
from scipy.special import betainc, betaln, xlog1py, xlogy
from scipy.stats import beta, binom, binomtest
import numpy as np

CASES = [(0, 1), (1, 1), (0, 20), (1, 20), (19, 20), (20, 20), (0, 300), (3, 300), (10, 100), (50, 100), (97, 100),
         (5, 2000), (777, 2000), (1999, 2000), (0, 100000), (12, 100000), (25000, 100000), (250, 1000000),
         (250000, 1000000)]
CONFIDENCES = [0.8, 0.9, 0.95, 0.99, 0.999]


def upper(k, n, c):
    return 1.0 if k == n else float(beta.ppf(c, k + 1, n - k))


def lower(k, n, c):
    return 0.0 if k == 0 else float(beta.ppf(1 - c, k, n - k + 1))


def log_evidence_below(k, n, p):
    """ln of the uniform mixture over (0, p) against p, by the incomplete beta function."""
    return (betaln(k + 1, n - k + 1) + np.log(betainc(k + 1, n - k + 1, p))
            - xlogy(k + 1, p) - xlog1py(n - k, -p))


def sequence_upper(k, n, c):
    distance = lambda p: log_evidence_below(k, n, p) + np.log1p(-c)
    start = max(k / n, 1e-12)
    if distance(1 - 1e-13) < 0:
        return None
    return float(brentq(distance, start, 1 - 1e-13, xtol=1e-15, rtol=1e-13))


print(f"# SciPy {scipy.__version__}")
print("quantity,hits,samples,parameter,value")
for k, n in CASES:
    for c in CONFIDENCES:
        print(f"upper,{k},{n},{c},{upper(k, n, c)!r}")
        print(f"lower,{k},{n},{c},{lower(k, n, c)!r}")
        if n > 1 and k < n:
            value = sequence_upper(k, n, c)
            if value is not None:
                print(f"sequence-upper,{k},{n},{c},{value!r}")
    for p in [0.001, 0.02, 0.25, 0.6, 0.99]:
        for quantity, value in [("at-most", binom.cdf(k, n, p)), ("probability", binom.pmf(k, n, p))]:
            if value > 1e-250:
                print(f"{quantity},{k},{n},{p},{float(value)!r}")
for b, c in [(0, 0), (1, 0), (5, 0), (44, 0), (3, 4), (12, 30), (300, 250), (2, 900)]:
    p = 1.0 if b + c == 0 else float(binomtest(b, b + c, 0.5).pvalue)
    print(f"mcnemar,{b},{c},0.5,{p!r}")
