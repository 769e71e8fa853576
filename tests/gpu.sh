#!/bin/sh
# What draws on this machine, whether the tests of OpenGL pass on it, and what stage II of the culling costs there.
#
#   tests/gpu.sh [BUILD [OUT]]      build/release and BUILD/gpu by default
#
# The one command for a machine with a graphics card; it runs on a software renderer as well, and says so. Exit code 1: a test failed, or
# there is no OpenGL at all. SELDINGER_TEST_DATA names the folder of test data; with SELDINGER_LONG_TESTS=1 the law of culling is tested
# by OpenGL on the largest surfaces too. OUT/device.json and OUT/image-space.json hold the figures, with the names of card and machine.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$root/build/release}
out=${2:-$build/gpu}
mkdir -p "$out"
failed=0
"$build/tests/engine/test_engine" --gtest_brief=1 --gtest_filter='Gpu*:CullLaw*:*/LargeSurface*:*/VeryLargeSurface*:CullStage*:CullCost*' || failed=1
"$build/tests/allocation/test_allocation" --gtest_brief=1 --gtest_filter='LookingByPictures*' || failed=1
"$build/engine/seldinger" bench device --json "$out/device.json" | tee "$out/device.txt"
"$build/engine/seldinger" bench image-space --json "$out/image-space.json" >"$out/image-space.txt" || failed=1
grep -q 'nothing was measured' "$out/device.txt" && failed=1
echo "----"
grep 'stage II' "$out/device.txt" || true
[ $failed = 0 ] && echo "all tests of OpenGL passed" || echo "FAILED, see above"
exit $failed
