//! The spectra of the plant's turbulence beside those of the standard: `sitl study turbulence`.
//!
//! ```text
//! level, heights, airspeed ─> filters of the plant ─> six axes over time ─> Welch ─> bands ─┬─> table, picture
//!                          └> formulas of MIL-F-8785C ─────────────────────────────> bands ─┘
//! ```

use host_io::{print_line, print_text};
use std::fmt::Write as _;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use icd::{Attitude, Ned};
use lab_tables::{Table, cells, table};
use plant_sim::io::whole;
use plant_sim::wind::level::spectra;
use plant_sim::wind::{LevelTurbulence, Surroundings, TurbulenceLevel};

use host_io::problem::{Problem, problem};
use lab_report::chart::panel::{Curve, Panel};
use lab_report::chart::{Figure, Ink, Pattern, sheet, write_figure};

use lab_judges::spectrum::{SpectrumBand, Welch};

/// Names of the axes, and the units of their spectra.
pub const AXES: [(&str, &str); 6] = [
    ("u", "log10 (m/s)²/(rad/m)"),
    ("v", "log10 (m/s)²/(rad/m)"),
    ("w", "log10 (m/s)²/(rad/m)"),
    ("p", "log10 (rad/s)²/(rad/m)"),
    ("q", "log10 (rad/s)²/(rad/m)"),
    ("r", "log10 (rad/s)²/(rad/m)"),
];

/// Most heights in one picture.
const HEIGHTS_MAX: usize = 3;
/// Their colours.
const COLOURS: [&str; HEIGHTS_MAX] = ["#0050aa", "#d95f02", "#3a8f5c"];
/// The way between two samples, as a part of the span and of L_w: the bends of the spectra lie far below the highest frequency.
const WAY_PER_SPAN: f64 = 0.05;
const WAY_PER_LENGTH: f64 = 0.02;
/// Lengths of turbulence in one segment of the estimate, times 2π.
const LENGTHS: f64 = 50.0;
/// Most samples, so that an absurd duration ends with a message.
const SAMPLES_MAX: f64 = 2.0e8;

/// Options of `sitl study turbulence`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct TurbulenceArgs {
    /// Level of the standard
    #[arg(long, value_name = "light|moderate|severe", value_parser = level)]
    pub level: TurbulenceLevel,
    /// Height above the ground, m; up to three, separated by commas
    #[arg(
        long,
        value_name = "M",
        value_delimiter = ',',
        allow_hyphen_values = true,
        required = true
    )]
    pub altitude_m: Vec<f64>,
    /// True airspeed, m/s
    #[arg(long, value_name = "M_S", allow_hyphen_values = true)]
    pub airspeed_m_s: f64,
    /// Span of the aircraft, m
    #[arg(long, value_name = "M", default_value_t = 9.144, allow_hyphen_values = true)]
    pub span_m: f64,
    /// Duration of the flight through the air, s
    #[arg(long, value_name = "S", default_value_t = 3_600.0, allow_hyphen_values = true)]
    pub seconds: f64,
    /// Seed of the random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
    /// Folder for the table and the picture
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

fn level(text: &str) -> Result<TurbulenceLevel, String> {
    let found = TurbulenceLevel::ALL.into_iter().find(|level| level.key() == text);
    found.ok_or_else(|| "expected light, moderate or severe".to_owned())
}

/// A height above the ground, m, and the spectra of the six axes there.
type Flown = (f64, [Vec<SpectrumBand>; 6]);

impl TurbulenceArgs {
    /// Spectra of the six axes on a flight at a height, straight and level in calm air.
    pub fn fly(&self, height_m: f64) -> [Vec<SpectrumBand>; 6] {
        let scales = self.level.scales(height_m);
        let way_m = (WAY_PER_SPAN * self.span_m).min(WAY_PER_LENGTH * scales.vertical_m);
        let period_s = way_m / self.airspeed_m_s;
        let longest_m = scales.horizontal_m.max(scales.vertical_m);
        let mut air = LevelTurbulence::new(self.level, self.span_m, period_s, self.seed, 0);
        let at = Surroundings {
            airspeed_m_s: self.airspeed_m_s,
            height_m,
            attitude: Attitude::identity(),
            wind: Ned::zero(),
        };
        // Limited.
        let whole = |value: f64| value.min(SAMPLES_MAX) as usize;
        // The transform wants a power of two.
        let segment = whole(LENGTHS * longest_m / way_m).next_power_of_two();
        // The filters start still.
        for _ in 0..segment / 4 {
            air.step(&at);
        }
        let mut welch = [(); 6].map(|()| Welch::new(segment));
        // At least one whole segment, or there is no estimate.
        for _ in 0..whole(self.seconds / period_s).max(segment) {
            let gust = air.step(&at);
            let values = gust.velocity.0.iter().chain(gust.rates.0.iter());
            for (welch, value) in welch.iter_mut().zip(values) {
                welch.add(*value);
            }
        }
        let formula = |axis: usize, omega| spectra(&scales, self.span_m, omega)[axis];
        let mut axis = 0;
        welch.map(|welch| {
            let bands = welch.bands(way_m, |omega| formula(axis, omega));
            axis += 1;
            bands
        })
    }
}

