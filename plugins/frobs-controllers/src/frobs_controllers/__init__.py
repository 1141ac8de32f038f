"""Controllers for joints, tools, grippers and wheeled bases."""
