#!/usr/bin/env bash
# The dependency rules. Between libraries: sim <- effects <- demos/producer, render <- demos/producer <- demos/engine <- demos/tune;
# sim and render never meet.
# usage: includes.sh SOURCE_DIR
cd "$1" || exit 2
status=0

# forbid FOLDERS PATTERN WHY: no file of the folders may include a header that matches the pattern.
forbid() {
  local rows
  rows=$(grep -rHnE --include=*.h --include=*.cpp "^ *# *include *[<\"]($2)" $1)
  [ -z "$rows" ] && return
  echo "$3:"
  echo "$rows"
  status=1
}

json='nlohmann|CLI/|valijson'
forbid sim "render/|effects/|producer/|$json|assimp|glad|GL/|stb|libdeflate" "sim includes more than std, Eigen, oneTBB, Qhull and xxhash"
forbid effects "render/|producer/|$json|assimp|glad|GL/|stb|libdeflate" "effects includes more than sim"
forbid render "sim/|effects/|producer/|CLI/|valijson" "render includes physics or scenes"
# glTF files are JSON; one header of its reader wraps the library.
forbid "$(find render -name '*.h' -o -name '*.cpp' | grep -v '^render/gltf_json.h$' | tr '\n' ' ')" nlohmann "render reads JSON only in render/gltf_json.h"
forbid "$(find render -name '*.h' -o -name '*.cpp' | grep -v '^render/trace/' | tr '\n' ' ')" "embree|glm/" "Embree and GLM are used only in render/trace"
forbid demos/producer "engine/|tune/|pybind11" "producer includes a library that depends on it"
forbid demos/engine "tune/|httplib" "engine includes a library that depends on it"
# Floors: within a library, a folder includes itself and the folders before it in the list.
# floors FOLDER PREFIX FLOOR...; "." is the folder's own files.
floors() {
  local base=$1 prefix=$2 above=() floor rest files
  shift 2
  rest=("$@")
  for floor in "$@"; do
    rest=("${rest[@]:1}")
    files=$base/$floor
    [ "$floor" != . ] || files=$(find "$base" -maxdepth 1 -name '*.h' -o -maxdepth 1 -name '*.cpp')
    above=()
    for name in "${rest[@]}"; do
      [ "$name" = . ] && above+=("[a-z_]+\\.h") || above+=("$name/")
    done
    [ ${#above[@]} = 0 ] || forbid "$files" "$prefix/($(IFS='|'; echo "${above[*]}"))" "$base/$floor includes a folder above it"
  done
  for floor in $(ls -d $base/*/ | xargs -n1 basename); do
    [[ " $* " == *" $floor "* ]] || { echo "$base/$floor has no place among the floors of tests/rules/includes.sh"; status=1; }
  done
}
floors sim sim core linear geometry collision dynamics articulation contact particles cloth . world
floors demos/producer producer base scene build format export run cli

public=$(grep -L 'Private' render/*.h)
for header in $public; do
  forbid "$header" 'assimp|glad|GL/|stb|libdeflate' "a public header shows a library behind it"
done
forbid "$(ls -d demos/producer tests/producer tests/cli 2>/dev/null | tr '\n' ' ')" 'assimp|glad|GL/|stb|libdeflate' "only render uses GL, assimp, stb and libdeflate"

# Libraries, and the files (without their endings) that may include them.
only() {
  local users
  users=$(grep -rlE "include *[<\"]$1" sim effects render demos | sed 's/\.[a-z]*$//' | sort -u | tr '\n' ' ')
  [ "$users" = "$2 " ] && return
  echo "$1 is used by: $users; it should be: $2"
  status=1
}
only 'libqhull_r/' 'sim/geometry/convex_hull'
only 'assimp/' 'render/mesh_import render/mesh_material render/model_files'
only 'stb_image' 'render/image_io'
only 'libdeflate.h' 'render/png'
only 'Imf' 'render/exr'
only 'httplib.h' 'demos/tune/http_server'
only 'turbojpeg.h' 'demos/engine/jpeg'
only 'dlfcn.h' 'render/gl_platform'
exit $status
