"""Encodes, decodes and copies videos with PyAV."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.errors import ParameterValueError
from frobs_data.errors import DataError
from frobs_data.layout import Feature, VideoPart
from frobs_data.stats import PictureStats

os.environ.setdefault("SVT_LOG", "1")  # SVT-AV1 prints its settings otherwise

import av
import av.error

_OPTIONS = {"libsvtav1": {"preset": "12", "crf": "30"}, "libx264": {"bf": "0", "crf": "23"}}
CODECS = {"libsvtav1": "av1", "libx264": "h264"}
"""Name in ``info.json`` of each supported encoder's codec."""


class Clip:
    """Pictures of one camera during one episode. They are encoded in the background while they are added.

    Use :meth:`DatasetWriter.clip` to make one, and give it to :meth:`DatasetWriter.add` as the column of the camera.

    Args:
        submit: Runs a function in the thread of the writer, which calls :meth:`finish` there.
        path: MP4 file to write.
        fps: Pictures per second [1/s].
        shape: (height, width, 3) of the pictures. Height and width must be even.
        codec: Name of the encoder, a key of :data:`CODECS`.

    Attributes:
        length: Number of pictures.
        stats: Their statistics, when they have been encoded.
    """

    def __init__(
        self, submit: Callable[[Callable[[], object]], None], path: Path, fps: int, shape: tuple[int, ...], codec: str
    ) -> None:
        self.path, self.length, self.stats = path, 0, PictureStats()
        self._submit, self._fps, self._shape, self._codec = submit, fps, shape, codec
        self._box: Any = None

    def append(self, picture: np.ndarray[Any, Any]) -> None:
        """Add a picture, (height, width, 3) uint8. The array may be changed afterwards.

        Raises:
            ParameterValueError: The picture has the wrong shape or data type.
            DataError: Writing failed earlier.
        """
        if np.shape(picture) != self._shape or picture.dtype != np.uint8:
            raise ParameterValueError("picture", np.shape(picture), f"a picture of shape {self._shape}, uint8")
        copied, number = np.array(picture), self.length
        self.length += 1
        self._submit(lambda: self._encode(copied, number))

    def discard(self) -> None:
        """Delete the pictures, because the episode is not recorded."""
        self._submit(self._delete)

    def finish(self) -> None:
        """Complete the video."""
        self._box.mux(self._stream.encode())
        self._box.close()

    def _encode(self, picture: np.ndarray[Any, Any], number: int) -> None:
        time_base = Fraction(1, self._fps)
        if self._box is None:
            self._box = av.open(str(self.path.absolute()), "w")
            self._stream = self._box.add_stream(
                self._codec, rate=self._fps, options={"g": "2", **_OPTIONS[self._codec]}
            )
            self._stream.height, self._stream.width = self._shape[:2]
            self._stream.pix_fmt, self._stream.time_base = "yuv420p", time_base
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame.pts, frame.time_base = number, time_base  # the muxer changes the time base of the stream
        self._box.mux(self._stream.encode(frame))
        self.stats.add(picture)

    def _delete(self) -> None:
        if self._box is not None:
            self._box.close()
        self.path.unlink(missing_ok=True)


def open_video(path: Path) -> Any:
    """Open an MP4 file for reading. No other format is probed, because playlists can name other files.

    Raises:
        DataError: The file is not an MP4 file with a video.
    """
    try:
        box = av.open(str(path.resolve()), format="mp4", options={"protocol_whitelist": "file"})
    except (av.error.FFmpegError, ValueError) as error:
        raise DataError(path, f"the video cannot be read: {_reason(error)}; download or record it again.") from error
    if not box.streams.video:
        box.close()
        raise DataError(path, "the file contains no video; download or record it again.")
    return box


