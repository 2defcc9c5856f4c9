//! Sums of terms over tables and inputs, and their tables, prepared for the derivative: names resolved, units converted, no allocation.
//!
//! ```text
//! term   = factor { factor }          a product
//! factor = number [ "/" number ] | input | function "(" input { "," input } ")"
//! ```
//!
//! An input carries its unit, as in `left_elevator_deg`; a function is a column of a table, and has as many inputs as
//! its table, in the same units. `-0.0076 left_elevator_deg` is a term, `c_roll_p(alpha_deg) p_span_2v` another.
//!
//! Breakpoints that several tables share are searched once; the functions of a table that are evaluated at the same inputs
//! are interpolated side by side.

use host_io::problem::{Problem, problem};

use super::{INPUTS_MAX, Outside, Table};

/// Most different pairs of input and breakpoints.
const AXES_MAX: usize = 16;

/// Most values from tables.
const VALUES_MAX: usize = 64;

/// Functions that are interpolated side by side: those of a grid are filled up with zeros to a multiple.
const LANES: usize = 2;

/// Most inputs in one term.
const PRODUCT_MAX: usize = 3;

/// Most inputs; the place after the last one holds the number one.
pub const SUM_INPUTS_MAX: usize = 31;

/// Sums of terms over one list of inputs.
#[derive(Debug, Clone)]
pub struct Sums {
    axes: Vec<TableAxis>,
    grids: Vec<TableGrid>,
    /// The terms of each output.
    sums: Vec<Vec<TableTerm>>,
}

/// An input with breakpoints, in the SI unit of the input.
#[derive(Debug, Clone, PartialEq)]
struct TableAxis {
    input: usize,
    breakpoints: Vec<f64>,
    per_width: Vec<f64>,
    per_mean_width: f64,
    outside: Outside,
    odd: bool,
}

/// Position of an input on its axis.
#[derive(Debug, Clone, Copy, Default)]
struct Spot {
    index: usize,
    /// Fraction of the interval.
    part: f64,
    /// -1 where an odd table is evaluated at a negative input, else 1.
    sign: f64,
}

/// Functions of one table at one set of inputs.
#[derive(Debug, Clone)]
struct TableGrid {
    /// Indices of the axes, the slowest first.
    axes: Vec<usize>,
    /// Distance of neighbours along each axis in `values`.
    strides: Vec<usize>,
    /// Offset of each corner of an interval from its first one; the bits of a corner give the axes on which it is farther.
    corners: Vec<usize>,
    /// Values of the used functions, side by side.
    values: Vec<f64>,
    /// Number of functions, with the zeros.
    width: usize,
    /// Index of the first of them among all values.
    first: usize,
}

/// A product in a sum. A missing factor is the number one: without a branch the loop over all
/// terms is twice as fast.
#[derive(Debug, Clone)]
struct TableTerm {
    factor: f64,
    value: usize,
    inputs: [usize; PRODUCT_MAX],
}

/// A sum as in a file: its key for errors, its terms.
pub struct SumText<'a> {
    /// Key in the file.
    pub key: &'a str,
    pub terms: &'a [String],
}

