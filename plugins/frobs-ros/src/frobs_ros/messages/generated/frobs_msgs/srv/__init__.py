from ._StepWorld import *
