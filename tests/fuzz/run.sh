#!/bin/sh
# Fuzzes the readers and the elementary tests with libFuzzer under ASan and UBSan.
#
#   tests/fuzz/run.sh [MINUTES [TARGET...]]      1 minute each and all targets by default
#
# Needs clang and its compiler-rt (Debian: clang libclang-rt-dev). The corpus stays in build/fuzz/corpus and grows from run to run;
# what breaks a promise is left in build/fuzz/found, and the exit code is 1. Make it a seed in tests/fuzz/seeds.cpp when mending it.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
build=${TROCAR_FUZZ_BUILD:-$root/build/fuzz}
minutes=${1:-1}
[ $# -gt 0 ] && shift
cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
    -DTROCAR_FUZZ=ON -DTROCAR_SANITIZE=address,undefined,fuzzer-no-link >/dev/null
ninja -C "$build" fuzz
fuzz=$build/tests/fuzz/fuzz
[ $# -eq 0 ] && set -- $("$fuzz" 2>&1 | sed -n 's/.*one of://p')
mkdir -p "$build/found"
failed=0
for target; do
    corpus=$build/corpus/$target
    mkdir -p "$corpus"
    printf '%-12s' "$target"
    # An input of 8 KiB may take 256 MiB at most: a wrong size field must not be trusted.
    if TROCAR_FUZZ_TARGET=$target TROCAR_FUZZ_SEEDS=$corpus "$fuzz" "$corpus" -max_total_time=$((minutes * 60)) -max_len=8192 \
        -malloc_limit_mb=256 -rss_limit_mb=2048 -timeout=10 -artifact_prefix="$build/found/$target-" -print_final_stats=1 \
        >"$build/$target.log" 2>&1; then
        sed -n 's/^stat::number_of_executed_units: */runs /p; s/^stat::average_exec_per_sec: */per second /p' "$build/$target.log" | tr '\n' ' '
        grep -o 'cov: [0-9]*' "$build/$target.log" | tail -1
    else
        failed=1
        echo "BROKEN, see $build/$target.log"
        grep -m3 'ERROR\|does not hold\|runtime error' "$build/$target.log" || true
    fi
done
exit $failed
