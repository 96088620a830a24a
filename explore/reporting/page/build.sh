#!/usr/bin/env bash
# Bundle the page's script: run after a change of anything in src or of the lock file, and commit bundle/.
# Needs npm. `tests/test_report.py` fails when the bundle is older than its sources.
set -euo pipefail
cd "$(dirname "$0")"

npm ci --no-audit --no-fund
mkdir -p bundle
node_modules/.bin/esbuild src/main.js --bundle --minify --format=iife --global-name=exploreReport --target=es2022 \
    --charset=ascii --legal-comments=none --metafile=bundle/meta.json --outfile=bundle/report.js

# esbuild drops the licences of what it bundles: the texts of exactly those modules go beside it.
: >bundle/THIRD_PARTY.txt
for module in $(grep -o '"node_modules/[^"]*"' bundle/meta.json | cut -d/ -f2 | LC_ALL=C sort -u); do
    version=$(node -p "require('./node_modules/$module/package.json').version")
    printf '%s %s\n\n' "$module" "$version" >>bundle/THIRD_PARTY.txt
    cat "node_modules/$module/LICENSE" >>bundle/THIRD_PARTY.txt
    printf '\n%s\n\n' "----" >>bundle/THIRD_PARTY.txt
done
rm bundle/meta.json

LC_ALL=C sha256sum build.sh package.json package-lock.json src/*.js >bundle/sources.sha256
wc -c bundle/report.js
