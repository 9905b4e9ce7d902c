"""Builds a Blender scene for Cycles from an exported scene.

Runs inside Blender's Python (`bpy`) only.
"""
