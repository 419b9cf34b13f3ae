"""Renders every camera of this export with Mitsuba 3 (pip install mitsuba).

    python3 render.py --spp 64 --out pictures

recovered.xml has the recovered light, added.xml, where lights were added, those: the room that
nobody modelled returns added light alone, so a picture is the sum of both.
"""
import argparse
import os
import sys

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--spp", type=int, default=64, help="paths per pixel")
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--out", default="pictures", help="folder for the pictures")
parser.add_argument("--variant", default="llvm_ad_rgb", help="any JIT variant with RGB")
parser.add_argument("--camera", type=int, action="append", help="only this one; may be repeated")
arguments = parser.parse_args()

try:
    import mitsuba as mi
except ImportError:
    sys.exit("Mitsuba 3 is missing: pip install mitsuba")
mi.set_variant(arguments.variant)

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, here)
import lobelia_mitsuba  # noqa: E402, F401: it registers the plugins

names = ["recovered.xml", "added.xml"]
scenes = [
    mi.load_file(os.path.join(here, name))
    for name in names
    if os.path.exists(os.path.join(here, name))
]
os.makedirs(arguments.out, exist_ok=True)
count = len(scenes[0].sensors())
for index in arguments.camera if arguments.camera is not None else range(count):
    picture = 0.0
    for number, scene in enumerate(scenes):
        seed = (arguments.seed * len(scenes) + number) * count + index
        picture = picture + mi.render(scene, sensor=index, spp=arguments.spp, seed=seed)
    name = scenes[0].sensors()[index].id().removeprefix("camera ")
    file = os.path.join(arguments.out, name + ".exr")
    mi.Bitmap(picture).write(file)
    print(file, flush=True)
