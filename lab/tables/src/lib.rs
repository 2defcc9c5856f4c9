//! A table of results, written twice with the same content: `NAME.csv` and `NAME.parquet`.
//!
//! A heading of the CSV is the name of its column, and the unit in brackets where the name does not end with it; a number has the
//! digits that read back as the same bits; what is missing is an empty cell. The units stand in the metadata of the Parquet too.

use std::fmt::{self, Display};
use std::path::Path;

use host_io::file;
use host_io::problem::{At as _, Problem};

mod parquet;

pub use parquet::{MAGIC, ParquetReader, ParquetWriter};

/// Units in which names end, each behind those that end with it.
const UNITS: &str = "m/s² rad/s² m/s rad/s deg/s rad/m ms s rad deg m N Pa nT %";

#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    Integer(i64),
    /// Finite, but in a file of another program.
    Number(f64),
    Text(String),
    Missing,
}

/// What the cells of a column are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// Never missing.
    Integer,
    Number,
    Text,
}

#[derive(Debug, Clone)]
pub struct Column {
    pub name: String,
    /// `1` of a count or a ratio; empty where it has none, or one for each row.
    pub unit: String,
    pub meaning: &'static str,
    pub kind: CellKind,
}

#[derive(Debug)]
pub struct Table {
    /// Name of its files, without their endings.
    pub name: String,
    pub columns: Vec<Column>,
    pub rows: Vec<Vec<Cell>>,
}

/// Columns, each as `name: Kind` or `name: Kind = "meaning"`.
#[macro_export]
macro_rules! columns {
    ($($name:ident: $kind:ident $(= $meaning:literal)?),* $(,)?) => {
        vec![$($crate::Column {
            meaning: concat!($($meaning)?),
            ..$crate::Column::new(stringify!($name), $crate::CellKind::$kind)
        }),*]
    };
}

/// A table of a name and [`columns`].
#[macro_export]
macro_rules! table {
    ($name:literal, $($columns:tt)*) => { $crate::Table::new($name, $crate::columns![$($columns)*]) };
}

/// A row of everything that can be a [`Cell`].
#[macro_export]
macro_rules! cells {
    ($($cell:expr),* $(,)?) => { vec![$($crate::Cell::from($cell)),*] };
}

impl Column {
    /// With the unit that the name ends with.
    pub fn new(name: impl Into<String>, kind: CellKind) -> Self {
        let name = name.into();
        let unit = match kind {
            CellKind::Integer => Some("1"),
            CellKind::Number => UNITS.split(' ').find(|unit| ends_with(&name, unit)),
            CellKind::Text => None,
        };
        Self { unit: unit.unwrap_or_default().to_owned(), name, meaning: "", kind }
    }

    pub fn with_unit(name: impl Into<String>, unit: &str) -> Self {
        Self { unit: unit.to_owned(), ..Self::new(name, CellKind::Number) }
    }

    fn heading(&self) -> String {
        let Self { name, unit, .. } = self;
        let is_bare = ["", "1"].contains(&unit.as_str()) || ends_with(name, unit);
        if is_bare { name.clone() } else { format!("{name} [{unit}]") }
    }
}

/// Whether the last words of a name are a unit.
fn ends_with(name: &str, unit: &str) -> bool {
    let end = unit.to_lowercase().replace('/', "_").replace('²', "2").replace('%', "percent");
    name.strip_suffix(&end).is_some_and(|before| before.ends_with('_'))
}

impl Table {
    pub fn new(name: impl Into<String>, columns: Vec<Column>) -> Self {
        Self { name: name.into(), columns, rows: Vec::new() }
    }

    pub fn csv(&self) -> String {
        let headings = self.columns.iter().map(|column| field(&column.heading())).collect();
        let cells = |row: &Vec<Cell>| row.iter().map(|cell| field(&cell.to_string())).collect();
        let lines = std::iter::once(headings).chain(self.rows.iter().map(cells));
        lines.map(|line: Vec<String>| line.join(",") + "\n").collect()
    }

    /// Writes both files; each replaces only one of its kind.
    pub fn write(self, folder: &Path) -> Result<(), Problem> {
        let (csv, path) = (self.csv(), folder.join(format!("{}.csv", self.name)));
        file::write(&path, csv.as_bytes(), file::beginning(csv.as_bytes())).at(path.display())?;
        let mut writer = ParquetWriter::create(folder, &self.name, self.columns, &[])?;
        self.rows.into_iter().try_for_each(|row| writer.push(row))?;
        writer.finish()
    }
}

impl Cell {
    pub fn integer(&self) -> Option<i64> {
        if let Self::Integer(value) = self { Some(*value) } else { None }
    }

    pub fn number(&self) -> Option<f64> {
        if let Self::Number(value) = self { Some(*value) } else { None }
    }

    pub fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }
}

/// As it stands in a CSV file, but for quotes.
impl Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => write!(f, "{value}"),
            // The shortest digits that read back as the same bits.
            Self::Number(value) if is_plain(*value) => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value:e}"),
            Self::Text(text) => f.write_str(text),
            Self::Missing => Ok(()),
        }
    }
}

/// Whether a number has few digits without an exponent.
fn is_plain(value: f64) -> bool {
    value == 0.0 || (1.0e-5..1.0e15).contains(&value.abs())
}

macro_rules! cell_from {
    ($($type:ty, $value:ident => $cell:expr;)*) => {
        $(impl From<$type> for Cell {
            fn from($value: $type) -> Self {
                $cell
            }
        })*
    };
}

