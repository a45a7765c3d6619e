"""How pages are shown in a notebook."""

import html


def framed(page: str, height: int = 600) -> str:
    """A page of its own inside of another: its style must not leave it, nor that of the notebook get in."""
    return f'<iframe srcdoc="{html.escape(page, quote=True)}" width="100%" height="{height}" style="border:0"></iframe>'
