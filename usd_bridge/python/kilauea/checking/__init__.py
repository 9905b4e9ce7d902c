"""Whether a stage renders as a reference does: the tests behind `kilauea check`."""
