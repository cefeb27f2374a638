#!/usr/bin/env bash
# Uses an installed prefix as strangers would: the command, an out-of-tree plugin, an embedding program, a system, pkg-config.
# usage: consume.sh PREFIX SOURCE
set -euo pipefail
prefix=$(realpath "$1")
source=$(realpath "$2")
. "$(dirname "$0")/common.sh"

command=$prefix/bin/delassus
"$command" plugins list | tee "$scratch/list"
grep -q '^apgd' "$scratch/list"
if "$command" plugins list | grep -A99 '^Rejected'; then echo "installed plugins were rejected" >&2; exit 1; fi

"$command" bench list | tee "$scratch/suites"
grep -q '^quick: ' "$scratch/suites"
grep -q "$prefix.*quick.yaml" "$scratch/suites"

# Only what is installed may be used from here on.
cp -r "$source/examples/plugin" "$source/examples/embed" "$source/examples/system" "$source/examples/problems/box_stack" "$scratch"
cmake -S "$scratch/plugin" -B "$scratch/plugin/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$scratch/plugin/build"
test -s "$scratch/plugin/build/uzawa.json"
test "$(nm -D --defined-only "$scratch/plugin/build/uzawa.so" | grep -vc ' A ')" = 1
"$command" plugins check "$scratch/plugin/build/uzawa.so"
"$command" solve "$scratch/box_stack" --solver "$scratch/plugin/build/uzawa.so" --tolerance 1e-4
DELASSUS_PLUGIN_PATH=$scratch/plugin/build "$command" solve "$scratch/box_stack" --solver uzawa --tolerance 1e-4

cmake -S "$scratch/embed" -B "$scratch/embed/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$scratch/embed/build"
"$scratch/embed/build/embed"
"$scratch/embed/build/embed" "solver: {name: pgs, options: {omega: 1.1}, tolerance: 1e-11}"
if "$scratch/embed/build/embed" "solver: {name: nobody}"; then echo "an unknown solver was accepted" >&2; exit 1; fi

cmake -S "$scratch/system" -B "$scratch/system/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$scratch/system/build"
for timestepper in euler_implicit_linearized euler_implicit newmark hht generalized_alpha rk4; do
    for solver in cholmod minres; do "$scratch/system/build/system" "$timestepper" "$solver"; done
done
for timestepper in euler_explicit rk4 trapezoidal trapezoidal_linearized; do "$scratch/system/build/system" "$timestepper" free; done
if "$scratch/system/build/system" euler_explicit; then echo "euler_explicit took a constraint" >&2; exit 1; fi

# Solvers behind the engines that are installed.
cp -r "$source/examples/engines" "$scratch"
for engine in dart:dart:libdart-dev bullet:bullet-float64:libbullet-dev; do
    IFS=: read -r folder module package <<<"$engine"
    if ! pkg-config --exists "$module"; then
        echo "skipped: $folder was not found ($package)"
        continue
    fi
    cmake -S "$scratch/engines/$folder" -B "$scratch/engines/$folder/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release >/dev/null
    cmake --build "$scratch/engines/$folder/build"
    for solver in auto ssn; do "$scratch/engines/$folder/build/scenes" "$solver"; done
done

PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name delassus.pc)")
export PKG_CONFIG_PATH
cc -std=c99 -pedantic "$source/examples/dump/dump.c" $(pkg-config --cflags delassus) -lm -o "$scratch/dump"
"$scratch/dump" "$scratch/two_blocks"
"$command" compare "$scratch/two_blocks" --solvers pgs,ssn -o "$scratch/compared"
if "$scratch/dump" "$scratch/two_blocks"; then echo "a folder was written over" >&2; exit 1; fi
g++ -std=c++20 $flags "$scratch/embed/embed.cpp" $(pkg-config --cflags --libs delassus) -Wl,-rpath,"$(pkg-config --variable=libdir delassus)" \
    -o "$scratch/embed-pc"
"$scratch/embed-pc"
package=$prefix/lib/python3/dist-packages
if [ -d "$package/delassus" ]; then
    for python in python3 /usr/bin/python3; do
        if "$python" -c 'import numpy, scipy' 2>/dev/null; then break; fi
    done
    (cd "$scratch" && PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$package "$python" - "$prefix" <<'END'
import sys
import delassus
assert delassus.__file__.startswith(sys.argv[1]) and all(p["library"].startswith(sys.argv[1]) for p in delassus.plugins())
result = delassus.solve(delassus.read("box_stack"))
print(result)
assert result.solved
END
    )
fi
echo "$prefix: used as strangers would"
