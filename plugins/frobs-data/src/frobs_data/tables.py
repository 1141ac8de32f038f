"""Reads Parquet files of strangers within limits."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from frobs_core.util.files import check_regular
from frobs_data.budgets import BUDGET
from frobs_data.errors import DataError
from frobs_data.layout import Feature

_DAMAGE = (pa.ArrowException, OSError, ValueError, KeyError, TypeError, MemoryError)


def open_table(path: Path, limit: str, rows: int, text: str = "") -> pq.ParquetFile:
    """Open a Parquet file.

    Args:
        path: The file.
        limit: Key of :data:`~frobs_data.budgets.BUDGET` with the size limit.
        rows: Maximum number of rows.
        text: Column of texts for :func:`text_lists`.

    Raises:
        DataError: The file is missing or damaged, or exceeds a limit.
    """
    try:
        check_regular(path, BUDGET[limit])
        file = pq.ParquetFile(path)
        leaves = [file.schema.column(index).path for index in range(len(file.schema))]
        if texts := [leaf for leaf in leaves if leaf.partition(".")[0] == text]:
            file = pq.ParquetFile(path, read_dictionary=texts)
        meta = file.metadata
        groups = [meta.row_group(index) for index in range(meta.num_row_groups)]
        columns = [group.column(index) for group in groups for index in range(group.num_columns)]
        size = max(sum(group.total_byte_size for group in groups), sum(column.num_values for column in columns))
        if size > BUDGET[limit]:
            raise DataError(path, f"the table has {size:,} bytes; the limit is {BUDGET[limit]:,}.")
        if not 0 <= meta.num_rows <= rows or sum(group.num_rows for group in groups) != meta.num_rows:
            raise DataError(path, f"the table has {meta.num_rows:,} rows; meta/info.json allows {rows:,}.")
    except _DAMAGE as error:
        raise damaged(path, error) from error
    return file


def read_table(
    file: pq.ParquetFile, path: Path, columns: Sequence[str], bounds: tuple[str, int, int] | None = None
) -> pa.Table:
    """Read columns of an open file.

    Args:
        file: The file.
        path: Its path.
        columns: Names of the columns.
        bounds: Name of a column, and the smallest and largest value of interest. Row groups without such values are
            skipped.

    Raises:
        DataError: A column is missing, or the file is damaged.
    """
    present = set(file.schema_arrow.names)
    missing = [name for name in columns if name not in present]
    if missing:
        raise DataError(path, f"the table has no column {', '.join(map(repr, missing))}.")
    try:
        groups = [
            i for i in range(file.num_row_groups) if bounds is None or _overlaps(file.metadata.row_group(i), bounds)
        ]
        return file.read_row_groups(groups, columns=list(columns), use_threads=False)
    except _DAMAGE as error:
        raise damaged(path, error) from error


def _overlaps(group: pq.RowGroupMetaData, bounds: tuple[str, int, int]) -> bool:
    name, low, high = bounds
    for index in range(group.num_columns):
        column = group.column(index)
        if column.path_in_schema == name and (found := column.statistics) is not None and found.has_min_max:
            return bool(found.min <= high and found.max >= low)
    return True


def column_array(column: pa.ChunkedArray, feature: Feature, path: Path, name: str) -> np.ndarray[Any, Any]:
    """Convert a column of numbers to an array, (rows, …), or (rows,) for the shape ``(1,)``.

    Raises:
        DataError: The column does not have the data type or shape that ``meta/info.json`` declares.
    """
    rows, array = len(column), column.combine_chunks()
    try:
        while pa.types.is_nested(array.type):
            if array.null_count:
                raise ValueError("it contains empty values")
            array = array.flatten()
        if array.null_count or not _is_number(array.type):
            raise ValueError("it contains empty values or no numbers")
        values: np.ndarray[Any, Any] = array.to_numpy(zero_copy_only=False)
        return values.astype(feature.dtype, copy=False).reshape(rows, *feature.row_shape)
    except (*_DAMAGE, AttributeError) as error:
        expected = f"{feature.dtype} values of shape {feature.shape}"
        raise DataError(path, f"the column '{name}' must contain {expected}: {_line(error)}.") from error


def text_lists(column: pa.ChunkedArray, path: Path) -> list[tuple[str, ...]]:
    """Convert a column of texts, or of lists of texts, which was read as a dictionary.

    A small file can repeat a long text millions of times, so equal texts share their memory.

    Raises:
        DataError: The column contains something else, or empty values.
    """
    array = column.combine_chunks()
    lengths = np.ones(len(array), np.int64)
    if is_list := pa.types.is_list(array.type):
        lengths = array.value_lengths().fill_null(-1).to_numpy(zero_copy_only=False)
        array = array.flatten()
    if not pa.types.is_dictionary(array.type) or array.null_count or (is_list and np.any(lengths < 0)):
        raise DataError(path, "the tasks must be sentences.")
    texts, indices = array.dictionary.to_pylist(), array.indices.to_numpy(zero_copy_only=False)
    if not all(type(text) is str for text in texts):
        raise DataError(path, "the tasks must be sentences.")
    parts = np.split(indices, np.cumsum(lengths)[:-1])
    return [tuple(texts[index] for index in part) for part in parts] if len(column) else []


def damaged(path: Path, error: BaseException) -> DataError:
    """Return the error for a file that cannot be read."""
    return DataError(path, f"the file is missing or damaged: {_line(error)}; download or record it again.")


def _is_number(kind: pa.DataType) -> bool:
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind))


def _line(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return str(text).splitlines()[0].rstrip(".")[:300]
