#!/bin/sh
# Installs packages into a virtual environment, and prints every five seconds what pip is doing.
# Usage: install.sh PYTHON ARGUMENTS_OF_PIP_INSTALL
set -eu

python=$1
shift
venv=$(dirname "$(dirname "$python")")
log=$venv/install.log

report() {
  doing=$(grep -aE '^ *(Collecting|Downloading|Building|Installing collected)' "$log" | tail -n 1 | sed 's/^ *//; s/ (from.*//; s/ (pyproject.*//')
  case $doing in
  Installing*) # the newest package, not the list of all
    newest=$(ls -td "$venv"/lib/python*/site-packages/*.dist-info 2>/dev/null | head -n 1)
    doing="Installed $(basename "${newest:-pip}" .dist-info)"
    ;;
  esac
  echo "  $(du -sm "$venv" | cut -f 1) MB  $(printf '%.70s' "$doing")"
}

: >"$log"
(while sleep 5 && kill -0 $$ 2>/dev/null; do report; done) &
trap "kill $! 2>/dev/null || true" EXIT
# Without --no-compile, pip would compile all modules, which takes as long as the rest of the installation.
if ! PIP_DISABLE_PIP_VERSION_CHECK=1 "$python" -m pip --no-input install --no-compile --progress-bar off \
  --constraint constraints.txt "$@" >>"$log" 2>"$log.errors"; then
  cat "$log.errors" >&2
  exit 1
fi
