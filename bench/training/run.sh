#!/bin/sh
# Control steps per second of the two trainers, in turn, on one core. See README.md.
set -eu
pairs=${1:-5}
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
venv=${CARGO_TARGET_DIR:-$root/target}/bench-training
cd "$root"
if ! [ -e "$venv/ready" ]; then
    echo "installing stable-baselines3 into $venv ..." >&2
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet torch stable-baselines3 && touch "$venv/ready"
fi
cargo build --release --quiet -p policyc-train --example throughput
ours=${CARGO_TARGET_DIR:-target}/release/examples/throughput
pin=$(command -v taskset >/dev/null && echo "taskset -c 0" || true)
export OMP_NUM_THREADS=1 MKL_NUM_THREADS=1
echo "pair  policyc steps/s  with looks  Stable-Baselines3 steps/s  ratio  with looks"
n=1
while [ "$n" -le "$pairs" ]; do
    a=$($pin "$ours" examples/train/paper12.toml 1 | tail -1 | cut -d' ' -f1)
    # as a user runs it: the n-th seed of the file to its end
    w=$($pin "$ours" examples/train/paper12.toml "$n" whole | tail -1 | cut -d' ' -f1)
    b=$($pin "$venv/bin/python" "$here/sb3.py" 3000)
    awk -v n="$n" -v a="$a" -v w="$w" -v b="$b" \
        'BEGIN { printf "%4d  %15d  %10d  %25d  %5.2f  %10.2f\n", n, a, w, b, a / b, w / b }'
    n=$((n + 1))
done
