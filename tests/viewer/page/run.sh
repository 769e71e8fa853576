#!/usr/bin/env bash
# The page in headless Chromium. 77, with the reason: something it needs is not here.
# run.sh PROGRAM BUILD_FOLDER SOURCE_FOLDER [measure SCENE [KEYS]]
set -euo pipefail
program=$(realpath "$1") build=$(realpath "$2") source=$(realpath "$3")
skip() { echo "skipped: $*"; exit 77; }
node=$(command -v node || command -v nodejs) || skip "node is not installed (apt-get install nodejs npm)"
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[[ -n $chromium ]] || skip "Chromium is not installed (apt-get install chromium)"
[[ -f $build/page/index.html ]] || skip "the page was not built (cmake --build $build --target viewer_page)"
[[ -d $build/page_build/node_modules/playwright-core ]] || skip "the page's packages are not there (cmake --build $build --target viewer_page)"
(cd "$build/page_build" && "$node" node_modules/typescript/bin/tsc --noEmit) # the types hold
export CHROMIUM=$chromium TROCAR=$program PAGE_BUILD=$build/page_build TROCAR_SOURCE=$source
if [[ ${4:-} == measure ]]; then exec "$node" "$source/tests/viewer/page/measure.mjs" "${@:5}"; fi
# A browser that cannot reach this machine's own address, or hangs, is no failure of the page (a busy machine without a card): once more, then skipped.
log=$(mktemp)
trap 'rm -f "$log"' EXIT
for attempt in 1 2; do
    status=0 reason=
    timeout -k 10 600 "$node" --test --test-concurrency=1 "$source/tests/viewer/page/page.test.mjs" >"$log" 2>&1 || status=$?
    cat "$log"
    ((status == 0)) && exit 0
    if ((status == 124 || status == 137)); then
        reason="the browser stood still for 600 s"
    elif grep -q 'net::ERR_' "$log"; then
        reason="the browser did not reach the program: $(grep -m1 -o 'net::ERR_[A-Z_]*' "$log")"
    fi
    [[ -n $reason ]] || exit "$status"
    echo "attempt $attempt: $reason"
done
skip "$reason, twice"
