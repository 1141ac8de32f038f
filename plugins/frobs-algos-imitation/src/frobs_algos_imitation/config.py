"""Settings of the algorithms."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveFloat, PositiveInt

from frobs_algos.settings import Fraction, Settings


class ImitationConfig(Settings):
    """Settings that every algorithm accepts.

    Attributes:
        history: Number of observations that the policy sees, each with the action before it. More than 1 gives the
            policy a memory.
        net_arch: Widths of the hidden layers.
        learning_rate: Learning rate at the beginning. It decreases to 0 along a cosine.
        weight_decay: Weight decay of the optimizer AdamW.
        batch_size: Number of samples per update.
        image_shift: Maximum distance by which pictures are randomly shifted in an update [pixels].
        image_color: Maximum relative amount by which the contrast and brightness of pictures are randomly changed in an
            update.
        torch_threads: Number of threads for PyTorch.
    """

    history: PositiveInt = 1
    net_arch: list[PositiveInt] = Field(default=[256, 256, 256], min_length=1)
    learning_rate: PositiveFloat = 1e-3
    weight_decay: NonNegativeFloat = 1e-4
    batch_size: PositiveInt = 256
    image_shift: NonNegativeInt = 2
    image_color: Fraction = 0.0
    torch_threads: PositiveInt = 1


class CloningConfig(ImitationConfig):
    """Settings of behavior cloning, in which a training step is one update of the network.

    Attributes:
        demonstrations: Folder of a recorded data set, or the name or path of a policy that plays the demonstrations,
            such as ``expert``.
        demonstration_episodes: Number of episodes that a policy plays. A data set is used as a whole.
        demonstration_mapping: YAML file that maps observation terms to the columns of a data set that FRobs did not
            record, or None.
    """

    demonstrations: str = "expert"
    demonstration_episodes: PositiveInt = 100
    demonstration_mapping: str | None = None


class DaggerConfig(ImitationConfig):
    """Settings of DAgger.

    Attributes:
        expert: Name or path of the policy that labels the visited states, such as ``expert``, or a list with the folders
            of data sets in which a person acted.
        expert_share: Share of the steps in which the expert acts after the first round. It decreases linearly to 0
            during the training run.
        updates: Number of updates after each round. In a round, every environment plays an episode.
        final_updates: Number of updates after the last round.
    """

    expert: str | Annotated[list[str], Field(min_length=1)] = "expert"
    expert_share: Fraction = 0.3
    updates: PositiveInt = 1200
    final_updates: PositiveInt = 3600


class ChunkConfig(CloningConfig):
    """Settings of action chunking.

    Attributes:
        chunk: Number of future actions that the network predicts.
        width: Width of the transformer.
        heads: Number of attention heads, which must divide ``width``.
        encoder_layers: Number of layers that encode the observations.
        decoder_layers: Number of layers that decode the actions.
        ensemble: Decay rate m of the weights exp(−m·i) with which predictions of the same action are averaged, where
            the oldest prediction has i = 0.
    """

    batch_size: PositiveInt = 64
    chunk: PositiveInt = 10
    width: PositiveInt = 64
    heads: PositiveInt = 4
    encoder_layers: PositiveInt = 1
    decoder_layers: PositiveInt = 1
    ensemble: NonNegativeFloat = 0.01
