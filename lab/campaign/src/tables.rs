//! The tables that a specification asks for: aggregates over the flights of each cell, as Markdown and as coloured fields.

use std::fmt::Write as _;

use lab_judges::metrics::{max, mean, quantile, rms, upper_95};
use lab_report::chart::axis::number;
use lab_report::chart::drawing::Drawing;
use lab_report::chart::{Figure, WIDTH};
use lab_tables::{Cell, CellKind, Column, Table};

use crate::plan::{Plan, Run};
use crate::results::{Results, median};
use crate::spec::{Aggregate, ColumnSpec, Fields, TableSpec};
use crate::table::of_variable;

/// Space left of the fields, for names, and height of a line of them.
const LEFT: f64 = 190.0;
const FIELD: f64 = 25.0;

/// A table with the runs of each of its cells.
struct Cells<'a> {
    plan: &'a Plan,
    table: &'a TableSpec,
    /// Names of the rows, cell by cell, and of what stands across.
    rows: Vec<Vec<String>>,
    across: Vec<String>,
    /// For each row and each of `across` the runs.
    runs: Vec<Vec<Vec<usize>>>,
}

/// All tables of a campaign, in Markdown; empty where it has none.
pub fn markdown(plan: &Plan, results: &Results) -> String {
    let tables = &plan.file.spec.tables;
    let mut text = String::new();
    for table in tables {
        let _ = write!(text, "\n## {}\n\n", table.title);
        if !table.about.is_empty() {
            let _ = write!(text, "{}\n\n", table.about);
        }
        text += &Cells::of(plan, table).markdown(results);
    }
    text
}

/// The same as tables for programs, by their numbers in the specification.
pub fn all(plan: &Plan, results: &Results) -> impl Iterator<Item = Table> {
    let tables = (1..).zip(&plan.file.spec.tables);
    tables.map(|(number, table)| Cells::of(plan, table).table(format!("table-{number}"), results))
}

/// The first table that has fields, as a drawing.
pub fn figure(plan: &Plan, results: &Results) -> Option<Figure> {
    let with_fields = |table: &&TableSpec| table.columns.iter().any(|c| c.fields.is_some());
    let table = plan.file.spec.tables.iter().find(with_fields)?;
    Cells::of(plan, table).figure(results)
}

impl<'a> Cells<'a> {
    fn of(plan: &'a Plan, table: &'a TableSpec) -> Self {
        let mut cells =
            Self { plan, table, rows: Vec::new(), across: Vec::new(), runs: Vec::new() };
        for number in 0..plan.runs() {
            // The plan is checked, so every run can be drawn.
            let Ok(run) = plan.run(number) else { continue };
            if table.law.as_ref().is_some_and(|law| plan.laws()[run.law] != law) {
                continue;
            }
            let row = table.rows.iter().map(|key| name(plan, &run, key)).collect();
            let across =
                table.across.as_ref().map_or_else(String::new, |key| name(plan, &run, key));
            let (row, across) = (place(&mut cells.rows, row), place(&mut cells.across, across));
            cells.runs.resize_with(cells.rows.len(), Vec::new);
            let of_row = &mut cells.runs[row];
            of_row.resize_with(of_row.len().max(across + 1), Vec::new);
            of_row[across].push(usize::try_from(number).unwrap_or(usize::MAX));
        }
        cells
    }

