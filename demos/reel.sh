#!/usr/bin/env bash
# Cuts out/reel.mp4, a minute of the gallery with titles: demos/reel.sh [RENDER OPTIONS...]. Finished shots are kept in out/reel.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p out/reel
options=("$@")
[[ " $* " == *" --size "* ]] || options+=(--size 1280x720)
# Shots of other options do not fit together with new ones.
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
  [ -f "$shot.mp4" ] || build/offstage render "$shot.json" -o "$shot.mp4" "${options[@]}"
  echo "file '$(basename "$shot.mp4")'" >>"$list"
done <<<"$shots"
ffmpeg -y -loglevel error -f concat -i "$list" -c copy out/reel.mp4
echo out/reel.mp4
