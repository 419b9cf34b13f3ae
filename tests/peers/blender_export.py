"""Whether the package for Blender opens there and renders about the capture's first photograph.

    python3 blender_export.py FOLDER/blender CAPTURE/images/000.exr

with Blender as a module (pip install bpy).
Lamps are isotropic there and the background is infinitely far away, so this asks only that every
channel is as bright within a third where we see surfaces, and that the two pictures correlate by 0.8
over blocks of 16 by 16 pixels: a world, lamp or camera that is turned or scaled wrongly fails.
"""
import os
import subprocess
import sys
import tempfile

try:
    import bpy
except ImportError:
    print("skipped: no bpy here")
    sys.exit(0)
import numpy as np

package, ours = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    theirs = os.path.join(folder, "picture.exr")
    subprocess.run([sys.executable, os.path.join(package, "open_in_blender.py"), "--render", theirs,
                    "--samples", "8"], check=True, stdout=subprocess.DEVNULL)
    pictures = []
    for file in (theirs, ours):
        image = bpy.data.images.load(os.path.abspath(file))
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        pixels = np.array(image.pixels[:]).reshape(height, width, 4)
        rows, columns = height // 16 * 16, width // 16 * 16
        blocks = pixels[:rows, :columns].reshape(rows // 16, 16, columns // 16, 16, 4)
        pictures.append(blocks.mean(axis=(1, 3)).reshape(-1, 4))
theirs, ours = pictures
covered = theirs[:, 3] > 0.999
passed = covered.any()
for c, name in enumerate("RGB"):
    a, b = theirs[covered, c], ours[covered, c]
    ratio, together = a.mean() / b.mean(), np.corrcoef(a, b)[0, 1]
    print(f"{name}: Blender's is {ratio:.3f} of the photograph's, correlation {together:.3f}")
    passed = passed and 2 / 3 < ratio < 4 / 3 and together > 0.8
print("passed" if passed else "FAILED")
sys.exit(0 if passed else 1)
