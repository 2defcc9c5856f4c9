//! `runs.parquet`: every run of a campaign with its variables, what became of it, and its measures.
//!
//! Units stand in `columns.csv` and in the metadata of the file, under the key `units`; there too are the build that flew it and, as
//! in `setup.json`, what it flew.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use host_io::file::NewFile;
use lab_studies::problem::{At as _, Problem};
use lab_studies::table::field;
use parquet::basic::{ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::plan::{Plan, Value};
use crate::store::{PROGRAM, Row, RunEnd, Store, write_new};

/// Name of the table.
pub const RUNS: &str = "runs.parquet";
/// Keys of the metadata that say of which build and of which specification with its files the runs are.
pub const PROGRAM_KEY: &str = "program";
/// See [`PROGRAM_KEY`].
pub const FINGERPRINT: &str = "fingerprint";
/// Name of the list of its columns.
pub const COLUMNS: &str = "columns.csv";
/// Name of the file with the setups; they are in the metadata of the table too.
const SETUP: &str = "setup.json";
/// Rows of a group: what is in memory at once.
const GROUP: usize = 16_384;
/// First line of the list of columns.
pub(crate) const HEADING: &str = "column,unit,meaning\n";

/// A column of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Column {
    name: String,
    unit: String,
    meaning: String,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Integer,
    Number,
    Text,
}

/// The values of a column in a group of rows.
#[derive(Debug)]
enum Cells {
    Integers(Vec<i64>),
    Numbers(Vec<Option<f64>>),
    Texts(Vec<Option<String>>),
}

/// Writes the table and the list of its columns from the parts of a store; `each` sees every row, in the order of the runs.
pub fn write(plan: &Plan, store: &Store, each: &mut dyn FnMut(&Row)) -> Result<(), Problem> {
    store.check_complete()?;
    let columns = columns(plan);
    let path = store.folder().join(RUNS);
    let file = NewFile::begin(&path, |beginning| beginning.starts_with(b"PAR1"));
    let file = file.at(path.display())?;
    let setup = plan.setup_json()?;
    let about = [(PROGRAM_KEY, PROGRAM), (FINGERPRINT, &plan.fingerprint), ("setup", &setup)];
    let mut writer = begin(&columns, &about, file).at(RUNS)?;
    let mut cells = empty(&columns);
    let mut count = 0;
    for part in 0..store.count() {
        for row in store.runs(part)? {
            each(&row);
            add(plan, &columns, &mut cells, row)?;
            count += 1;
            if count == GROUP {
                write_group(&mut writer, &cells).at(RUNS)?;
                (cells, count) = (empty(&columns), 0);
            }
        }
    }
    if count > 0 {
        write_group(&mut writer, &cells).at(RUNS)?;
    }
    let file = writer.into_inner().at(RUNS)?;
    file.finish().at(path.display())?;
    write_columns(&columns, store.folder())?;
    write_new(&store.folder().join(SETUP), setup.as_bytes(), b"{\n  \"fingerprint\"")
}

fn columns(plan: &Plan) -> Vec<Column> {
    let column = |name: &str, unit: &str, meaning: &str, kind| Column {
        name: name.to_owned(),
        unit: unit.to_owned(),
        meaning: meaning.to_owned(),
        kind,
    };
    let mut columns = vec![
        column("run", "1", "number of the run, for --run", Kind::Integer),
        column("flight", "1", "number of the flight, which every law flies", Kind::Integer),
        column("airframe", "", "the aircraft", Kind::Text),
        column("law", "", "the law", Kind::Text),
        column("seed", "1", "seed of the flight", Kind::Integer),
    ];
    for variable in plan.variables() {
        let is_text = variable.each.is_some()
            || variable.is_two
            || variable.values.iter().flatten().any(|v| !(v.is_float() || v.is_integer()));
        let kind = if is_text { Kind::Text } else { Kind::Number };
        let joint = plan.file.spec.joint.iter().find(|joint| joint.name == variable.key);
        let (unit, meaning) = match joint {
            Some(joint) => (joint.unit.as_str(), "level of several keys"),
            None => ("", "key of --set; its name ends with its unit"),
        };
        columns.push(column(&variable.key, unit, meaning, kind));
    }
    columns.extend([
        column("outcome", "", "kept, lost, or failed: could not be flown", Kind::Text),
        column("reason", "", "what it was lost by, or why it failed", Kind::Text),
        column("lost_at_s", "s", "time of the loss", Kind::Number),
        column("end_s", "s", "time at the end of the flight", Kind::Number),
    ]);
    for aircraft in &plan.aircraft {
        for (name, unit) in &aircraft.measures {
            if columns.iter().all(|column| column.name != *name) {
                columns.push(column(name, unit, "a measure, defined in docs/fly.md", Kind::Number));
            }
        }
    }
    columns
}

