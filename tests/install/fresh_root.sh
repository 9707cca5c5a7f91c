#!/usr/bin/env bash
# Builds and tests offstage in a fresh system, and installs its packages in another:  fresh_root.sh BUILD_DIR [SUITE]
# SUITE is a release of Debian that debootstrap knows (default: trixie). The mirror is the one that apt uses here. Needs root and
# the network; exits with 77 (skipped) without. Fetched packages and compiled files are kept in BUILD_DIR/roots for the next run.
set -euo pipefail
source=$(realpath "$(dirname "$0")/../..")
suite=${2:-trixie}
roots=$(realpath "$1")/roots/$suite
mirror=$(apt-get indextargets --format '$(SITE)' 2>/dev/null | grep -m1 '/debian/*$') || mirror=
if [ "$(id -u)" != 0 ] || [ -z "$mirror" ] || ! command -v debootstrap >/dev/null; then
  echo "needs root, debootstrap and a mirror of Debian"
  exit 77
fi
mkdir -p "$roots/ccache"

# enter ROOT COMMAND...: runs bash in the system ROOT. The folders of the kernel are mounted until it ends.
enter() {
  local root=$1
  shift
  mkdir -p "$root/ccache"
  cp /etc/resolv.conf "$root/etc/"
  unshare --mount bash -c '
    for folder in proc sys dev; do mount --rbind "/$folder" "$0/$folder"; done
    mount --bind "$1" "$0/ccache"
    shift
    exec chroot "$0" env -i PATH=/usr/sbin:/usr/bin HOME=/root CCACHE_DIR=/ccache bash -euo pipefail -c "$@"' \
    "$root" "$roots/ccache" "$@"
}
# fresh NAME: makes a copy of the new system.
fresh() {
  rm -rf --one-file-system "${roots:?}/$1"
  cp -a "$roots/bare" "$roots/$1"
}

if [ ! -d "$roots/bare" ]; then
  rm -rf "$roots/making"
  debootstrap --variant=minbase "$suite" "$roots/making" "$mirror" >"$roots/debootstrap.log" ||
    { tail "$roots/debootstrap.log"; exit 1; }
  # Sets of rules of this machine's apt that the mirror may need; fetched packages are kept.
  cp /etc/apt/apt.conf.d/99* "$roots/making/etc/apt/apt.conf.d/" 2>/dev/null || true
  mv "$roots/making" "$roots/bare"
fi

fresh build
mkdir "$roots/build/offstage"
git -C "$source" ls-files -z | tar -C "$source" --null -T - -c | tar -x -C "$roots/build/offstage"
enter "$roots/build" '
  cd /offstage
  . cmake/packages.sh
  install_packages $build_packages $test_packages dpkg-dev file
  g++ --version | head -1
  cmake --preset release -DOFFSTAGE_WERROR=ON -DOFFSTAGE_BENCH=OFF
  cmake --build build
  ctest --test-dir build -L "unit|golden" -j "$(nproc)" --output-on-failure
  cd build
  cpack -G DEB'

fresh install
mkdir "$roots/install/packages"
cp "$roots"/build/offstage/build/*.deb "$roots/install/packages/"
cp -r "$source/tests/install/consumer" "$roots/install/"
enter "$roots/install" '
  export DEBIAN_FRONTEND=noninteractive
  apt-get update -q
  apt-get install -y -q --no-install-recommends /packages/offstage_*.deb ffmpeg
  offstage render /usr/share/offstage/demos/scenes/rain.json -o rain.mp4 --duration 0.5 --quality draft
  apt-get install -y -q --no-install-recommends /packages/offstage-dev_*.deb g++ cmake make
  cmake -S consumer -B consumer/build
  cmake --build consumer/build
  consumer/build/consumer two.png
  ls -l rain.mp4 two.png'
