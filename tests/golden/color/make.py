"""Matrices from linear RGB of other primaries to linear Rec. 709, by colour-science 0.4 (Bradford adaptation).

    pip install colour-science && python3 make.py > matrices.json
"""
import json

import colour

# sRGB's published matrix is rounded to four decimals; here all come from the chromaticities.
spaces = {}
target = colour.RGB_COLOURSPACES["ITU-R BT.709"].copy()
target.use_derived_transformation_matrices(True)
for name in ["ACEScg", "ACES2065-1", "Display P3", "Adobe RGB (1998)", "ITU-R BT.2020", "ITU-R BT.709"]:
    space = colour.RGB_COLOURSPACES[name].copy()
    space.use_derived_transformation_matrices(True)
    matrix = colour.matrix_RGB_to_RGB(space, target, "Bradford")
    spaces[name] = {
        "primaries": space.primaries.tolist(),
        "white": list(map(float, space.whitepoint)),
        "rec709_from": matrix.tolist(),
    }
print(json.dumps({"made_by": f"colour-science {colour.__version__}", "spaces": spaces}, indent=1))
