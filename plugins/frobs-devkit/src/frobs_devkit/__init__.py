"""Tools for plugin authors.

testing/           the conformance kit
doctor/            problems in robot files and plugins
parity/            certificates of how closely simulators agree
probe/             what importing a plugin does, examined in a separate process
robot_sheet/       images of a robot in its home position and at its limits
scaffold/          new plugins from templates
simulations.py     a simulation of one robot
bench.py           time of each part of an environment step
bench_training.py  time of each part of a training run
scaling/           speed and memory for different numbers of environments, threads, processes and nodes
cli/               the commands
"""
