#!/usr/bin/env bash
# Cuts out/reel.mp4, a minute of the gallery with titles: demos/reel.sh [RENDER OPTIONS...]. Finished shots are kept in out/reel.
# Cuts docs/reel.webp, the moving picture of the README:  demos/reel.sh --readme [RENDER OPTIONS...]. Finished frames are kept in
# out/readme.
set -euo pipefail
cd "$(dirname "$0")/.."

# scene|from [s]|length [s]: the moments with the most motion, and hard cuts between them.
readme_shots='wall|1.2|1.25
glass|1.6|1.5
fountain|3|1.5
drape|0.25|0.85
explosion|0.9167|1.3333
fireworks|7.5|1.75'

readme_reel() {
  local number=0 scene from length shot
  rm -rf out/readme/cut
  mkdir -p out/readme/cut
  while IFS='|' read -r scene from length; do
    number=$((number + 1))
    shot=out/readme/$scene
    cat >"$shot.json" <<END
{"version": 1, "include": ["../../demos/scenes/$scene.json"],
 "output": {"start": $from, "duration": $length, "fps": 12}}
END
    build/offstage render "$shot.json" --allow demos --allow assets -o "$shot/####.png" --size 480x270 --resume "$@"
    for frame in "$shot"/*.png; do cp "$frame" "out/readme/cut/${number}_$(basename "$frame")"; done
  done <<<"$readme_shots"
  ffmpeg -y -loglevel error -framerate 12 -pattern_type glob -i 'out/readme/cut/*.png' -c:v libwebp_anim -quality 60 \
    -compression_level 4 -loop 0 docs/reel.webp
  echo docs/reel.webp
}
if [ "${1:-}" = --readme ]; then
  shift
  readme_reel "$@"
  exit
fi

mkdir -p out/reel
options=("$@")
[[ " $* " == *" --size "* ]] || options+=(--size 1280x720)
# Removes shots that were rendered with other options.
[ "$(cat out/reel/options 2>/dev/null)" = "${options[*]}" ] || rm -f out/reel/*.mp4
echo "${options[*]}" >out/reel/options

# scene|from [s]|length [s]|title
shots='wall|0.9|4|Stacks, friction, a wrecking ball
dominoes|1|4|Chains of collisions
arch|3|4|An arch that stands by friction
marbles|1|4|Exact collisions with meshes
cradle|0|3|Simultaneous and sequential impacts
explosion|0.6|4|Islands and explosions
pile|0.2|3|Heaps of every shape
ragdolls|0.2|4|Joints with limits
machine|2|3|Kinematic machines
drape|0.1|3|Cloth
flag|2|4|Wind
fountain|3|4|Thousands of drops
sprinkler|2|2|Sprinklers
rain|2|4|Rain and splashes
smoke|4|3|Smoke that shadows itself
fire|2.5|3|Fire that lights its surroundings
fireworks|2.5|4|Emitters that emit emitters'

list=out/reel/list.txt
: >"$list"
number=0
while IFS='|' read -r scene from length title; do
  number=$((number + 1))
  shot=$(printf 'out/reel/%02d_%s' "$number" "$scene")
  cat >"$shot.json" <<END
{"version": 1, "include": ["../../demos/scenes/$scene.json"],
 "overlays": [{"type": "text", "text": "$title", "place": "bottom_left", "size": 0.05}],
 "output": {"start": $from, "duration": $length, "fps": 30}}
END
  [ -f "$shot.mp4" ] || build/offstage render "$shot.json" --allow demos --allow assets -o "$shot.mp4" "${options[@]}"
  echo "file '$(basename "$shot.mp4")'" >>"$list"
done <<<"$shots"
ffmpeg -y -loglevel error -f concat -i "$list" -c copy out/reel.mp4
echo out/reel.mp4
