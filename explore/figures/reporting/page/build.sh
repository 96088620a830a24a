#!/usr/bin/env bash
# Bundle the script of the report's page, and scripts and styles of the service's pages, which are made of the same
# modules: run after a change of anything in src of either or of the lock file, and commit bundle/ of both.
# Needs npm. `tests/test_report.py` fails when the bundle is older than its sources.
set -euo pipefail
cd "$(dirname "$0")"

npm ci --no-audit --no-fund
browser=../../../service/page
mkdir -p bundle "$browser/bundle"
node_modules/.bin/esbuild src/main.js --bundle --minify --format=iife --global-name=exploreReport --target=es2022 \
    --charset=ascii --legal-comments=none --metafile=bundle/meta.json --outfile=bundle/report.js
# The service's modules find d3 here: they lie outside of this folder.
for page in browse jobs; do
    NODE_PATH=$PWD/node_modules node_modules/.bin/esbuild "$browser/src/$page.js" --bundle --minify --format=esm --target=es2022 \
        --charset=ascii --legal-comments=none --metafile="bundle/$page.json" --outfile="$browser/bundle/$page.js"
    node_modules/.bin/esbuild "$browser/src/$page.css" --bundle --minify --outfile="$browser/bundle/$page.css"
done

# esbuild drops the licences of what it bundles: the texts of exactly those modules go beside it.
: >bundle/THIRD_PARTY.txt
for module in $(grep -oh '"node_modules/[^"]*"' bundle/meta.json bundle/browse.json bundle/jobs.json | cut -d/ -f2 | LC_ALL=C sort -u); do
    version=$(node -p "require('./node_modules/$module/package.json').version")
    printf '%s %s\n\n' "$module" "$version" >>bundle/THIRD_PARTY.txt
    cat "node_modules/$module/LICENSE" >>bundle/THIRD_PARTY.txt
    printf '\n%s\n\n' "----" >>bundle/THIRD_PARTY.txt
done
rm bundle/meta.json bundle/browse.json bundle/jobs.json
cp bundle/THIRD_PARTY.txt "$browser/bundle/"

LC_ALL=C sha256sum build.sh package.json package-lock.json page.css src/*.js "$browser"/src/* >bundle/sources.sha256
wc -c bundle/report.js "$browser"/bundle/*
