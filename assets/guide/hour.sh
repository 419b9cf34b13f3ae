#!/usr/bin/env bash
# Works through the studio as an artist does in an hour, with a mouse and keys that nobody holds: opens
# the example, tags, runs, inspects, relights with three lights and an object, sets them into a
# photograph, renders, saves, opens again and exports to Blender. Every step is a picture, and what
# was written is checked at the end.
#
#   assets/guide/hour.sh [dark|light] [FOLDER]
#   assets/guide/hour.sh all [FOLDER]
#
# WALK_SCREEN=1600x900 and WALK_SCALE=2 give another screen and size of text; `all` goes through both
# themes at 1280x720 and 1600x900, at 100 % and 200 %. HOUR_SAMPLES=150 opens a project of the example with
# so many samples, whose run takes seconds. Needs what walk.sh needs.
if [ "${1:-}" = all ]; then
    failed=0
    for screen in 1280x720 1600x900; do
        for scale in 1 2; do
            for theme in dark light; do
                name=$screen-${scale}00-$theme
                echo "== $name"
                WALK_SCREEN=$screen WALK_SCALE=$scale bash "$0" $theme "${2:-out/hour}/$name" || failed=1
            done
        done
    done
    exit $failed
fi
walk=hour
. "$(dirname "$0")/window.sh"

