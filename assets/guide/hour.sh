#!/usr/bin/env bash
# Works through the studio as an artist does in an hour, by mouse and keys that nobody holds: open,
# tag, run, inspect, relight with three lights and an object, set them into a photograph, render, save,
# open again, export to Blender. Every step is a picture, and what was written is looked into.
#
#   assets/guide/hour.sh [dark|light] [FOLDER]
#
# WALK_SCREEN=1600x900 and WALK_SCALE=2 give another screen and size of text. Needs what walk.sh needs.
walk=hour
. "$(dirname "$0")/window.sh"

width=${WALK_SCREEN%x*} height=${WALK_SCREEN#*x}
text() { xdotool type --delay 15 -- "$1"; sleep 0.5; }
aside() { xdotool mousemove $((width / 2)) $((height - 4)); sleep 0.3; }
# What a command is called in the palette finds it: the same at every size.
command_() { keys ctrl+p; text "$1"; keys Return; sleep 0.7; }
# Waits until a picture of the whole window is the same twice.
rest() {
    aside
    import -window root "$work/before.png"
    for _ in $(seq "${1:-120}"); do
        sleep 1
        import -window root "$work/after.png"
        [ "$(compare -metric AE "$work/before.png" "$work/after.png" null: 2>&1)" = 0 ] && return
        mv "$work/after.png" "$work/before.png"
    done
}
picture() { rest 20; still "$1"; }
# Waits for a file, which is there whole or not at all.
wait_file() {
    for _ in $(seq "${2:-240}"); do [ -s "$1" ] && return; sleep 0.5; done
    fail "$1 was not written"
}
# A path into the dialog that asks for it.
path() { sleep 1; keys ctrl+a; text "$1"; keys Return; }

cat >"$work/block.obj" <<'OBJ'
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

start
picture 01-start
command_ "open example"
picture 02-open
keys F2
command_ "select all surfaces"
picture 03-tag
keys F3
still 04-reconstruct
keys ctrl+r
sleep 2
still 05-running
rest
picture 06-done
keys F4
command_ "show error per sample"
command_ "select worst sample"
picture 07-worst-sample
command_ "select strongest light"
picture 08-strongest-light

keys F5
sleep 2
command_ "add area light"
command_ "add sphere light"
command_ "add spot light"
picture 09-three-lights
# The selected one half a metre up, by keys over the 3D view.
xdotool mousemove $((45 * width / 100)) $((40 * height / 100))
sleep 0.3
keys g z
text "-.3"
keys Return
picture 10-moved
command_ "add object"
path "$work/block.obj"
picture 11-object
# Through the first photograph: what was added is set into it.
xdotool mousemove $((45 * width / 100)) $((40 * height / 100))
sleep 0.3
keys 0 Tab
sleep 6
still 12-composite
keys 0

keys F12
sleep 1
still 13-render
keys ctrl+a
text "$work/pictures"
keys Return
wait_file "$work/pictures/005-composite.exr" 1200
picture 14-rendered
keys ctrl+s
path "$work/hour.lobelia"
wait_file "$work/hour.lobelia"
picture 15-saved
keys ctrl+q
for _ in $(seq 60); do kill -0 "$window" 2>/dev/null || break; sleep 0.25; done
kill -0 "$window" 2>/dev/null && fail "the window has not closed"

start "$work/hour.lobelia"
rest
keys F5
picture 16-reopened
keys ctrl+shift+e
sleep 1
still 17-export
# Blender, by the keys of any form: Tab goes on, Space switches.
keys Tab Tab space
picture 18-blender
keys Tab Tab Tab Tab Tab Tab Tab Tab ctrl+a
text "$work/scene"
keys Tab Tab space
wait_file "$work/scene/blender/open_in_blender.py" 600
picture 19-exported
keys ctrl+q
for _ in $(seq 60); do kill -0 "$window" 2>/dev/null || break; sleep 0.25; done
wait "$window" || true
window=

python3 - "$work/hour.lobelia" <<'PY' || fail "the saved project is not what was done"
import json, sys
edits = json.load(open(sys.argv[1]))["relight"]
lights, objects = edits["lights"], edits["objects"]
sys.exit(not (len(lights) == 3 and len(objects) == 1 and "solution" in json.dumps(edits) + open(sys.argv[1]).read()))
PY
echo "The hour went well; the pictures are in $out"
