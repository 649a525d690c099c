"""Figures of [DDGIR]."""
