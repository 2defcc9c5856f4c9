//! The flights of the study: faults drawn for each class, and healthy flights.

use core::ops::ControlFlow;
use std::fmt::Write as _;

use autopilot::event::EventKind;
use flight_control::isolation::Verdict;
use icd::units::DEG;
use icd::{Effector, EffectorList};
use plant_sim::{Airframe, Scenario};

use super::{Options, VARIANTS, Variant};
use crate::closed_loop::{self, FlightSetup};
use crate::false_alarms::flights::{
    Condition, FLIGHT_S, SETTLED_S, conditions, entry, flights_for, programme, setup,
};
use crate::problem::Problem;
use crate::runner;
use crate::study::{Sides, draws};

/// The first fault may begin at this time, s: the turbulence has built up.
const ONSET_S: f64 = 15.0;
/// A flight ends this long after the onset, s.
const AFTER_S: f64 = 20.0;
/// Roll angle of the turns, deg.
const ROLL_DEG: f64 = 15.0;

/// What is broken: one effector, or the left and the right one of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Class {
    /// The effectors, in the order of the list.
    pub effectors: [Option<Effector>; 2],
}

/// All that can be broken on an aircraft.
#[derive(Debug, Clone, PartialEq)]
pub struct Classes {
    pub list: EffectorList,
    /// The classes: each angle, then each pair.
    pub all: Vec<Class>,
}

impl Classes {
    /// Those of an aircraft.
    pub fn of(airframe: &Airframe) -> Self {
        let list = airframe.effectors;
        let angles = list.all().filter(|effector| list.is_angle(*effector));
        let singles = angles.map(|effector| Class { effectors: [Some(effector), None] });
        let pairs =
            list.pairs().map(|[left, right]| Class { effectors: [Some(left), Some(right)] });
        Self { list, all: singles.chain(pairs).collect() }
    }

    /// `left elevator`, or `left elevator and right elevator`.
    pub fn name(&self, class: &Class) -> String {
        let names = class.effectors.into_iter().flatten().map(|effector| self.list.name(effector));
        names.collect::<Vec<_>>().join(" and ")
    }

    /// Place of the class that a verdict names; `None` for two that are no pair.
    pub fn place(&self, verdict: &Verdict) -> Option<usize> {
        self.all.iter().position(|class| class.effectors == verdict.effectors)
    }
}

/// What became of one flight with a fault.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Place of the class.
    pub class: usize,
    /// Seed of the flight.
    pub seed: u64,
    /// The fault, as keys of a scenario.
    pub fault: String,
    /// From the onset until the detector woke, s.
    pub detected_s: Option<f64>,
    /// From the onset until an effector was named, s.
    pub named_s: Option<f64>,
    /// From the onset until the right ones were named, s.
    pub right_s: Option<f64>,
    /// Others were named at some time.
    pub ever_wrong: bool,
    /// The verdict at the end.
    pub verdict: Option<Verdict>,
    /// From the onset until the aircraft was lost, s.
    pub lost_s: Option<f64>,
}

/// What became of the healthy flights of a law.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Healthy {
    /// Time that counts, s.
    pub seconds: f64,
    /// How often the detector woke.
    pub woken: u32,
    /// How often an effector was named.
    pub named: u32,
    pub lost: u32,
}

