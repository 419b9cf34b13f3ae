#!/usr/bin/env bash
# From real photographs to a relit picture, with a mouse and keys that nobody holds: four photographs of a
# castle, no cameras and no mesh. Cameras are found, a tower is a box, a facade and the ivy below the tower are
# planes from points; all are tagged, one has a given reflectance, and a lamp lights them at dusk. Counts what the
# hand does and the seconds, prints both, and keeps a picture of every step.
#
#   assets/guide/castle.sh PHOTOGRAPHS [dark|light] [FOLDER]
#
# PHOTOGRAPHS is the folder apps/Tests/data/images of OpenMVS, 640x479 (AGPL-3.0, and therefore not in this
# repository). Needs what table.sh needs.
photographs=$(cd "${1:?the folder of the photographs}" && pwd)
shift
walk=castle
. "$(dirname "$0")/hand.sh"

begin_from_photographs "$photographs" 450
step castle-1-cameras

click 1238 43
# Which way is up, by two pilasters of the facade and the edge of the tower; its cornice runs along x.
press z
drag 742 370 724 212
drag 332 378 349 229
drag 262 318 278 190
press x
drag 415 313 560 252
# The tower above the ivy: five corners of the box in the first photograph and in the last. The roof hides
# the others.
press b
click 405 419; click 642 334; click 745 381; press space
click 412 257; press space; click 722 205
press Next Next Next; sleep 3
click 430 418; click 594 328; click 744 369; press space
click 432 262; press space; click 722 185
press v
press Prior Prior Prior; sleep 3
# Its two storeys are taken to be 8 m high.
press k
drag 405 419 412 257
press ctrl+a
text 8
press Return
sleep 2
saved 'things == ["box1"] and len(picks) >= 10' || fail "the tower was not drawn"
step castle-2-tower

# The facade beside it, and the two sides of the ivy, each a plane about the points in a lasso.
press l
drag 252 130 395 222 385 420 262 390 252 300; sleep 3
press l
drag 655 350 735 388 790 570 660 580; sleep 3
press l
drag 577 372 635 345 640 580 577 580; sleep 3
saved 'things == ["box1", "polygon1", "polygon2", "polygon3"]' || fail "the planes were not found"
press v
step castle-3-planes

press ctrl+m
wait_until "the mesh" 60 test -s "$work/castle/scene.obj"
sleep 5
press F3
sleep 3
click 1019 203   # Take for radiance (sRGB)
sleep 3
wait_ready 60
press F2
sleep 3
for row in 92 117 242 267 217; do   # what photographs show, the plaster of the facade last
    click 1021 "$row"
    click 948 359   # Textured
done
click 948 383   # Known reflectance
for field in "1024 0.55" "1081 0.53" "1138 0.47"; do
    click "${field% *}" 407
    press ctrl+a
    text "${field#* }"
    press Return
done
click 964 432   # Standard deviation
step castle-4-tags
press F3 ctrl+r
sleep 5
wait_ready "${TABLE_RUNNING:-900}"
step castle-5-run
press F5
command_ "add area light"
sleep 2
click 1247 454   # All of the recovered light
press ctrl+a
text 0.1
press Return
xdotool mousemove 585 330
press 0
sleep "${TABLE_RELIT:-20}"
step castle-6-dusk
press ctrl+q
echo "$((SECONDS - began)) s, $hands movements of the hand; the pictures are in $out"
