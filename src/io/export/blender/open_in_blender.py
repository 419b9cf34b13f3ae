"""Opens this export in Blender 4 or later, with its light and cameras.

    blender --python open_in_blender.py
    blender --background --python open_in_blender.py -- --render picture.png

or, with Blender as a Python module (pip install bpy),

    python3 open_in_blender.py --render picture.png --save scene.blend

The surfaces, lamps, suns and added lights come from scene.glb. What is broad of the recovered
light (the sky, the background of a room) becomes the world, from world.exr: its place in scene.glb
is taken by stand-ins for programs that know points and cones alone, which are removed here.
"""
import argparse
import json
import math
import os
import sys

import bpy

own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
if "--" not in sys.argv and "--python" in sys.argv:
    own = []
parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--render", help="write a picture from the first camera")
parser.add_argument("--camera", type=int, default=0, help="from this one")
parser.add_argument("--samples", type=int, default=64)
parser.add_argument("--percent", type=int, default=100, help="size of the picture")
parser.add_argument("--save", help="write a .blend file")
arguments = parser.parse_args(own)

here = os.path.dirname(os.path.abspath(__file__))
bpy.ops.wm.read_factory_settings(use_empty=True)
# Numbers as they stand: a unit of the photographs' radiance is a unit of Blender's.
bpy.ops.import_scene.gltf(
    filepath=os.path.join(here, "scene.glb"), export_import_convert_lighting_mode="COMPAT"
)
for thing in [t for t in bpy.data.objects if t.type == "LIGHT"]:
    above = thing
    while above is not None and above.name != "background stand-ins":
        above = above.parent
    if above is not None:
        bpy.data.objects.remove(thing)

scene = bpy.context.scene
world = bpy.data.worlds.new("recovered background")
scene.world = world
if world.node_tree is None:
    world.use_nodes = True
nodes, links = world.node_tree.nodes, world.node_tree.links
nodes.clear()
output = nodes.new("ShaderNodeOutputWorld")
background = nodes.new("ShaderNodeBackground")
image = nodes.new("ShaderNodeTexEnvironment")
turn = nodes.new("ShaderNodeMapping")
place = nodes.new("ShaderNodeTexCoord")
image.image = bpy.data.images.load(os.path.join(here, "world.exr"))
image.image.colorspace_settings.name = "Non-Color"
# Blender's middle of such a picture looks along +x, ours along -y.
turn.inputs["Rotation"].default_value = (0.0, 0.0, math.radians(90.0))
links.new(place.outputs["Generated"], turn.inputs["Vector"])
links.new(turn.outputs["Vector"], image.inputs["Vector"])
links.new(image.outputs["Color"], background.inputs["Color"])
links.new(background.outputs["Background"], output.inputs["Surface"])

with open(os.path.join(here, "cameras.json"), encoding="utf-8") as file:
    cameras = json.load(file)["cameras"]
for given in cameras:
    camera = bpy.data.objects[given["name"]].data
    width, height = given["width"], given["height"]
    camera.sensor_fit = "HORIZONTAL"
    camera.lens = given["fl_x"] / width * camera.sensor_width
    # In parts of the width; what glTF has no place for.
    camera.shift_x = (width / 2 - given["cx"]) / width
    camera.shift_y = (given["cy"] - height / 2) / width * given["fl_x"] / given["fl_y"]
chosen = cameras[arguments.camera]
scene.camera = bpy.data.objects[chosen["name"]]
render = scene.render
render.engine = "CYCLES"
render.resolution_x, render.resolution_y = chosen["width"], chosen["height"]
render.resolution_percentage = arguments.percent
render.pixel_aspect_x, render.pixel_aspect_y = 1.0, max(chosen["fl_x"] / chosen["fl_y"], 1.0)
if chosen["fl_y"] > chosen["fl_x"]:
    render.pixel_aspect_x = chosen["fl_y"] / chosen["fl_x"]
scene.cycles.samples = arguments.samples
scene.cycles.use_denoising = False
# The camera sees nothing where nothing was modelled.
render.film_transparent = True
scene.view_settings.view_transform = "Standard"
scene.view_settings.exposure = math.log2(1.0 / max(chosen["white"], 1e-6))
if arguments.save:
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(arguments.save))
if arguments.render:
    render.filepath = os.path.abspath(arguments.render)
    if arguments.render.endswith(".exr"):
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_depth = "32"
    bpy.ops.render.render(write_still=True)
