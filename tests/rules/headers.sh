#!/usr/bin/env bash
# Every header compiles alone.  usage: headers.sh SOURCE_DIR COMPILER INCLUDE_FLAGS...
cd "$1" || exit 2
compiler=$2
shift 2
find sim effects render demos/producer -name '*.h' | sort |
  xargs -P "$(nproc)" -I{} sh -c '
    header=$1; shift
    echo "#include \"$header\"" |
      "$@" -std=c++20 -march=x86-64-v3 -Wall -Wextra -Werror -Wno-missing-field-initializers -fsyntax-only -x c++ - ||
      { echo "$header is not self-contained"; exit 255; }' sh {} "$compiler" "$@"
