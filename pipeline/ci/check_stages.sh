#!/bin/sh
# Checks every stage of a list and leaves a report of each:
#
#   check_stages.sh LIST REPORTS [OPTION ...]
#
# A line of LIST is a stage and the options of `kilauea check` for it, without spaces in any word;
# empty lines and lines that begin with # are skipped. Stages and references are relative to the
# working directory. The options after REPORTS go to every check.
#
# Exit code: 0 where all pass; 1 where one differs, or could not be told; 2 or more where a check
# could not be made, which is worse, since then nobody knows.
set -u

if [ $# -lt 2 ]; then
    echo "usage: check_stages.sh LIST REPORTS [OPTION ...]" >&2
    exit 2
fi
list=$1
reports=$2
shift 2
options=$*

if [ ! -r "$list" ]; then
    echo "check_stages.sh: $list cannot be read" >&2
    exit 2
fi
mkdir -p "$reports" || exit 2

worst=0
number=0
while read -r stage own_options || [ -n "$stage" ]; do
    case $stage in '' | \#*) continue ;; esac
    number=$((number + 1))
    name=$(basename "$stage")
    report=$reports/$(printf '%02d' $number)-${name%.*}
    # Both lists of options are meant to be split into words.
    # shellcheck disable=SC2086
    kilauea check "$stage" --report "$report" $own_options $options </dev/null
    code=$?
    [ $code -gt $worst ] && worst=$code
done <"$list"

if [ $number -eq 0 ]; then
    echo "check_stages.sh: $list names no stage" >&2
    exit 2
fi
exit $worst
