#!/usr/bin/env bash
# The table of dependencies (cmake/dependencies.txt) in the hands of scripts/install-dependencies, with an apt that only says what
# it was asked for, and in those of CMake's summary. usage: dependencies.sh BUILD SOURCE
set -euo pipefail
source=$(realpath "$2")
. "$(dirname "$0")/common.sh"
fail() { echo "$*" >&2; exit 1; }
says() { grep -qF -- "$2" "$scratch/$1" || { cat "$scratch/$1" >&2; fail "$1 does not say: $2"; }; }

# A tree with the script, and a release that has the packages of $scratch/offered but not those of $scratch/contradict.
mkdir -p "$scratch/tree/scripts" "$scratch/tree/cmake" "$scratch"/tree/plugins/{cone,arrow} "$scratch/bin"
cp "$source/scripts/install-dependencies" "$scratch/tree/scripts/"
cat > "$scratch/tree/cmake/dependencies.txt" <<'TABLE'
# row | for | need | packages | name | without
base   | run  | required | libbase-dev libold/libnew | Base |
spare  | run  | optional | libspare-dev | Spare [parts; of 3.1 | files of spares: none, "at all"
solve  | run  | optional | libsolve-dev | Solve |
odd    | run  | optional | libodd-dev   | Odd | odd ends
extra  | test | required | libextra-dev | Extra |
TABLE
echo 'delassus_plugin_needs(cone solve)' > "$scratch/tree/plugins/cone/CMakeLists.txt"
echo 'delassus_plugin_needs(arrow base solve)' > "$scratch/tree/plugins/arrow/CMakeLists.txt"
for program in dpkg-query apt-get apt-cache sudo; do
    cat > "$scratch/bin/$program" <<PROGRAM
#!/usr/bin/env bash
scratch='$scratch'
PROGRAM
    chmod +x "$scratch/bin/$program"
done
echo 'exec "$@"' >> "$scratch/bin/sudo"
echo 'grep -qx -- "${@: -1}" "$scratch/installed" && echo "install ok installed"' >> "$scratch/bin/dpkg-query"
cat >> "$scratch/bin/apt-cache" <<'PROGRAM'
grep -qx -- "$2" "$scratch/offered" || exit 0
printf '%s:\n  Installed: (none)\n  Candidate: 1.0\n' "$2"
sleep 0.02  # apt writes in pieces
printf '  Version table:\n'
PROGRAM
cat >> "$scratch/bin/apt-get" <<'PROGRAM'
case " $* " in
    *" indextargets "*) echo /lists ;;
    *" update "*) echo update >> "$scratch/asked" ;;
    *" -s "*) for word; do if grep -qx -- "$word" "$scratch/contradict"; then exit 100; fi; done ;;
    *) echo "$*" >> "$scratch/asked" ;;
esac
PROGRAM
install() {  # what is installed, offered, in contradiction; then the script's argument
    printf '%s\n' $1 > "$scratch/installed"; printf '%s\n' $2 > "$scratch/offered"; printf '%s\n' $3 > "$scratch/contradict"
    : > "$scratch/asked"
    status=0
    PATH=$scratch/bin:$PATH "$scratch/tree/scripts/install-dependencies" "$4" > "$scratch/said" 2>&1 || status=$?
}

echo "== an optional package is lacking, of two names the second exists"
install "" "libbase-dev libnew libsolve-dev libodd-dev" "" run
[ $status = 0 ] || { cat "$scratch/said" >&2; fail "the script ended with $status"; }
says said 'has no libspare-dev; without Spare [parts; of 3.1: no files of spares: none, "at all"'
says asked " libbase-dev libnew libsolve-dev libodd-dev"
if grep -q libspare "$scratch/asked"; then fail "a package that does not exist was asked for"; fi

echo "== what solvers need is named with the solvers"
install "libbase-dev libold libspare-dev libodd-dev" "" "" run
[ $status = 0 ] || fail "the script ended with $status"
says said "has no libsolve-dev; without Solve: no solver arrow, cone"
[ ! -s "$scratch/asked" ] || fail "apt was asked although nothing can be had"

