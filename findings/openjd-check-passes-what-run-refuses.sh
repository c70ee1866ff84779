#!/usr/bin/env bash
# openjd-cli 0.8.0 with openjd-model 0.13.0 (PyPI).
#
# A PATH parameter with an absolute default, or one that leads up with `..`: one would expect `openjd check`, which
# validates templates, to say what `openjd run` will refuse.
#
# `check` passes both, and `run` refuses both ("Default paths must be relative"), unless a value is given with `-p`: only
# then the default is not looked at. A template without a default says at once what has to be given.
set -uo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv" && "$work/venv/bin/pip" install -q openjd-cli==0.8.0 openjd-model==0.13.0 openjd-sessions==0.13.0 ||
    { echo "not run: the packages cannot be installed"; exit 0; }
cd "$work" || exit 1
openjd=$work/venv/bin/openjd
template() {
    cat <<YAML
specificationVersion: jobtemplate-2023-09
name: paths
parameterDefinitions:
- {name: Input, type: PATH${1:+, default: "$1"}}
steps:
- name: Show
  script: {actions: {onRun: {command: echo, args: ["seen {{Param.Input}}"]}}}
YAML
}
result() { if "$@" >log 2>&1; then echo passes; else echo refuses; fi; }
seen=""
for default in /srv/input.txt ../input.txt ""; do
    template "$default" >job.yaml
    given=()
    [ -n "$default" ] || given=(-p Input=/srv/input.txt)
    seen="$seen${default:-none}: check $(result "$openjd" check job.yaml), run $(result "$openjd" run job.yaml --step Show "${given[@]}"); "
    template "$default" >job.yaml
    [ -z "$default" ] || seen="${seen}with -p: $(result "$openjd" run job.yaml --step Show -p Input=/srv/input.txt); "
done
echo "$("$openjd" --version 2>&1): $seen"
case $seen in
    "/srv/input.txt: check passes, run refuses; "*"none: check passes, run passes; ") ;;
    *) exit 1 ;;
esac
