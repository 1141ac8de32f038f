#!/bin/sh
# Builds the documentation in site/, and prints every five seconds what Sphinx is doing. Usage: build.sh PYTHON
set -eu

log=build/docs.log
mkdir -p build
: >"$log"
(while sleep 5 && kill -0 $$ 2>/dev/null; do printf '  %.100s\n' "$(tail -n 1 "$log")"; done) &
trap "kill $! 2>/dev/null || true" EXIT
"$1" -m sphinx --builder html --fail-on-warning --keep-going --nitpicky --jobs auto --no-color --doctree-dir build/doctrees docs site \
  >"$log"
touch build/docs-built
echo "The documentation is at site/index.html."
