#!/usr/bin/env bash
# After `pip install` of the repository, the package works from its own folder, with its presets.
# usage: install.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source=$(realpath "$1")
build=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
OFFSTAGE_BUILD=$build /usr/bin/python3 -m pip install --quiet --no-deps --no-build-isolation --no-index --target "$work/site" \
  "$source" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
cd "$work"
mv site/offstage/data/presets/rain.json site/offstage/data/presets/only_installed.json
PYTHONPATH=$work/site /usr/bin/python3 - <<'PYTHON'
import importlib.metadata
import offstage
assert offstage.__file__.endswith("site/offstage/__init__.py") and importlib.metadata.version("offstage")
scene = offstage.scene({"version": 1, "effects": [{"preset": "only_installed"}], "output": {"duration": 0.2}})
*_, last = offstage.render(scene, images=False)
print(last.number, "frames,", sum(len(p["id"]) for p in last.snapshot.point_sets), "particles")
PYTHON
