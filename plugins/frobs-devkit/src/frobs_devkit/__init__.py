"""Tools for plugin authors.

testing/           the conformance kit
doctor/            problems of robot files and plugins
parity/            certificates: how closely two simulators agree
robot_sheet/       a robot drawn at home and at its limits
scaffold/          new plugins from templates
bench.py           where the time of a step goes
bench_training.py  where the time of a training run goes
scaling/           how the speed grows with environments, threads, processes and nodes
cli/               the commands
"""
