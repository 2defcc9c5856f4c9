//! Sums of terms as an airframe file writes them, which combine tables and inputs.
//!
//! ```text
//! term   = factor { factor }          a product
//! factor = number [ "/" number ] | input | function "(" input { "," input } ")"
//! ```
//!
//! An input carries its unit, as in `left_elevator_deg`; a function is a column of a table, and has as many inputs as
//! its table, in the same units. `-0.0076 left_elevator_deg` is a term, `c_roll_p(alpha_deg) p_span_2v` another.

/// One factor of a term.
#[derive(Debug, Clone, PartialEq)]
pub enum Factor {
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

pub fn factors(term: &str) -> Result<Vec<Factor>, String> {
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
