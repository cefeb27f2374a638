# What the tests of the package share: a scratch folder that goes away at the end.
# shellcheck shell=bash
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
here=$(dirname "$(realpath "$0")")
flags=${CONSUMER_FLAGS:-}  # of the consumer's compiler: a sanitized library wants them
