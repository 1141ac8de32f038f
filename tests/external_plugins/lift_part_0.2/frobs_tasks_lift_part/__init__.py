"""The plugin of the tutorial "own object, gripper and contact task" of version 0.2, unchanged but for a line break."""