def decode(path: Path, part: VideoPart, length: int, fps: int, feature: Feature) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the pictures of one episode, each (height, width, 3) uint8.

    Args:
        path: The video file.
        part: The episode's part of the file.
        length: Number of pictures.
        fps: Pictures per second [1/s].
        feature: Camera, whose size the pictures must have.

    Raises:
        DataError: The video is damaged, has pictures of another size, or does not contain the episode.
    """
    height, width, _ = feature.shape
    count = 0
    try:
        with open_video(path) as box:
            stream = box.streams.video[0]
            if (stream.height, stream.width) != (height, width):
                found = f"{stream.height} × {stream.width} pixels"
                raise DataError(path, f"the pictures are {found}, not {height} × {width}.")
            stream.codec_context.options = {"max_pixels": str((height + 256) * (width + 256))}
            box.seek(int(part.start / stream.time_base), stream=stream)
            for frame in box.decode(stream):
                time = float(frame.pts * frame.time_base) - part.start if frame.pts is not None else -1.0
                if time < -0.5 / fps:
                    continue
                if count == length or (frame.height, frame.width) != (height, width) or abs(time * fps - count) > 0.5:
                    break
                yield frame.to_ndarray(format="rgb24")
                count += 1
                if count == length:
                    return
    except (av.error.FFmpegError, ValueError, OverflowError, MemoryError) as error:
        raise DataError(path, f"the video is damaged after picture {count}: {_reason(error)}.") from error
    found = f"{count} of {length} pictures"
    raise DataError(path, f"the video contains {found} of an episode that begins at {part.start} s.")


class Packets:
    """Encoded pictures of one episode, which can be copied into another file without decoding.

    Args:
        path: The video file.
        part: The episode's part of the file.
        fps: Pictures per second [1/s].

    Attributes:
        size: Size of the pictures in the file [bytes].
        kind: Properties that all videos of one file must share.

    Raises:
        DataError: The video is damaged, or the episode does not begin with a key frame.
    """

    def __init__(self, path: Path, part: VideoPart, fps: int) -> None:
        try:
            self._box = open_video(path)
            self.stream = stream = self._box.streams.video[0]
            context = stream.codec_context
            self.kind = (context.name, context.width, context.height, context.pix_fmt, bytes(context.extradata or b""))
            base = stream.time_base
            first, last = ((time - 0.5 / fps) / float(base) for time in (part.start, part.end))
            self._box.seek(int(part.start / base), stream=stream)
            packets = [each for each in self._box.demux(stream) if each.pts is not None and each.dts is not None]
            self.packets = [packet for packet in packets if first <= packet.pts < last]
        except (av.error.FFmpegError, ValueError, OverflowError) as error:
            raise DataError(path, f"the video cannot be copied: {_reason(error)}.") from error
        if not self.packets or not self.packets[0].is_keyframe:
            reason = "does not begin with a key frame, so it cannot be cut out"
            raise DataError(path, f"the episode at {part.start} s {reason}.")
        self.path, self.start = path, round(part.start / base)
        self.size = sum(packet.size for packet in self.packets)

    def close(self) -> None:
        """Close the video file."""
        self._box.close()


class Muxer:
    """Joins encoded episodes in one MP4 file.

    Args:
        path: The file.
        like: Packets of the first episode, which determine the codec.
        fps: Pictures per second [1/s].
    """

    def __init__(self, path: Path, like: Packets, fps: int) -> None:
        self._kind, self._size, self._fps, self._length = like.kind, 0, fps, 0
        self._box = av.open(str(path.absolute()), "w")
        self._stream = self._box.add_stream_from_template(like.stream, opaque=True)

    def fits(self, packets: Packets, limit: float) -> bool:
        """Return whether an episode can be appended without exceeding a size limit [bytes]."""
        return self._kind == packets.kind and self._size + packets.size <= limit

    def add(self, packets: Packets, length: int) -> tuple[float, float]:
        """Append the packets of an episode with ``length`` pictures, and return its first and last time [s]."""
        start = self._length / self._fps
        try:
            for packet in packets.packets:
                shift = round(start / packet.time_base) - packets.start
                packet.pts += shift
                packet.dts += shift
                packet.stream = self._stream
                self._box.mux(packet)
        except (ValueError, OverflowError) as error:  # the times of the packets do not increase
            raise DataError(packets.path, f"the video cannot be copied: {_reason(error)}.") from error
        self._length += length
        self._size += packets.size
        packets.close()
        return start, self._length / self._fps

    def close(self) -> None:
        """Complete the file."""
        self._box.close()


def _reason(error: BaseException) -> str:
    return str(getattr(error, "strerror", None) or error).rstrip(".")