width=${WALK_SCREEN%x*} height=${WALK_SCREEN#*x} scale=$WALK_SCALE
text() { xdotool type --delay 15 -- "$1"; }
press() { xdotool key --delay 20 "$@"; }
# As many fields back, with Shift held from before the first to after the last.
back() { settle; xdotool keydown shift; settle; for _ in $(seq "$1"); do press Tab; settle; done; xdotool keyup shift; settle; }
# Places in pixels of 100 %, from the left of the window or of the 3D view. What is to be clicked stands still.
click() { settle; xdotool mousemove "$1" "$2"; settle; xdotool click 1; settle; }
click_left() { click $((scale * $1)) $((scale * $2)); }
click_view() { click $((185 * width / 1000 + scale * $1)) $((scale * $2)); }
over_view() { xdotool mousemove $((46 * width / 100)) $((height / 2)); settle; }
aside() { xdotool mousemove $((width / 2)) $((height - 4)); settle; }
# What a command is called in the palette finds it: the same at every size. The window takes keys in their
# order, however many come during a frame.
command_() { press ctrl+p; text "$1"; press Return; settle; }
# The lower left corner, where the window says what it does; "Ready" at rest.
state() { import -window root -crop "$((45 * scale))x$((20 * scale))+0+$((height - 23 * scale))" +repage "$1"; }
is_ready() { state "$work/now.png"; differ_by "$work/ready.png" "$work/now.png" 0; }
wait_ready() {
    aside
    for _ in $(seq "${1:-900}"); do is_ready && return; sleep 0.5; done
    fail "the window did not come to rest"
}
# Waits for a file, which is there whole or not at all.
wait_file() {
    for _ in $(seq "${2:-900}"); do [ -s "$1" ] && return; sleep 0.5; done
    fail "$1 was not written"
}
# A path into the field that has the focus.
path() { press ctrl+a; text "$1"; settle; }
leave() {
    press ctrl+q
    for _ in $(seq 240); do kill -0 "$window" 2>/dev/null || break; sleep 0.25; done
    kill -0 "$window" 2>/dev/null && fail "the window has not closed"
    wait "$window" || fail "the window ended badly: $(cat "$work/window.log")"
    window=
}

cat >"$work/block.obj" <<'OBJ'
mtllib block.mtl
v -0.3 -0.3 0
v 0.3 -0.3 0
v 0.3 0.3 0
v -0.3 0.3 0
v 0 0 0.7
usemtl block
f 4 3 2 1
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
OBJ
printf 'newmtl block\nKd 0.7 0.1 0.1\n' >"$work/block.mtl"

start
aside
state "$work/ready.png"
picture 01-start
if [ -n "${HOUR_SAMPLES:-}" ]; then
    leave
    cat >"$work/example.lobelia" <<JSON
{"version": 3, "capture": "$PWD/assets/examples/corner",
 "materials": [$(for own in floor wall1 wall2 box1 box2; do
    printf '{"name": "%s", "specular": false, "surfaces": ["%s"]}, ' $own $own; done)
    {"name": "box3", "specular": false, "surfaces": ["box3"]}],
 "options": {"samples": {"count": "$HOUR_SAMPLES", "min_per_material": "10"}, "joint": {"light_sets": "1"}}}
JSON
    start "$work/example.lobelia"
else
    command_ "open example"
fi
settle
wait_ready
picture 02-open
press F2
click_left 48 277    # the floor in the outliner
press n              # a material of its own
picture 03-tag
press F3
picture 04-reconstruct
press ctrl+r
settle 3
still 05-running
wait_ready 3600
picture 06-done
press F4
command_ "show error per sample"
command_ "select worst sample"
picture 07-worst-sample
command_ "select strongest light"
picture 08-strongest-light
command_ "show compare"
picture 09-compare

press F5
settle
# The exposure, since three lights more are brighter; in a narrow view it stands in the second row.
if [ $((545 * width / 1000 / scale)) -lt 430 ]; then click_view 40 98; else click_view 254 73; fi
press ctrl+a
text "-2"
press Return
command_ "add area light"
command_ "add sphere light"
command_ "add spot light"
picture 10-three-lights
# The selected one lower, by keys over the 3D view.
over_view
press g z
text "-.3"
press Return
picture 11-moved
command_ "add object"
path "$work/block.obj"
press Return
settle
picture 12-object
# Through a photograph what was added is set into it.
over_view
press 0 Tab
picture 13-composite
over_view
press 0

press F12
settle
still 14-render
path "$work/pictures"
back 5   # up to the paths a pixel
text "8"
press Tab Tab Tab Tab Tab
settle
still 15-render-chosen
press Return
wait_file "$work/pictures/005-composite.exr" 3600
wait_ready
picture 16-rendered
command_ "save as"
path "$work/hour.lobelia"
press Return
wait_file "$work/hour.lobelia"
picture 17-saved
leave

start "$work/hour.lobelia"
wait_ready
press F5
picture 18-reopened
press ctrl+shift+e
settle
still 19-export
path "$work/scene"
back 5   # up to Blender
press space
press Tab Tab Tab Tab Tab Tab Tab Tab                         # and past its light probe to the folder
settle
still 20-blender
press Return
wait_file "$work/scene/blender/open_in_blender.py" 3600
wait_ready 3600
picture 21-exported
leave

python3 - "$work" <<'PY' || fail "what was written is not what was done"
import json, os, sys
work = sys.argv[1]
project = json.load(open(f"{work}/hour.lobelia"))
edits = project["relight"]
tagged = [own for own in project["materials"] if own["name"].startswith("material")]
checks = {
    "the floor has a material of its own": [own["surfaces"] for own in tagged] == [["floor"]],
    "three lights": len(edits["lights"]) == 3,
    "the spot was moved": any(abs(light.get("position", [0, 0, 0])[2] - 1.95) < 0.02
                              for light in edits["lights"]),
    "the exposure of the view": project["view"]["exposure_ev"] == -2,
    "an object": len(edits["objects"]) == 1,
    "results beside the project": bool(os.listdir(f"{work}/hour.lobelia-data")),
    "six pictures and six composites": len([name for name in os.listdir(f"{work}/pictures")
                                            if name.endswith(".png")]) == 12,
    "glTF for Blender": any(name.endswith((".glb", ".gltf"))
                            for name in os.listdir(f"{work}/scene/blender")),
}
for what, holds in checks.items():
    print(f"{'yes' if holds else 'NO '}  {what}")
sys.exit(not all(checks.values()))
PY
echo "The hour went well; the pictures are in $out"
