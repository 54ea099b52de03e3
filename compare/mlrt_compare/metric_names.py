"""What the metrics of two images are called, on the command line and in JSON."""

from __future__ import annotations

METRICS = ("abs", "mean_abs", "rmse", "relmse", "smape", "energy", "psnr", "ssim", "flip")
BETTER_LARGER = ("psnr", "ssim")
