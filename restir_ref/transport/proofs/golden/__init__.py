"""Golden vectors of paths: small scenes, primary samples, and all that a renderer makes of them, as JSON.

For those who port path tracing with ReSTIR to a GPU and want unit tests without Python in the renderer.  Worlds bring
the scenes (`flatland2d.golden`, `tracer3d.golden`); `docs/golden.md` explains the fields.
"""
