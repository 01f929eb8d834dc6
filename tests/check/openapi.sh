#!/usr/bin/env bash
# api/openapi.yaml passes Redocly's linter. It is fetched once, at one version, into the user's cache.
set -eu
cd "$(dirname "$0")/../.."
version=1.34.5
command -v npm >/dev/null || { echo "npm is not installed"; exit 77; }
cache=${XDG_CACHE_HOME:-$HOME/.cache}/pelt/redocly-$version
if [ ! -x "$cache/node_modules/.bin/redocly" ]; then
    mkdir -p "$(dirname "$cache")"
    scratch=$(mktemp -d "$cache.XXXXXX")
    trap 'rm -rf "$scratch"' EXIT
    if ! npm install --prefix "$scratch" --loglevel=error --no-audit --no-fund --no-update-notifier \
        "@redocly/cli@$version" >"$scratch.log" 2>&1; then
        tail -n 5 "$scratch.log"
        rm -f "$scratch.log"
        echo "the linter cannot be fetched: npm has no @redocly/cli $version to give"
        exit 77
    fi
    rm -f "$scratch.log"
    mv -T "$scratch" "$cache" 2>/dev/null || [ -x "$cache/node_modules/.bin/redocly" ]
fi
REDOCLY_TELEMETRY=off REDOCLY_SUPPRESS_UPDATE_NOTICE=true \
    "$cache/node_modules/.bin/redocly" lint --config tests/check/redocly.yaml api/openapi.yaml
