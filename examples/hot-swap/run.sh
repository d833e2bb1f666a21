#!/usr/bin/env bash
# A block of a running plant is swapped: for its next version, for one in another language, for one that fails. Needs
# `cargo xtask guests`. Ends with 0 when everything went as README.md says, else with 1 and what did not.
#
#   run.sh [LATCHWORK [COMPONENTS]]     the program and the folder of the example's blocks, if not in target/
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
latchwork=${1:-$here/../../target/release/latchwork}
blocks=${2:-$here/../../target/example-components}
work=$(mktemp -d)
export LATCHWORK_SOCKET=$work/plant.sock
plant=
stop() {
    [ -z "$plant" ] || { kill -INT "$plant" 2>/dev/null || true; wait "$plant" 2>/dev/null || true; }
    rm -rf "$work"
}
trap stop EXIT

fail() { echo "FAILED: $*" >&2; exit 1; }
# Runs a command, shows it and what it prints, and keeps that for `says`. The first argument is the exit code it must have.
out=
runs() {
    local expected=$1 code=0
    shift
    echo "\$ latchwork $*"
    out=$("$latchwork" "$@" 2>&1) || code=$?
    echo "$out"
    echo
    [ "$code" = "$expected" ] || fail "exit code $code instead of $expected: latchwork $*"
}
says() { case $out in *"$1"*) ;; *) fail "it does not say \"$1\"" ;; esac; }
# The starts that the block tells now.
starts() {
    local line fd watch
    exec {fd}< <(exec "$latchwork" watch hours.outputs.starts --json)
    watch=$!
    read -r -t 30 line <&"$fd" || fail "no value of hours.outputs.starts"
    kill "$watch"
    sed -n 's/.*"value":\([0-9][0-9]*\).*/\1/p' <<<"$line"
}

"$latchwork" run "$here/plant.toml" --socket "$LATCHWORK_SOCKET" --data "$work/data" --quiet >"$work/run.log" 2>&1 &
plant=$!
# Until it answers, at most 30 s.
for _ in $(seq 150); do
    "$latchwork" status >/dev/null 2>&1 && break
    kill -0 "$plant" 2>/dev/null || { cat "$work/run.log" >&2; fail "the plant did not start"; }
    sleep 0.2
done
runs 0 status
says pump-hours-1

echo "--- What would version 2 change?"
runs 0 swap hours "$blocks/pump-hours-2.wasm" --dry-run

echo "--- Version 2, after a hundred executions in the shadow of version 1"
before=$(starts)
runs 0 swap hours "$blocks/pump-hours-2.wasm" --shadow 100 --probation 50 --yes
after=$(starts)
[ "$before" -ge 1 ] && [ "$after" -ge "$before" ] || fail "$after starts after the swap, $before before it"

if [ -e "$blocks/pump-hours-c.wasm" ]; then
    echo "--- The same in C"
    before=$after
    runs 0 swap hours "$blocks/pump-hours-c.wasm" --shadow 100 --probation 50 --yes
    after=$(starts)
    [ "$after" -ge "$before" ] || fail "$after starts after the swap, $before before it"
else
    echo "SKIPPED: $blocks/pump-hours-c.wasm is missing: clang-19 and lld-19 build it"
fi

echo "--- Version 3, whose mistake comes to light after 200 executions: the version before comes back by itself"
before=$after
runs 1 swap hours "$blocks/pump-hours-3.wasm" --probation 1000 --yes
says trapped
after=$(starts)
[ "$after" -ge "$before" ] || fail "$after starts after the rollback, $before before it"
runs 0 swaps
runs 0 records --kind swap

kill -INT "$plant"
wait "$plant" || fail "the plant ended with exit code $?"
plant=

echo "--- Once more what the block got, at full speed"
runs 0 replay "$work/data/recorder" --block hours
says "equal bit for bit"
echo "everything went as it should"
