#!/usr/bin/env bash
# Installs the build into a scratch folder and uses it as strangers would. usage: install-and-consume.sh BUILD SOURCE
set -euo pipefail
build=$(realpath "$1")
source=$(realpath "$2")
. "$(dirname "$0")/common.sh"

cmake --install "$build" --prefix "$scratch/prefix" >/dev/null
"$here/consume.sh" "$scratch/prefix" "$source"
