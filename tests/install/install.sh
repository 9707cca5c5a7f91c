#!/usr/bin/env bash
# Installs into a new folder: the program must find its presets and models there, and another project the libraries.
# usage: install.sh BUILD_DIR
set -euo pipefail
tests=$(realpath "$(dirname "$0")")
build=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix
cmake --install "$build" --prefix "$prefix" >"$work/log" || { cat "$work/log"; exit 1; }

for file in bin/offstage share/man/man1/offstage.1 share/offstage/scene.schema.json share/zsh/vendor-completions/_offstage \
    share/fish/vendor_completions.d/offstage.fish; do
  [ -s "$prefix/$file" ] || { echo "$file was not installed"; exit 1; }
done
python3 -m json.tool "$prefix/share/offstage/scene.schema.json" >/dev/null
cmp "$prefix/share/offstage/scene.schema.json" <("$build/offstage" schema)
if command -v man >/dev/null; then
  LC_ALL=C.UTF-8 man --warnings -l "$prefix/share/man/man1/offstage.1" 2>"$work/warnings" >/dev/null
  [ ! -s "$work/warnings" ] || { cat "$work/warnings"; exit 1; }
fi
# Completes a command, an option, and a value.
for words in "ren render" "render --qual --quality" "render --quality fi final"; do
  set -- $words
  got=$(bash -c ". '$prefix/share/bash-completion/completions/offstage'
    COMP_WORDS=(offstage ${*:1:$#-1}) COMP_CWORD=$(($# - 1)); _offstage; echo \"\${COMPREPLY[*]}\"")
  [ "$got" = "${!#}" ] || { echo "offstage ${*:1:$#-1} was completed by '$got'"; exit 1; }
done

# These names exist only in the installation.
mv "$prefix/share/offstage/presets/rain.json" "$prefix/share/offstage/presets/only_installed.json"
mv "$prefix/share/offstage/assets/models/duck.glb" "$prefix/share/offstage/assets/models/only_installed.glb"
cat >"$work/scene.json" <<'JSON'
{"version": 1, "effects": [{"preset": "only_installed"}],
 "bodies": [{"motion": "static", "shape": {"type": "mesh", "file": "only_installed.glb"}}],
 "render": {"size": [64, 36], "quality": "draft"}, "output": {"duration": 0.1}}
JSON
cd "$work"
prefix/bin/offstage frame scene.json -n 1 -o one.png -q
prefix/bin/offstage validate prefix/share/offstage/demos/scenes/wall.json >/dev/null

cmake -S "$tests/consumer" -B consumer -DCMAKE_PREFIX_PATH="$prefix" >log || { cat log; exit 1; }
cmake --build consumer >log 2>&1 || { cat log; exit 1; }
consumer/consumer two.png
[ -s one.png ] && [ -s two.png ]
