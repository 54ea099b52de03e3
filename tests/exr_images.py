"""EXR files for tests, written without the code that is tested."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR


def write_exr(path: Path, image: np.ndarray, **further: np.ndarray) -> Path:
    """Writes (H, W, 3) as R, G and B and further (H, W) channels by their names, in single
    precision."""
    channels = dict(zip("RGB", np.moveaxis(image, 2, 0), strict=True)) | further
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    planes = {name: np.ascontiguousarray(p, np.float32) for name, p in channels.items()}
    OpenEXR.File(header, planes).write(str(path))
    return path


def picture(seed: int, height: int = 48, width: int = 64) -> np.ndarray:
    """(H, W, 3) float32 of smooth colours with an edge and some texture, all positive."""
    y, x = np.mgrid[0:height, 0:width] / 64
    image = np.stack([0.2 + 0.5 * x, 0.3 + 0.4 * y, 0.4 + 0.2 * x * y], axis=-1)
    image[:, width // 2 :] *= 0.5
    texture = np.random.default_rng(seed).uniform(0.9, 1.1, image.shape)
    return (image * texture).astype(np.float32)
