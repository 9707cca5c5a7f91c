#!/usr/bin/env bash
# Draws all pictures of the tests of model features on one contact sheet, to be looked at:
#   tests/render/model_sheet.sh SHEET.png
# Each of the tests makes a model file of about a kilobyte and compares pixels with the colours that follow from its
# format. Needs build/test_render and ffmpeg. Also writes SHEET.txt, with the test of each picture by row and column.
set -euo pipefail
cd "$(dirname "$0")/../.."
sheet=$(realpath -m "${1:?usage: tests/render/model_sheet.sh SHEET.png}")
columns=12
pictures=$(mktemp -d)
trap 'rm -r "$pictures"' EXIT
OFFSTAGE_MODEL_SHEET=$pictures build/test_render --gtest_brief=1 --gtest_filter='GltfPicture.*:ObjPicture.*:PlyPicture.*'
count=0
for picture in "$pictures"/*.png; do
  name=$(basename -s .png "$picture")
  printf '%d %d %s\n' $((count / columns + 1)) $((count % columns + 1)) "${name#*_}"
  count=$((count + 1))
done >"${sheet%.*}.txt"
count=$(wc -l <"${sheet%.*}.txt")
ffmpeg -y -loglevel error -pattern_type glob -i "$pictures/*.png" -frames:v 1 \
  -vf "scale=144:96:flags=neighbor,tile=${columns}x$(((count + columns - 1) / columns)):padding=4" "$sheet"
echo "$count pictures on $sheet"
