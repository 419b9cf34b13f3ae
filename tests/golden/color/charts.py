"""Colours of a chart's patches by colour-science 0.4, and published colour differences.

    pip install colour-science && python3 charts.py > charts.json

Reflectance spectra: BabelColor's mean of 30 ColorChecker charts (Pascale, "RGB coordinates of the Macbeth
ColorChecker", 2006). Each becomes what a linear Rec. 709 camera sees of it under D65, by the CIE 1931 2 degree
observer at 1 nm, a perfect white being 1, 1, 1. `python3 charts.py rust` prints the tables of src/math/spectrum.rs
and src/scene/charts/table.rs. Differences: Sharma, Wu, Dalal, "The CIEDE2000 color-difference formula", 2005,
Table 1, and colour-science's own figure beside each.
"""
import json
import sys

import colour
import numpy as np

OBSERVER = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
D65 = colour.SDS_ILLUMINANTS["D65"]
SPECTRA = colour.SDS_COLOURCHECKERS["BabelColor Average"]
FIRST, LAST, STEP = 360, 780, 5

rec709 = colour.RGB_COLOURSPACES["ITU-R BT.709"].copy()
rec709.use_derived_transformation_matrices(True)
FROM_XYZ = rec709.matrix_XYZ_to_RGB
ONES = colour.SpectralDistribution(np.ones(LAST - FIRST + 1), np.arange(FIRST, LAST + 1))
WHITE = colour.sd_to_XYZ(ONES, cmfs=OBSERVER, illuminant=D65) / 100


def linear(spectrum):
    xyz = colour.sd_to_XYZ(spectrum, cmfs=OBSERVER, illuminant=D65) / 100
    return (FROM_XYZ @ xyz) / (FROM_XYZ @ WHITE)


def lab(rgb):
    xyz = np.linalg.inv(FROM_XYZ) @ np.array(rgb)
    return colour.XYZ_to_Lab(xyz, colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"])


def weights():
    """Of reflectances every 5 nm, a cubic through the nearest four between: X, Y, Z under D65, Y of white 1."""
    fine = np.arange(FIRST, LAST + 1)
    light = D65.copy().align(colour.SpectralShape(FIRST, LAST, 1)).values
    product = OBSERVER.copy().align(colour.SpectralShape(FIRST, LAST, 1)).values * light[:, None]
    nodes = np.arange(FIRST, LAST + 1, STEP)
    result = np.zeros((len(nodes), 3))
    for at, row in zip(fine, product / product[:, 1].sum()):
        first = int(np.clip((at - FIRST) // STEP - 1, 0, len(nodes) - 4))
        for i in range(first, first + 4):
            others = [k for k in range(first, first + 4) if k != i]
            result[i] += row * np.prod([(at - nodes[k]) / (nodes[i] - nodes[k]) for k in others])
    return result


SHARMA = """
50 2.6772 -79.7751 50 0 -82.7485 2.0425
50 3.1571 -77.2803 50 0 -82.7485 2.8615
50 2.8361 -74.0200 50 0 -82.7485 3.4412
50 -1.3802 -84.2814 50 0 -82.7485 1.0000
50 -1.1848 -84.8006 50 0 -82.7485 1.0000
50 -0.9009 -85.5211 50 0 -82.7485 1.0000
50 0 0 50 -1 2 2.3669
50 -1 2 50 0 0 2.3669
50 2.4900 -0.0010 50 -2.4900 0.0009 7.1792
50 2.4900 -0.0010 50 -2.4900 0.0010 7.1792
50 2.4900 -0.0010 50 -2.4900 0.0011 7.2195
50 2.4900 -0.0010 50 -2.4900 0.0012 7.2195
50 -0.0010 2.4900 50 0.0009 -2.4900 4.8045
50 -0.0010 2.4900 50 0.0010 -2.4900 4.8045
50 -0.0010 2.4900 50 0.0011 -2.4900 4.7461
50 2.5 0 50 0 -2.5 4.3065
50 2.5 0 73 25 -18 27.1492
50 2.5 0 61 -5 29 22.8977
50 2.5 0 56 -27 -3 31.9030
50 2.5 0 58 24 15 19.4535
50 2.5 0 50 3.1736 0.5854 1.0000
50 2.5 0 50 3.2972 0 1.0000
50 2.5 0 50 1.8634 0.5757 1.0000
50 2.5 0 50 3.2592 0.3350 1.0000
60.2574 -34.0099 36.2677 60.4626 -34.1751 39.4387 1.2644
63.0109 -31.0961 -5.8663 62.8187 -29.7946 -4.0864 1.2630
61.2901 3.7196 -5.3901 61.4292 2.2480 -4.9620 1.8731
35.0831 -44.1164 3.7933 35.0232 -40.0716 1.5901 1.8645
22.7233 20.0904 -46.6940 23.0331 14.9730 -42.5619 2.0373
36.4612 47.8580 18.3852 36.2715 50.5065 21.2231 1.4146
90.8027 -2.0831 1.4410 91.1528 -1.6435 0.0447 1.4441
90.9257 -0.5406 -0.9208 88.6381 -0.8985 -0.7239 1.5381
6.7747 -0.2908 -2.4247 5.8714 -0.0985 -2.2286 0.6377
2.0776 0.0795 -1.1350 0.9033 -0.0636 -0.5514 0.9082
"""

if sys.argv[1:] == ["rust"]:
    for row in weights():
        print("    [{:.6e}, {:.6e}, {:.6e}],".format(*row))
    for name, spectrum in SPECTRA.items():
        print("    (\"{}\", [{:.4f}, {:.4f}, {:.4f}]),".format(name, *linear(spectrum)))
    sys.exit()

patches = []
for name, spectrum in SPECTRA.items():
    rgb = linear(spectrum)
    patches.append({"name": name, "reflectance": spectrum.values.tolist(),
                    "rec709": np.round(rgb, 7).tolist(), "lab": np.round(lab(rgb), 6).tolist()})
pairs = []
for line in SHARMA.split("\n"):
    if line:
        numbers = [float(word) for word in line.split()]
        own = float(colour.difference.delta_E_CIE2000(numbers[:3], numbers[3:6]))
        pairs.append({"a": numbers[:3], "b": numbers[3:6], "published": numbers[6], "colour_science": own})
        assert abs(own - numbers[6]) < 1e-4, (numbers, own)
print(json.dumps({"made_by": f"colour-science {colour.__version__}",
                  "wavelengths": SPECTRA["dark skin"].wavelengths.tolist(),
                  "patches": patches, "differences": pairs}, indent=1))
