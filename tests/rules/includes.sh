#!/usr/bin/env bash
# The dependency rule: sim <- effects <- demos/producer, render <- demos/producer; sim and render never meet.
# usage: includes.sh SOURCE_DIR
cd "$1" || exit 2
status=0

# forbid FOLDERS PATTERN WHY: no file of the folders may include what matches.
forbid() {
  local rows
  rows=$(grep -rnE --include=*.h --include=*.cpp "^ *# *include *[<\"]($2)" $1)
  [ -z "$rows" ] && return
  echo "$3:"
  echo "$rows"
  status=1
}

json='nlohmann|CLI/|valijson'
forbid sim "render/|effects/|producer/|$json|assimp|glad|GL/|stb|spng" "sim includes more than std, Eigen, oneTBB, Qhull and xxhash"
forbid effects "render/|producer/|$json|assimp|glad|GL/|stb|spng" "effects includes more than sim"
forbid render "sim/|effects/|producer/|$json" "render knows something of physics or JSON"
public=$(grep -L 'Private' render/*.h)
for header in $public; do
  forbid "$header" 'assimp|glad|GL/|stb|spng' "a public header shows a library behind it"
done
forbid "$(ls -d demos/producer tests/producer tests/cli 2>/dev/null | tr '\n' ' ')" 'assimp|glad|GL/|stb|spng' "only render uses GL, assimp, stb and libspng"

# One importer of each library.
for library in 'assimp/' 'stb_image' 'spng.h' 'GL/osmesa.h'; do
  users=$(grep -rlE "include *[<\"]$library" sim effects render demos | sed 's/\.[a-z]*$//' | sort -u | wc -l)
  [ "$users" -ge 1 ] || { echo "nothing uses $library any more; drop it here"; status=1; }
done
exit $status
