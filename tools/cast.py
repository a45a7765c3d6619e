#!/usr/bin/env python3
"""A moving picture of a command, from a real run in a terminal, such as docs/pictures/demo.svg.

    pip install pyte
    tools/cast.py docs/pictures/demo.svg 100x30 'policyc demo --steps 2000'

The command runs in a pseudo-terminal of that width, and pyte plays the terminal. Each line appears when it appeared in the run; pauses are cut
to a second and a half, and lines that come faster than the eye can follow are held for a tenth of a second. What does not play animations, such as
print, shows the end.
"""

import fcntl
import html
import os
import pty
import select
import struct
import sys
import termios
import time

import pyte

SCROLLBACK = 400
CHARACTER, LINE, MARGIN = 7.8, 18, 12
BACK, FRONT = "#16181d", "#d8dbe2"
COLORS = {
    "red": "#ff7b72", "green": "#7ee787", "brown": "#e3b341", "blue": "#79c0ff", "magenta": "#d2a8ff", "cyan": "#76e3ea", "white": "#f0f3f6",
}
LONGEST_PAUSE, SHORTEST = 1.5, 0.1


def record(command, columns):
    """The rows that the command left on a terminal without end, and for each the time in s at which it had first something in it."""
    screen = pyte.Screen(columns, SCROLLBACK)
    stream = pyte.ByteStream(screen)
    stream.feed(f"$ {command}\r\n".encode())
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ.update(TERM="xterm-256color", COLUMNS=str(columns), LINES=str(SCROLLBACK))
        os.execvp("sh", ["sh", "-c", command])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", SCROLLBACK, columns, 0, 0))
    started, seen = time.monotonic(), {}
    while True:
        if not select.select([terminal], [], [], 0.05)[0]:
            continue
        try:
            data = os.read(terminal, 65536)
        except OSError:
            break
        if not data:
            break
        stream.feed(data)
        for row in range(screen.cursor.y + 1):
            seen.setdefault(row, time.monotonic() - started)
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if code != 0:
        sys.exit(f"`{command}` ended with {code}")
    rows = [[screen.buffer[y][x] for x in range(columns)] for y in range(screen.cursor.y)]
    return rows, [seen.get(row, 0.0) for row in range(len(rows))]


def paced(times):
    """The times of a run that can be followed."""
    now, before, out = 0.0, times[0], []
    for at in times:
        now += min(max(at - before, SHORTEST), LONGEST_PAUSE)
        before = at
        out.append(now)
    return out


def spans(row):
    """A row as runs of one colour."""
    runs = []
    for cell in row:
        style = (COLORS.get(cell.fg.removeprefix("bright"), FRONT), cell.bold)
        if runs and runs[-1][0] == style:
            runs[-1][1] += cell.data
        else:
            runs.append([style, cell.data])
    if runs:
        runs[-1][1] = runs[-1][1].rstrip()
    text = ""
    for (color, bold), part in runs:
        fill = "" if color == FRONT else f' fill="{color}"'
        weight = ' font-weight="bold"' if bold else ""
        text += f"<tspan{fill}{weight}>{html.escape(part)}</tspan>" if fill or weight else html.escape(part)
    return text


def drawn(command, rows, times, columns, lines):
    width, height = columns * CHARACTER + 2 * MARGIN, lines * LINE + 2 * MARGIN
    whole = times[-1] + 0.1
    steps = [f"{100 * at / whole:.2f}%{{transform:translateY({-max(0, n + 1 - lines) * LINE}px)}}" for n, at in enumerate(times) if n + 1 > lines]
    end = -max(0, len(rows) - lines) * LINE
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height}" role="img" aria-label="{html.escape(command)} in a terminal">',
        f"<style>text{{font:13px ui-monospace,Menlo,Consolas,'DejaVu Sans Mono',monospace;fill:{FRONT};white-space:pre}}"
        f".all{{transform:translateY({end}px);animation:s {whole:.1f}s step-end backwards}}.all text{{animation:a .01s step-end backwards}}"
        "@keyframes a{from{visibility:hidden}}"
        f"@keyframes s{{0%{{transform:translateY(0)}}{''.join(steps)}}}"
        "@media (prefers-reduced-motion:reduce){.all,.all text{animation:none}}</style>",
        f'<rect width="{width:.0f}" height="{height}" rx="8" fill="{BACK}"/>',
        f'<svg x="{MARGIN}" y="{MARGIN}" width="{columns * CHARACTER:.0f}" height="{lines * LINE}"><g class="all">',
    ]
    for n, (row, at) in enumerate(zip(rows, times)):
        text = spans(row)
        if text:
            delay = f' style="animation-delay:{at:.2f}s"' if n else ""
            out.append(f'<text y="{n * LINE + 14}"{delay} textLength="{len("".join(c.data for c in row).rstrip()) * CHARACTER:.1f}">{text}</text>')
    out.append("</g></svg></svg>")
    return "\n".join(out) + "\n"


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    target, size, command = sys.argv[1:]
    columns, lines = map(int, size.split("x"))
    rows, times = record(command, columns)
    text = drawn(command, rows, paced(times), columns, lines)
    with open(target, "w", encoding="utf-8") as file:
        file.write(text)
    print(f"{target}: {len(rows)} lines, {paced(times)[-1]:.1f} s, {len(text) / 1024:.0f} kB")


main()
