# How programs for Windows are tried, for scripts to source: begin_wine PREFIX, then `wine PROGRAM` any number of times, then end_wine, which
# also runs when the script exits. The prefix is complete before the first program starts, and one wine server lasts until the last has ended.
# One script at a time uses a prefix. The server of a script that was killed ends by itself after 60 s without a program.

begin_wine() { # prefix
    export WINEPREFIX=$1 WINEDEBUG=-all,err+all # Debian's `wine` gives advice on every start unless this begins with -all
    mkdir -p "$WINEPREFIX"
    end_wine # of a script that was killed
    trap end_wine EXIT
    wineserver -p60 && wine wineboot --init
}

end_wine() {
    wineserver -k || true # fails where none runs
    wineserver -w
    trap - EXIT
}
