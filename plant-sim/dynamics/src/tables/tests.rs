use super::lookup::{SumText, Sums};
use super::*;
use proptest::prelude::*;

fn text(inputs: &[&str], csv: &str) -> TableText {
    let inputs = inputs.iter().map(|name| (*name).to_owned()).collect();
    TableText { inputs, outside: Outside::Clamp, odd_in: None, csv: csv.to_owned() }
}

fn refusal(inputs: &[&str], csv: &str) -> String {
    text(inputs, csv).read().unwrap_err().to_string()
}

const GRID: &str = "
x, y_deg, f, g
0, 0, 1, 10
0, 10, 2, 20
0, 30, 4, 40
1, 0, 5, 50   # a row may say something
1, 10, 6, 60

1, 30, 8, 80
";

fn grid() -> TableText {
    text(&["x", "y_deg"], GRID)
}

/// The sum of these terms at inputs x, y_rad and z.
fn sum(tables: &[TableText], terms: &[&str], inputs: [f64; 3]) -> Result<f64, Problem> {
    let tables: Vec<Table> = tables.iter().map(|table| table.read().unwrap()).collect();
    let terms: Vec<String> = terms.iter().map(|term| (*term).to_owned()).collect();
    let sums = [SumText { key: "c_x", terms: &terms }];
    let names = ["x", "y_rad", "z"].map(str::to_owned);
    let sums = Sums::new(&tables, &sums, &names)?;
    let mut out = [0.0];
    sums.add_to(&mut out, &inputs);
    Ok(out[0])
}

fn at(table: &TableText, term: &str, x: f64, y_deg: f64) -> f64 {
    sum(std::slice::from_ref(table), &[term], [x, y_deg.to_radians(), 0.0]).unwrap()
}

#[test]
fn a_table_is_read_with_its_breakpoints_and_values() {
    let table = grid().read().unwrap();
    assert_eq!(table.inputs[0].breakpoints, [0.0, 1.0]);
    assert_eq!(table.inputs[1].breakpoints, [0.0, 10.0, 30.0]);
    assert_eq!(table.functions, ["f", "g"]);
    assert_eq!(table.values.len(), 12);
}

#[test]
fn values_between_breakpoints_lie_on_lines_and_outside_at_the_ends() {
    let close = |ours: f64, expected: f64| {
        assert!((ours - expected).abs() < 1e-12, "{ours} is not {expected}");
    };
    close(at(&grid(), "f(x, y_deg)", 0.0, 0.0), 1.0);
    close(at(&grid(), "f(x, y_deg)", 1.0, 30.0), 8.0);
    close(at(&grid(), "f(x, y_deg)", 0.5, 20.0), 5.0);
    close(at(&grid(), "2 g(x, y_deg)", 0.25, 5.0), 2.0 * 25.0);
    close(at(&grid(), "f(x, y_deg)", 7.0, -9.0), 5.0);
    let extrapolating = TableText { outside: Outside::Extrapolate, ..grid() };
    close(at(&extrapolating, "f(x, y_deg)", 2.0, -10.0), 8.0);
    close(at(&extrapolating, "f(x, y_deg)", 0.0, 40.0), 5.0);
}

#[test]
fn an_odd_table_is_mirrored_to_the_bit() {
    let csv = "x, y_deg, f\n0, 0, 0\n0, 30, 0\n1, 0, 5\n1, 30, 8";
    let odd = TableText { odd_in: Some("x".to_owned()), ..text(&["x", "y_deg"], csv) };
    for x in [0.0, 0.3, 1.0, 5.0] {
        assert_eq!(at(&odd, "f(x, y_deg)", -x, 17.0), -at(&odd, "f(x, y_deg)", x, 17.0), "{x}");
    }
    assert_eq!(at(&odd, "f(x, y_deg)", -0.5, 0.0), -2.5);
    let step = TableText { odd_in: Some("x".to_owned()), ..grid() };
    let message = step.read().unwrap_err().to_string();
    assert_eq!(message, "line 2: f = 1, expected 0 at x = 0: the functions are odd in it");
}

#[test]
fn a_term_multiplies_numbers_inputs_in_their_units_and_one_function() {
    let terms = ["0.5 -8/2 x y_deg", "z z", "3"];
    let value = sum(&[], &terms, [2.0, 90.0_f64.to_radians(), 5.0]).unwrap();
    assert!((value - (-360.0 + 25.0 + 3.0)).abs() < 1e-12, "{value}");
    let twice =
        sum(&[grid()], &["f(x, y_deg) z", "f(z, y_deg)", "g(x,y_deg)"], [0.0, 0.0, 1.0]).unwrap();
    assert_eq!(twice, 1.0 + 5.0 + 10.0, "the same table at two places, and two of its functions");
}

