#!/usr/bin/env bash
# Makes the pictures of the Model page for the guide: the photographs of the shipped example without
# its cameras and mesh, with the strokes of tests/golden/model/corner-diffuse.json, which are of the
# same room at twice the size.
#
#   assets/guide/model.sh [dark|light] [FOLDER]
#
# Needs Xvfb, xdotool, ImageMagick and Python beside what the window needs, and
# `cargo build --release` before (or LOBELIA=PROGRAM). Nothing of the user's settings is read or
# written.
walk=model
. "$(dirname "$0")/window.sh"
# Photographs are read and strokes solved.
settle() { sleep "${MODEL_WAIT:-8}"; }

"$program" new "$work/room" --images assets/examples/corner/images/*.exr >/dev/null
python3 - tests/golden/model/corner-diffuse.json "$work/room/model.json" <<'PY'
import json, sys
model = json.load(open(sys.argv[1]))
for own in model["photographs"]:
    own["w"], own["h"] = own["w"] // 2, own["h"] // 2
for stroke in model["strokes"]:
    for key in ("from", "to", "pixel"):
        if key in stroke:
            stroke[key] = [value / 2 for value in stroke[key]]
json.dump(model, open(sys.argv[2], "w"))
PY

start "$work/room"
settle
still model-fit
xdotool mousemove 90 443   # the third thing of the list
sleep 0.5
xdotool click 1
sleep 3
xdotool mousemove 560 330
sleep 1
still model-thing
keys ctrl+n
sleep 3
still model-new
keys Escape
sleep 1
xdotool mousemove 640 716
keys ctrl+m
settle
still model-used
[ -s "$work/room/scene.obj" ] || fail "no mesh was written"
keys ctrl+q
echo "The pictures are in $out"
