"""Reads Parquet files of strangers within limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
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


def read_table(
    path: Path,
    limit: str,
    rows: int,
    columns: Iterable[str] | Callable[[list[str]], Iterable[str]],
    bounds: tuple[str, int, int] | None = None,
) -> pa.Table:
    """Read columns of a Parquet file. Texts are read as dictionaries, see :func:`text_lists`.

    Args:
        path: The file.
        limit: Key of :data:`~frobs_data.budgets.BUDGET` with the size limit.
        rows: Maximum number of rows.
        columns: Names of the columns, or a function that chooses them.
        bounds: Name of a column, and the smallest and largest value of interest. Row groups without such values are
            skipped.

    Raises:
        DataError: The file is missing or damaged, exceeds a limit, or lacks a column.
    """
    try:
        check_regular(path, BUDGET[limit])
        file = pq.ParquetFile(path)
        leaves = [file.schema.column(index) for index in range(len(file.schema))]
        if texts := [leaf.path for leaf in leaves if leaf.physical_type == "BYTE_ARRAY"]:
            file = pq.ParquetFile(path, read_dictionary=texts)
        groups = [file.metadata.row_group(index) for index in range(file.num_row_groups)]
        values = sum(group.column(index).num_values for group in groups for index in range(group.num_columns))
        size, count = max(values, sum(group.total_byte_size for group in groups)), file.metadata.num_rows
        if size > BUDGET[limit]:
            raise DataError(path, f"the table has {size:,} bytes; the limit is {BUDGET[limit]:,}.")
        if not 0 <= count <= rows or sum(group.num_rows for group in groups) != count:
            raise DataError(path, f"the table has {count:,} rows; the limit is {rows:,}.")
        names = file.schema_arrow.names
        if len(set(names)) != len(names):
            raise ValueError("several columns have the same name")
        chosen = list(columns(names) if callable(columns) else columns)
        if missing := sorted(set(chosen).difference(names)):
            raise DataError(path, f"the table has no column {', '.join(map(repr, missing))}.")
        selected = [index for index, group in enumerate(groups) if bounds is None or _overlaps(group, bounds)]
        return file.read_row_groups(selected, columns=chosen, use_threads=False)
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
        kind = array.type
        number = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
        if array.null_count or not number:
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
    if pa.types.is_list(array.type):
        lengths = array.value_lengths().fill_null(-1).to_numpy(zero_copy_only=False)
        array = array.flatten()
    texts = array.dictionary.to_pylist() if pa.types.is_dictionary(array.type) and not array.null_count else [None]
    if not all(type(text) is str for text in texts) or np.any(lengths < 0):
        raise DataError(path, "the tasks must be sentences.")
    parts = np.split(array.indices.to_numpy(zero_copy_only=False), np.cumsum(lengths)[:-1])
    return [tuple(texts[index] for index in part) for part in parts] if len(column) else []


def damaged(path: Path, error: BaseException) -> DataError:
    """Return the error for a file that cannot be read."""
    return DataError(path, f"the file is missing or damaged: {_line(error)}; download or record it again.")


def _line(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return str(text).splitlines()[0].rstrip(".")[:300]
