# Sourced by demos/run.sh and tests/run.sh. Installs missing packages, on Debian 12, Debian 13 and Ubuntu 24.04.
# "a|b": the first of both packages that the release has. "a?": an optional package, installed if the release has it.

build_packages="g++ cmake ninja-build pkg-config python3-glad libeigen3-dev libtbb-dev libegl1 libgl1-mesa-dri libassimp-dev libstb-dev
libembree-dev libglm-dev libdeflate-dev libopenexr-dev libqhull-dev libxxhash-dev libzstd-dev nlohmann-json3-dev libcli11-dev libfmt-dev libcpp-httplib-dev
libturbojpeg0-dev ffmpeg
libdraco-dev? libmeshoptimizer-dev? libwebp-dev?
libosmesa6? mold? ccache?"
test_packages="libgtest-dev librapidcheck-dev libfcl-dev libccd-dev libbullet-dev libvalijson-dev assimp-testmodels
chromium|chromium-browser chromium-driver|chromium-chromedriver python3-selenium
pybind11-dev python3-dev python3-numpy python3-pytest python3-matplotlib python3-pip"
long_packages="blender slurm-wlm munge"
bench_packages="libbenchmark-dev"
fuzz_packages="clang libclang-rt-14-dev|libclang-rt-19-dev|libclang-rt-18-dev"

is_installed() { dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q '^install ok installed$'; }
is_known() { apt-cache policy "$1" 2>/dev/null | grep -q 'Candidate: [^(]'; }

# missing_packages PACKAGE...: prints those that are not installed, with one name for each choice.
missing_packages() {
  local wanted name names
  for wanted in "$@"; do
    names=${wanted%\?}
    for name in ${names//|/ }; do is_installed "$name" && continue 2; done
    for name in ${names//|/ }; do
      is_known "$name" && echo "$name" && continue 2
    done
    [ "$wanted" != "$names" ] || echo "${names%%|*}"  # unknown here: apt-get will report it
  done
}

# install_packages PACKAGE...: returns at once if all are installed; uses sudo if not root; without either, a message says what to do.
install_packages() {
  local name missing as_root="" required=()
  [ -n "$(missing_packages "$@")" ] || return 0
  for name in "$@"; do
    [ "$name" != "${name%\?}" ] || required+=("$name")
  done
  missing=$(missing_packages "${required[@]}")
  if ! command -v apt-get >/dev/null; then
    [ -z "$missing" ] || echo "Packages are missing, and there is no apt-get to install them. Install them by hand; in Debian they are called:" $missing >&2
    [ -z "$missing" ]
    return
  fi
  if [ "$(id -u)" != 0 ]; then
    [ -n "$missing" ] || return 0
    if ! command -v sudo >/dev/null; then
      echo "Run this as root first: apt-get install" $missing >&2
      return 1
    fi
    as_root=sudo
  fi
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2 || return
  missing=$(missing_packages "$@")  # again, since the names of this release are known only after the update
  echo "Installing:" $missing >&2
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing >&2
}
