//! Comma-separated values to a [`Table`], or the errors in them.

use super::{BREAKPOINTS_MAX, INPUTS_MAX, Input, Outside, Table, TableText};
use host_io::problem::{Problem, problem};

/// A row of numbers and its line.
type Row = (usize, Vec<f64>);

pub(super) fn read(text: &TableText) -> Result<Table, Problem> {
    let n = text.inputs.len();
    if !(1..=INPUTS_MAX).contains(&n) {
        return Err(problem!("inputs = {n} names, expected 1 to {INPUTS_MAX}"));
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

fn header(text: &TableText, line: &str) -> Result<Vec<String>, Problem> {
    let header: Vec<String> = line.split(',').map(|name| name.trim().to_owned()).collect();
    let n = text.inputs.len();
    if header.len() <= n || header[..n] != text.inputs[..] {
        let expected = text.inputs.join(", ");
        return Err(problem!(
            "line 1: header {line:?}, expected {expected} and then the name of at least one function"
        ));
    }
    for (i, name) in header.iter().enumerate() {
        if header[..i].contains(name) {
            return Err(problem!(
                "line 1: the column {name} stands twice, expected one column for each name"
            ));
        }
    }
    Ok(header)
}

fn numbers(line: usize, text: &str, header: &[String]) -> Result<Row, Problem> {
    let cells: Vec<&str> = text.split(',').map(str::trim).collect();
    if cells.len() != header.len() {
        let (found, expected) = (cells.len(), header.len());
        return Err(problem!("line {line}: {found} values, expected {expected} as in the header"));
    }
    let number = |(cell, column): (&&str, &String)| match cell.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(problem!("line {line}: {column} = {cell:?}, expected a finite number")),
    };
    Ok((line, cells.iter().zip(header).map(number).collect::<Result<_, _>>()?))
}

/// Breakpoints of an input: its values while the slower inputs stay at their first ones.
fn input(name: &str, rows: &[Row], i: usize) -> Result<Input, Problem> {
    let mut breakpoints: Vec<f64> = Vec::new();
    for (line, row) in rows.iter().take_while(|(_, row)| row[..i] == rows[0].1[..i]) {
        let found = row[i];
        match breakpoints.last() {
            Some(last) if *last == found => {}
            Some(last) if *last > found => {
                return Err(problem!(
                    "line {line}: {name} = {found}, expected more than {last}: breakpoints increase"
                ));
            }
            _ => breakpoints.push(found),
        }
    }
    let found = breakpoints.len();
    if !(2..=BREAKPOINTS_MAX).contains(&found) {
        return Err(problem!("{name} has {found} breakpoints, expected 2 to {BREAKPOINTS_MAX}"));
    }
    Ok(Input { name: name.to_owned(), breakpoints })
}

/// Every combination of breakpoints once, the last input fastest.
fn check_order(inputs: &[Input], rows: &[Row]) -> Result<(), Problem> {
    let expected: usize = inputs.iter().map(|input| input.breakpoints.len()).product();
    for (index, (line, row)) in rows.iter().enumerate().take(expected) {
        let mut rest = index;
        for (i, input) in inputs.iter().enumerate().rev() {
            let expected_value = input.breakpoints[rest % input.breakpoints.len()];
            rest /= input.breakpoints.len();
            if row[i] != expected_value {
                let (name, found) = (&input.name, row[i]);
                return Err(problem!("line {line}: {name} = {found}, expected {expected_value}"));
            }
        }
    }
    if rows.len() != expected {
        let counts: Vec<String> =
            inputs.iter().map(|input| input.breakpoints.len().to_string()).collect();
        return Err(problem!(
            "{} rows of values, expected {expected}: one for each combination of {} breakpoints",
            rows.len(),
            counts.join(" x ")
        ));
    }
    Ok(())
}

fn odd_in(text: &TableText, inputs: &[Input]) -> Result<Option<usize>, Problem> {
    let Some(name) = &text.odd_in else { return Ok(None) };
    let index = inputs.iter().position(|input| input.name == *name && input.breakpoints[0] == 0.0);
    match index {
        Some(index) if text.outside == Outside::Clamp => Ok(Some(index)),
        _ => Err(problem!(
            "odd_in = {name:?}, expected an input whose first breakpoint is 0, in a table with outside = \"clamp\""
        )),
    }
}

/// An odd function is zero at zero.
fn check_odd(header: &[String], rows: &[Row], n: usize, odd: usize) -> Result<(), Problem> {
    for (line, row) in rows.iter().filter(|(_, row)| row[odd] == 0.0) {
        if let Some(k) = (n..row.len()).find(|k| row[*k] != 0.0) {
            return Err(problem!(
                "line {line}: {} = {}, expected 0 at {} = 0: the functions are odd in it",
                header[k],
                row[k],
                header[odd]
            ));
        }
    }
    Ok(())
}