echo "== a required package is lacking"
install "" "libbase-dev libspare-dev libsolve-dev libodd-dev" "" run
[ $status = 2 ] || fail "the script ended with $status"
says said "has no package libold or libnew, which Delassus needs"
[ "$(wc -l < "$scratch/said")" = 1 ] || fail "more than a sentence was said"
if grep -q install "$scratch/asked"; then fail "something was installed all the same"; fi
install "libbase-dev libold libspare-dev libsolve-dev libodd-dev" "" "" test
[ $status = 2 ] || fail "the script ended with $status"
says said "has no package libextra-dev, which Delassus needs"

echo "== an optional package cannot be installed beside the others"
install "" "libbase-dev libold libspare-dev libsolve-dev libodd-dev" "libsolve-dev" run
[ $status = 0 ] || fail "the script ended with $status"
says said "libsolve-dev cannot be installed; without Solve: no solver arrow, cone"
says asked " libbase-dev libold libspare-dev libodd-dev"

echo "== nothing is missing"
install "libbase-dev libold libspare-dev libsolve-dev libodd-dev" "" "" run
[ $status = 0 ] && [ ! -s "$scratch/said" ] && [ ! -s "$scratch/asked" ] || fail "something was done"

echo "== CMake's summary"
cp "$source"/cmake/Delassus{Dependencies,Summary}.cmake "$scratch/tree/cmake/"
cat > "$scratch/tree/CMakeLists.txt" <<'LISTS'
cmake_minimum_required(VERSION 3.25)
project(tree LANGUAGES NONE)
set(DELASSUS_PLUGIN_DIRECTORY "${CMAKE_BINARY_DIR}")
include(cmake/DelassusDependencies.cmake)
set(HERE yes)
set(THERE NOTFOUND)
delassus_dependency(base HERE)
delassus_dependency(spare HERE THERE)
delassus_dependency(solve THERE)
if(NOT FORGET)
  delassus_dependency(odd HERE)
endif()
add_subdirectory(plugins/cone)
add_subdirectory(plugins/arrow)
if(NOT DELASSUS_HAS_base OR DELASSUS_HAS_spare)
  message(FATAL_ERROR "what was found is taken for missing, or the other way round")
endif()
include(cmake/DelassusSummary.cmake)
LISTS
for plugin in cone arrow; do echo "message(FATAL_ERROR built)" >> "$scratch/tree/plugins/$plugin/CMakeLists.txt"; done
cmake -S "$scratch/tree" -B "$scratch/configured" > "$scratch/summary" 2>&1 || { cat "$scratch/summary" >&2; fail "CMake failed"; }
says summary "not built: cone: Solve was not found (Debian: libsolve-dev)"
says summary "not built: arrow: Solve was not found (Debian: libsolve-dev)"
says summary 'left out: Spare [parts; of 3.1 was not found (Debian: libspare-dev): no files of spares: none, "at all"'
printf 'solver\tcone\tSolve was not found (Debian: libsolve-dev)\nsolver\tarrow\tSolve was not found (Debian: libsolve-dev)\n' > "$scratch/expected"
printf 'part\tSpare [parts; of 3.1\tSpare [parts; of 3.1 was not found (Debian: libspare-dev): no files of spares: none, "at all"\n' >> "$scratch/expected"
diff "$scratch/expected" "$scratch/configured/not-built.list"
if cmake -S "$scratch/tree" -B "$scratch/configured" -DFORGET=ON > "$scratch/summary" 2>&1; then fail "a row that nobody looks for passed"; fi
says summary "nothing says whether odd was found"

echo "== the table of this tree"
while IFS='|' read -r row for need packages name without rest; do
    [ -n "$name" ] && [ -z "$rest" ] || fail "a row has six columns: $row"
    [[ $for =~ ^\ *(run|python|test|ci)\ *$ ]] || fail "$row: for is $for"
    [[ $need =~ ^\ *(required|optional)\ *$ ]] || fail "$row: need is $need"
done < <(grep -v '^#' "$source/cmake/dependencies.txt")
echo "all rows are read"
