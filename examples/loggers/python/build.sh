#!/bin/sh
# Makes a component of logger.py: build.sh [OUTPUT.wasm]
#
# Needs Python 3.9 or newer with pip. componentize-py is fetched once, in exactly one version, into the folder that
# LATCHWORK_COMPONENTIZE names (default: .componentize beside this script).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
output=${1:-logger.wasm}
version=0.25.1
tools=${LATCHWORK_COMPONENTIZE:-$here/.componentize}/$version
if [ ! -x "$tools/bin/componentize-py" ]; then
    # Beside it first: an interrupted download is not taken for a whole one.
    rm -rf "$tools.new"
    python3 -m pip install --quiet --disable-pip-version-check --target "$tools.new" "componentize-py==$version"
    rm -rf "$tools"
    mv "$tools.new" "$tools"
fi
PYTHONPATH=$tools python3 "$tools/bin/componentize-py" --quiet \
    --wit-path "$here/../../../wit/journal" --world logger \
    componentize --python-path "$here" logger --output "$output"
