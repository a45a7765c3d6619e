#!/usr/bin/env python3
"""Writes weights.safetensors: 6-64-64-9, uniform in +-1/sqrt(inputs) as PyTorch's Linear, from a 64-bit LCG of seed 6."""
import json
import struct
import sys

state = 6


def uniform(spread):
    global state
    state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
    return ((state >> 40) / 2**23 - 1.0) * spread


widths = [6, 64, 64, 9]
tensors, data = {}, b""
for layer, (inputs, outputs) in enumerate(zip(widths, widths[1:])):
    for name, shape in (("weight", [outputs, inputs]), ("bias", [outputs])):
        count = shape[0] * (shape[1] if len(shape) > 1 else 1)
        values = struct.pack(f"<{count}f", *(uniform(inputs**-0.5) for _ in range(count)))
        tensors[f"fc{layer}.{name}"] = {
            "dtype": "F32", "shape": shape, "data_offsets": [len(data), len(data) + len(values)]}
        data += values
header = json.dumps(tensors, separators=(",", ":")).encode()
header += b" " * (-len(header) % 8)
with open(sys.argv[1] if len(sys.argv) > 1 else "weights.safetensors", "wb") as file:
    file.write(struct.pack("<Q", len(header)) + header + data)