/// A fault of a class, drawn: the tables of a scenario, and the same in one line.
fn fault(
    classes: &Classes,
    airframe: &Airframe,
    class: &Class,
    onset_s: f64,
    between: &mut impl FnMut(f64, f64) -> f64,
) -> (String, String) {
    // Half of the faults are jams at an angle; a pair jams together or apart.
    let kind = between(0.0, 10.0);
    let is_pair = class.effectors[1].is_some();
    let (mut tables, mut line) = (String::new(), String::new());
    let mut same = None;
    for effector in class.effectors.into_iter().flatten() {
        let [min, max] = [airframe.servos[effector].min, airframe.servos[effector].max];
        let [min, max] = [min / DEG, max / DEG];
        // Not so near neutral that nothing is there to be noticed.
        let drawn = between(0.2, 1.0) * if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        // The second one of a pair that jams together stands where one command had moved both.
        let part = same.filter(|_| kind < 5.0).unwrap_or(drawn);
        same = Some(if airframe.gains[effector].roll == 0.0 { part } else { -part });
        let angle = if part < 0.0 { -part * min } else { part * max };
        let keys = match kind {
            k if k < 6.0 || is_pair => format!("kind = \"stuck_at\"\nangle_deg = {angle:.2}"),
            k if k < 7.0 => {
                let side = if part < 0.0 { "negative" } else { "positive" };
                format!("kind = \"hard_over\"\nside = \"{side}\"")
            }
            k if k < 8.5 => format!("kind = \"biased\"\nbias_deg = {:.2}", 0.5 * angle),
            k if k < 9.5 => {
                let amplitude = 0.5 * angle.abs();
                format!(
                    "kind = \"oscillating\"\namplitude_deg = {amplitude:.2}\nfrequency_hz = 1.0"
                )
            }
            _ => format!("kind = \"partial_loss\"\nremaining_percent = {:.1}", 20.0 * part.abs()),
        };
        let key = classes.list.key(effector);
        // Writing to a string cannot fail.
        let _ = writeln!(
            tables,
            "[[plant.fault]]\neffector = \"{key}\"\nonset_s = {onset_s:.3}\n{keys}"
        );
        let _ = write!(
            line,
            "{}{key} {}",
            if line.is_empty() { "" } else { "; " },
            keys.replace('\n', " ")
        );
    }
    (tables, line.replace('"', ""))
}

/// Level flight, a turn before the fault in half of the flights, a turn the other way and a climb after it.
pub(super) fn references(
    condition: &Condition,
    onset_s: f64,
    between: &mut impl FnMut(f64, f64) -> f64,
) -> String {
    let Condition { altitude_m, airspeed_m_s } = *condition;
    let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    let before = if between(0.0, 1.0) < 0.5 { 0.0 } else { side * ROLL_DEG };
    entry(0.0, 0.0, altitude_m, airspeed_m_s)
        + &entry(onset_s - 4.0, before, altitude_m, airspeed_m_s)
        + &entry(onset_s + 6.0, -side * ROLL_DEG, altitude_m, airspeed_m_s)
        + &entry(onset_s + 12.0, 0.0, altitude_m + 100.0, airspeed_m_s)
}

fn select(mut setup: FlightSetup, variant: &Variant) -> FlightSetup {
    let selection = &mut setup.parameters.gains.selection;
    (selection.allocation, selection.isolation) = (variant.allocation, variant.isolation);
    setup
}

/// Flies every class with every law, each flight in air of its own.
pub fn fly_faults(
    options: &Options,
    sides: &Sides,
    classes: &Classes,
) -> Result<[Vec<Outcome>; VARIANTS.len()], Problem> {
    let numbers = (0..classes.all.len())
        .flat_map(|class| (0..u64::from(options.flights)).map(move |flight| (class, flight)));
    let seeds = (0_u64..).map(|number| options.seed.wrapping_add(number));
    let items: Vec<((usize, u64), u64)> = numbers.zip(seeds).collect();
    let at = conditions(&[], &sides.scale());
    let one = |((class, flight), seed): &((usize, u64), u64)| {
        let condition = &at[usize::try_from(flight % 3).unwrap_or(0)];
        fly_fault(options, sides, classes, *class, condition, *seed)
    };
    let flown = runner::try_map("flights with a fault", &items, one)?;
    Ok(std::array::from_fn(|law| flown.iter().map(|flight| flight[law].clone()).collect()))
}

/// One fault with each law.
fn fly_fault(
    options: &Options,
    sides: &Sides,
    classes: &Classes,
    class: usize,
    condition: &Condition,
    seed: u64,
) -> Result<[Outcome; VARIANTS.len()], Problem> {
    let mut between = draws(seed, *b"-----two-step isolation-");
    let onset_s = (between(ONSET_S, ONSET_S + 5.0) * 1.0e3).round() / 1.0e3;
    let broken = classes.all[class];
    let (tables, line) = fault(classes, sides.airframe(), &broken, onset_s, &mut between);
    let references = references(condition, onset_s, &mut between);
    let duration_s = onset_s + AFTER_S;
    let mut setup = setup(&options.air(), sides, condition, seed, &references, duration_s)?;
    let text = format!("[plant]\nseed = {seed}\n{tables}");
    setup.plant.faults =
        Scenario::from_toml("the study", &text, &sides.airframe().effectors)?.plant.faults;
    let start = Outcome { class, seed, fault: line, ..Outcome::default() };
    fly_each(&setup, &VARIANTS, broken.effectors, onset_s, &start)
}

