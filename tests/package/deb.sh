#!/usr/bin/env bash
# Makes the Debian packages of the build, installs them into an empty root, and uses what is there as strangers would: the
# lines of README.md, programs and a plugin that are built against the development package.
# usage: deb.sh BUILD SOURCE. Exits with 77 where the tools are missing, but for CI.
set -euo pipefail
build=$(realpath "$1")
source=$(realpath "$2")
. "$(dirname "$0")/common.sh"
fail() { echo "$*" >&2; exit 1; }

for tool in cpack dpkg-deb dpkg-shlibdeps file; do
    command -v "$tool" >/dev/null && continue
    [ -z "${CI:-}" ] || fail "$tool was not found"
    echo "skipped: $tool was not found; scripts/install-dependencies ci installs it"
    exit 77
done

cpack --config "$build/CPackConfig.cmake" -B "$scratch/packages" >"$scratch/log" 2>&1 || { cat "$scratch/log" >&2; exit 1; }

echo "== the packages"
names=(libdelassus delassus-plugins delassus libdelassus-dev)
if grep -q '^set(CPACK_COMPONENTS_ALL .*python' "$build/CPackConfig.cmake"; then names+=(python3-delassus); fi
if grep -q '^set(CPACK_COMPONENTS_ALL .*importers' "$build/CPackConfig.cmake"; then names+=(delassus-importers); fi
files=()
for name in "${names[@]}"; do
    file=$(echo "$scratch/packages/${name}"_*_"$(dpkg --print-architecture)".deb)
    [ -f "$file" ] || fail "no package $name was made"
    files+=("$file")
    for field in Version Section Maintainer Description; do
        [ -n "$(dpkg-deb -f "$file" "$field")" ] || fail "$name has no $field"
    done
    dpkg-deb -c "$file" >"$scratch/$name.contents"
    size=$(awk '/^-/ { size += int(($3 + 1023) / 1024) } !/^-/ { size += 1 } END { print size }' "$scratch/$name.contents")
    [ "$(dpkg-deb -f "$file" Installed-Size)" = "$size" ] || fail "$name: Installed-Size is not $size"
    if grep -vE '^[^ ]+ root/root .* \./(usr/.*)?$' "$scratch/$name.contents"; then fail "$name has files outside /usr, or not root's"; fi
    grep -q " ./usr/share/doc/$name/copyright$" "$scratch/$name.contents" || fail "$name has no copyright file"
    printf '%s: %s kB; depends on %s; recommends %s\n' "$name" "$(($(stat -c %s "$file") / 1024))" \
        "$(dpkg-deb -f "$file" Depends)" "$(dpkg-deb -f "$file" Recommends)"
done
depends() { dpkg-deb -f "$scratch/packages/$1"_*.deb Depends; }
[[ $(depends libdelassus) == *libyaml-cpp* ]] || fail "libdelassus does not depend on what it links"
[[ $(depends delassus) == *"libdelassus (="* ]] || fail "delassus does not depend on its library"
[[ $(depends libdelassus)$(depends delassus) != *@(petsc|mumps|mpi|siconos)* ]] || fail "a solver's library is needed without the solver"

echo "== installing"
root=$scratch/root
mkdir -p "$root"/{etc,var/lib/dpkg/{info,updates}}
if [ "$(id -u)" -eq 0 ]; then
    # The root's database of packages is this machine's, so that dpkg checks the dependencies against what is installed here.
    cp /var/lib/dpkg/status "$root/var/lib/dpkg/status"
    (cd /var/lib/dpkg/info && printf '%s\0' *.list) | (cd "$root/var/lib/dpkg/info" && xargs -0 touch)
    mkdir "$scratch/bin"
    printf '#!/bin/sh\nexec /sbin/ldconfig -r "$DPKG_ROOT"\n' >"$scratch/bin/ldconfig"
    chmod +x "$scratch/bin/ldconfig"
    PATH=$scratch/bin:$PATH dpkg --root="$root" --force-script-chrootless -i "${files[@]}"
else
    for file in "${files[@]}"; do dpkg-deb -x "$file" "$root"; done
fi

# Together they hold what `cmake --install` installs, and their copyright files.
cmake --install "$build" --prefix "$scratch/prefix" >/dev/null
# Completions for zsh are in a folder of Debian's own, where they come from a package.
files_of() { (cd "$1" && find . ! -type d | sed 's|zsh/vendor-completions|zsh/site-functions|' | sort); }
for document in man/man1/delassus.1 bash-completion/completions/delassus zsh/vendor-completions/_delassus \
    fish/vendor_completions.d/delassus.fish; do
    [ -s "$root/usr/share/$document" ] || fail "the package delassus has no $document"
done
diff <(files_of "$scratch/prefix") <(files_of "$root/usr" | grep -v '/copyright$') || fail "the packages and the install tree differ"
rm -r "$scratch/prefix"
if find "$root/usr" -type f \( -name '*.so*' -o -path '*/bin/*' \) -exec ldd {} + | grep 'not found'; then fail "libraries are missing"; fi

echo "== README.md"
"$here/readme-lines.sh" "$root/usr" "$source"
echo "== against the development package"
"$here/consume.sh" "$root/usr" "$source"
