"""Kilauea: a production renderer for USD."""
