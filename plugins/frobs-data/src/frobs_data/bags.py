"""Reads ROS 2 bags (MCAP and SQLite) within limits, with the library ``rosbags``.

Definitions of message types in a bag are not used, because ``rosbags`` would generate code from them. Only the types of
ROS 2's own packages can be read.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from frobs_core.util.errors import FrobsError
from frobs_core.util.files import check_regular
from frobs_core.util.install_hints import local_install_hint
from frobs_core.util.yaml import load_yaml
from frobs_data.budgets import BAG_BUDGET
from frobs_data.errors import DataError

_REPAIR = "record it again, or repair its index with 'ros2 bag reindex'"
_MOST_PADDING = 64  # [bytes]
_SUFFIXES = (".mcap", ".db3")


class Bag:
    """A bag of ROS 2, open for reading. Use it as a context manager.

    Args:
        path: Folder with ``metadata.yaml``, or one ``.mcap`` or ``.db3`` file.

    Attributes:
        path: The path.
        topics: Message type of each topic that has messages.

    Raises:
        DataError: The bag is missing, damaged or incomplete, exceeds a limit, or ``rosbags`` is not installed.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        try:
            from rosbags.rosbag2 import Reader
        except ModuleNotFoundError as error:
            hint = local_install_hint("pip install 'frobs-data[bags]'")
            raise DataError(path, f"bags are read with the package rosbags; install it with: {hint}") from error
        for file in self._files():
            self._check_file(file)
        _limit_decompression()
        self._reader = self._guard(lambda: Reader(self.path))
        self._guard(self._reader.open)
        try:
            if self._reader.message_count > (most := BAG_BUDGET["messages"]):
                raise DataError(path, f"the bag has {self._reader.message_count:,} messages; the limit is {most:,}.")
            self.topics: Mapping[str, str] = {
                each.topic: each.msgtype for each in self._reader.connections if each.msgcount
            }
            if len(self.topics) > (most := BAG_BUDGET["topics"]):
                raise DataError(path, f"the bag has {len(self.topics):,} topics; the limit is {most:,}.")
            if not self.topics:
                raise DataError(path, "the bag contains no messages; record some first.")
            self._start = self._reader.start_time
        except BaseException:
            self.close()
            raise

    def messages(self, topics: Collection[str]) -> Iterator[tuple[float, str, Any]]:
        """Yield the time since the start of the bag [s], the topic and the message, for all messages of some topics.

        The time is the time at which the message was recorded. Messages are sorted by time within a topic.

        Raises:
            DataError: A message is damaged or too large, or its type is not one of ROS 2's own packages.
        """
        chosen = [each for each in self._reader.connections if each.topic in topics and each.msgcount]
        found = iter(self._guard(lambda: self._reader.messages(chosen)) if chosen else ())
        latest: dict[str, float] = {}
        while (item := self._guard(lambda: next(found, None))) is not None:
            connection, nanoseconds, data = item
            time, topic = 1e-9 * (nanoseconds - self._start), connection.topic
            if len(data) > (most := BAG_BUDGET["bytes of a message"]):
                raise DataError(self.path, f"a message of '{topic}' has {len(data):,} bytes; the limit is {most:,}.")
            if time < latest.get(topic, 0.0):
                raise DataError(self.path, f"the messages of '{topic}' are not sorted by time; {_REPAIR}.")
            latest[topic] = time
            what = f"the message of '{topic}' at {time:.3f} s cannot be read as {connection.msgtype}"
            yield time, topic, self._guard(partial(self._deserialize, bytes(data), connection.msgtype), what)

    def close(self) -> None:
        """Close the files."""
        self._reader.close()

    def __enter__(self) -> Bag:
        """Return the bag."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the files."""
        self.close()

    @cached_property
    def _types(self) -> Any:
        from rosbags.typesys import Stores, get_typestore

        return get_typestore(Stores.ROS2_JAZZY)

    def _deserialize(self, data: bytes, kind: str) -> Any:
        """Return a message. Unlike in rosbags, bytes may follow it, because ROS 2 reserves some for alignment."""
        if len(data) < 4 or data[0] != 0 or data[1] not in (0, 1):
            raise ValueError("its encoding is not plain CDR")
        definition = self._types.get_msgdef(kind)
        read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        message, size = read(memoryview(data)[4:], 0, definition.cls, self._types)
        if len(data) - 4 - size > _MOST_PADDING:
            raise ValueError(f"{len(data) - 4 - size:,} bytes follow it")
        return message

    def _files(self) -> list[Path]:
        """Return the files with messages, after checking what ``metadata.yaml`` says about them."""
        if not self.path.is_dir():
            if self.path.suffix not in _SUFFIXES:
                advice = "specify a folder that 'ros2 bag record' has written, or one .mcap or .db3 file"
                problem = "is not a bag" if self.path.exists() else "does not exist"
                raise DataError(self.path, f"the file {problem}; {advice}.")
            return [self.path]
        metadata = self.path / "metadata.yaml"
        if not metadata.is_file():
            files = [str(file) for file in sorted(self.path.iterdir()) if file.suffix in _SUFFIXES]
            advice = _REPAIR + (f", or import the file {files[0]}" if len(files) == 1 else "")
            raise DataError(self.path, f"the folder has no metadata.yaml, so its recording did not end; {advice}.")
        content = load_yaml(metadata).get("rosbag2_bagfile_information")
        content = content if isinstance(content, dict) else {}
        names = content.get("relative_file_paths")
        if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
            raise DataError(metadata, f"the names of the bag's files are missing; {_REPAIR}.")
        if str(content.get("compression_mode") or "none").lower() != "none":
            advice = "decompress it with 'ros2 bag convert'; MCAP's own compression is supported"
            raise DataError(self.path, f"the bag is compressed as a whole or message by message; {advice}.")
        return [self.path / Path(name).name for name in names]

    def _check_file(self, file: Path) -> None:
        try:
            check_regular(file, BAG_BUDGET["bytes of a file"])
        except OSError as error:
            raise DataError(file, f"the file cannot be read: {error.strerror}.") from error
        if file.suffix == ".db3":
            self._guard(lambda: _check_database(file))

    def _guard(self, read: Callable[[], Any], what: str = "the bag is damaged or incomplete") -> Any:
        """Call a function of ``rosbags``, which raises all kinds of errors for damaged files."""
        try:
            return read()
        except FrobsError:
            raise
        except Exception as error:
            reason = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
            raise DataError(self.path, f"{what}: {reason}; {_REPAIR}.") from error