impl Sums {
    /// Resolves every name. `inputs` are the known inputs by their names in SI units, as in `alpha_rad`; files may use
    /// `alpha_deg` instead.
    pub fn new(tables: &[Table], sums: &[SumText<'_>], inputs: &[String]) -> Result<Self, Problem> {
        let mut build = LookupBuild { tables, inputs, uses: Vec::new(), axes: Vec::new() };
        let mut products = Vec::new();
        for (output, sum) in sums.iter().enumerate() {
            for text in sum.terms {
                let form = |problem| problem!("{}: term {text:?} {problem}", sum.key);
                products.push((output, build.product(text).map_err(form)?));
            }
        }
        let grids = build.grids();
        let values = grids.iter().map(|grid| grid.width).sum();
        for (what, found, max) in [
            ("inputs", inputs.len(), SUM_INPUTS_MAX),
            ("inputs of tables", build.axes.len(), AXES_MAX),
            ("functions", values, VALUES_MAX),
        ] {
            if found > max {
                return Err(problem!(
                    "{found} {what} in all sums together, expected at most {max}"
                ));
            }
        }
        let mut sums = vec![Vec::new(); sums.len()];
        for (output, product) in products {
            let value = product.function.map(|(grid, function)| grids[grid].first + function);
            let mut inputs = [SUM_INPUTS_MAX; PRODUCT_MAX];
            inputs.iter_mut().zip(&product.inputs).for_each(|(place, input)| *place = *input);
            let value = value.unwrap_or(VALUES_MAX);
            sums[output].push(TableTerm { factor: product.factor, value, inputs });
        }
        Ok(Self { axes: build.axes, grids, sums })
    }

    /// Adds every sum to the output with its index. `inputs` in SI units, in the order of the names given to [`Sums::new`].
    #[inline]
    pub fn add_to(&self, outputs: &mut [f64], inputs: &[f64]) {
        let mut known = [1.0; SUM_INPUTS_MAX + 1];
        known[..inputs.len()].copy_from_slice(inputs);
        let mut spots = [Spot::default(); AXES_MAX];
        for (spot, axis) in spots.iter_mut().zip(&self.axes) {
            *spot = axis.find(known[axis.input]);
        }
        let mut values = [0.0; VALUES_MAX + 1];
        values[VALUES_MAX] = 1.0;
        for grid in &self.grids {
            grid.interpolate(&spots, &mut values[grid.first..grid.first + grid.width]);
        }
        for (output, sum) in outputs.iter_mut().zip(&self.sums) {
            *output += sum.iter().fold(0.0, |sum, term| {
                let [first, second, third] = term.inputs.map(|input| known[input]);
                sum + term.factor * values[term.value] * first * second * third
            });
        }
    }
}

impl TableAxis {
    #[inline]
    fn find(&self, input: f64) -> Spot {
        let (x, sign) = if self.odd && input < 0.0 { (-input, -1.0) } else { (input, 1.0) };
        // Evenly spaced breakpoints give the interval at once; in any other table it is not far from there.
        let last = self.per_width.len() - 1;
        // It saturates.
        let mut index = (((x - self.breakpoints[0]) * self.per_mean_width) as usize).min(last);
        while index > 0 && x < self.breakpoints[index] {
            index -= 1;
        }
        while index < last && x >= self.breakpoints[index + 1] {
            index += 1;
        }
        let part = (x - self.breakpoints[index]) * self.per_width[index];
        let part = match self.outside {
            Outside::Clamp if part > 1.0 => 1.0,
            Outside::Clamp if part < 0.0 => 0.0,
            _ => part,
        };
        Spot { index, part, sign }
    }
}

impl TableGrid {
    #[inline]
    fn interpolate(&self, spots: &[Spot; AXES_MAX], out: &mut [f64]) {
        let mut base = 0;
        let mut weights = [0.0; 1 << INPUTS_MAX];
        weights[0] = 1.0;
        let mut corners = 1;
        for (axis, stride) in self.axes.iter().zip(&self.strides) {
            let Spot { index, part, sign } = spots[*axis];
            base += index * stride;
            for corner in 0..corners {
                let weight = sign * weights[corner];
                (weights[corner], weights[corner + corners]) =
                    (weight * (1.0 - part), weight * part);
            }
            corners *= 2;
        }
        let values = &self.values[base..];
        let corners = &self.corners[..corners];
        for (pair, out) in out.chunks_exact_mut(LANES).enumerate() {
            // Two names instead of an array, which the compiler would keep in memory.
            let (mut first, mut second) = (0.0, 0.0);
            for (weight, corner) in weights.iter().zip(corners) {
                let at = corner + pair * LANES;
                first += weight * values[at];
                second += weight * values[at + 1];
            }
            (out[0], out[1]) = (first, second);
        }
    }
}

/// A product before the positions of the values are known.
struct Product {
    factor: f64,
    /// Index among the uses of tables, and among the functions of that one.
    function: Option<(usize, usize)>,
    inputs: Vec<usize>,
}

/// Functions of a table at the same inputs.
struct AxisUse {
    table: usize,
    axes: Vec<usize>,
    functions: Vec<usize>,
}

struct LookupBuild<'a> {
    tables: &'a [Table],
    inputs: &'a [String],
    uses: Vec<AxisUse>,
    axes: Vec<TableAxis>,
}

