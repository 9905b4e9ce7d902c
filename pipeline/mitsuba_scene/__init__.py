"""Builds a Mitsuba scene from an exported scene. The variant is chosen before importing this."""
