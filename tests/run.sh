#!/usr/bin/env bash
# Builds offstage and runs its tests:  tests/run.sh [--long] [--tsan] [CTEST OPTIONS...]
#   --long  also the long cases (label "long"), for which scanned models are fetched, the benchmarks are built, the fuzz
#           targets run, and the unit tests run with all checks of the sanitizers
#   --tsan  also the threaded tests under ThreadSanitizer
# The unit tests and the model importer run a second time with libraries under AddressSanitizer and UndefinedBehaviorSanitizer
# (label "sanitized").
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/packages.sh

long=(-LE long)
bench=OFF
tsan=no
while [ $# -gt 0 ]; do
  case $1 in
    --long) long=() bench=ON ;;
    --tsan) tsan=yes ;;
    *) break ;;
  esac
  shift
done

install_packages $build_packages $test_packages
[ $bench = OFF ] || install_packages $bench_packages $fuzz_packages $long_packages debootstrap
cores=$(nproc)
failed=0

# Builds the benchmarks against other engines, if their files are there (tests/bench/RESULTS.md).
peers=()
[ -d ../shared/peers ] && peers=("-DOFFSTAGE_PEERS=$(realpath ../shared/peers)")

# All tests are built together and run together, so that all cores are busy until the end.
cmake --preset release -DOFFSTAGE_WERROR=ON -DOFFSTAGE_TESTS=ON -DOFFSTAGE_SANITIZED_TESTS=ON -DOFFSTAGE_PYTHON=ON \
  -DOFFSTAGE_BENCH=$bench "${peers[@]}"
cmake --build build

if [ ${#long[@]} = 0 ]; then
  cmake --preset asan
  cmake --build build-asan --target test_sim test_effects test_producer test_engine test_tune test_render
  UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 ctest --test-dir build-asan -L unit -j "$cores" --output-on-failure || failed=1
  tests/meshes.sh build/meshes
  export OFFSTAGE_MESHES=$PWD/build/meshes
  cmake --preset fuzz
  cmake --build build-fuzz --target fuzz_targets
  ctest --test-dir build-fuzz -L fuzz -LE long -j "$cores" --output-on-failure || failed=1
fi

if [ "$tsan" = yes ]; then
  cmake --preset tsan
  cmake --build build-tsan --target test_sim test_validation test_determinism test_producer
  TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" build-tsan/test_sim --gtest_filter='StagedLoop.*' || failed=1
  TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" build-tsan/test_validation --gtest_filter='*Determinism.*' || failed=1
  TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" build-tsan/test_determinism || failed=1
  TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" build-tsan/test_producer --gtest_filter='Pipeline.*' || failed=1
fi

ctest --test-dir build "${long[@]}" -j "$cores" --output-on-failure "$@" || failed=1
exit $failed