impl LookupBuild<'_> {
    fn product(&mut self, text: &str) -> Result<Product, String> {
        let mut product = Product { factor: 1.0, function: None, inputs: Vec::new() };
        for factor in factors(text)? {
            match factor {
                Factor::Number(number) => product.factor *= number,
                Factor::Input(name) => {
                    let (index, unit) = self.input(&name)?;
                    // Inputs come in SI units at run time, so the unit goes into the factor.
                    product.factor /= unit;
                    product.inputs.push(index);
                }
                Factor::Function { name, inputs } => {
                    if product.function.replace(self.function(&name, &inputs)?).is_some() {
                        return Err("has two functions, expected at most one".to_owned());
                    }
                }
            }
        }
        if product.inputs.len() > PRODUCT_MAX {
            return Err(format!(
                "has {} inputs, expected at most {PRODUCT_MAX}",
                product.inputs.len()
            ));
        }
        Ok(product)
    }

    /// Index of an input, and the SI value of the unit of its name.
    fn input(&self, name: &str) -> Result<(usize, f64), String> {
        let find = |name: &str| self.inputs.iter().position(|input| input == name);
        let in_degrees = || find(&format!("{}_rad", name.strip_suffix("_deg")?));
        find(name)
            .map(|index| (index, 1.0))
            .or_else(|| in_degrees().map(|index| (index, 1.0_f64.to_radians())))
            .ok_or_else(|| {
                format!("has {name}, expected a number or one of {}", self.inputs.join(", "))
            })
    }

    fn function(&mut self, name: &str, inputs: &[String]) -> Result<(usize, usize), String> {
        let column = |table: &Table| table.functions.iter().position(|function| function == name);
        let found = self.tables.iter().enumerate().find_map(|(i, table)| Some((i, column(table)?)));
        let Some((table, function)) = found else {
            let known: Vec<&str> =
                self.tables.iter().flat_map(|table| &table.functions).map(String::as_str).collect();
            return Err(format!("has {name}(), expected one of {}", known.join(", ")));
        };
        let columns = &self.tables[table].inputs;
        if columns.len() != inputs.len() {
            return Err(format!(
                "has {} inputs of {name}(), expected {}",
                inputs.len(),
                columns.len()
            ));
        }
        let mut axes = Vec::new();
        for k in 0..columns.len() {
            let (input, unit) = self.input(&inputs[k])?;
            if is_degrees(&inputs[k]) != is_degrees(&columns[k].name) {
                let (found, column) = (&inputs[k], &columns[k].name);
                return Err(format!(
                    "has {found} as input of {name}(), expected the unit of its column {column}"
                ));
            }
            axes.push(self.axis(table, k, input, unit));
        }
        let same = |other: &AxisUse| other.table == table && other.axes == axes;
        let index = self.uses.iter().position(same).unwrap_or_else(|| {
            self.uses.push(AxisUse { table, axes, functions: Vec::new() });
            self.uses.len() - 1
        });
        Ok((index, index_or_push(&mut self.uses[index].functions, function)))
    }

    fn axis(&mut self, table: usize, k: usize, input: usize, unit: f64) -> usize {
        let table = &self.tables[table];
        let breakpoints: Vec<f64> = table.inputs[k].breakpoints.iter().map(|x| x * unit).collect();
        let intervals = breakpoints.len() - 1;
        // There are at most 200.
        let per_mean_width = intervals as f64 / (breakpoints[intervals] - breakpoints[0]);
        let per_width: Vec<f64> =
            breakpoints.windows(2).map(|pair| 1.0 / (pair[1] - pair[0])).collect();
        let (outside, odd) = (table.outside, table.odd_in == Some(k));
        index_or_push(
            &mut self.axes,
            TableAxis { input, breakpoints, per_width, per_mean_width, outside, odd },
        )
    }

    /// The uses of tables with their values side by side.
    fn grids(&self) -> Vec<TableGrid> {
        let mut first = 0;
        let grid = |used: &AxisUse| {
            let table = &self.tables[used.table];
            let width = used.functions.len().next_multiple_of(LANES);
            let mut values = Vec::new();
            for row in table.values.chunks(table.functions.len()) {
                values.extend(used.functions.iter().map(|function| row[*function]));
                values.resize(values.len().next_multiple_of(LANES), 0.0);
            }
            let mut strides = vec![width; used.axes.len()];
            for k in (1..strides.len()).rev() {
                strides[k - 1] = strides[k] * table.inputs[k].breakpoints.len();
            }
            first += width;
            let mut corners = vec![0];
            for stride in &strides {
                corners.extend_from_within(..);
                let half = corners.len() / 2;
                corners[half..].iter_mut().for_each(|corner| *corner += stride);
            }
            TableGrid {
                axes: used.axes.clone(),
                strides,
                corners,
                values,
                width,
                first: first - width,
            }
        };
        self.uses.iter().map(grid).collect()
    }
}

fn is_degrees(name: &str) -> bool {
    name.ends_with("_deg")
}

fn index_or_push<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|other| *other == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

/// One factor of a term.
#[derive(Debug, Clone, PartialEq)]
enum Factor {
    Number(f64),
    /// An input, by its name with unit.
    Input(String),
    /// A function of inputs.
    Function {
        /// Name of the function.
        name: String,
        /// Names of its inputs, with units.
        inputs: Vec<String>,
    },
}

fn factors(term: &str) -> Result<Vec<Factor>, String> {
    let mut factors = Vec::new();
    let mut rest = term.trim();
    while !rest.is_empty() {
        let end = rest.find(|c: char| c.is_whitespace() || c == '(').unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        if let Some(inside) = after.trim_start().strip_prefix('(') {
            let (arguments, after) =
                inside.split_once(')').ok_or("has an open bracket, expected ) after the inputs")?;
            let inputs =
                arguments.split(',').map(|input| name(input.trim())).collect::<Result<_, _>>()?;
            factors.push(Factor::Function { name: name(word)?, inputs });
            rest = after.trim_start();
        } else {
            factors.push(match number(word) {
                Some(number) if number.is_finite() => Factor::Number(number),
                Some(_) => return Err(format!("has {word}, expected finite numbers")),
                None => Factor::Input(name(word)?),
            });
            rest = after.trim_start();
        }
    }
    if factors.is_empty() { Err("is empty, expected a product".to_owned()) } else { Ok(factors) }
}

/// A number, or one over another without a space.
fn number(word: &str) -> Option<f64> {
    let (above, below) = word.split_once('/').unwrap_or((word, "1"));
    Some(above.parse::<f64>().ok()? / below.parse::<f64>().ok()?)
}

fn name(word: &str) -> Result<String, String> {
    let good = word.starts_with(|c: char| c.is_ascii_lowercase())
        && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if good {
        Ok(word.to_owned())
    } else {
        Err(format!("has {word:?}, expected a number or a name"))
    }
}
