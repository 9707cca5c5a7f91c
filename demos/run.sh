#!/usr/bin/env bash
# Builds offstage and renders a film of the gallery:  demos/run.sh [NAME] [RENDER OPTIONS...]
# NAME is a scene of demos/scenes without .json (default: fountain); "all" renders every one, "list" names them, "reel" cuts a minute
# from the best of them.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/packages.sh

name=${1:-fountain}
[ $# -gt 0 ] && shift
if [ "$name" = list ]; then
  basename -s .json demos/scenes/*.json
  exit 0
fi
if [ "$name" != all ] && [ "$name" != reel ] && [ ! -f "demos/scenes/$name.json" ]; then
  echo "There is no scene '$name'; there are: $(basename -s .json demos/scenes/*.json | tr '\n' ' ')" >&2
  exit 2
fi

install_packages $build_packages
[ -f build/CMakeCache.txt ] || cmake --preset release -DOFFSTAGE_WERROR=ON -DOFFSTAGE_TESTS=OFF >&2
cmake --build build --target offstage >&2

mkdir -p out
if [ "$name" = reel ]; then
  exec demos/reel.sh "$@"
fi
for scene in demos/scenes/*.json; do
  this=$(basename -s .json "$scene")
  if [ "$name" = all ] || [ "$name" = "$this" ]; then
    build/offstage render "$scene" --allow assets -o "out/$this.mp4" --force "$@"
  fi
done
