#!/usr/bin/env bash
# Walks through the studio as a new user would, with a mouse and keys that nobody holds, and keeps a
# picture of every step: the pictures of the guide and of the README.
#
#   assets/guide/walk.sh [dark|light] [FOLDER]
#
# Needs Xvfb, xdotool and ImageMagick (apt-get install xvfb xdotool imagemagick) beside what the
# window needs, and `cargo build --release` before (or LOBELIA=PROGRAM). Nothing of the user's
# settings is read or written. Panels stand where a fresh start at 1280x720 puts them: where a click
# has missed, the last lines say so, since the saved project is looked into.
walk=walk
. "$(dirname "$0")/window.sh"

text() { xdotool type --delay 15 "$1"; sleep 0.5; }
# The pointer moves before it presses, as a hand does.
click() { xdotool mousemove "$1" "$2" mousemove "$(($1 + 2))" "$2"; sleep 0.3; xdotool click 1; sleep 0.8; }
aside() { xdotool mousemove 640 716; sleep 0.3; }
# What a command is called in the palette finds it.
command_() { keys ctrl+p; text "$1"; keys Return; sleep 0.5; }

# The lower left corner, where the window says what it does; "Ready" at rest.
state() { import -window root -crop 90x22+0+697 +repage "$1"; }
is_ready() {
    state "$work/now.png"
    [ "$(compare -metric AE "$work/ready.png" "$work/now.png" null: 2>&1)" = 0 ]
}
wait_ready() {
    for _ in $(seq "${1:-240}"); do is_ready && return; sleep 0.5; done
    fail "the window did not come to rest"
}
# A picture once nothing moves any more: notices have gone, photographs are there.
picture() {
    aside
    import -window root "$work/before.png"
    for _ in $(seq 20); do
        sleep 1
        import -window root "$work/after.png"
        [ "$(compare -metric AE "$work/before.png" "$work/after.png" null: 2>&1)" = 0 ] && break
        mv "$work/after.png" "$work/before.png"
    done
    still "$1"
}

start
aside
state "$work/ready.png"
picture 01-start
command_ "open example"
sleep 1
wait_ready
picture 02-open

keys F2
click 1041 97   # the floor in the list of materials
click 1051 281  # Specular
picture 03-tag

keys F3 ctrl+r
sleep "${WALK_RUNNING:-6}"
still 04-running
wait_ready
picture 05-converged

keys F4
command_ "show error per sample"
command_ "select worst sample"
picture 06-worst-sample
command_ "select strongest light"
sleep 2
picture 07-strongest-light

# Afresh: nothing has changed, so that a plain run would keep all.
keys ctrl+shift+r
sleep 3
still 08-second-run
keys Escape
wait_ready
picture 09-cancelled

keys F2
click 1041 97
click 945 303   # Textured
picture 10-textured
keys ctrl+z
sleep 2
still 11-undone
sleep 7

keys ctrl+e
sleep 1
keys ctrl+a
text "$work/results"
keys Return
wait_ready
[ -s "$work/results/solution.json" ] || fail "no results were exported"
keys ctrl+s
sleep 1
keys ctrl+a
text "$work/corner.lobelia"
keys Return
still 12-saved
keys ctrl+q
for _ in $(seq 40); do kill -0 "$window" 2>/dev/null || break; sleep 0.25; done
kill -0 "$window" 2>/dev/null && fail "the window has not closed"

project=$work/corner.lobelia
[ -s "$project" ] || fail "the project was not saved"
python3 - "$project" <<'PY' || fail "the saved project is not what was tagged"
import json, sys
materials = {m["name"]: m for m in json.load(open(sys.argv[1]))["materials"]}
floor = materials["floor"]
sys.exit(not (floor["specular"] and not floor.get("textured")))
PY

start "$project"
wait_ready
keys F4
command_ "show materials"
picture 13-reopened
keys ctrl+q
wait "$window" || true
window=
echo "The walk went well; the pictures are in $out"
