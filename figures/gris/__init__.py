"""Figures of [GRIS]."""
