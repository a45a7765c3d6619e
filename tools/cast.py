#!/usr/bin/env python3
"""A moving picture of a command, from a real run in a terminal, such as docs/pictures/demo.gif.

    pip install pyte pillow
    tools/cast.py docs/pictures/demo.gif 104x30 'policyc demo --steps 2000'

The command runs in a pseudo-terminal of that size, and pyte plays the terminal. Every line becomes a frame. Pauses longer than two seconds are
cut to two, and lines that come faster than the eye can follow stay for a tenth of a second. The font is DejaVu Sans Mono.
"""

import os
import pty
import select
import struct
import sys
import time

import fcntl
import pyte
import termios
from PIL import Image, ImageDraw, ImageFont

FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSansMono.ttf"
SIZE = 13
BACK, FRONT = "#16181d", "#d8dbe2"
COLORS = {
    "default": FRONT, "black": "#16181d", "red": "#ff7b72", "green": "#7ee787", "brown": "#e3b341", "blue": "#79c0ff",
    "magenta": "#d2a8ff", "cyan": "#76e3ea", "white": "#f0f3f6",
}
LONGEST_PAUSE, SHORTEST_FRAME, LAST_FRAME = 2.0, 0.1, 6.0


def snapshot(screen):
    """What the screen shows, as rows of (character, colour, bold)."""
    return tuple(
        tuple((screen.buffer[y][x].data, screen.buffer[y][x].fg, screen.buffer[y][x].bold) for x in range(screen.columns))
        for y in range(screen.lines)
    )


def record(command, columns, lines):
    """Pairs of time in s and what the screen showed then."""
    screen = pyte.Screen(columns, lines)
    stream = pyte.ByteStream(screen)
    stream.feed(f"$ {command}\r\n".encode())
    pid, terminal = pty.fork()
    if pid == 0:
        os.environ.update(TERM="xterm-256color", COLUMNS=str(columns), LINES=str(lines))
        os.execvp("sh", ["sh", "-c", command])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
    started = time.monotonic()
    frames = [(0.0, snapshot(screen))]
    while True:
        ready, _, _ = select.select([terminal], [], [], 0.05)
        if not ready:
            continue
        try:
            data = os.read(terminal, 65536)
        except OSError:
            break
        if not data:
            break
        for line in data.splitlines(keepends=True):
            stream.feed(line)
            shown = snapshot(screen)
            if shown != frames[-1][1]:
                frames.append((time.monotonic() - started, shown))
    _, status = os.waitpid(pid, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        sys.exit(f"`{command}` ended with {os.waitstatus_to_exitcode(status)}")
    return frames


def held(frames):
    """Pairs of a screen and how long it stays in s."""
    ends = [at for at, _ in frames[1:]]
    stays = [min(max(end - at, SHORTEST_FRAME), LONGEST_PAUSE) for (at, _), end in zip(frames, ends)] + [LAST_FRAME]
    stays[0] = max(stays[0], 1.0)
    return [(shown, stay) for (_, shown), stay in zip(frames, stays)]


def painted(shown, font):
    width, height = round(font.getlength("m")), SIZE + 5
    image = Image.new("RGB", (len(shown[0]) * width + 16, len(shown) * height + 16), BACK)
    draw = ImageDraw.Draw(image)
    for y, row in enumerate(shown):
        for x, (character, color, bold) in enumerate(row):
            if character.strip():
                color = COLORS.get(color.removeprefix("bright"), f"#{color}" if len(color) == 6 else FRONT)
                at = (8 + x * width, 8 + y * height)
                draw.text(at, character, font=font, fill=color, stroke_width=0)
                if bold:
                    draw.text((at[0] + 0.5, at[1]), character, font=font, fill=color)
    return image.quantize(colors=24)


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    target, size, command = sys.argv[1:]
    columns, lines = map(int, size.split("x"))
    font = ImageFont.truetype(FONT, SIZE)
    frames = held(record(command, columns, lines))
    images = [painted(shown, font) for shown, _ in frames]
    stays = [round(stay * 1000) for _, stay in frames]
    images[0].save(target, save_all=True, append_images=images[1:], duration=stays, loop=0, optimize=True)
    print(f"{target}: {len(images)} frames, {sum(stays) / 1000:.1f} s, {os.path.getsize(target) / 1024:.0f} kB")


main()
