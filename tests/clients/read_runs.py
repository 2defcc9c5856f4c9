#!/usr/bin/env python3
"""Reads runs.parquet of a campaign with pandas and with polars, and checks that both see the same table.

    python3 tests/clients/read_runs.py FOLDER RUNS
"""

import sys
from pathlib import Path

import pandas
import polars


def main():
    folder, runs = Path(sys.argv[1]), int(sys.argv[2])
    table = pandas.read_parquet(folder / "runs.parquet")
    other = polars.read_parquet(folder / "runs.parquet")
    columns = pandas.read_csv(folder / "columns.csv", keep_default_na=False)
    assert table.shape == other.shape == (runs, len(columns)), (table.shape, other.shape, len(columns))
    assert list(table.columns) == other.columns == list(columns["column"])
    assert list(table["run"]) == other["run"].to_list() == list(range(runs))
    for name in columns["column"]:
        one = table[name].dropna()
        assert one.to_list() == other[name].drop_nulls().to_list(), name
        number = columns["unit"][columns["column"] == name].item() not in ("", "1")
        assert not number or one.empty or pandas.api.types.is_numeric_dtype(one), name
    for csv in folder.glob("*.csv"):
        one = pandas.read_csv(csv, keep_default_na=False, na_values=[""])
        other = pandas.read_parquet(csv.with_suffix(".parquet"))
        one.columns = [name.split(" [")[0] for name in one.columns]
        pandas.testing.assert_frame_equal(one, other, check_dtype=False, check_exact=True)
    lost = int((table["outcome"] == "lost").sum())
    summary = pandas.read_csv(folder / "summary.csv")
    assert lost == summary["lost"].sum(), (lost, summary)
    print(f"{runs} runs, {len(columns)} columns, {lost} lost: pandas and polars agree")


if __name__ == "__main__":
    main()
