"""Renders a scene with MLRT and with Mitsuba and sets images and timings side by side."""
