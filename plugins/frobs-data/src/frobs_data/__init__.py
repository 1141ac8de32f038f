"""Robot data sets in the format LeRobotDataset v3.0: write, read, check and edit them, and train on them.

layout.py     features, episodes and paths of a data set
dataset.py    reads a data set
writer.py     writes a data set, one episode at a time
joining.py    combines episodes into large files
recording.py  records policies
importing.py  imports ROS bags, with bags.py, bag_topics.py, bag_episodes.py and mirror.py
operated.py   records people, alone or instead of a policy
twin.py       identifies delay, noise and tracking of a recorded robot
video.py      encodes, decodes and copies videos
stats.py      statistics of features
training.py   arrays for learning algorithms
edit.py       merge, split, check and export data sets
cli/          commands
"""

from typing import TYPE_CHECKING

from frobs_cli.lazy_names import lazy_names

if TYPE_CHECKING:
    from frobs_data.dataset import Dataset as Dataset
    from frobs_data.edit import check as check
    from frobs_data.edit import merge as merge
    from frobs_data.edit import split as split
    from frobs_data.errors import DataError as DataError
    from frobs_data.importing import import_bags as import_bags
    from frobs_data.layout import Episode as Episode
    from frobs_data.layout import Feature as Feature
    from frobs_data.recording import record as record
    from frobs_data.replaying import Replay as Replay
    from frobs_data.replaying import replay as replay
    from frobs_data.training import training_arrays as training_arrays
    from frobs_data.twin import Twin as Twin
    from frobs_data.twin import identify as identify
    from frobs_data.writer import DatasetWriter as DatasetWriter

__all__, __getattr__ = lazy_names(__name__, __file__)
