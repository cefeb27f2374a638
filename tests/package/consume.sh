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
cp -r "$source/examples/plugin" "$source/examples/plugin-c" "$source/examples/plugin-rust" "$source/examples/embed" \
    "$source/examples/system" "$source/examples/problems/box_stack" "$scratch"

# The README's lines for a plugin, with no word on optimisation; whoever chooses one gets it.
build_plugin() { # FOLDER [cmake argument…]
    cmake -S "$scratch/plugin" -B "$1" -DCMAKE_PREFIX_PATH="$prefix" "${@:2}" >/dev/null
    cmake --build "$1"
}
optimized() { [ "$(grep -c '"optimized": true' "$1/uzawa.json")" = 1 ]; }
plugin=$scratch/plugin/build
build_plugin "$plugin" ${flags:+-DCMAKE_CXX_FLAGS="$flags"}
optimized "$plugin" || { echo "the plugin was built without optimisation" >&2; exit 1; }
test "$(nm -D --defined-only "$plugin/uzawa.so" | grep -vc ' A ')" = 1
"$command" plugins check "$plugin/uzawa.so"
"$command" solve "$scratch/box_stack" --solver "$plugin/uzawa.so" --tolerance 1e-4
DELASSUS_PLUGIN_PATH=$plugin "$command" solve "$scratch/box_stack" --solver uzawa --tolerance 1e-4
if [ -z "$flags" ]; then
    echo 'set(CMAKE_CXX_FLAGS_INIT -O0)' >"$scratch/toolchain.cmake"
    build_plugin "$scratch/chosen/type" -DCMAKE_BUILD_TYPE=Debug
    build_plugin "$scratch/chosen/flags" -DCMAKE_CXX_FLAGS=-O0
    build_plugin "$scratch/chosen/toolchain" -DCMAKE_TOOLCHAIN_FILE="$scratch/toolchain.cmake"
    if command -v ninja >/dev/null; then
        build_plugin "$scratch/chosen/configurations" -G 'Ninja Multi-Config' -DCMAKE_LIBRARY_OUTPUT_DIRECTORY_DEBUG="$scratch/chosen/configurations"
    fi
    for folder in "$scratch"/chosen/*; do
        if optimized "$folder"; then echo "$folder: the choice was overruled" >&2; exit 1; fi
    done
    "$command" plugins check "$scratch/chosen/type/uzawa.so" >"$scratch/checked"
    grep 'WARNING.*identity/build' "$scratch/checked"
    "$command" compare "$scratch/box_stack" --solvers uzawa --plugin-path "$scratch/chosen/type" --tolerance 1e-2 --repeats 1 \
        -o "$scratch/warned" 2>&1 | grep 'warning: uzawa was built without optimisation'
fi
cmake -S "$scratch/plugin-c" -B "$scratch/plugin-c/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_C_FLAGS="$flags" >/dev/null
cmake --build "$scratch/plugin-c/build"
"$command" plugins check "$scratch/plugin-c/build/dense_c.so" | tail -1
cmake --install "$plugin" --prefix "$scratch/elsewhere"
installed=$(dirname "$(find "$scratch/elsewhere" -name uzawa.so)")
test -s "$installed/uzawa.json"
[ "${installed#"$scratch/elsewhere/"}" = "$(cd "$prefix" && dirname "$(find lib* -path '*/delassus/plugins/apgd.so')")" ]
DELASSUS_PLUGIN_PATH=$installed "$command" plugins info uzawa

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

if pkg-config --exists mujoco || [ -e /usr/include/mujoco/mujoco.h ]; then
    adapter=$scratch/engines/mujoco
    cmake -S "$adapter" -B "$adapter/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release >/dev/null
    cmake --build "$adapter/build"
    "$adapter/build/run" "$adapter/models/hand.xml" 0.2
    # Times are for a quiet machine; creep is not.
    "$adapter/build/grip" "$adapter/models/grip.xml" 1000 >"$scratch/grip" || true
    awk '/Delassus.*hard/ { held++; if ($(NF-1) ^ 2 > 1e-18) exit 1 } END { exit held < 6 }' "$scratch/grip" ||
        { cat "$scratch/grip"; echo "the grip creeps" >&2; exit 1; }
    if [ -z "$flags" ]; then python3 "$adapter/grip.py"; fi
else
    echo "skipped: mujoco was not found (libmujoco-dev)"
fi

if ! command -v pkg-config >/dev/null; then
    echo "$prefix: used as strangers would, but for pkg-config, which was not found"
    exit 0
fi
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name delassus.pc)")
export PKG_CONFIG_PATH
# Plugins by hand: the lines of docs/writing-a-plugin.md.
awk '/^```/ { inside = ($0 == "```sh"); next } inside' "$source/docs/writing-a-plugin.md" >"$scratch/lines"
mkdir "$scratch/by-hand"
cp "$scratch/plugin/uzawa.cpp" "$scratch/plugin-c/dense.c" "$scratch/plugin-rust/dense.rs" "$scratch/by-hand"
built=0
while IFS= read -r line <&3; do
    if [[ $line == *rust* ]] && ! command -v rustc >/dev/null; then
        echo "skipped, since rustc was not found: $line"
        continue
    fi
    echo "== $line"
    (cd "$scratch/by-hand" && export PATH=$prefix/bin:$PATH XDG_DATA_HOME=$scratch/data && eval "$line")
    built=$((built + 1))
done 3<"$scratch/lines"
[ "$built" -ge 5 ] || { echo "docs/writing-a-plugin.md has lost its lines" >&2; exit 1; }
for library in "$scratch"/by-hand/*.so; do
    grep -q '"optimized": true' "${library%.so}.json"
    if [ -z "$flags" ]; then "$command" plugins check "$library" | tail -1; fi
done
# Every library of the CMake package has its module.
for module in delassus delassus-sdk $(cd "$prefix" && find lib* -name 'libdelassus_*.so' | sed 's|.*/lib||; s|\.so$||; s|_|-|g'); do
    pkg-config --exists --print-errors "$module"
done
g++ -std=c++20 $flags "$scratch/system/system.cpp" $(pkg-config --cflags --libs delassus-dynamics) \
    -Wl,-rpath,"$(pkg-config --variable=libdir delassus)" -o "$scratch/system-pc"
"$scratch/system-pc" newmark cholmod
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
