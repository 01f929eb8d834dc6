#!/usr/bin/env bash
# Every example is a scene that the reader accepts; those of examples/later/ are what this version
# answers with 501, the others are what it draws.
set -eu
cd "$(dirname "$0")/../.."
build=${1:-build}
make --no-print-directory BUILD="$build" "$build/tests/tools/scene_check" >/dev/null
tool=$build/tests/tools/scene_check
"$tool" api/examples/*.json api/examples/later/*.json
for scene in api/examples/*.json api/examples/later/*.json; do
    answer=$({ wc -c <"$scene"; cat "$scene"; } | "$tool")
    case $scene in
    */later/*) wanted=false ;;
    *) wanted=true ;;
    esac
    if [[ $answer == *'"not_implemented":[]'* ]]; then drawn=true; else drawn=false; fi
    if [ $drawn != $wanted ]; then
        echo "$scene: drawn $drawn, wanted $wanted: ${answer:0:200}"
        exit 1
    fi
done
