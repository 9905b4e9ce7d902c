"""What `kilauea bench` measures, one module per subcommand."""
