#!/usr/bin/env bash
# From real photographs to a relit picture, with a mouse and keys that nobody holds: twenty photographs of
# a table, no cameras and no mesh. Cameras are found, the table is a plane from points, a poster is a
# polygon, a carton a box; all are tagged, reconstructed, and lit by a lamp that was not there. Counts what
# the hand does and the seconds, prints both, and keeps a picture of every step.
#
#   assets/guide/table.sh PHOTOGRAPHS [dark|light] [FOLDER]
#
# PHOTOGRAPHS is the folder images/robot of tabletop_robot (sangminkim-99/COLMAP_multicam on GitHub),
# 640x480, without a licence and therefore not in this repository. Needs what walk.sh needs, and openmvg-rs
# as a package of a python3 on the search path. Places in the window are those of a fresh start at
# 1280x720, so that WALK_SCREEN and WALK_SCALE must not be given.
photographs=$(cd "${1:?the folder of the photographs}" && pwd)
shift
walk=table
. "$(dirname "$0")/window.sh"

hands=0 began=$SECONDS
# Movements of the hand: clicks, drags, keys (combinations count once), texts.
text() { hands=$((hands + 1)); xdotool type --delay 15 "$1"; sleep 0.5; }
press() { hands=$((hands + $#)); for key in "$@"; do keys "$key"; done; }
click() {
    hands=$((hands + 1))
    xdotool mousemove "$1" "$2" mousemove "$(($1 + 2))" "$2"
    sleep 0.4; xdotool mousedown 1; sleep 0.2; xdotool mouseup 1; sleep 0.8
}
# A drag through places.
drag() {
    local x=$1 y=$2 part
    hands=$((hands + 1))
    xdotool mousemove "$x" "$y"; sleep 0.4; xdotool mousedown 1; sleep 0.2
    shift 2
    while [ $# -gt 1 ]; do
        for part in 1 2 3 4; do
            xdotool mousemove $((x + ($1 - x) * part / 4)) $((y + ($2 - y) * part / 4)); sleep 0.05
        done
        x=$1 y=$2
        shift 2
    done
    sleep 0.3; xdotool mouseup 1; sleep 1
}
command_() { press ctrl+p; text "$1"; press Return; }
step() { still "$1"; echo "  after $((SECONDS - began)) s, $hands movements of the hand"; }
# Waits until a command succeeds: "the model" 60 test -f FILE.
wait_until() {
    local what=$1 most=$2 _
    shift 2
    for _ in $(seq $((2 * most))); do "$@" && return; sleep 0.5; done
    fail "$what did not come"
}
# The lower left corner, where the window says what it does; "Ready" at rest.
state() { import -window root -crop 44x22+0+697 +repage "$1"; }
is_ready() {
    state "$work/now.png"
    [ "$(compare -metric AE "$work/ready.png" "$work/now.png" null: 2>&1)" = 0 ]
}
wait_ready() { xdotool mousemove 640 716; wait_until "rest" "$1" is_ready; }
saved() { press ctrl+s; sleep 1; python3 - "$work/table/model.json" "$1" <<'PY'
import json, sys
model = json.load(open(sys.argv[1]))
things = [thing["id"] for thing in model.get("things", [])]
picks = [stroke for stroke in model.get("strokes", []) if stroke["kind"] == "pick"]
sys.exit(f"{things}, {len(picks)} picks: {sys.argv[2]} is not so" if not eval(sys.argv[2]) else 0)
PY
}

start
xdotool mousemove 640 716; sleep 1
state "$work/ready.png"
press ctrl+n; sleep 2
click 425 350; sleep 2
text "$photographs"
press Return; sleep 2
click 597 505
press ctrl+a
text "$work/table"
press Tab
click 386 537
wait_until "the capture" 60 test -f "$work/table/transforms.json"
sleep 6
click 60 62   # Find cameras…
sleep 2
click 1119 270
wait_until "the cameras" 120 test -f "$work/table/model.unsaved.json"
sleep 3
step table-1-cameras

click 1238 43
# All posters at once are about the plane of the table, which is the floor.
press l
drag 250 300 290 95 560 130 545 270 690 270 700 220 895 220 895 500 920 500 830 585 400 585 420 330
sleep 4
click 1145 366
click 1074 397
sleep 2
# A poster that lies on it: its corners in one photograph, each where two lines cross.
press g
click 1145 366
click 1074 397
click 695 500; click 885 500; click 885 228; click 703 228
sleep 3
# Its long side is that of a sheet of A4.
press k
drag 697 500 705 228
press ctrl+a
text 0.297
press Return
sleep 3
saved 'things == ["polygon1", "polygon2"] and len(picks) > 12' || fail "the posters were not drawn"
step table-2-planes

# A carton, by seven corners in each of two photographs; its back bottom corner is hidden.
press Next; sleep 2
press b
click 496 169; click 640 211; click 652 187; press space
click 493 116; click 651 148; click 664 125; click 507 78
press Next Next; sleep 3
click 602 162; click 719 250; click 747 230; press space
click 605 111; click 730 207; click 772 174; click 636 83
press v
sleep 3
saved 'len(picks) > 26 and things[-1] == "box1"' || fail "the carton was not drawn"
step table-3-box

press ctrl+m
wait_until "the mesh" 60 test -s "$work/table/scene.obj"
sleep 5
press F3
click 1019 203   # Take for radiance (sRGB)
wait_ready 60
press F2
for row in 217 242; do   # the table and the poster in the list of materials
    click 1021 "$row"
    click 945 334   # Textured
done
step table-4-tags
press F3 ctrl+r
sleep 5
wait_ready "${TABLE_RUNNING:-900}"
step table-5-run
press F5
command_ "add area light"
sleep "${TABLE_RELIT:-20}"
step table-6-relit
press ctrl+q
echo "$((SECONDS - began)) s, $hands movements of the hand; the pictures are in $out"
