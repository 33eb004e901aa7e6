#!/usr/bin/env bash
# Installs the build into a folder of its own and builds a program outside the tree against it.
# Arguments: the build folder, the source folder, the compiler.
set -euo pipefail
build=$1 source=$2 compiler=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/installed" >"$work/log" || { cat "$work/log"; exit 1; }
cmake -S "$source/tests/install/consumer" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/installed" \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE=Release >>"$work/log" || { cat "$work/log"; exit 1; }
cmake --build "$work/build" >>"$work/log" || { cat "$work/log"; exit 1; }
{ read -r scenes; read -r assets; } <"$work/build/folders"
env -u LD_LIBRARY_PATH "$work/build/program" "$scenes/sphere_press.json" "$assets"
