//! `sitl aircraft trimmable`: which jams leave a steady flight at all, whatever the controller does.

use host_io::{print_line, print_text};
use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use host_io::file;
use host_io::folder::OutFolder;
use icd::Effector;
use lab_tables::{Table, cells, table};
use plant_sim::airframe::Airframe;
use plant_sim::dynamics::Dynamics;
use plant_sim::earth::{Earth, EarthModel};
use plant_sim::trim::{self, Trim};

use lab_engine::configuration::AircraftArgs;
use lab_engine::settings::Target;
use lab_judges::steady::{Search, SteadyFlight};
use lab_report::chart::write_figure;
use lab_report::runner;
use sets::Set;

pub mod picture;
pub mod sets;

/// Part of the healthy authority that is left on every axis where a margin is required.
pub const MARGIN: f64 = 0.1;
/// Halvings between the last jam with a steady flight and the first without.
const HALVINGS: u32 = 5;
/// Steps of the jams of an engine over its range.
const ENGINE_STEPS: f64 = 20.0;

/// Options of `sitl aircraft trimmable`.
#[derive(Debug, Clone, clap::Args)]
pub struct TrimmableArgs {
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// Which steady flights count, instead of the sets that come with the program
    #[arg(long, value_name = "FILE")]
    sets: Option<PathBuf>,
    /// Step of the jams, deg
    #[arg(long, value_name = "DEG", default_value_t = 1.0, value_parser = step, allow_hyphen_values = true)]
    step_deg: f64,
    /// Also jam two effectors at once, in steps of this many degrees
    #[arg(long, value_name = "DEG", value_parser = step, allow_hyphen_values = true)]
    pairs_deg: Option<f64>,
    /// Folder for the tables and the picture
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Parser of a step.
fn step(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(step) if (0.05..=90.0).contains(&step) => Ok(step),
        _ => Err("expected a number from 0.05 to 90 deg".to_owned()),
    }
}

/// One jam, and the steady flight that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The jammed effectors by their place in the list, with their positions, rad or N: one or two.
    pub jams: Vec<(usize, f64)>,
    /// A steady flight.
    pub flight: Option<SteadyFlight>,
}

/// The jams of one effector in one set.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Place of the set in the file.
    pub set: usize,
    /// With [`MARGIN`] left on every axis.
    pub margin: bool,
    /// The effector.
    pub effector: usize,
    /// Largest jam to the negative and to the positive side up to which every jam leaves a steady flight, rad or N; `None`
    /// if not even the healthy aircraft has one.
    pub limits: Option<[f64; 2]>,
    /// The jams.
    pub rows: Vec<Row>,
}

impl Sweep {
    /// A flight with a margin is a flight: the search, which is local, may have found it there only.
    fn include(&mut self, with_margin: &Self) {
        include(&mut self.rows, &with_margin.rows);
        self.limits = match (self.limits, with_margin.limits) {
            (Some([low, high]), Some([other_low, other_high])) => {
                Some([low.min(other_low), high.max(other_high)])
            }
            (one, other) => one.or(other),
        };
    }
}

/// The same for the jams themselves.
fn include(rows: &mut [Row], with_margin: &[Row]) {
    for row in rows.iter_mut().filter(|row| row.flight.is_none()) {
        let same = with_margin.iter().find(|other| other.jams == row.jams);
        row.flight = same.and_then(|other| other.flight);
    }
}

/// A set by its place, whether the margin is required, and the search.
type SetSearch<'a> = (usize, bool, Search<'a>);
/// A set by its place, whether the margin is required, and jams.
type Jams = (usize, bool, Vec<Row>);

/// An aircraft and the sets.
#[derive(Debug)]
pub struct Study {
    dynamics: Dynamics,
    sets: Vec<Set>,
    /// Level flight of the healthy aircraft at the design point.
    trim: Trim,
}

