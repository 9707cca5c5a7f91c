#!/usr/bin/env bash
# Documents name files, tests and pages that exist:  docs.sh SOURCE_DIR
# - relative links of every Markdown page lead to a file,
# - a code block below a comment `<!-- file: PATH -->` is the text of that file,
# - source paths in docs/physics.md exist, and so do the tests, scenes, functions and keys that it, docs/book.md and docs/step.md name,
# - every row of the sections of docs/book.md names a test or a scene.
set -euo pipefail
cd "$1"
failed=0
problem() { echo "$1" >&2; failed=1; }

while read -r page; do
  while read -r link; do
    target=${link%%#*}
    [ -z "$target" ] || [ -e "$(dirname "$page")/$target" ] || problem "$page: the link '$link' leads nowhere"
  done < <(sed '/^```/,/^```/d' "$page" | grep -oE '\]\([^)]+\)' | sed -E 's/^\]\(//; s/\)$//' | grep -vE '^[a-z]+:' || true)
done < <(find . -name '*.md' -not -path './build*')

while IFS=: read -r page line path; do
  path=$(sed -E 's/.*file: (.*) -->.*/\1/' <<<"$path")
  cmp -s "$path" <(tail -n "+$((line + 2))" "$page" | sed '/^```$/,$d') || problem "$page:$line: the code differs from '$path'"
done < <(grep -rnE '^<!-- file: .* -->' docs README.md --include='*.md' || true)

while read -r path; do
  [ -e "$path" ] || problem "docs/physics.md: there is no file '$path'"
done < <(grep -oE '`(sim|effects|render|demos|tests)/[A-Za-z0-9_/.]+`' docs/physics.md | tr -d '`' | sort -u)

tests=$(grep -rhoE '^(TEST|TEST_F|TEST_P|RC_GTEST_PROP)\([A-Za-z0-9_]+, *[A-Za-z0-9_]+' tests --include='*.cpp' | sed -E 's/^[A-Z_]+\(//; s/, */./')
while read -r name; do
  case $name in
    *.\*) grep -qF "${name%\*}" <<<"$tests" || problem "docs/physics.md or docs/book.md: there is no test suite '${name%.\*}'" ;;
    *) grep -qx "$name" <<<"$tests" || problem "docs/physics.md or docs/book.md: there is no test '$name'" ;;
  esac
done < <(grep -ohE '`[A-Z][A-Za-z0-9]+\.(\*|[A-Z][A-Za-z0-9]+)`' docs/physics.md docs/book.md | tr -d '`' | sort -u)

# The lists "scene `x`" and "scenes `x`, `y`" of docs/book.md.
while read -r name; do
  [ -e "demos/scenes/$name.json" ] || problem "docs/book.md: there is no scene '$name'"
done < <(grep -oE 'scenes? `[a-z_]+`(, `[a-z_]+`)*' docs/book.md | grep -oE '`[a-z_]+`' | tr -d '`' | sort -u)

# Names of functions, classes, keys and scenes. Names of one or two letters are variables of equations.
words=$(grep -rhoE '[A-Za-z_][A-Za-z0-9_]+' sim effects render demos --include='*.h' --include='*.cpp' | sort -u)
scenes=$(basename -s .json demos/scenes/*.json)
while read -r name; do
  problem "docs/physics.md, docs/book.md or docs/step.md: there is no '$name' in the sources"
done < <(sed -E 's/\$`[^`]*`\$//g' docs/physics.md docs/book.md docs/step.md | grep -oE '`[A-Za-z_][A-Za-z0-9_:]{2,}(\(\))?`' | tr -d '`()' | sed 's/.*:://' |
  sort -u | grep -vxFf <(printf '%s\n%s\n' "$words" "$scenes"))

while read -r row; do
  cell=$(sed -E 's/ *\|$//; s/.*\| *//' <<<"$row")
  grep -qE '`([A-Z][A-Za-z0-9]+\.|[a-z_]+`)' <<<"$cell" || problem "docs/book.md: no test and no scene runs '$row'"
done < <(sed '/^## Measured/,$d' docs/book.md | grep -E '^\| [0-9A-G]')
exit $failed