#[test]
fn an_error_in_a_table_names_line_value_and_expected_value() {
    let xy = ["x", "y_deg"];
    for (from, to, message) in [
        (
            "x, y_deg, f, g",
            "x, z, f, g",
            "line 1: header \"x, z, f, g\", expected x, y_deg and then the name of at least one function",
        ),
        (
            "x, y_deg, f, g",
            "x, y_deg, f, f",
            "line 1: the column f stands twice, expected one column for each name",
        ),
        ("0, 10, 2, 20", "0, 10, 2", "line 3: 3 values, expected 4 as in the header"),
        ("0, 10, 2, 20", "0, 10, two, 20", "line 3: f = \"two\", expected a finite number"),
        ("0, 10, 2, 20", "0, 10, 2, inf", "line 3: g = \"inf\", expected a finite number"),
        ("0, 10, 2, 20", "0, 10, 2, nan", "line 3: g = \"nan\", expected a finite number"),
        (
            "0, 10, 2, 20",
            "0, -10, 2, 20",
            "line 3: y_deg = -10, expected more than 0: breakpoints increase",
        ),
        ("1, 10, 6, 60", "1, 11, 6, 60", "line 6: y_deg = 11, expected 10"),
        ("1, 0, 5, 50", "1, 30, 5, 50", "line 5: y_deg = 30, expected 0"),
        (
            "1, 30, 8, 80",
            "",
            "5 rows of values, expected 6: one for each combination of 2 x 3 breakpoints",
        ),
        (
            "1, 30, 8, 80",
            "1, 30, 8, 80\n1, 30, 8, 80",
            "7 rows of values, expected 6: one for each combination of 2 x 3 breakpoints",
        ),
    ] {
        assert!(GRID.contains(from));
        assert_eq!(refusal(&xy, &GRID.replacen(from, to, 1)), message);
    }
    assert_eq!(refusal(&[], GRID), "inputs = 0 names, expected 1 to 4");
    assert_eq!(refusal(&["x"], "x, f\n1, 2"), "x has 1 breakpoints, expected 2 to 200");
    assert_eq!(refusal(&["x"], "x, f"), "x has 0 breakpoints, expected 2 to 200");
    let odd = TableText { odd_in: Some("z".to_owned()), ..grid() };
    assert!(odd.read().unwrap_err().to_string().starts_with("odd_in = \"z\", expected an input"));
}

#[test]
fn an_error_in_a_term_names_key_term_and_expected_value() {
    for (term, message) in [
        ("f(x", "has an open bracket, expected ) after the inputs"),
        ("", "is empty, expected a product"),
        ("2 Alpha", "has \"Alpha\", expected a number or a name"),
        ("2 w", "has w, expected a number or one of x, y_rad, z"),
        ("inf x", "has inf, expected finite numbers"),
        ("1/0 x", "has 1/0, expected finite numbers"),
        ("h(x)", "has h(), expected one of f, g"),
        ("f(x)", "has 1 inputs of f(), expected 2"),
        ("f(x, y_rad)", "has y_rad as input of f(), expected the unit of its column y_deg"),
        ("f(x, y_deg) g(x, y_deg)", "has two functions, expected at most one"),
        ("x x x x", "has 4 inputs, expected at most 3"),
    ] {
        let error = sum(&[grid()], &[term], [0.0; 3]).unwrap_err().to_string();
        assert_eq!(error, format!("c_x: term {term:?} {message}"));
    }
}

proptest! {
    #[test]
    fn a_multilinear_function_comes_out_as_it_is_in_three_dimensions(
        a in proptest::array::uniform8(-3.0..3.0_f64), x in -2.0..2.0_f64, y in -1.0..4.0_f64, z in 0.0..5.0_f64,
    ) {
        let f = |x: f64, y: f64, z: f64| {
            a[0] + a[1] * x + a[2] * y + a[3] * z + a[4] * x * y + a[5] * x * z + a[6] * y * z + a[7] * x * y * z
        };
        let mut csv = "x, y_rad, z, f\n".to_owned();
        for i in [-2.0, -0.5, 2.0] {
            for j in [-1.0, 4.0] {
                for k in [0.0, 1.0, 3.0, 5.0] {
                    csv += &format!("{i}, {j}, {k}, {}\n", f(i, j, k));
                }
            }
        }
        let ours = sum(&[text(&["x", "y_rad", "z"], &csv)], &["f(x, y_rad, z)"], [x, y, z]).unwrap();
        // Rounding of eight products of numbers up to 3 * 40.
        prop_assert!((ours - f(x, y, z)).abs() < 1e-11, "{ours} is not {}", f(x, y, z));
    }

    #[test]
    fn no_text_makes_a_table_or_a_term_panic(csv in ".{0,200}", term in ".{0,60}") {
        let _ = text(&["x"], &csv).read().map_err(|error| error.to_string());
        let _ = sum(&[grid()], &[&term], [f64::NAN, f64::INFINITY, -1.0e300]).map_err(|error| error.to_string());
    }
}