/// The same flight with each law.
pub(super) fn fly_each<const N: usize>(
    setup: &FlightSetup,
    variants: &[Variant; N],
    broken: [Option<Effector>; 2],
    onset_s: f64,
    start: &Outcome,
) -> Result<[Outcome; N], Problem> {
    let mut flown = variants.map(|_| start.clone());
    for (variant, outcome) in variants.iter().zip(&mut flown) {
        let setup = select(setup.clone(), variant);
        let limits = setup.plant.airframe.limits;
        let _ = closed_loop::watch(&setup, |tick| {
            let truth = tick.plant.truth();
            let after_s = truth.time.as_seconds() - onset_s;
            outcome.verdict = tick.log.isolation.verdict;
            if limits.are_exceeded(&truth.into()) {
                outcome.lost_s = Some(after_s);
                return ControlFlow::Break(());
            }
            if after_s >= 0.0 {
                if tick.log.compensator_active {
                    outcome.detected_s.get_or_insert(after_s);
                }
                for event in tick.events {
                    let EventKind::Isolated(verdict) = event.kind else { continue };
                    outcome.named_s.get_or_insert(after_s);
                    match verdict.effectors == broken {
                        true => _ = outcome.right_s.get_or_insert(after_s),
                        false => outcome.ever_wrong = true,
                    }
                }
            }
            ControlFlow::Continue(())
        })?;
    }
    Ok(flown)
}

/// Flies the healthy flights of every law.
pub fn fly_healthy(options: &Options, sides: &Sides) -> Result<[Healthy; VARIANTS.len()], Problem> {
    let flights = flights_for(options.hours, 1);
    let numbers = (0..flights).flat_map(|flight| (0..VARIANTS.len()).map(move |law| (flight, law)));
    let items: Vec<(u64, usize)> = numbers.collect();
    let at = conditions(&[], &sides.scale());
    let one = |(flight, law): &(u64, usize)| {
        let condition = &at[usize::try_from(flight % 3).unwrap_or(0)];
        // Other air than that of the faults.
        let seed = options.seed.wrapping_add(1 << 32).wrapping_add(*flight);
        let references = programme(condition, &sides.scale(), seed, false);
        let setup = setup(&options.air(), sides, condition, seed, &references, FLIGHT_S)?;
        watch(&select(setup, &VARIANTS[*law]))
    };
    let results = runner::try_map("healthy flights of 10 minutes", &items, one)?;
    let mut healthy = [Healthy::default(); VARIANTS.len()];
    for ((_, law), flown) in items.iter().zip(results) {
        let all = &mut healthy[*law];
        all.seconds += flown.seconds;
        all.woken += flown.woken;
        all.named += flown.named;
        all.lost += flown.lost;
    }
    Ok(healthy)
}

fn watch(setup: &FlightSetup) -> Result<Healthy, Problem> {
    let mut healthy = Healthy::default();
    let limits = setup.plant.airframe.limits;
    let (h, mut active) = (setup.plant.period.as_seconds(), false);
    let _ = closed_loop::watch(setup, |tick| {
        let truth = tick.plant.truth();
        if limits.are_exceeded(&truth.into()) {
            healthy.lost = 1;
            return ControlFlow::Break(());
        }
        if truth.time.as_seconds() >= SETTLED_S {
            healthy.seconds += h;
            healthy.woken += u32::from(tick.log.compensator_active && !active);
            let named = tick.events.iter().filter(|e| matches!(e.kind, EventKind::Isolated(_)));
            healthy.named += u32::try_from(named.count()).unwrap_or(u32::MAX);
        }
        active = tick.log.compensator_active;
        ControlFlow::Continue(())
    })?;
    Ok(healthy)
}