cell_from! {
    u32, value => Self::Integer(value.into());
    // As in every table; the commands take no greater one than `i64` has.
    u64, value => Self::Integer(value.cast_signed());
    bool, value => Self::Integer(value.into());
    f64, value => if value.is_finite() { Self::Number(value) } else { Self::Missing };
    // A CSV has the same for both.
    &str, text => if text.is_empty() { Self::Missing } else { Self::Text(text.to_owned()) };
    &String, text => text.as_str().into();
    String, text => text.as_str().into();
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

/// A text as a field of a CSV file (RFC 4180). A text that a spreadsheet would take for a formula, such as the name `=1+1` of a law
/// in a file of a user, begins with an apostrophe; a number stays a number.
fn field(text: &str) -> String {
    let is_formula =
        text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    let text = if is_formula { format!("'{text}") } else { text.to_owned() };
    match is_formula || text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_text_of_a_stranger_is_one_cell_and_no_formula_and_a_number_stays_one() {
        for (text, expected) in [
            ("PID, NESO", "\"PID, NESO\""),
            ("the \"best\"", "\"the \"\"best\"\"\""),
            ("=HYPERLINK(\"x\")", "\"'=HYPERLINK(\"\"x\"\")\""),
            ("+1+1", "\"'+1+1\""),
            ("-cmd|' /C calc'!A0", "\"'-cmd|' /C calc'!A0\""),
            ("@SUM(A1)", "\"'@SUM(A1)\""),
            ("\t=1", "\"'\t=1\""),
            ("\r=1", "\"'\r=1\""),
            ("a\n=1", "\"a\n=1\""),
            ("-5.25", "-5.25"),
            ("+1e-3", "+1e-3"),
            ("plain", "plain"),
            ("", ""),
        ] {
            assert_eq!(field(text), expected);
        }
    }

    #[test]
    fn a_heading_has_the_unit_once() {
        for (name, unit, expected) in [
            ("lost_percent", "%", "lost_percent"),
            ("peaks", "s", "peaks [s]"),
            ("altitude_rmse", "m", "altitude_rmse [m]"),
            ("alarms", "1/h", "alarms [1/h]"),
            ("flights", "1", "flights"),
            ("level", "", "level"),
        ] {
            assert_eq!(Column::with_unit(name, unit).heading(), expected);
        }
        for (name, unit) in [
            ("time_s", "s"),
            ("step_ms", "ms"),
            ("airspeed_m_s", "m/s"),
            ("specific_force_x_m_s2", "m/s²"),
            ("turn_rate_deg_s", "deg/s"),
            ("magnetic_field_x_nt", "nT"),
            ("kept_low_percent", "%"),
            ("peaks", ""),
        ] {
            let column = Column::new(name, CellKind::Number);
            assert_eq!((column.unit.as_str(), column.heading()), (unit, name.to_owned()));
        }
    }

    fn table(rows: Vec<Vec<Cell>>) -> Table {
        let mut columns = columns![law: Text, flights: Integer];
        columns.push(Column::with_unit("roll", "deg"));
        Table { rows, ..Table::new("laws", columns) }
    }

    #[test]
    fn both_files_have_the_same_content_and_replace_only_files_of_their_kind() {
        let home = tempfile::tempdir().unwrap();
        let at = |name: &str| home.path().join(name);
        let none: Option<&str> = None;
        let rows = vec![cells!["a, b", 3_u32, 0.1], cells![none, false, f64::NAN]];
        assert_eq!(cells![""], cells![none], "an empty text is missing");
        let write = || table(rows.clone()).write(home.path());
        write().unwrap();
        let csv = std::fs::read_to_string(at("laws.csv")).unwrap();
        assert_eq!(csv, "law,flights,roll [deg]\n\"a, b\",3,0.1\n,0,\n");
        let reader = ParquetReader::open(&at("laws.parquet")).unwrap();
        let read = reader.rows().unwrap().map(|row| row.unwrap().into_iter().unzip());
        let (names, read): (Vec<Vec<String>>, Vec<Vec<Cell>>) = read.unzip();
        assert_eq!(
            (read, reader.columns(), reader.count()),
            (rows.clone(), vec!["law", "flights", "roll"], 2)
        );
        assert_eq!(names[1], reader.columns());
        assert!(reader.about("units").unwrap().contains("roll = \"deg\""));
        write().unwrap();
        for name in ["laws.csv", "laws.parquet"] {
            let ours = std::fs::read(at(name)).unwrap();
            std::fs::write(at(name), "mine").unwrap();
            let refused = write().unwrap_err().to_string();
            assert!(refused.contains(name) && refused.contains("not written by"), "{refused}");
            assert_eq!(std::fs::read(at(name)).unwrap(), b"mine");
            std::fs::write(at(name), ours).unwrap();
        }
    }

    #[test]
    fn a_cell_of_another_kind_is_refused() {
        let home = tempfile::tempdir().unwrap();
        let none: Option<u32> = None;
        for row in [
            cells![1_u32, 2_u32, 3.0],
            cells!["a", 2.0, 3.0],
            cells!["a", none, 3.0],
            cells!["a", 2_u32, 3_u32],
        ] {
            let rows = vec![cells!["a", 1_u32, 2.0], row];
            let refused = table(rows).write(home.path()).unwrap_err().to_string();
            assert!(refused.contains("laws.parquet: Parquet error"), "{refused}");
            assert!(!home.path().join("laws.parquet").exists());
        }
    }

    proptest! {
        #[test]
        fn every_number_reads_back_as_the_same_bits(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            let text = Cell::from(value).to_string();
            prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), bits);
        }
    }
}
