#!/usr/bin/env bash
# Blender reads exported films: positions agree with the trace, and Cycles draws the objects.
# usage: blender.sh OFFSTAGE SOURCE_DIR PICTURES
# Tests the formats that Debian's Blender supports, which is built without USD and Alembic: glTF for a wall and a cloth, PLY for a
# fountain.
set -euo pipefail
offstage=$(realpath "$1")
source=$(realpath "$2")
mkdir -p "$3"
pictures=$(realpath "$3")
command -v blender >/dev/null || { echo "blender is missing: apt-get install blender"; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# film NAME FORMAT: writes the export, the trace, and the picture that offstage draws of the last of five frames.
film() {
  "$offstage" simulate "$source/demos/scenes/$1.json" --duration 1 --trace "$1.csv" -q
  "$offstage" export "$source/demos/scenes/$1.json" --duration 1 -o "$2" -q
  "$offstage" frame "$source/demos/scenes/$1.json" --duration 1 -n -1 --size 320x180 -o "$pictures/$1-offstage.png" --force -q
}
run() { blender --background --factory-startup --python-exit-code 9 --python "$source/tests/export/blender_check.py" -- "$@" >log 2>&1 || { tail -n 30 log; exit 1; }; grep '^check:' log; }

film wall wall.glb
run wall.glb wall.csv "$pictures/wall-blender.png"
film drape drape.glb
run drape.glb drape.csv "$pictures/drape-blender.png"
film fountain fountain/####.ply
"$offstage" export "$source/demos/scenes/fountain.json" --duration 1 -o fountain-table.csv -q
run fountain fountain-table.csv "$pictures/fountain-blender.png"
