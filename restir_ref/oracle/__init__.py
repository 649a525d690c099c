"""The exact oracle: expectations enumerated over finite cells, not sampled.

`enumeration` answers `choose` with every option, `cells` are finite integrals, `laws` state
Definition 4.1 for all f at once, `moments` propagates exact variances, `zoo` keeps the classic bugs.
"""
