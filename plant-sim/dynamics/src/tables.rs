//! Tables of an airframe file: values over one or more inputs, linear between breakpoints.
//!
//! A table is written as comma-separated values. The first columns are the inputs, the last of them changing
//! fastest; every further column is a function of them. Sums of terms define the use of the functions
//! ([`lookup`], which evaluates sums and tables together).
//!
//! ```toml
//! [[aerodynamics.table]]
//! inputs = ["elevator_deg", "alpha_deg"]
//! outside = "clamp"
//! csv = """
//! elevator_deg, alpha_deg, c_x, c_pitch
//! -24, -10, -0.099, 0.205
//! ..."""
//! ```

use host_io::problem::{At as _, Problem, problem};
use serde::{Deserialize, Serialize};

pub mod aerodynamics;
pub mod lookup;
pub mod thrust;

/// Most inputs of a table.
pub const INPUTS_MAX: usize = 4;

/// Most breakpoints of an input.
pub const BREAKPOINTS_MAX: usize = 200;

/// Most tables in one part of an airframe file.
pub const TABLES_MAX: usize = 64;

/// The value of a table outside its breakpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// The value at the nearest end.
    Clamp,
    /// Extrapolation along the line through the last two breakpoints.
    Extrapolate,
}

/// A table as in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableText {
    /// Names of the inputs with their units, as in the header of the values.
    pub inputs: Vec<String>,
    /// Rule outside the breakpoints.
    pub outside: Outside,
    /// An input, whose breakpoints begin at zero, in which all functions are odd: the value at -x is minus the value
    /// at +x.
    #[serde(default)]
    pub odd_in: Option<String>,
    pub csv: String,
}

/// A valid table: every number finite, breakpoints in order, no row missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Inputs, the first one changing most slowly.
    pub inputs: Vec<Input>,
    /// Rule outside the breakpoints.
    pub outside: Outside,
    /// Index of the input in which the functions are odd.
    pub odd_in: Option<usize>,
    /// Names of the functions.
    pub functions: Vec<String>,
    /// Values row by row, the functions of a row side by side.
    pub values: Vec<f64>,
}

/// An input of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name with unit, as in `alpha_deg`.
    pub name: String,
    /// Values at which the functions are listed, increasing, in the unit of the name.
    pub breakpoints: Vec<f64>,
}

/// Parts with tables in binary files: as the text of a text file, whose keys determine its form.
pub(crate) mod stored {
    use serde::de::{DeserializeOwned, Error as _};
    use serde::ser::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<T: Serialize, S: Serializer>(part: &T, to: S) -> Result<S::Ok, S::Error> {
        if to.is_human_readable() {
            return part.serialize(to);
        }
        serde_json::to_string(part).map_err(S::Error::custom)?.serialize(to)
    }

    pub fn deserialize<'de, T: DeserializeOwned, D: Deserializer<'de>>(
        from: D,
    ) -> Result<T, D::Error> {
        if from.is_human_readable() {
            return T::deserialize(from);
        }
        serde_json::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Reads all tables of a part of the file.
fn read_all(section: &'static str, texts: &[TableText]) -> Result<Vec<Table>, Problem> {
    if texts.len() > TABLES_MAX {
        let found = texts.len();
        return Err(problem!("[[{section}.table]]: {found} tables, expected at most {TABLES_MAX}"));
    }
    let mut tables: Vec<Table> = Vec::new();
    for (index, text) in texts.iter().enumerate() {
        let place = format!("[[{section}.table]] number {}", index + 1);
        let table = text.read().at(&place)?;
        let known = |name: &&String| tables.iter().any(|other| other.functions.contains(name));
        if let Some(name) = table.functions.iter().find(known) {
            return Err(problem!(
                "{place}: the function {name} stands in another table too, expected one for each name"
            ));
        }
        tables.push(table);
    }
    Ok(tables)
}

/// A row of numbers and its line.
type Row = (usize, Vec<f64>);

impl TableText {
    fn read(&self) -> Result<Table, Problem> {
        let n = self.inputs.len();
        if !(1..=INPUTS_MAX).contains(&n) {
            return Err(problem!("inputs = {n} names, expected 1 to {INPUTS_MAX}"));
        }
        // Lines count from the header, also where the text begins with an empty line.
        let mut lines = self
            .csv
            .trim_start_matches(['\r', '\n'])
            .lines()
            .enumerate()
            .map(|(index, line)| (index + 1, line.split('#').next().unwrap_or_default().trim()))
            .filter(|(_, line)| !line.is_empty());
        let header = header(self, lines.next().map_or("", |(_, line)| line))?;
        let rows =
            lines.map(|(line, row)| numbers(line, row, &header)).collect::<Result<Vec<_>, _>>()?;
        let inputs = (0..n).map(|i| input(&header[i], &rows, i)).collect::<Result<Vec<_>, _>>()?;
        check_order(&inputs, &rows)?;
        let mut odd_in = None;
        if let Some(name) = &self.odd_in {
            let is_it = |input: &Input| input.name == *name && input.breakpoints[0] == 0.0;
            let odd = inputs.iter().position(is_it).filter(|_| self.outside == Outside::Clamp);
            let odd = odd.ok_or_else(|| {
                problem!(
                    "odd_in = {name:?}, expected an input whose first breakpoint is 0, in a table with outside = \"clamp\""
                )
            })?;
            check_odd(&header, &rows, n, odd)?;
            odd_in = Some(odd);
        }
        let values = rows.iter().flat_map(|(_, row)| row[n..].iter().copied()).collect();
        Ok(Table { inputs, outside: self.outside, odd_in, functions: header[n..].to_vec(), values })
    }
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
    // Surplus rows are told by their number below.
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

#[cfg(test)]
mod tests;
