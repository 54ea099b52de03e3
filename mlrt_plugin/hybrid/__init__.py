"""Mitsuba's own shading on this package's hits: for scenes that are not native throughout.

Sensors, samplers, textures, BSDFs and emitters are Mitsuba's, in the variant `llvm_ad_rgb`.
The closest hit and the shadow test of all triangle meshes come from the kd-tree.
"""
