//! Parquet files: written a group of rows at a time, and read a row at a time.

use std::collections::BTreeMap;
use std::fs::File;
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use host_io::file::NewFile;
use host_io::problem::{At as _, Problem, problem};
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, RowGroupMetaData};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::record::Field;
use parquet::schema::types::{ColumnDescriptor, Type};

use super::{Cell, CellKind, Column};

/// How a Parquet file begins.
pub const MAGIC: &[u8] = b"PAR1";
/// Rows of a group: what is in memory at once.
const GROUP: usize = 16_384;

/// A table whose rows need not be in memory together.
pub struct ParquetWriter {
    path: PathBuf,
    columns: Vec<Column>,
    writer: SerializedFileWriter<NewFile>,
    rows: Vec<Vec<Cell>>,
}

impl ParquetWriter {
    /// `about` is metadata, beside the units.
    pub fn create(
        folder: &Path,
        name: &str,
        columns: Vec<Column>,
        about: &[(&str, &str)],
    ) -> Result<Self, Problem> {
        let path = folder.join(format!("{name}.parquet"));
        let file = NewFile::begin(&path, |beginning| beginning.starts_with(MAGIC));
        let file = file.at(path.display())?;
        let field = |column: &Column| {
            let (physical, logical, repetition) = match column.kind {
                CellKind::Integer => (Physical::INT64, None, Repetition::REQUIRED),
                CellKind::Number => (Physical::DOUBLE, None, Repetition::OPTIONAL),
                CellKind::Text => {
                    (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::OPTIONAL)
                }
            };
            let builder = Type::primitive_type_builder(&column.name, physical);
            builder.with_repetition(repetition).with_logical_type(logical).build().map(Arc::new)
        };
        let fields = columns.iter().map(field).collect::<Result<_, _>>()?;
        let schema = Type::group_type_builder(name).with_fields(fields).build()?;
        let units: BTreeMap<&str, &str> =
            columns.iter().map(|column| (column.name.as_str(), column.unit.as_str())).collect();
        let units = toml::to_string(&units)?;
        let about = about.iter().copied().chain([("units", units.as_str())]);
        let about = about.map(|(key, value)| KeyValue::new(key.to_owned(), value.to_owned()));
        let properties = WriterProperties::builder()
            .set_created_by(format!("Two-Step {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(about.collect()))
            .build();
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties));
        Ok(Self { writer: writer.at(path.display())?, path, columns, rows: Vec::new() })
    }

    pub fn push(&mut self, row: Vec<Cell>) -> Result<(), Problem> {
        self.rows.push(row);
        if self.rows.len() < GROUP { Ok(()) } else { self.write_group().at(self.path.display()) }
    }

    /// Writes what is left, and gives the file its name.
    pub fn finish(mut self) -> Result<(), Problem> {
        if !self.rows.is_empty() {
            self.write_group().at(self.path.display())?;
        }
        let file = self.writer.into_inner().at(self.path.display())?;
        file.finish().at(self.path.display())
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let rows = mem::take(&mut self.rows);
        let mut group = self.writer.next_row_group()?;
        for (place, column) in self.columns.iter().enumerate() {
            let Some(writer) = group.next_column()? else { break };
            let cells = || rows.iter().map(|row| &row[place]);
            let levels: Vec<i16> = cells().map(|cell| (*cell != Cell::Missing).into()).collect();
            let levels = Some(&levels[..]);
            // Where a cell is of another kind there are fewer values than levels, which is refused.
            match column.kind {
                CellKind::Integer => {
                    write::<Int64Type>(writer, cells().filter_map(Cell::integer), None)?;
                }
                CellKind::Number => {
                    write::<DoubleType>(writer, cells().filter_map(Cell::number), levels)?;
                }
                CellKind::Text => {
                    let texts = cells().filter_map(Cell::text).map(ByteArray::from);
                    write::<ByteArrayType>(writer, texts, levels)?;
                }
            }
        }
        group.close().map(drop)
    }
}

fn write<T: DataType>(
    mut writer: SerializedColumnWriter<'_>,
    values: impl Iterator<Item = T::T>,
    levels: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let values: Vec<T::T> = values.collect();
    // It returns how many it has written: all of them, or there is an error.
    let _ = writer.typed::<T>().write_batch(&values, levels, None)?;
    writer.close()
}

/// A table that this or another program has written.
pub struct ParquetReader {
    pub path: PathBuf,
    reader: SerializedFileReader<File>,
}

impl ParquetReader {
    pub fn open(path: &Path) -> Result<Self, Problem> {
        let reader = SerializedFileReader::new(File::open(path).at(path.display())?);
        let reader = reader.at(path.display())?;
        let columns = reader.metadata().row_groups().iter().flat_map(RowGroupMetaData::columns);
        for column in columns {
            let (name, compression) = (column.column_path().string(), column.compression());
            if !matches!(
                compression,
                Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::GZIP(_)
            ) {
                return Err(problem!(
                    "{}: column {name} is compressed with {compression}; this program reads NONE, SNAPPY and GZIP",
                    path.display()
                ));
            }
        }
        Ok(Self { path: path.to_owned(), reader })
    }

    pub fn count(&self) -> i64 {
        self.reader.metadata().file_metadata().num_rows()
    }

    /// Each row as its cells with the names of their columns.
    pub fn rows(
        &self,
    ) -> Result<impl Iterator<Item = Result<Vec<(String, Cell)>, Problem>>, Problem> {
        let rows = self.reader.get_row_iter(None).at(self.path.display())?;
        let cell = |(name, field)| (name, Cell::from(field));
        Ok(rows.map(move |row| {
            Ok(row.at(self.path.display())?.into_columns().into_iter().map(cell).collect())
        }))
    }

    /// Metadata under a key.
    pub fn about(&self, key: &str) -> Option<&str> {
        let about = self.reader.metadata().file_metadata().key_value_metadata()?;
        about.iter().find(|entry| entry.key == key)?.value.as_deref()
    }

    /// The columns of a table of this program.
    pub fn kinds(&self) -> Vec<Column> {
        let units: BTreeMap<String, String> =
            self.about("units").and_then(|text| toml::from_str(text).ok()).unwrap_or_default();
        let schema = self.reader.metadata().file_metadata().schema_descr();
        let column = |found: &Arc<ColumnDescriptor>| {
            let kind = match found.physical_type() {
                Physical::INT64 => CellKind::Integer,
                Physical::DOUBLE => CellKind::Number,
                // As `rows` gives what is neither.
                _ => CellKind::Text,
            };
            let unit = units.get(found.name()).cloned().unwrap_or_default();
            Column { unit, ..Column::new(found.name(), kind) }
        };
        schema.columns().iter().map(column).collect()
    }

    pub fn columns(&self) -> Vec<&str> {
        let schema = self.reader.metadata().file_metadata().schema_descr();
        schema.columns().iter().map(|column| column.name()).collect()
    }
}

impl From<Field> for Cell {
    fn from(field: Field) -> Self {
        match field {
            Field::Null => Self::Missing,
            Field::Long(value) => Self::Integer(value),
            Field::Double(value) => Self::Number(value),
            Field::Str(text) => Self::Text(text),
            // Tables of other programs have more kinds; as texts they can still be compared.
            other => Self::Text(other.to_string()),
        }
    }
}
