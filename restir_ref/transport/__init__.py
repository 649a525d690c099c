"""Light transport in d dimensions: paths from primary samples, BSDF lobes, shifts.  [GRIS 7-8]

Nothing here knows whether d is 2 or 3.  A world hands in a `Space` (how to make frames and sample
balls, simplices and visible normals in its dimension), surfaces, and sensors.  Read `vectors`,
`space`, `lobes`, `materials`, `scene`, `rays`, then `paths`, `record` and `shifts`; `restir_pt` plugs them
into the passes: that is the renderer, and it needs nothing of the two folders.  `baselines` are what it is
compared with; `proofs` says the same at length, and judges shifts of your own.
"""
