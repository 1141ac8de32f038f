from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["abb_irb120_reacher"], package_dir={"": "src"}))
