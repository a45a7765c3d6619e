#!/bin/sh
# What action.yml runs: finds or builds policyc, compares the files, and leaves annotations and a summary.
# Inputs stand in POLICYC_POLICY, POLICYC_GENERATED, POLICYC_PROGRAM and POLICYC_VERSION.
set -eu

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

program=${POLICYC_PROGRAM:-}
if [ -z "$program" ]; then
    # outside of the scratch folder: a second step of the job finds it built
    root=${RUNNER_TEMP:-$scratch}/policyc
    if [ -n "${POLICYC_VERSION:-}" ]; then
        cargo install --locked --quiet --root "$root" --version "$POLICYC_VERSION" policyc
    else
        cargo install --locked --quiet --root "$root" --path "$GITHUB_ACTION_PATH/cli"
    fi
    program=$root/bin/policyc
fi

status=0
"$program" verify --drift-only --annotations github --report "markdown=$scratch/summary.md" \
    --generated="$POLICYC_GENERATED" -- "$POLICYC_POLICY" || status=$?

if [ -n "${GITHUB_STEP_SUMMARY:-}" ]; then
    if [ -f "$scratch/summary.md" ]; then
        cat "$scratch/summary.md" >>"$GITHUB_STEP_SUMMARY"
    else
        printf '## policyc verify: nothing could be compared\n\nThe log of the step says why.\n' >>"$GITHUB_STEP_SUMMARY"
    fi
fi
exit "$status"