/// Flies, draws and writes.
///
/// # Errors
/// An option that cannot be, with its range; what prevents the files.
pub fn run(args: &TurbulenceArgs) -> Result<(), Problem> {
    args.check()?;
    let folder = OutFolder::create(&args.out)?;
    let flown: Vec<Flown> =
        args.altitude_m.iter().map(|height_m| (*height_m, args.fly(*height_m))).collect();
    table(&flown).write(folder.path())?;
    write_figure(&folder, &figure(args, &flown))?;
    print_text!("{}", summary(args, &flown));
    print_line!("wrote {}", args.out.display());
    Ok(())
}

impl TurbulenceArgs {
    fn check(&self) -> Result<(), Problem> {
        let check = |option: &str, value: f64, least: f64, most: f64| match value {
            value if (least..=most).contains(&value) => Ok(()),
            value => Err(problem!("--{option} {value} is outside {least} to {most}")),
        };
        if self.altitude_m.len() > HEIGHTS_MAX {
            let found = self.altitude_m.len();
            return Err(problem!("--altitude-m: {found} heights, at most {HEIGHTS_MAX}"));
        }
        for height_m in &self.altitude_m {
            check("altitude-m", *height_m, 0.0, 25_000.0)?;
        }
        // Below 20 m/s the turbulence of the plant does not change more slowly.
        check("airspeed-m-s", self.airspeed_m_s, 20.0, 1_000.0)?;
        check("span-m", self.span_m, 0.5, 100.0)?;
        check("seconds", self.seconds, 1.0, 1.0e6)
    }
}

fn table(flown: &[Flown]) -> Table {
    let mut table = table!("turbulence",
        altitude_m: Number, axis: Text, omega_rad_m: Number, spectrum: Number, formula: Number,
        segments: Number);
    for (height_m, axes) in flown {
        for (bands, (axis, _)) in axes.iter().zip(AXES) {
            for SpectrumBand { omega_rad_m, estimate, formula, count } in bands {
                table.rows.push(cells![*height_m, axis, *omega_rad_m, *estimate, *formula, *count]);
            }
        }
    }
    table
}

/// The largest deviation of each axis, in the bands that have enough estimates.
fn summary(args: &TurbulenceArgs, flown: &[Flown]) -> String {
    let mut text = String::new();
    for (height_m, axes) in flown {
        let scales = args.level.scales(*height_m);
        let _ = writeln!(
            text,
            "{} at {height_m} m: L {:.1} m, {:.1} m up; intensity {:.2} m/s, {:.2} m/s up",
            args.level,
            scales.horizontal_m,
            scales.vertical_m,
            scales.horizontal_m_s,
            scales.vertical_m_s
        );
        for (bands, (axis, _)) in axes.iter().zip(AXES) {
            let far = |band: &SpectrumBand| (band.estimate / band.formula - 1.0).abs();
            // The average of a hundred estimates is good to a tenth.
            let certain = bands.iter().filter(|band| band.count >= 100.0);
            let worst = certain.map(far).fold(0.0, f64::max);
            let _ = writeln!(text, "  {axis}: within {:.1} % of the formula", 100.0 * worst);
        }
    }
    text
}