/// Computes and writes.
pub fn run(args: &TrimmableArgs) -> Result<(), Box<dyn Error>> {
    args.aircraft.check_read(&[Target::Airframe])?;
    let study = Study::new(args.aircraft.airframe()?, args.sets()?)?;
    let folder = OutFolder::create(&args.out)?;
    let sweeps = study.singles(args.step_deg);
    let pairs = match args.pairs_deg {
        Some(step_deg) => study.pairs(step_deg),
        None => Vec::new(),
    };
    let table = study.markdown(&sweeps);
    study.table(&sweeps, &pairs).write(folder.path())?;
    folder.write_markdown("trimmable.md", &table)?;
    write_figure(&folder, &picture::figure(&study, &sweeps))?;
    print_text!("{table}");
    print_line!("wrote {}", args.out.display());
    Ok(())
}

impl TrimmableArgs {
    fn sets(&self) -> Result<Vec<Set>, Box<dyn Error>> {
        let Some(path) = &self.sets else { return Ok(sets::read("sets.toml", sets::SHIPPED)?) };
        let text = file::read_text(path, file::TEXT_MAX)
            .map_err(|problem| format!("--sets {}: {problem}", path.display()))?;
        Ok(sets::read(&path.display().to_string(), &text)?)
    }
}

impl Study {
    /// An aircraft over a flat Earth, in still air.
    pub fn new(airframe: Airframe, sets: Vec<Set>) -> Result<Self, Box<dyn Error>> {
        let earth = Earth::new(EarthModel::Flat, airframe.design_point.geodetic());
        let dynamics = Dynamics::new(airframe, earth)?;
        let design = dynamics.airframe().design_point;
        let trim = trim::solve(&dynamics, &design, &icd::Ned::zero())?;
        Ok(Self { dynamics, sets, trim })
    }

    /// The aircraft.
    pub fn airframe(&self) -> &Airframe {
        self.dynamics.airframe()
    }

    /// The sets.
    pub fn sets(&self) -> &[Set] {
        &self.sets
    }

    /// The effectors in the order of the list.
    pub fn effectors(&self) -> Vec<Effector> {
        self.airframe().effectors.all().collect()
    }

