#!/bin/sh
# The OpenGL renderer of this machine, whether the tests of OpenGL pass on it, and the cost of stage II of the culling there.
#
#   tests/gpu.sh [BUILD [OUT]]      build/release and BUILD/gpu by default
#
# The one command for a machine with a graphics card; it runs on a software renderer as well, and says so. Exit code 1: a test failed, a
# figure was not measured, or there is no OpenGL at all. 2: a program of the build is missing. With TROCAR_GPU_QUICK=1 a few tests and the
# small tables, for machines that draw by software: two minutes. TROCAR_TEST_DATA names the folder of test data; with TROCAR_LONG_TESTS=1 the law of culling is tested
# by OpenGL on the largest surfaces too. OUT/device.json and OUT/image-space.json hold the figures, with the names of card and machine.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$root/build/release}
out=${2:-$build/gpu}
mkdir -p "$out"
failed=0
program=$build/trocar
tests='Gpu*:CullLaw*:*/LargeSurface*:*/VeryLargeSurface*:CullStage*:CullCost*'
quick=
if [ "${TROCAR_GPU_QUICK:-}" = 1 ]; then
    tests='GpuContext*:GpuFailure*:CullStage*:CullCost*'
    quick=--quick
fi
for needed in "$program" "$build/tests/engine/test_engine" "$build/tests/allocation/test_allocation"; do
    [ -x "$needed" ] && continue
    echo "$needed is not there, expected a build with tests: ./start build, or cmake --build $build" >&2
    exit 2
done
"$build/tests/engine/test_engine" --gtest_brief=1 --gtest_filter="$tests" || failed=1
"$build/tests/allocation/test_allocation" --gtest_brief=1 --gtest_filter='ImageSpaceCulling*' || failed=1
"$program" bench device $quick --json "$out/device.json" >"$out/device.txt" || failed=1
cat "$out/device.txt"
"$program" bench image-space $quick --json "$out/image-space.json" >"$out/image-space.txt" || failed=1
grep -q 'nothing was measured' "$out/device.txt" && failed=1
echo "----"
grep 'stage II' "$out/device.txt" || true
[ $failed = 0 ] && echo "all tests of OpenGL passed" || echo "FAILED, see above"
exit $failed
