"""Light transport in d dimensions: paths from primary samples, BSDF lobes, shifts.  [GRIS 7-8]

Nothing here knows whether d is 2 or 3.  A world hands in a `Space` (how to make frames and sample
balls, simplices and visible normals in its dimension), surfaces, and sensors.  Read `vectors`,
`space`, `lobes`, `materials`, `scene`, `rays`, then `paths`, `record` and `shifts`; `restir_pt` plugs them
into the passes.  `reading` and `direction_measure` say the same at length, `copies` and `judge` are for
shifts of your own, `path_reuse`, `restir_gi` and `restir_di` for comparisons.
"""
