//! `runs.parquet`: every run of a campaign with its variables, what became of it, and its measures.
//!
//! Units stand in the table `columns` and in the metadata of the file, under the key `units`; there too are the build that flew it and,
//! as in `setup.json`, what it flew.

use host_io::problem::Problem;
use lab_tables::{Cell, CellKind, Column, ParquetWriter, Table, cells, columns};

use crate::plan::{Plan, Value};
use crate::spec::Variable;
use crate::store::{PROGRAM, Row, RunEnd, RunStore, write_new};

/// Name of the table.
pub const RUNS: &str = "runs.parquet";
/// Keys of the metadata that say of which build and of which specification with its files the runs are.
pub const PROGRAM_KEY: &str = "program";
/// See [`PROGRAM_KEY`].
pub const FINGERPRINT: &str = "fingerprint";
/// Name of the file with the setups; they are in the metadata of the table too.
const SETUP: &str = "setup.json";

/// Writes the table and the list of its columns from the parts of a store; `each` sees every row, in the order of the runs.
pub fn write(plan: &Plan, store: &RunStore, each: &mut dyn FnMut(&Row)) -> Result<(), Problem> {
    store.check_complete()?;
    let columns = columns(plan);
    let setup = plan.setup_json()?;
    let about = [(PROGRAM_KEY, PROGRAM), (FINGERPRINT, &plan.fingerprint), ("setup", &setup)];
    let mut writer = ParquetWriter::create(store.folder(), "runs", columns.clone(), &about)?;
    for part in 0..store.count() {
        for row in store.runs(part)? {
            each(&row);
            writer.push(cells_of(plan, &columns, row)?)?;
        }
    }
    writer.finish()?;
    let mut list = Table::new("columns", columns![column: Text, unit: Text, meaning: Text]);
    list.rows.extend(columns.iter().map(|of| cells![&of.name, &of.unit, of.meaning]));
    list.write(store.folder())?;
    write_new(&store.folder().join(SETUP), setup.as_bytes(), b"{\n  \"fingerprint\"")
}

fn columns(plan: &Plan) -> Vec<Column> {
    let mut columns = columns![
        run: Integer = "number of the run, for --run",
        flight: Integer = "number of the flight, which every law flies",
        airframe: Text = "the aircraft",
        law: Text = "the law",
        seed: Integer = "seed of the flight",
    ];
    columns.extend(plan.variables().iter().map(|variable| of_variable(plan, variable)));
    columns.extend(columns![
        outcome: Text = "kept, lost, or failed: could not be flown",
        reason: Text = "what it was lost by, or why it failed",
        lost_at_s: Number = "time of the loss",
        end_s: Number = "time at the end of the flight",
    ]);
    for (name, unit) in plan.aircraft.iter().flat_map(|aircraft| &aircraft.measures) {
        // Aircraft share measures, and each has one column.
        if columns.iter().all(|column| column.name != *name) {
            let meaning = "a measure, defined in docs/fly.md";
            columns.push(Column { meaning, ..Column::with_unit(name, unit) });
        }
    }
    columns
}

pub(crate) fn of_variable(plan: &Plan, variable: &Variable) -> Column {
    let is_text = variable.each.is_some()
        || variable.is_two
        || variable.values.iter().flatten().any(|v| !(v.is_float() || v.is_integer()));
    let joint = plan.file.spec.joint.iter().find(|joint| joint.name == variable.key);
    let (unit, meaning) = match joint {
        Some(joint) => (joint.unit.as_str(), "level of several keys"),
        None => ("", "key of --set; its name ends with its unit"),
    };
    let kind = if is_text { CellKind::Text } else { CellKind::Number };
    Column { name: variable.key.clone(), unit: unit.to_owned(), meaning, kind }
}

fn cells_of(plan: &Plan, columns: &[Column], row: Row) -> Result<Vec<Cell>, Problem> {
    let run = plan.run(row.run)?;
    let aircraft = &plan.aircraft[run.airframe];
    let (name, law) = (&aircraft.name, plan.laws()[run.law]);
    let mut cells = cells![run.number, run.flight, name, law, run.seed];
    let variables = run.values.iter().zip(&columns[cells.len()..]);
    cells.extend(variables.map(|(value, column)| value.cell(column.kind)));
    let reason = Some(row.reason).filter(|reason| !reason.is_empty());
    let end_s = (row.end != RunEnd::Failed).then_some(row.end_s);
    cells.extend(cells![row.end.name(), reason, row.lost_at_s, end_s]);
    cells.extend(columns[cells.len()..].iter().map(|column| {
        let place = aircraft.measures.iter().position(|(name, _)| *name == column.name);
        place.and_then(|place| row.measures.get(place).copied().flatten()).into()
    }));
    Ok(cells)
}

impl Value {
    pub(crate) fn cell(&self, kind: CellKind) -> Cell {
        match kind {
            CellKind::Number => self.number().into(),
            _ => self.setting().into(),
        }
    }

    /// For tables of people: numbers with at most six digits.
    pub fn shown(&self) -> String {
        match self {
            Self::Number(number) => format!("{}", (number * 1.0e6).round() / 1.0e6),
            Self::Text(text) => text.clone(),
        }
    }
}
