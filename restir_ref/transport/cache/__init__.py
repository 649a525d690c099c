"""Irradiance stored in space, at the end of paths: probes, and what resampling makes of them.  [DDGIR 3]

Read `field`, the two lines that the rest of transport may ask of a cache, then `grid`, `maps`, `volume` (what a query
tells), `update` (what a frame adds) and `converge`; `biases` says where queries look, `storage` keeps a volume.
"""
