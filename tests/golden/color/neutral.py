"""Values of Khronos PBR Neutral in exact fractions, each put back by the inverse, which is derived here on its own.

    python3 neutral.py > neutral.json
"""
import json
from fractions import Fraction as F
from math import sqrt

F90, KD = F(4, 100), F(15, 100)
KS = F(8, 10) - F90


def forward(c):
    """github.com/KhronosGroup/ToneMapping, PBR_Neutral/README.md, 'PBR Neutral Specification'."""
    x = min(c)
    f = x - x * x / (4 * F90) if x <= 2 * F90 else F90
    p = max(v - f for v in c)
    if p <= KS:
        return [v - f for v in c]
    pn = 1 - (1 - KS) ** 2 / (p + 1 - 2 * KS)
    g = 1 / (KD * (p - pn) + 1)
    return [(v - f) * pn / p * g + pn * (1 - g) for v in c]


def inverse(c):
    """From the peak of what came out the one that went in, then the mix with white, then the shine."""
    pn = max(c)
    base = list(c)
    if pn > KS:
        p = (1 - KS) ** 2 / (1 - pn) - 1 + 2 * KS
        g = 1 / (KD * (p - pn) + 1)
        base = [((v - pn) / g + pn) * p / pn for v in base]
    x = min(base)
    # x - f is x^2 / (4 F90) below 2 F90 and x - F90 above.
    shine = sqrt(4 * F90 * x) - float(x) if x <= F90 else F90
    return [float(v + shine) if x > F90 else float(v) + shine for v in base]


steps = [F(0), F(1, 50), F(7, 100), F(8, 100), F(18, 100), F(1, 2), F(76, 100), F(8, 10), F(1), F(2), F(8), F(40)]
colours = [[r, g, b] for i, r in enumerate(steps) for g in steps[i::3] for b in steps[::4]]
values = []
for c in colours:
    out = forward(c)
    assert all(0 <= v <= 1 for v in out), (c, out)
    back = inverse(out)
    assert all(abs(a - b) <= 1e-12 * (1 + b) for a, b in zip(back, map(float, c))), (c, out, back)
    values.append({"in": list(map(float, c)), "out": list(map(float, out))})
print('{"values": [\n' + ",\n".join(json.dumps(v) for v in values) + "\n]}")
