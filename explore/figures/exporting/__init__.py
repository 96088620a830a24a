"""A chosen design for CAD and other tools: its study, motion, drawing and animation as files."""
