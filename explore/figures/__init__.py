"""What people look at: charts, the report, drawings and exported motions."""
