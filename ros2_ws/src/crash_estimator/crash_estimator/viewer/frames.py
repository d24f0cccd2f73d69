"""Which samples of a block are drawn where a drawing need not show every one (pure)."""

import numpy as np

FRAMES = 200
"""Pictures of the drawings in one recording; the time plots show every sample."""


def frame_ends(time_ns: np.ndarray, span: tuple[float, float]) -> np.ndarray:
    """Rows that end a frame of the recording, and the last row, so that a slow replay moves with each block."""
    period = max((span[1] - span[0]) / FRAMES * 1e9, 1.0)
    frame = np.floor((time_ns - span[0] * 1e9) / period)
    return np.append(np.flatnonzero(np.diff(frame)), len(time_ns) - 1)
