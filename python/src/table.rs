//! Tables: columns of numbers and texts, which numpy, pandas, polars and pyarrow take without a copy.

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{ArrowPrimitiveType, Float64Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch, RecordBatchIterator, StringArray};
use arrow_array::{Float64Array, Int64Array};
use arrow_schema::{Field, Schema};
use lab_tables::{Cell, CellKind, Column, ParquetReader};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList};

use crate::options::refused;

/// Tables by name, in an order.
pub type Tables = Vec<(String, Table)>;

/// A table by columns.
#[pyclass(frozen, module = "two_step")]
pub struct Table {
    batch: RecordBatch,
}

impl Table {
    /// Of numbers.
    pub fn of_numbers(names: impl IntoIterator<Item = String>, columns: Vec<Vec<f64>>) -> Self {
        let arrays =
            columns.into_iter().map(|column| Arc::new(Float64Array::from(column)) as ArrayRef);
        Self::of(names.into_iter().map(|name| (name, String::new())), arrays)
    }

    /// Of names with their units, and columns of one length.
    fn of(
        names: impl IntoIterator<Item = (String, String)>,
        arrays: impl IntoIterator<Item = ArrayRef>,
    ) -> Self {
        let arrays: Vec<ArrayRef> = arrays.into_iter().collect();
        let fields = names.into_iter().zip(&arrays).map(|((name, unit), array)| {
            let field = Field::new(name, array.data_type().clone(), true);
            match unit.as_str() {
                "" => field,
                _ => field.with_metadata(HashMap::from([("unit".to_owned(), unit)])),
            }
        });
        let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
        // Columns of one length by construction.
        let empty = RecordBatch::new_empty(schema.clone());
        Self { batch: RecordBatch::try_new(schema, arrays).unwrap_or(empty) }
    }

    /// Of the program's rows.
    pub fn of_rows(columns: &[Column], rows: &[Vec<Cell>]) -> Self {
        let arrays = columns.iter().enumerate().map(|(place, column)| -> ArrayRef {
            let cells = rows.iter().map(|row| &row[place]);
            match column.kind {
                CellKind::Integer => Arc::new(cells.map(Cell::integer).collect::<Int64Array>()),
                CellKind::Number => Arc::new(cells.map(Cell::number).collect::<Float64Array>()),
                CellKind::Text => Arc::new(cells.map(Cell::text).collect::<StringArray>()),
            }
        });
        let names = columns.iter().map(|column| (column.name.clone(), column.unit.clone()));
        Self::of(names, arrays)
    }

    fn column(&self, name: &str) -> PyResult<&ArrayRef> {
        self.batch.column_by_name(name).ok_or_else(|| {
            PyKeyError::new_err(format!("{name:?}; the columns are {}", self.names().join(", ")))
        })
    }
}

#[pymethods]
impl Table {
    /// Reads a table of results, NAME.parquet.
    #[staticmethod]
    pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| {
            let reader = ParquetReader::open(&path)?;
            let kinds = reader.kinds();
            let rows: Result<Vec<Vec<Cell>>, _> = reader
                .rows()?
                .map(|row| row.map(|cells| cells.into_iter().map(|(_, cell)| cell).collect()))
                .collect();
            Ok(Self::of_rows(&kinds, &rows?))
        })
        .map_err(|problem: host_io::problem::Problem| refused(problem))
    }

    /// Names of the columns.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// Units of the columns that have one, by name; "1" of a count or a ratio.
    #[getter]
    fn units(&self) -> BTreeMap<String, String> {
        let schema = self.batch.schema();
        let unit = |field: &Arc<Field>| {
            Some((field.name().clone(), field.metadata().get("unit")?.clone()))
        };
        schema.fields().iter().filter_map(unit).collect()
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __contains__(&self, name: &str) -> bool {
        self.batch.column_by_name(name).is_some()
    }

    fn __repr__(&self) -> String {
        format!("Table of {} rows: {}", self.batch.num_rows(), self.names().join(", "))
    }

    /// A column: an array of numpy that shares the memory of the table, read-only; missing numbers are nan, and of texts it is a list.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let array = self.column(name)?;
        if let Some(texts) = array.as_any().downcast_ref::<StringArray>() {
            return Ok(PyList::new(py, texts.iter())?.into_any());
        }
        let array = match array.as_any().downcast_ref::<Float64Array>() {
            Some(numbers) if numbers.null_count() > 0 => {
                let numbers = numbers.iter().map(|number| number.unwrap_or(f64::NAN));
                Arc::new(Float64Array::from_iter_values(numbers))
            }
            _ => array.clone(),
        };
        py.import("numpy")?.call_method1("asarray", (ColumnMemory(array),))
    }

    /// The table as pandas.DataFrame.
    fn to_pandas<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("pandas")?.getattr("DataFrame")?.call_method1("from_arrow", (slf,))
    }

    /// The table as polars.DataFrame.
    fn to_polars<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

    /// Columns by name, as `table[name]` has them.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for name in self.names() {
            all.set_item(&name, self.__getitem__(py, &name)?)?;
        }
        Ok(all)
    }

    /// The stream of the Arrow PyCapsule interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // A consumer may wish another schema, and the producer may ignore it.
        drop(requested_schema);
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}

/// The memory of a column of numbers, for numpy, which keeps this object as long as it looks at the memory.
#[pyclass(frozen)]
struct ColumnMemory(ArrayRef);

#[pymethods]
impl ColumnMemory {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fn start<T: ArrowPrimitiveType>(array: &dyn Array) -> Option<usize> {
            let array = array.as_any().downcast_ref::<arrow_array::PrimitiveArray<T>>()?;
            Some(array.values().as_ptr() as usize)
        }
        let (kind, start) = match start::<Float64Type>(&self.0) {
            Some(start) => ("<f8", start),
            None => {
                let start = start::<Int64Type>(&self.0);
                ("<i8", start.ok_or_else(|| PyTypeError::new_err("a column of texts is no array"))?)
            }
        };
        let about = PyDict::new(py);
        about.set_item("version", 3)?;
        about.set_item("shape", (self.0.len(),))?;
        about.set_item("typestr", kind)?;
        about.set_item("data", (start, true))?;
        Ok(about)
    }
}
