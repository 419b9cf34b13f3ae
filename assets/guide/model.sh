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
set -euo pipefail
cd "$(dirname "$0")/../.."

theme=${1:-dark}
out=$(mkdir -p "${2:-out/model-$theme}" && cd "${2:-out/model-$theme}" && pwd)
program=${LOBELIA:-$PWD/target/release/lobelia}
for tool in Xvfb xdotool import python3 "$program"; do
    command -v "$tool" >/dev/null || { echo "model.sh: $tool is missing" >&2; exit 1; }
done

work=$(mktemp -d)
export XDG_CONFIG_HOME=$work/config XDG_RUNTIME_DIR=$work/run DISPLAY=:${WALK_DISPLAY:-88}
mkdir -p "$XDG_CONFIG_HOME/lobelia" "$XDG_RUNTIME_DIR"
chmod 700 "$XDG_RUNTIME_DIR"
echo "{\"theme\": \"$theme\"}" >"$XDG_CONFIG_HOME/lobelia/studio.json"
Xvfb "$DISPLAY" -screen 0 1280x720x24 >/dev/null 2>&1 &
server=$!
window=
trap 'kill $window $server 2>/dev/null || true; rm -rf "$work"' EXIT

keys() { xdotool key --delay 60 "$@"; sleep 0.7; }
picture() { import -window root -colors 256 "PNG8:$out/$1.png"; echo "$1"; }
start() {
    for _ in $(seq 40); do xdotool getdisplaygeometry >/dev/null 2>&1 && break; sleep 0.25; done
    "$program" "$@" >"$work/window.log" 2>&1 &
    window=$!
    for _ in $(seq 60); do
        xdotool search --name Lobelia windowfocus >/dev/null 2>&1 && break
        kill -0 "$window" 2>/dev/null || { cat "$work/window.log" >&2; exit 1; }
        sleep 0.5
    done
    sleep "${MODEL_WAIT:-8}"
}

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
picture model-fit
xdotool mousemove 90 391   # the third thing of the list
sleep 0.5
xdotool click 1
sleep 3
xdotool mousemove 560 330
sleep 1
picture model-thing
keys ctrl+n
sleep 3
picture model-new
keys Escape
sleep 1
xdotool mousemove 640 716
keys ctrl+m
sleep "${MODEL_WAIT:-8}"
picture model-used
[ -s "$work/room/scene.obj" ] || { echo "model.sh: no mesh was written" >&2; exit 1; }
keys ctrl+q
echo "The pictures are in $out"
