"""What Python gives, as TOML: the crates read and check it as they do a file's."""

import json
import math
from typing import Any, Mapping


def value(item: Any) -> str:
    """An item as TOML of one line."""
    if isinstance(item, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {value(one)}" for key, one in item.items()) + " }"
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, str):
        # TOML's escapes in quotes are those of JSON
        return json.dumps(item)
    if isinstance(item, (list, tuple)) or hasattr(item, "tolist") and getattr(item, "ndim", 0) > 0:
        return "[" + ", ".join(value(one) for one in item) + "]"
    if hasattr(item, "__index__"):
        return str(int(item))
    number = float(item)
    # `repr` of a float survives the round trip
    return repr(number) if math.isfinite(number) else str(number)


def document(entries: Mapping[str, Any]) -> str:
    """A document of one line for each key; those that are None are left out."""
    lines = [f"{key} = {value(item)}\n" for key, item in entries.items() if item is not None]
    return "".join(lines)
