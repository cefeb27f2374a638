#!/usr/bin/env bash
# Runs every line of the sh blocks of README.md in a scratch copy of the repository, as a stranger would, but for scripts/run and
# scripts/test. usage: readme-lines.sh TREE SOURCE
# TREE is a build tree, which takes the place of build/release, or an installed prefix such as /usr, which takes that of install.
set -euo pipefail
tree=$(realpath "$1")
source=$(realpath "$2")
. "$(dirname "$0")/common.sh"

mkdir "$scratch/repository"
if git -C "$source" rev-parse --is-inside-work-tree >/dev/null 2>&1; then
    git -C "$source" ls-files -z --cached --others --exclude-standard |
        tar -C "$source" --null --files-from=- --ignore-failed-read -c 2>/dev/null | tar -C "$scratch/repository" -x
else
    tar -C "$source" --exclude=./build --exclude=./delassus-bench -c . | tar -C "$scratch/repository" -x
fi
cd "$scratch/repository"
mkdir -p build
if [ -f "$tree/CMakeCache.txt" ]; then
    ln -s "$tree" build/release
    skipped='^scripts/'
else
    ln -s "$tree" install
    export PATH=$tree/bin:$PATH
    skipped='^(scripts/|cmake --install)'
fi
export CXXFLAGS="${CXXFLAGS:-} $flags"

awk '/^```/ { inside = ($0 == "```sh"); next } inside && NF { print NR "\t" $0 }' README.md > "$scratch/lines"
count=0
while IFS=$'\t' read -r number line <&3; do
    if [[ $line =~ $skipped ]]; then continue; fi
    echo "== README.md:$number: $line"
    status=0
    begin=$SECONDS
    eval "$line" || status=$?
    echo "-- $((SECONDS - begin)) s"
    if [ "$status" -ne 0 ]; then echo "README.md:$number failed with exit code $status: $line" >&2; exit 1; fi
    count=$((count + 1))
done 3< "$scratch/lines"
if [ "$count" -lt 10 ]; then echo "only $count lines were found in the sh blocks of README.md" >&2; exit 1; fi
echo "README: $count lines passed"
