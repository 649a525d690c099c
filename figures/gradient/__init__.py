"""Figures of [GPT]."""