def _check_database(file: Path) -> None:
    """Reject databases in which reading a table would execute something: only plain tables are expected."""
    with closing(sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)) as connection:
        for kind, name, sql in connection.execute("SELECT type, name, sql FROM sqlite_master"):
            text = str(sql or "").upper()
            if kind not in ("table", "index") or "VIRTUAL" in text or "GENERATED" in text or " AS " in text:
                raise DataError(file, f"the database contains '{name}', which is not a plain table.")
        count, largest = connection.execute("SELECT count(*), max(length(data)) FROM messages").fetchone()
        for what, found in (("messages", count), ("bytes of a message", largest or 0)):
            if found > BAG_BUDGET[what]:
                raise DataError(file, f"the bag exceeds the limit of {BAG_BUDGET[what]:,} {what}.")


def _limit_decompression() -> None:
    """Make ``rosbags`` decompress no more than the size that a chunk of an MCAP file claims, within the limit."""
    import lz4.frame
    from rosbags.rosbag2 import storage_mcap

    def limited(decompressor: Callable[[], Any]) -> Callable[[bytes, int], bytes]:
        def decompress(data: bytes, size: int) -> bytes:
            if size > (most := BAG_BUDGET["bytes of a chunk, decompressed"]):
                raise ValueError(f"a chunk has {size:,} bytes; the limit is {most:,}")
            return bytes(decompressor().decompress(data, max_length=max(1, size)))

        return decompress

    storage_mcap.DECOMPRESSORS.update(
        lz4=limited(lz4.frame.LZ4FrameDecompressor), zstd=limited(vars(storage_mcap)["zstd"].ZstdDecompressor)
    )
