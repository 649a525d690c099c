"""Notebooks for people who render, and the plain functions behind them, which need neither Jupyter nor widgets."""