fn figure(args: &TurbulenceArgs, flown: &[Flown]) -> Figure {
    let TurbulenceArgs { level, airspeed_m_s, span_m, .. } = args;
    let title = format!("Turbulence, {level}, at {airspeed_m_s} m/s, span {span_m} m");
    let flown_ink = |place: usize| Ink::new(COLOURS[place % HEIGHTS_MAX], Pattern::Solid).wide(2.4);
    let formula = Ink::new("#111111", Pattern::Dashed).wide(1.2);
    let names: Vec<String> =
        flown.iter().map(|(height_m, _)| format!("flown at {height_m} m")).collect();
    let mut legend: Vec<(&str, Ink)> =
        names.iter().enumerate().map(|(place, name)| (name.as_str(), flown_ink(place))).collect();
    legend.push(("MIL-F-8785C", formula));
    let log = |omega: f64, value: f64| (omega.log10(), value.max(1.0e-300).log10());
    let panels: Vec<Panel<'_>> = AXES
        .iter()
        .enumerate()
        .map(|(axis, (name, y_label))| {
            let mut curves = Vec::new();
            for (place, (_, axes)) in flown.iter().enumerate() {
                let of = |value: fn(&SpectrumBand) -> f64| {
                    axes[axis].iter().map(|band| log(band.omega_rad_m, value(band))).collect()
                };
                curves.push(Curve::unnamed(of(|band| band.estimate), flown_ink(place)));
                curves.push(Curve::unnamed(of(|band| band.formula), formula));
            }
            let all = || curves.iter().flat_map(|curve| curve.points.iter());
            let range = |values: &mut dyn Iterator<Item = f64>| {
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                    (low.min(value), high.max(value))
                })
            };
            let (low, high) = range(&mut all().map(|point| point.1));
            Panel {
                title: format!("{name}_g"),
                x_label: "log10 of the spatial frequency, rad/m",
                y_label,
                x: range(&mut all().map(|point| point.0)),
                y: (low - 0.2, high + 0.2),
                height: 240.0,
                curves,
                ..Panel::default()
            }
        })
        .collect();
    let caption = "Spectra of the six axes of turbulence against the standard".to_owned();
    Figure { name: "turbulence", caption, svg: sheet(&title, &legend, 3, &panels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(level: TurbulenceLevel, seconds: f64) -> TurbulenceArgs {
        let (altitude_m, out) = (vec![100.0], PathBuf::new());
        TurbulenceArgs { level, altitude_m, airspeed_m_s: 60.0, span_m: 3.0, seconds, seed: 1, out }
    }

    #[test]
    fn val_spectra_of_all_six_axes_are_those_of_the_standard_at_every_level_low_and_high() {
        for level in TurbulenceLevel::ALL {
            for height_m in [30.0, 5_000.0] {
                // Forty segments of the longest length.
                let longest_m = level.scales(height_m).horizontal_m;
                let axes = args(level, 40.0 * LENGTHS * longest_m / 60.0).fly(height_m);
                for (bands, (axis, _)) in axes.iter().zip(AXES) {
                    let certain: Vec<&SpectrumBand> =
                        bands.iter().filter(|band| band.count >= 100.0).collect();
                    assert!(certain.len() > 8, "{level}, {height_m} m, {axis}: too few bands");
                    for band in certain {
                        // One over the root of the count is one deviation of the estimate; four are allowed, and 4 % for
                        // the frequencies beyond the highest one, which fold back.
                        let allowed = 4.0 / band.count.sqrt() + 0.04;
                        let ratio = band.estimate / band.formula;
                        assert!(
                            (ratio - 1.0).abs() < allowed,
                            "{level}, {height_m} m, {axis} at {} rad/m: {ratio} of the formula, {} estimates",
                            band.omega_rad_m,
                            band.count
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn an_option_that_cannot_be_is_named_with_its_range() {
        let args = args(TurbulenceLevel::Light, 10.0);
        assert_eq!(args.check(), Ok(()));
        let refused = |args: TurbulenceArgs| args.check().unwrap_err().to_string();
        let slow = TurbulenceArgs { airspeed_m_s: 3.0, ..args.clone() };
        assert_eq!(refused(slow), "--airspeed-m-s 3 is outside 20 to 1000");
        let nowhere = TurbulenceArgs { altitude_m: vec![f64::NAN], ..args.clone() };
        assert!(refused(nowhere).contains("--altitude-m NaN"));
        let many = TurbulenceArgs { altitude_m: vec![1.0; 4], ..args };
        assert!(refused(many).contains("at most 3"));
        assert!(level("mild").unwrap_err().contains("light, moderate or severe"));
    }

    #[test]
    fn table_and_picture_have_all_axes() {
        let args = args(TurbulenceLevel::Light, 1.0);
        let flown = vec![(30.0, args.fly(30.0))];
        let text = table(&flown).csv();
        for (axis, _) in AXES {
            assert!(text.contains(&format!("\n30,{axis},")), "{axis}");
            assert!(figure(&args, &flown).svg.contains(&format!("{axis}_g")));
        }
        assert!(summary(&args, &flown).contains("light at 30 m"));
    }
}
