"""Blocks of Python on a page, run one after the other; a block of `text` behind one shows what it prints."""

import contextlib
import importlib.util
import io
import pathlib
import re
from typing import List, Tuple


def blocks(page: str) -> List[Tuple[str, str, str]]:
    """Code, what is shown behind it, and the library without which it is left out."""
    found = []
    for match in re.finditer(r"^```(\w*)[^\n]*\n(.*?)^```$", page, re.MULTILINE | re.DOTALL):
        language, text = match[1], match[2]
        if language == "python":
            needs = re.match(r"# needs: (\w+)", text)
            found.append([text, "", needs[1] if needs else ""])
        elif language == "text" and found and not found[-1][1]:
            found[-1][1] = text
    return [tuple(block) for block in found]


def is_in(shown: str, printed: str) -> bool:
    """Whether each line that is shown was printed, in this order; `...` stands for any text."""
    rest = iter(printed.splitlines())
    for line in shown.splitlines():
        pattern = ".*".join(re.escape(part) for part in line.split("..."))
        if line.strip() != "..." and not any(re.fullmatch(pattern, other.rstrip()) for other in rest):
            return False
    return True


def run(page: pathlib.Path) -> Tuple[int, int]:
    """Runs a page where the reader is; how many blocks ran and how many were left out."""
    names, ran, left_out = {"__name__": "__main__"}, 0, 0
    for code, shown, needs in blocks(page.read_text(encoding="utf-8")):
        if needs and importlib.util.find_spec(needs) is None:
            left_out += 1
            continue
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(code, str(page), "exec"), names)
        assert is_in(shown, out.getvalue()), f"{code}\nshows\n{shown}\nand prints\n{out.getvalue()}"
        ran += 1
    return ran, left_out
