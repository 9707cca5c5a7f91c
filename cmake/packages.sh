# Sourced by demos/run.sh and tests/run.sh: installs what is missing from Debian 12.

build_packages="g++ cmake ninja-build ccache pkg-config python3-glad libeigen3-dev libtbb-dev libosmesa6 libegl1 libgl1-mesa-dri libassimp-dev \
libstb-dev libdeflate-dev libopenexr-dev libqhull-dev libxxhash-dev libzstd-dev nlohmann-json3-dev libcli11-dev libfmt-dev ffmpeg"
test_packages="libgtest-dev libbenchmark-dev librapidcheck-dev libfcl-dev libccd-dev libbullet-dev libvalijson-dev assimp-testmodels"

# install_packages NAME...: quick when all are there; sudo if not root; a clear message if neither.
install_packages() {
  local missing="" package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing="$missing $package"
  done
  [ -z "$missing" ] && return 0
  if ! command -v apt-get >/dev/null; then
    echo "These Debian 12 packages are needed, and there is no apt-get here to install them:$missing" >&2
    return 1
  fi
  local as_root=""
  if [ "$(id -u)" != 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "Run this as root first: apt-get install$missing" >&2
      return 1
    fi
    as_root=sudo
  fi
  echo "Installing:$missing" >&2
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2 &&
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing >&2
}
