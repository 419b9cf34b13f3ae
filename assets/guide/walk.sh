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

# A key that opens a dialog for a path, and the path. The window behind a dialog is dimmed. The key is pressed again
# where nothing comes: the system may take so long to say that it has no dialog that it looks like Cancel.
answer() {
    import -window root "$work/behind.png"
    for _ in $(seq 12); do
        keys "$1"
        for _ in $(seq 8); do
            sleep 1
            import -window root "$work/dialog.png"
            differ_by "$work/behind.png" "$work/dialog.png" 200000 || break 2
        done
    done
    sleep 1
    keys ctrl+a
    text "$2"
    keys Return
}

start
aside
state "$work/ready.png"
picture 01-start
command_ "open example"
pause 1
wait_ready
command_ "show materials"   # not the log, which has the folder and the seconds of this machine
picture 02-open

keys F2
click 1041 97   # the floor in the list of materials
click 1051 281  # Specular
picture 03-tag

keys F3 ctrl+r
# The first iterations are in the plot.
for _ in $(seq 600); do
    [ "$(import -window root -crop 640x180+290+500 +repage png:- | identify -format %k -)" -gt 8 ] && break
    sleep 0.2
done
still 04-running
wait_ready
picture 05-converged

keys F4
command_ "show error per sample"
command_ "select worst sample"
picture 06-worst-sample
command_ "select strongest light"
pause 2
picture 07-strongest-light

# Afresh: nothing has changed, so that a plain run would keep all.
keys ctrl+shift+r
pause 3
still 08-second-run
keys Escape
wait_ready
picture 09-cancelled

keys F2
click 1041 97
click 945 303   # Textured
picture 10-textured
keys ctrl+z
pause 2
still 11-undone
pause 7

answer ctrl+e "$work/results"
wait_ready
[ -s "$work/results/solution.json" ] || fail "no results were exported"
answer ctrl+s "$work/corner.lobelia"
pause 2
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