    /// The search of each set, without and with a margin.
    fn searches(&self) -> Vec<SetSearch<'_>> {
        let design = self.airframe().design_point;
        let of_set = |(place, set): (usize, &Set)| {
            let search = Search::new(&self.dynamics, set.bounds(&design), set.thrust_part);
            let with_margin = search.with_margin(MARGIN, &self.trim);
            [(place, false, search), (place, true, with_margin)]
        };
        self.sets.iter().enumerate().flat_map(of_set).collect()
    }

    /// Every effector alone.
    pub fn singles(&self, step_deg: f64) -> Vec<Sweep> {
        let searches = self.searches();
        let count = self.airframe().effectors.len();
        let items: Vec<_> =
            searches.iter().flat_map(|search| (0..count).map(move |e| (search, e))).collect();
        let mut sweeps =
            runner::map("jams of one effector", &items, |((set, margin, search), effector)| {
                self.sweep(*set, *margin, search, *effector, step_deg)
            });
        // Each set stands twice, without and with the margin.
        for both in sweeps.chunks_mut(2 * count) {
            let (bare, with_margin) = both.split_at_mut(count);
            for (bare, with_margin) in bare.iter_mut().zip(with_margin) {
                bare.include(with_margin);
            }
        }
        sweeps
    }

    /// Positions at which an effector jams: zero, of an engine the thrust of a healthy flight, and from there outwards on
    /// either side.
    fn jams(
        &self,
        effector: usize,
        step_deg: f64,
        healthy: Option<&SteadyFlight>,
    ) -> (f64, [Vec<f64>; 2]) {
        let airframe = self.airframe();
        let all = self.effectors();
        let servo = &airframe.servos[all[effector]];
        let is_angle = airframe.effectors.is_angle(all[effector]);
        let step =
            if is_angle { step_deg.to_radians() } else { (servo.max - servo.min) / ENGINE_STEPS };
        let thrust =
            || healthy.map_or(&self.trim.positions, |flight| &flight.positions)[all[effector]];
        let middle = if is_angle { 0.0 } else { thrust() };
        let sides = [servo.min, servo.max].map(|end| {
            // Rounding must not add a step without a length.
            let steps = ((end - middle).abs() / step - 1.0e-9).ceil().max(0.0);
            // A few hundred.
            let steps = steps as u32;
            let at = |i: u32| middle + (end - middle).signum() * step * f64::from(i);
            // The last step is shorter, to end exactly at the stop.
            (1..=steps).map(|i| if i == steps { end } else { at(i) }).collect()
        });
        (middle, sides)
    }

    fn sweep(
        &self,
        set: usize,
        margin: bool,
        search: &Search<'_>,
        effector: usize,
        step_deg: f64,
    ) -> Sweep {
        let healthy = search.find(&[]);
        let (middle, sides) = self.jams(effector, step_deg, healthy.as_ref());
        let find = |at: f64, near: &[SteadyFlight]| search.jammed(&[(effector, at)]).find(near);
        let at_end =
            |at: f64, near: &[SteadyFlight]| search.jammed(&[(effector, at)]).find_thoroughly(near);
        let mut rows = Vec::new();
        let first = find(middle, healthy.as_slice());
        rows.push(Row { jams: vec![(effector, middle)], flight: first });
        let limits = sides.map(|side| {
            let (mut last, mut near, mut inside) = (middle, first, first.is_some());
            for at in side {
                // Behind the end of the range a flight may exist again; it is looked for with less effort.
                let flight =
                    if inside { at_end(at, near.as_slice()) } else { find(at, near.as_slice()) };
                rows.push(Row { jams: vec![(effector, at)], flight });
                // The next search begins at the flight that was found last.
                match flight {
                    Some(_) if inside => (last, near) = (at, flight),
                    Some(_) => near = flight,
                    None if inside => {
                        inside = false;
                        let (mut low, mut high) = (last, at);
                        for _ in 0..HALVINGS {
                            let between = 0.5 * (low + high);
                            match at_end(between, near.as_slice()) {
                                Some(found) => (low, near) = (between, Some(found)),
                                None => high = between,
                            }
                        }
                        last = low;
                    }
                    None => {}
                }
            }
            last
        });
        rows.sort_by(|a, b| a.jams[0].1.total_cmp(&b.jams[0].1));
        Sweep { set, margin, effector, limits: first.map(|_| limits), rows }
    }

    /// Every two effectors at once.
    fn pairs(&self, step_deg: f64) -> Vec<Jams> {
        let searches = self.searches();
        let count = self.airframe().effectors.len();
        let mut items = Vec::new();
        for search in &searches {
            for one in 0..count {
                items.extend((one + 1..count).map(|other| (search, one, other)));
            }
        }
        let all = |effector| {
            let (middle, [below, above]) = self.jams(effector, step_deg, None);
            below.into_iter().rev().chain([middle]).chain(above).collect::<Vec<f64>>()
        };
        let mut pairs = runner::map("jams of two effectors", &items, |item| {
            let ((set, margin, search), one, other) = item;
            let mut rows: Vec<Row> = Vec::new();
            let others = all(*other);
            for at in all(*one) {
                for (place, then) in others.iter().enumerate() {
                    let jams = vec![(*one, at), (*other, *then)];
                    // The neighbours that are solved already.
                    let before = rows.len().checked_sub(1).filter(|_| place > 0);
                    let below = rows.len().checked_sub(others.len());
                    let near: Vec<SteadyFlight> = [before, below]
                        .into_iter()
                        .flatten()
                        .filter_map(|i| rows[i].flight)
                        .collect();
                    let flight = search.jammed(&jams).find(&near);
                    rows.push(Row { jams, flight });
                }
            }
            (*set, *margin, rows)
        });
        // There are count (count - 1) / 2 pairs, without and with the margin.
        for both in pairs.chunks_mut(count * (count - 1)) {
            let (bare, with_margin) = both.split_at_mut(both.len() / 2);
            for ((.., bare), (.., with_margin)) in bare.iter_mut().zip(with_margin) {
                include(bare, with_margin);
            }
        }
        pairs
    }

    /// Factor and unit of a position for people.
    fn unit(&self, effector: usize) -> (f64, &'static str) {
        let (airframe, effector) = (self.airframe(), self.effectors()[effector]);
        airframe.effectors.shown_unit(effector, airframe.servos[effector].max)
    }

    fn engine_unit(&self) -> &'static str {
        let list = &self.airframe().effectors;
        let engine = self.effectors().iter().position(|effector| !list.is_angle(*effector));
        engine.map_or("kN", |engine| self.unit(engine).1)
    }

    /// Position in the unit of people.
    pub fn shown(&self, effector: usize, value: f64) -> f64 {
        value * self.unit(effector).0
    }

    fn table(&self, sweeps: &[Sweep], pairs: &[Jams]) -> Table {
        let mut table = table!("trimmable",
            set: Text, margin: Integer, effector: Text, jammed_at: Number, other_effector: Text,
            other_jammed_at: Number, exists: Integer, airspeed_m_s: Number,
            angle_of_attack_deg: Number, sideslip_deg: Number, bank_deg: Number, climb_deg: Number,
            turn_rate_deg_s: Number);
        let singles = sweeps.iter().map(|s| (s.set, s.margin, &s.rows));
        let all = singles.chain(pairs.iter().map(|(set, margin, rows)| (*set, *margin, rows)));
        let (list, effectors) = (&self.airframe().effectors, self.effectors());
        for (set, margin, rows) in all {
            for Row { jams, flight } in rows {
                let mut row = cells![&self.sets[set].key, margin];
                for place in 0..2 {
                    let jam = jams.get(place);
                    row.push(jam.map(|(effector, _)| list.key(effectors[*effector])).into());
                    row.push(jam.map(|(effector, at)| self.shown(*effector, *at)).into());
                }
                row.extend(cells![flight.is_some(), flight.map(|f| f.airspeed_m_s)]);
                let angles = flight
                    .map(|f| [f.alpha_rad, f.beta_rad, f.bank_rad, f.climb_rad, f.turn_rate_rad_s]);
                row.extend((0..5).map(|place| angles.map(|all| all[place].to_degrees()).into()));
                table.rows.push(row);
            }
        }
        table
    }

    /// The limits of every effector in every set, in Markdown.
    pub fn markdown(&self, sweeps: &[Sweep]) -> String {
        let airframe = self.airframe();
        let list = &airframe.effectors;
        let mut text = format!(
            "Jams of {} up to which a steady flight exists, deg (engine: {}), at {} m; with {:.0} %: a tenth of the healthy authority \
             left on every axis both ways.\n\n| jammed |",
            airframe.name,
            self.engine_unit(),
            airframe.design_point.altitude_m,
            100.0 * MARGIN
        );
        for set in &self.sets {
            let _ = write!(text, " {} | with {:.0} % |", set.name, 100.0 * MARGIN);
        }
        let _ = write!(text, "\n|---|{}\n", "---|".repeat(2 * self.sets.len()));
        for (place, effector) in self.effectors().into_iter().enumerate() {
            let _ = write!(text, "| {} |", list.name(effector));
            for sweep in sweeps.iter().filter(|sweep| sweep.effector == place) {
                let _ = match sweep.limits {
                    None => write!(text, " none |"),
                    Some(limits) => {
                        let [low, high] = limits.map(|at| self.shown(place, at));
                        write!(text, " {low:.1} to {high:.1} |")
                    }
                };
            }
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests;
