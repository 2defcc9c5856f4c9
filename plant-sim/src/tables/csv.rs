//! Comma-separated values to a [`Table`], or the errors in them.

use super::{BREAKPOINTS_MAX, INPUTS_MAX, Input, Outside, Table, TableText};

/// Why a table was refused. Lines are counted from 1 at the header of the values.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// Too few or too many inputs.
    #[error("inputs = {found} names, expected 1 to {INPUTS_MAX}")]
    Inputs { found: usize },
    /// The header does not begin with the inputs, or no function follows.
    #[error(
        "line 1: header {found:?}, expected {expected} and then the name of at least one function"
    )]
    Header { found: String, expected: String },
    /// A name occurs twice in the header.
    #[error("line 1: the column {name} stands twice, expected one column for each name")]
    Twice { name: String },
    /// A row with too few or too many values.
    #[error("line {line}: {found} values, expected {expected} as in the header")]
    Columns { line: usize, found: usize, expected: usize },
    /// A value that is not a finite number.
    #[error("line {line}: {column} = {found:?}, expected a finite number")]
    Number {
        line: usize,
        /// Name of the column.
        column: String,
        found: String,
    },
    /// A breakpoint out of order or missing, or an invalid value.
    #[error("line {line}: {column} = {found}, expected {expected}")]
    Breakpoint {
        line: usize,
        /// Name of the column.
        column: String,
        found: f64,
        expected: String,
    },
    /// Wrong number of rows.
    #[error(
        "{found} rows of values, expected {expected}: one for each combination of {breakpoints} breakpoints"
    )]
    Rows {
        found: usize,
        /// The number that the breakpoints require.
        expected: usize,
        /// Breakpoints of each input, as in `5 x 12`.
        breakpoints: String,
    },
    /// An input with a single breakpoint, or too many.
    #[error("{column} has {found} breakpoints, expected 2 to {BREAKPOINTS_MAX}")]
    Breakpoints {
        /// Name of the input.
        column: String,
        found: usize,
    },
    /// The input of `odd_in` does not exist or does not begin at zero.
    #[error(
        "odd_in = {found:?}, expected an input whose first breakpoint is 0, in a table with outside = \"clamp\""
    )]
    Odd { found: String },
}

/// A row of numbers and its line.
type Row = (usize, Vec<f64>);

pub(super) fn read(text: &TableText) -> Result<Table, TableError> {
    let n = text.inputs.len();
    if !(1..=INPUTS_MAX).contains(&n) {
        return Err(TableError::Inputs { found: n });
    }
    let mut lines = text
        .csv
        .trim_start_matches(['\r', '\n'])
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty());
    let header = header(text, lines.next().map_or("", |(_, line)| line))?;
    let rows =
        lines.map(|(line, row)| numbers(line, row, &header)).collect::<Result<Vec<_>, _>>()?;
    let inputs = (0..n).map(|i| input(&header[i], &rows, i)).collect::<Result<Vec<_>, _>>()?;
    check_order(&inputs, &rows)?;
    let odd_in = odd_in(text, &inputs)?;
    if let Some(odd) = odd_in {
        check_odd(&header, &rows, n, odd)?;
    }
    let values = rows.iter().flat_map(|(_, row)| row[n..].iter().copied()).collect();
    Ok(Table { inputs, outside: text.outside, odd_in, functions: header[n..].to_vec(), values })
}

fn header(text: &TableText, line: &str) -> Result<Vec<String>, TableError> {
    let header: Vec<String> = line.split(',').map(|name| name.trim().to_owned()).collect();
    let n = text.inputs.len();
    if header.len() <= n || header[..n] != text.inputs[..] {
        return Err(TableError::Header {
            found: line.to_owned(),
            expected: text.inputs.join(", "),
        });
    }
    for (i, name) in header.iter().enumerate() {
        if header[..i].contains(name) {
            return Err(TableError::Twice { name: name.clone() });
        }
    }
    Ok(header)
}

fn numbers(line: usize, text: &str, header: &[String]) -> Result<Row, TableError> {
    let cells: Vec<&str> = text.split(',').map(str::trim).collect();
    if cells.len() != header.len() {
        return Err(TableError::Columns { line, found: cells.len(), expected: header.len() });
    }
    let number = |(cell, column): (&&str, &String)| match cell.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(TableError::Number { line, column: column.clone(), found: (*cell).to_owned() }),
    };
    Ok((line, cells.iter().zip(header).map(number).collect::<Result<_, _>>()?))
}

/// Breakpoints of an input: its values while the slower inputs stay at their first ones.
fn input(name: &str, rows: &[Row], i: usize) -> Result<Input, TableError> {
    let column = || name.to_owned();
    let mut breakpoints: Vec<f64> = Vec::new();
    for (line, row) in rows.iter().take_while(|(_, row)| row[..i] == rows[0].1[..i]) {
        let found = row[i];
        match breakpoints.last() {
            Some(last) if *last == found => {}
            Some(last) if *last > found => {
                let expected = format!("more than {last}: breakpoints increase");
                return Err(TableError::Breakpoint {
                    line: *line,
                    column: column(),
                    found,
                    expected,
                });
            }
            _ => breakpoints.push(found),
        }
    }
    let found = breakpoints.len();
    if !(2..=BREAKPOINTS_MAX).contains(&found) {
        return Err(TableError::Breakpoints { column: column(), found });
    }
    Ok(Input { name: column(), breakpoints })
}

/// Every combination of breakpoints once, the last input fastest.
fn check_order(inputs: &[Input], rows: &[Row]) -> Result<(), TableError> {
    let expected: usize = inputs.iter().map(|input| input.breakpoints.len()).product();
    for (index, (line, row)) in rows.iter().enumerate().take(expected) {
        let mut rest = index;
        for (i, input) in inputs.iter().enumerate().rev() {
            let expected_value = input.breakpoints[rest % input.breakpoints.len()];
            rest /= input.breakpoints.len();
            if row[i] != expected_value {
                return Err(TableError::Breakpoint {
                    line: *line,
                    column: input.name.clone(),
                    found: row[i],
                    expected: expected_value.to_string(),
                });
            }
        }
    }
    if rows.len() != expected {
        let counts: Vec<String> =
            inputs.iter().map(|input| input.breakpoints.len().to_string()).collect();
        return Err(TableError::Rows {
            found: rows.len(),
            expected,
            breakpoints: counts.join(" x "),
        });
    }
    Ok(())
}

fn odd_in(text: &TableText, inputs: &[Input]) -> Result<Option<usize>, TableError> {
    let Some(name) = &text.odd_in else { return Ok(None) };
    let index = inputs.iter().position(|input| input.name == *name && input.breakpoints[0] == 0.0);
    match index {
        Some(index) if text.outside == Outside::Clamp => Ok(Some(index)),
        _ => Err(TableError::Odd { found: name.clone() }),
    }
}

/// An odd function is zero at zero.
fn check_odd(header: &[String], rows: &[Row], n: usize, odd: usize) -> Result<(), TableError> {
    for (line, row) in rows.iter().filter(|(_, row)| row[odd] == 0.0) {
        if let Some(k) = (n..row.len()).find(|k| row[*k] != 0.0) {
            return Err(TableError::Breakpoint {
                line: *line,
                column: header[k].clone(),
                found: row[k],
                expected: format!("0 at {} = 0: the functions are odd in it", header[odd]),
            });
        }
    }
    Ok(())
}