fn begin<W: Write + Send>(
    columns: &[Column],
    about: &[(&str, &str)],
    file: W,
) -> Result<SerializedFileWriter<W>, ParquetError> {
    let fields = columns.iter().map(|column| {
        let (physical, logical, converted) = match column.kind {
            Kind::Integer => (Physical::INT64, None, ConvertedType::NONE),
            Kind::Number => (Physical::DOUBLE, None, ConvertedType::NONE),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String), ConvertedType::UTF8),
        };
        let repetition = match column.kind {
            Kind::Integer => Repetition::REQUIRED,
            _ => Repetition::OPTIONAL,
        };
        let builder = Type::primitive_type_builder(&column.name, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .with_converted_type(converted);
        builder.build().map(Arc::new)
    });
    let fields = fields.collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("runs").with_fields(fields).build()?;
    let units: BTreeMap<&str, &str> =
        columns.iter().map(|column| (column.name.as_str(), column.unit.as_str())).collect();
    let units = toml::to_string(&units).unwrap_or_default();
    let about = about.iter().copied().chain([("units", units.as_str())]);
    let about = about.map(|(key, value)| KeyValue::new(key.to_owned(), value.to_owned())).collect();
    let properties = WriterProperties::builder()
        .set_created_by(format!("Two-Step {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(about))
        .build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

fn empty(columns: &[Column]) -> Vec<Cells> {
    let of = |column: &Column| match column.kind {
        Kind::Integer => Cells::Integers(Vec::new()),
        Kind::Number => Cells::Numbers(Vec::new()),
        Kind::Text => Cells::Texts(Vec::new()),
    };
    columns.iter().map(of).collect()
}

fn add(plan: &Plan, columns: &[Column], cells: &mut [Cells], row: Row) -> Result<(), Problem> {
    let run = plan.run(row.run)?;
    let aircraft = &plan.aircraft[run.airframe];
    let mut values = run.values.iter();
    let is_failed = row.end == RunEnd::Failed;
    for (place, (column, cells)) in columns.iter().zip(cells).enumerate() {
        let is_variable = (5..5 + run.values.len()).contains(&place);
        let value = if is_variable { values.next() } else { None };
        match cells {
            Cells::Integers(list) => list.push(match column.name.as_str() {
                "run" => run.number.cast_signed(),
                "flight" => run.flight.cast_signed(),
                _ => run.seed.cast_signed(),
            }),
            Cells::Texts(list) => list.push(match (column.name.as_str(), value) {
                (_, Some(value)) => Some(value.setting()),
                ("airframe", None) => Some(aircraft.name.clone()),
                ("law", None) => Some(plan.laws()[run.law].to_owned()),
                ("outcome", None) => Some(row.end.name().to_owned()),
                _ => (!row.reason.is_empty()).then(|| row.reason.clone()),
            }),
            Cells::Numbers(list) => list.push(match (column.name.as_str(), value) {
                (_, Some(value)) => value.number(),
                ("lost_at_s", None) => row.lost_at_s,
                ("end_s", None) => (!is_failed).then_some(row.end_s),
                (name, None) => {
                    let place = aircraft.measures.iter().position(|(known, _)| known == name);
                    place.and_then(|place| row.measures.get(place).copied().flatten())
                }
            }),
        }
    }
    Ok(())
}

fn write_group<W: Write + Send>(
    writer: &mut SerializedFileWriter<W>,
    cells: &[Cells],
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for cells in cells {
        let Some(mut column) = group.next_column()? else { break };
        match cells {
            Cells::Integers(list) => {
                let _ = column.typed::<Int64Type>().write_batch(list, None, None)?;
            }
            Cells::Numbers(list) => {
                let (values, levels) = flat(list.iter().copied());
                let _ = column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            Cells::Texts(list) => {
                let texts = list.iter().map(|text| text.as_deref().map(ByteArray::from));
                let (values, levels) = flat(texts);
                let _ =
                    column.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    Ok(())
}

/// The values that are there, and for each one whether it is.
fn flat<T>(list: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let mut values = Vec::new();
    let levels = list.map(|value| match value {
        None => 0,
        Some(value) => {
            values.push(value);
            1
        }
    });
    let levels = levels.collect();
    (values, levels)
}

fn write_columns(columns: &[Column], folder: &Path) -> Result<(), Problem> {
    let mut text = HEADING.to_owned();
    for Column { name, unit, meaning, .. } in columns {
        let _ = writeln!(text, "{},{},{}", field(name), field(unit), field(meaning));
    }
    write_new(&folder.join(COLUMNS), text.as_bytes(), HEADING.as_bytes())
}

impl Value {
    /// For tables of people: numbers with at most six digits.
    pub fn shown(&self) -> String {
        match self {
            Self::Number(number) => format!("{}", (number * 1.0e6).round() / 1.0e6),
            Self::Text(text) => text.clone(),
        }
    }
}