    fn markdown(&self, results: &Results) -> String {
        let columns = &self.table.columns;
        let heading = |across: &String, column: &ColumnSpec| {
            let words = [across, column.name.as_str(), self.unit(column)];
            words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(", ")
        };
        let named = || columns.iter().filter(|column| !column.is_remark());
        let of_columns =
            self.across.iter().flat_map(|across| named().map(move |c| heading(across, c)));
        let headings: Vec<String> = self.table.rows.iter().cloned().chain(of_columns).collect();
        let rule = "---|".repeat(headings.len());
        let mut text = format!("| {} |\n|{rule}\n", headings.join(" | "));
        for (row, runs) in self.rows.iter().zip(&self.runs) {
            let mut cells = row.clone();
            for across in 0..self.across.len() {
                let runs = runs.get(across).map_or(&[][..], Vec::as_slice);
                for column in columns {
                    let cell = self.cell(column, runs, results);
                    match cells.last_mut() {
                        Some(before) if column.is_remark() && !cell.is_empty() => {
                            *before += &format!(", {cell}");
                        }
                        _ if column.is_remark() => {}
                        _ => cells.push(cell),
                    }
                }
            }
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        text
    }

    /// A row for each cell: what it is of, its flights, and its columns without rounding.
    fn table(&self, name: String, results: &Results) -> Table {
        let Self { table: TableSpec { rows, across, columns, .. }, .. } = self;
        let of_spec = |column: &ColumnSpec| {
            let by = serde_json::to_string(&column.by).unwrap_or_default();
            let name = format!("{}_{}", column.of, by.trim_matches('"'));
            match column.words.is_empty() {
                true => Column::with_unit(name, self.unit(column)),
                false => Column::new(name, CellKind::Text),
            }
        };
        let key = |key: &String| {
            let variable = self.plan.variables().iter().find(|variable| variable.key == *key);
            variable.map_or(Column::new(key, CellKind::Text), |of| of_variable(self.plan, of))
        };
        let keys = rows.iter().chain(across).map(key);
        let flights = Column::new("flights", CellKind::Integer);
        let all = keys.chain([flights]).chain(columns.iter().map(of_spec)).collect();
        let mut table = Table::new(name, all);
        for (names, runs) in self.rows.iter().zip(&self.runs) {
            for (name, runs) in self.across.iter().zip(runs) {
                let names = names.iter().chain(across.as_ref().map(|_| name));
                let keys = names.zip(&table.columns).map(|(name, column)| match column.kind {
                    CellKind::Number => name.parse::<f64>().ok().into(),
                    _ => name.into(),
                });
                let values = columns.iter().map(|column| {
                    let value = self.value(column, runs, results);
                    // NaN would become the number 0, and so the first word.
                    let word = column.words.get(value as usize).filter(|_| value.is_finite());
                    if column.words.is_empty() { value.into() } else { word.into() }
                });
                let flights = Cell::from(runs.len() as u64);
                let row = keys.chain([flights]).chain(values).collect();
                table.rows.push(row);
            }
        }
        table
    }

    /// A block for each combination of all row keys but the last, a line for each of the last, a field for each of `across`.
    fn figure(&self, results: &Results) -> Option<Figure> {
        let columns = &self.table.columns;
        let column = columns.iter().find(|column| column.fields.is_some())?;
        let Fields { within, due } = column.fields.as_ref()?;
        let (mut drawing, mut y) = (Drawing::default(), 46.0);
        drawing.text((14.0, 25.0), "start", r#" font-size="20""#, &self.table.title);
        for sentence in self.table.about.split_inclusive(". ") {
            drawing.text((14.0, y), "start", r#" font-size="12""#, sentence.trim_end());
            y += 17.0;
        }
        let width = (WIDTH - LEFT) / self.across.len() as f64;
        let x_of = |place: usize| LEFT + width * place as f64;
        let mut block = None;
        for (row, runs) in self.rows.iter().zip(&self.runs) {
            let (line, names) = row.split_last()?;
            if block != Some(names) {
                let keys = self.table.rows.iter().zip(names);
                let title: Vec<String> = keys.map(|(key, name)| format!("{key} {name}")).collect();
                let style = r#" font-weight="bold""#;
                drawing.text((14.0, y + 22.0), "start", style, &title.join(", "));
                y += 32.0;
                for (place, across) in self.across.iter().enumerate() {
                    let at = (x_of(place) + 0.5 * width, y + 8.0);
                    drawing.text(at, "middle", r#" font-size="12""#, across);
                }
                (block, y) = (Some(names), y + 16.0);
            }
            drawing.text((LEFT - 10.0, y + 16.0), "end", r#" font-size="12""#, line);
            for (place, runs) in runs.iter().enumerate() {
                let value = |of: &String| aggregate(column, of, runs, results);
                let is_due = due.as_ref().is_none_or(|due| value(due) > 0.0);
                let colour = match (value(&column.of) <= *within, is_due) {
                    (true, _) => r##"fill="#bfe3c0""##,
                    (false, true) => r##"fill="#f0a8a0""##,
                    (false, false) => r##"fill="#d8d8d8""##,
                };
                let x = x_of(place);
                drawing.rectangle((x, y), (x + width - 4.0, y + FIELD - 3.0), colour, "");
                let cells = columns.iter().map(|column| self.cell(column, runs, results));
                let text: Vec<String> = cells.filter(|cell| !cell.is_empty()).collect();
                let at = (x + 0.5 * width - 2.0, y + 16.0);
                drawing.text(at, "middle", r#" font-size="12""#, &text.join(", "));
            }
            y += FIELD;
        }
        let caption = format!("{}. {}", self.table.title, self.table.about);
        Some(Figure { name: "fields", caption, svg: drawing.finish((WIDTH, y + 14.0)) })
    }

    fn unit(&self, column: &ColumnSpec) -> &'static str {
        match (column.by, self.plan.shown_unit(&column.of).0) {
            _ if !column.words.is_empty() => "",
            (Aggregate::Percent, _) => "%",
            (Aggregate::BoundPerHour, _) => "1/h",
            (_, "1") => "",
            (_, _) if column.of == "lost_at_s" => "s",
            (_, unit) => unit,
        }
    }

    /// In the unit of people.
    fn value(&self, column: &ColumnSpec, runs: &[usize], results: &Results) -> f64 {
        self.plan.shown_unit(&column.of).1 * aggregate(column, &column.of, runs, results)
    }

    fn cell(&self, column: &ColumnSpec, runs: &[usize], results: &Results) -> String {
        let ColumnSpec { of, decimals, words, .. } = column;
        let value = self.value(column, runs, results);
        match (of.as_str(), words.get(value as usize)) {
            _ if !value.is_finite() => "-".to_owned(),
            ("lost", _) => format!("{value} of {}", runs.len()),
            (_, Some(word)) => word.clone(),
            _ => number(value, *decimals),
        }
    }
}

fn aggregate(column: &ColumnSpec, of: &str, runs: &[usize], results: &Results) -> f64 {
    let value = |of| move |run: &usize| results.value(of, column.all, *run);
    let values = runs.iter().map(value(of)).filter(|value| value.is_finite());
    match column.by {
        Aggregate::Sum => values.reduce(|sum, value| sum + value).unwrap_or(f64::NAN),
        Aggregate::P95 => quantile(values.collect(), 0.95),
        Aggregate::BoundPerHour => {
            let healthy_s = runs.iter().map(value("healthy_s")).filter(|time| time.is_finite());
            let hours = healthy_s.sum::<f64>() / 3_600.0;
            upper_95(values.sum()) / hours
        }
        Aggregate::Mean => mean(values),
        Aggregate::Percent => 100.0 * mean(values),
        Aggregate::Rms => rms(values),
        Aggregate::Median => median(values).unwrap_or(f64::NAN),
        Aggregate::Largest => max(values),
    }
}

/// What a run has under a key of a table.
fn name(plan: &Plan, run: &Run, key: &str) -> String {
    match (key, plan.variables().iter().position(|variable| variable.key == key)) {
        (_, Some(place)) => run.values[place].shown(),
        ("law", _) => plan.laws()[run.law].to_owned(),
        _ => plan.aircraft[run.airframe].name.clone(),
    }
}

/// The place of a name, which is new at the end.
fn place<T: PartialEq>(names: &mut Vec<T>, name: T) -> usize {
    names.iter().position(|known| *known == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    })
}
