#!/usr/bin/env bash
# Makes a wheel and an archive of the build, installs the one into a folder of its own, unpacks the other into a folder with a space
# in its name, and uses both where nothing of the build can be found. usage: wheel.sh BUILD SOURCE. Exits with 77 where the tools
# are missing, but for CI.
set -euo pipefail
build=$(realpath "$1")
source=$(realpath "$2")
. "$(dirname "$0")/common.sh"
fail() { echo "$*" >&2; exit 1; }

if ! ls "$build"/lib/python3/dist-packages/delassus/_delassus.*.so >/dev/null 2>&1; then
    echo "skipped: the build has no Python package"
    exit 77
fi
python=$(sed -n 's/^Python_EXECUTABLE:[^=]*=//p' "$build/CMakeCache.txt")
for tool in patchelf zstd readelf; do
    command -v "$tool" >/dev/null && continue
    [ -z "${CI:-}" ] || fail "$tool was not found"
    echo "skipped: $tool was not found; scripts/install-dependencies ci installs it"
    exit 77
done
"$python" -m pip --version >/dev/null 2>&1 || { echo "skipped: $python has no pip"; exit 77; }

"$source/scripts/make-wheel" --build "$build" --archive -o "$scratch/made"
wheel=$(echo "$scratch"/made/delassus-*-linux_x86_64.whl)
archive=$(echo "$scratch"/made/delassus-*-linux_x86_64.tar.zst)
for file in "$wheel" "$archive"; do
    [ "$(stat -c %s "$file")" -lt 60000000 ] || fail "$file has $(stat -c %s "$file") bytes; at most 60 MB"
done
# Nothing of the environment helps to find libraries.
stripped=(env -i "PATH=/usr/bin:/bin" "HOME=$scratch")

echo "== the wheel"
"${stripped[@]}" "$python" -m pip install -q --no-index --no-deps --no-warn-script-location --target "$scratch/site" "$wheel"
licences=$(echo "$scratch"/site/delassus-*.dist-info/licenses)
grep -c . "$licences/LIBRARIES"
for file in "$scratch"/site/delassus/lib/bundled/*; do
    grep -qF "$(basename "$file")" "$licences/LIBRARIES" || fail "the licence of $(basename "$file") is not listed"
done
while IFS=' ' read -r package _; do
    [ -s "$licences/libraries/$package" ] || fail "the licence of $package is missing"
done < <(sed -n '/^PACKAGE VERSION/,$p' "$licences/LIBRARIES" | sed -n 's/^\([a-z][^ ]*\) [^ ]*: lib.*/\1/p')
"${stripped[@]}" "$scratch/site/bin/delassus" solve "$source/examples/problems/sphere_pile" --tolerance 1e-4
"${stripped[@]}" PYTHONPATH="$scratch/site" "$python" "$here/use_wheel.py" "$scratch/site/delassus" package

echo "== the archive"
mkdir "$scratch/a folder"
tar -C "$scratch/a folder" -xf "$archive"
root=$(echo "$scratch/a folder"/delassus-*-linux_x86_64)
for document in man/man1/delassus.1 bash-completion/completions/delassus doc/delassus/licenses/LIBRARIES; do
    [ -s "$root/share/$document" ] || fail "the archive has no share/$document"
done
"${stripped[@]}" "$python" "$here/use_wheel.py" "$root"
