#!/usr/bin/env bash
# Every header compiles alone.  usage: headers.sh SOURCE_DIR COMPILER INCLUDE_FLAGS...
# A header that includes one of `bases`, directly or not, is compiled with that base precompiled before it: nothing comes in
# that the header does not include itself, and most of the time is saved.
cd "$1" || exit 2
flags=("${@:3}" -std=c++20 -march=x86-64-v3 -Wall -Wextra -Werror -Wno-missing-field-initializers)
compiler=$2
bases="producer/scene/scene.h render/stage.h sim/world.h sim/core/types.h Eigen/Core"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

headers=$(find sim effects render demos/producer -name '*.h' | sort)
declare -A base_of

# users_of NAME: the headers that include NAME, directly or through others; demos/producer/x.h is included as producer/x.h.
users_of() {
  local found="" pattern=$1 more
  while more=$(grep -lE "^#include [<\"]($pattern)[>\"]" $headers | grep -vxF "$found"); do
    found+=$'\n'$more
    pattern=$(echo $more | sed 's#demos/##g; s/ /|/g')
  done
  echo "$found"
}

for base in $bases; do
  for header in $(users_of $base); do
    [ -n "${base_of[$header]}" ] || base_of[$header]=$work/${base//\//_}
  done
done

for base in $bases; do
  name=$work/${base//\//_}
  echo "#include <$base>" > "$name"
  printf '%s\0' "$name"
done | xargs -0 -P "$(nproc)" -I{} "$compiler" "${flags[@]}" -x c++-header {} -o {}.gch || exit

check() {
  local header=$1 base=$2
  shift 2
  [ "$base" = none ] || set -- "$@" -include "$base"
  echo "#include \"$header\"" | "$@" -fsyntax-only -x c++ - || { echo "$header is not self-contained"; exit 255; }
}
export -f check
for header in $headers; do
  echo "$header ${base_of[$header]:-none}"
done | xargs -P "$(nproc)" -L1 bash -c 'check "${@: -2}" "${@:1:$#-2}"' check "$compiler" "${flags[@]}"
