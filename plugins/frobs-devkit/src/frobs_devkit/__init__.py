"""Tools for plugin authors.

testing/           the conformance kit
doctor/            problems of robot files and plugins
parity/            certificates: how closely two simulators agree
robot_sheet/       images of a robot at home and at its limits
scaffold/          new plugins from templates
bench.py           time of a step, by part
bench_training.py  time of a training run, by part
scaling/           speed and memory by environments, threads, processes and nodes
cli/               the commands
"""
