"""Figures of [MCMC]."""
