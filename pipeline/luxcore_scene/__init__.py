"""Builds a LuxCore scene from an exported scene, as properties of its scene description."""
