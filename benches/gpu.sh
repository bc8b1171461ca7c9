#!/usr/bin/env bash
# The multiply on this machine's graphics adapters against its processor: prints tables.
# Builds the crate of the multiply and nothing else. SNAPIN_WRITE_DOCS=1 writes them into docs/performance.md.
set -euo pipefail
cd "$(dirname "$0")/.."
exec cargo bench --locked -p snapin-gpu --bench adapters "$@"
