"""An episode as a picture, drawn on an array: no library of charts is asked for."""

from typing import List, Sequence, Tuple

import numpy as np

HEIGHT, WIDTH, MARGIN = 240, 400, 8
VOLTAGE, DUTY, FRAME = (31, 98, 168), (196, 92, 28), (190, 190, 190)


def _curve(image: np.ndarray, values: Sequence[float], top: int, bottom: int, colour: Tuple[int, int, int]) -> None:
    """One curve over the width between two rows, scaled to its own ends."""
    numbers = np.nan_to_num(np.asarray(values, float))
    low, high = float(numbers.min()), float(numbers.max())
    span = high - low or 1.0
    left, right = MARGIN, WIDTH - MARGIN
    columns = np.arange(left, right)
    at = np.interp(columns, np.linspace(left, right - 1, len(numbers)), numbers)
    rows = np.rint(bottom - 2 - (at - low) / span * (bottom - top - 4)).astype(int)
    for column, (before, row) in zip(columns, zip([rows[0], *rows[:-1]], rows)):
        image[min(before, row) : max(before, row) + 2, column] = colour
    image[top, left:right] = image[bottom, left:right] = FRAME
    image[top : bottom + 1, left] = image[top : bottom + 1, right - 1] = FRAME


def picture(history: List[Tuple[float, float]]) -> np.ndarray:
    """Output voltage above and duty below, each over its own range; shape ``(240, 400, 3)``, ``uint8``."""
    image = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    voltage, duty = zip(*history)
    middle = HEIGHT * 2 // 3
    _curve(image, voltage, MARGIN, middle - MARGIN // 2, VOLTAGE)
    _curve(image, duty, middle + MARGIN // 2, HEIGHT - MARGIN, DUTY)
    return image
