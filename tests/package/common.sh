# What the tests of the package share: a scratch folder that goes away at the end.
# shellcheck shell=bash
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
here=$(dirname "$(realpath "$0")")
flags=${CONSUMER_FLAGS:-}  # of the consumer's compiler: a sanitized library wants them
if command -v ccache >/dev/null; then  # wherever the scratch folder is, what was compiled once is known
    export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR=$scratch CCACHE_NOHASHDIR=1
fi
