"""A contract as data, and as text: what :func:`policyc.export` fills in."""

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from . import _toml

#: A normalisation of one observation: ``clip(scale * o + offset)``, and half the width of the clip (or None).
Affine = Tuple[float, float, Optional[float]]


def filters(given: Sequence[Any]) -> List[Any]:
    """Filters as a contract writes them, from what an inspection says."""
    written: List[Any] = []
    for one in given:
        if isinstance(one, str):
            written.append(one)
            continue
        [(word, fields)] = one.items()
        plain = word in ("delay", "moving_average")
        written.append({word: fields["samples"] if plain and isinstance(fields, Mapping) else fields})
    return written


def normalised(feature: Mapping[str, Any], affine: Affine) -> Dict[str, Any]:
    """The feature whose observation is that of `feature`, normalised: one affine map and one clip again."""
    scale, offset, limit = affine
    found = dict(feature)
    found["scale"] = feature.get("scale", 1.0) * scale
    found["offset"] = feature.get("offset", 0.0) * scale + offset
    ends = feature.get("clip")
    low, high = (-float("inf"), float("inf")) if ends is None else (scale * end + offset for end in ends)
    if limit is not None:
        # two clips one after the other are one, since the map between them rises
        low, high = min(max(low, -limit), limit), max(min(high, limit), -limit)
    found["clip"] = None if high == float("inf") else [low, high]
    return found


def stacked(features: Sequence[Mapping[str, Any]], count: int) -> List[Dict[str, Any]]:
    """The features whose observation is the last `count` of `features`, the oldest first. A delay begins with what it sees first."""
    found = [dict(feature) for feature in features]
    for back in range(1, count):
        delayed = [
            {**feature, "name": f"{feature['name']}_back{back}", "filters": [*(feature.get("filters") or []), {"delay": back}]}
            for feature in features
        ]
        found = delayed + found
    return found


def _actions(data: Mapping[str, Any]) -> Dict[str, Any]:
    """The entries of ``[actions]``; none where an action is a number, whose scale the model says."""
    if data["schedule"] is not None:
        raise ValueError(
            "the network of this contract gives the gains of a law, which a model does not say: save the model, and write the law with "
            "`policyc new MODEL --gains`"
        )
    if data["law"] is not None:
        return {key: entry for key, entry in data["law"].items() if entry is not None}
    return {"duties": data["duties"]} if data["duties"] else {}


def from_inspection(data: Mapping[str, Any]) -> Dict[str, Any]:
    """The entries of a contract from what the package says of one."""
    pair = lambda ends: None if ends is None else [ends["low"], ends["high"]]  # noqa: E731
    limits = dict(data["limits"])
    limits["duty"] = pair(limits["duty"])
    return {
        "name": data["name"],
        "sample_period": data["sample_period"],
        "numeric_format": data["numeric_format"],
        "parameters": data["parameters"],
        "signals": [
            {"name": s["name"], "unit": s["unit"], "range": pair(s["range"]), "adc": s["adc"]} for s in data["signals"]
        ],
        "observers": data["observers"],
        "features": [
            {
                "name": f["name"],
                "source": f["source_text"],
                "filters": filters(f["filters"]),
                "scale": f["scale"],
                "offset": f["offset"],
                "clip": pair(f["clip"]),
            }
            for f in data["features"]
        ],
        "actions": _actions(data),
        "mapping": data["mapping"],
        "limits": limits,
        "fallback": data["fallback"],
    }


def _table(title: str, entries: Mapping[str, Any]) -> str:
    return f"\n{title}\n{_toml.document(entries)}"


def text(contract: Mapping[str, Any], network: str, about: Sequence[str]) -> str:
    """The text of ``policy.toml``; `network` is that of its section."""
    out = "".join(f"# {line}\n" for line in about)
    head = {name: contract.get(name) for name in ("name", "sample_period", "numeric_format")}
    out += _toml.document(head)
    if contract.get("parameters"):
        out += _table("[parameters]", contract["parameters"])
    for signal in contract["signals"]:
        out += _table("[[signal]]", signal)
    for observer in contract.get("observers", []):
        out += _table("[[observer]]", observer)
    for feature in contract["features"]:
        shown = {key: value for key, value in feature.items() if value != []}
        if shown.get("scale") == 1.0:
            del shown["scale"]
        if shown.get("offset") == 0.0:
            del shown["offset"]
        out += _table("[[feature]]", shown)
    out += f"\n[network]\n{network}"
    out += _table("[actions]", contract["actions"])
    if contract.get("mapping"):
        out += _table("[mapping]", contract["mapping"])
    out += _table("[limits]", contract["limits"])
    return out + _table("[fallback]", contract["fallback"])


def mapping_file(files: Sequence[str]) -> Optional[str]:
    """The mapping among the files of a contract."""
    found = [file for file in files[1:] if file.endswith(".toml")]
    return os.path.abspath(found[0]) if found else None
