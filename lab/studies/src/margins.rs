//! `sitl aircraft margins`: how much each law's loop can stand, by its linearisation and by flights.
//!
//! Plant, servos and laws are one sampled system (`closed_loop`). It is opened at the commands of one kind of effector
//! and stays closed at all others (`loops`). The flights then add the gain or the delay to the commands of these
//! effectors, once a little less than the margin and once a little more, and look whether a small disturbance dies out.

use host_io::print_line;
use std::collections::VecDeque;
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::PathBuf;

use autopilot::own_law::OwnLaw;
use autopilot::run::LawArgs;
use flight_control::gains::name_of;
use flight_control::{CompensatorLaw, CompensatorMode, MainLaw};
use host_io::folder::OutFolder;
use icd::{ControlPeriod, EffectorKind, EffectorList, PerEffector};
use lab_tables::{Table, cells, table};
use nalgebra::Complex;
use plant_sim::Airframe;
use plant_sim::servos::Servo;

use closed_loop::ClosedLoop;
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::AircraftArgs;
use lab_engine::flight::FlightSetup;
use lab_judges::loops::{Linear, Margins};
use lab_report::runner;

mod closed_loop;

/// Half width of the differences, and disturbance of the flights.
pub(crate) const AMPLITUDE: f64 = 1.0e-4;
/// Growth from which on a motion of the closed loop counts as unstable, 1/s: a doubling in ten minutes.
const UNSTABLE_1_S: f64 = 1.0e-3;
/// How far inside and outside a margin the flights are.
const INSIDE: f64 = 0.9;
const OUTSIDE: f64 = 1.1;
/// Margins above this are not flown: factor on the commands.
const GAIN_FLOWN_MAX: f64 = 30.0;
/// Cycles of the crossover in a flight with a delay.
const CYCLES: f64 = 60.0;
/// Time constants of the motion that grows outside of a margin, in flights with a gain.
const E_FOLDINGS: f64 = 20.0;
/// Shortest and longest flight, s.
const FLIGHT_S: [f64; 2] = [10.0, 600.0];
/// A disturbance has died out when the swing of the commands in the last tenth of a flight is below this part of that in
/// the first tenth.
const DIED_OUT: f64 = 0.01;
/// It decays when that swing is below this part of the one in the tenth after half the time: slow motions near a margin.
const DECAYS: f64 = 0.9;

/// Options of `sitl aircraft margins`.
#[derive(Debug, Clone, clap::Args)]
pub struct MarginsArgs {
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// Main controller and estimator; without them all that there are.
    #[command(flatten)]
    laws: LawArgs,
    /// Only with the compensator always on, or only with it off
    #[arg(long, value_enum, value_name = "MODE")]
    ftc: Option<Acts>,
    /// Control period, 1 to 4 ms
    #[arg(long, allow_negative_numbers = true, value_name = "MS", default_value = "2", value_parser = plant_sim::io::parse_period)]
    period_ms: ControlPeriod,
    /// Half width of the differences and disturbance of the flights: rad, rad/s, m/s, m
    #[arg(long, allow_negative_numbers = true, value_name = "SIZE", default_value_t = AMPLITUDE, value_parser = parse_amplitude)]
    amplitude: f64,
    /// Leave the flights out
    #[arg(long)]
    no_flights: bool,
    /// Folder for the margins and the eigenvalues as tables too
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// Whether the compensator acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Acts {
    Off,
    Always,
}

fn parse_amplitude(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{text} is no number"))?;
    if (1.0e-6..=0.1).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{text} is outside 0.000001 to 0.1"))
    }
}

/// Which laws are looked at together.
#[derive(Debug, Clone, Copy)]
struct Laws {
    main: MainLaw,
    /// `None`: the compensator is off.
    compensator: Option<CompensatorLaw>,
}

/// A loop with what it can stand, and flights that confirm it.
pub(crate) struct LoopRow {
    pub(crate) effectors: &'static str,
    pub(crate) margins: Margins,
    flights: Option<Flights>,
}

/// Whether the flights inside a margin were stable and those outside were not; `None` where there is no such margin.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Flights {
    gain: Option<bool>,
    delay: Option<bool>,
}

/// Prints the table of every requested law.
pub fn run(args: &MarginsArgs) -> Result<(), Box<dyn Error>> {
    args.aircraft.check()?;
    let airframe = args.aircraft.airframe()?;
    let all = args.all_laws(&airframe.effectors);
    let folder = args.out.as_deref().map(OutFolder::create).transpose()?;
    let looked_at =
        // An error in a box cannot leave its thread.
        runner::map("margins", &all, |laws| args.study(*laws).map_err(|error| error.to_string()));
    let [mut margins, mut eigenvalues] = tables();
    print_line!("{}", args.heading(&airframe));
    for loops in looked_at {
        let loops = loops?;
        print_line!("{}", loops.markdown());
        loops.add_to(&mut margins, &mut eigenvalues);
    }
    if let Some(folder) = folder {
        margins.write(folder.path())?;
        eigenvalues.write(folder.path())?;
        print_line!("wrote {}", folder.path().display());
    }
    Ok(())
}

/// Loops of a law and a compensator.
struct LawLoops {
    main: String,
    compensator: &'static str,
    loops: SetupLoops,
}

/// The loop of each kind of effector, and what remains when all are closed.
pub(crate) struct SetupLoops {
    pub(crate) rows: Vec<LoopRow>,
    /// Of the closed loop, 1/s.
    pub(crate) eigenvalues: Vec<Complex<f64>>,
}

fn tables() -> [Table; 2] {
    let margins = table!("margins",
        law: Text, compensator: Text, effectors: Text, crossover_rad_s: Number, gain_min: Number,
        gain_max: Number = "missing: any gain", phase_deg: Number, delay_ms: Number,
        flown_gain: Text = "agrees or differs: flights a little inside and outside of the margin",
        flown_delay: Text);
    let eigenvalues = table!("eigenvalues",
        law: Text, compensator: Text, real_rad_s: Number, imaginary_rad_s: Number);
    [margins, eigenvalues]
}

impl MarginsArgs {
    /// Takes a law that the program brings; it is looked at unless `--law` names another one.
    pub fn set_own_law(&mut self, own: &OwnLaw) {
        self.laws.set_own_law(own);
    }

    fn all_laws(&self, list: &EffectorList) -> Vec<Laws> {
        let has_nozzle = list.only(EffectorKind::NozzlePitch).is_some();
        let one_or_all = |one: Option<MainLaw>| match one {
            Some(law) => vec![law],
            None => MainLaw::NAMES
                .iter()
                .map(|(_, law)| *law)
                // A law of one's own need not show its states, and the eigenvalues would miss them.
                .filter(|law| *law != MainLaw::Own)
                // Without a nozzle it is the PID.
                .filter(|law| has_nozzle || *law != MainLaw::PidGangedNozzle)
                .collect(),
        };
        let mut estimators = vec![None];
        if self.ftc != Some(Acts::Off) {
            let all = CompensatorLaw::NAMES.iter().map(|(_, law)| *law);
            let chosen = all.filter(|law| self.laws.compensator.is_none_or(|one| one == *law));
            estimators.extend(chosen.map(Some));
        }
        if self.ftc == Some(Acts::Always) || self.ftc.is_none() && self.laws.compensator.is_some() {
            estimators.remove(0);
        }
        one_or_all(self.laws.law)
            .into_iter()
            .flat_map(|main| {
                estimators.iter().map(move |compensator| Laws { main, compensator: *compensator })
            })
            .collect()
    }

    fn heading(&self, airframe: &Airframe) -> String {
        let has_play = |servo: &Servo| {
            servo.imperfections.deadband > 0.0 || servo.imperfections.hysteresis > 0.0
        };
        let play = airframe.servos.iter().any(|(_, servo)| has_play(servo));
        let left_out = if play {
            "\n\nDeadband and hysteresis of the actuators are left out, in the flights too: they have no linear form."
        } else {
            ""
        };
        format!(
            "# Margins of the loops\n\n\
             Sampled loop with a period of {} ms, servos and engine, linearised in steady level flight at the design point \
             by differences of {} (rad, rad/s, m/s, m). A loop is opened at the commands of one kind of effector; all \
             others stay closed. Each figure is for one change alone.{left_out}\n",
            self.period_ms.as_seconds() * 1.0e3,
            self.amplitude,
        )
    }

    fn study(&self, laws: Laws) -> Result<LawLoops, Box<dyn Error>> {
        let options = SetupOptions {
            aircraft: self.aircraft.clone(),
            laws: self.laws.clone(),
            period_ms: self.period_ms,
            ..SetupOptions::default()
        };
        let mut setup = options.setup("nominal")?;
        let selection = &mut setup.parameters.gains.selection;
        (selection.main, selection.compensator) = (laws.main, CompensatorMode::Off);
        if let Some(compensator) = laws.compensator {
            selection.compensator_law = compensator;
            selection.compensator = CompensatorMode::AlwaysOn;
        }
        setup.parameters.check_law()?;
        let (main, compensator) = laws.names(self.laws.own.as_ref());
        let loops = loops(&setup, self.amplitude, !self.no_flights)
            .map_err(|error| format!("{main}, compensator {compensator}: {error}"))?;
        Ok(LawLoops { main: main.to_owned(), compensator, loops })
    }
}

impl Laws {
    fn names(self, own: Option<&OwnLaw>) -> (&str, &'static str) {
        let compensator = self.compensator.map_or("off", |law| name_of(CompensatorLaw::NAMES, law));
        let own = own.filter(|_| self.main == MainLaw::Own).map(OwnLaw::name);
        (own.unwrap_or(name_of(MainLaw::NAMES, self.main)), compensator)
    }
}

/// Loops of the laws that a setup selects. `amplitude` is the half width of the differences.
pub(crate) fn loops(
    setup: &FlightSetup,
    amplitude: f64,
    confirms_by_flights: bool,
) -> Result<SetupLoops, Box<dyn Error>> {
    let settled = ClosedLoop::settled(setup)?;
    let linear = settled.linearise(amplitude);
    let period_s = setup.plant.period.as_seconds();
    let mut rows = Vec::new();
    for (kind, group) in groups(&settled, &setup.plant.airframe.effectors) {
        if !linear.commands_any(&group) {
            // No law commands it.
            continue;
        }
        let margins = linear.margins(&group, period_s);
        // A loop that is unstable as it is has no margin that a flight could confirm.
        let flights = (confirms_by_flights && linear.is_stable(&group, 1.0)).then(|| {
            let (settled, linear, group) = (&settled, &linear, group.as_slice());
            fly(&Loops { settled, linear, group, amplitude, period_s }, &margins)
        });
        rows.push(LoopRow { effectors: kind.key(), margins, flights });
    }
    let eigenvalues = linear.eigenvalues(period_s).ok_or("the eigenvalues were not found")?;
    Ok(SetupLoops { rows, eigenvalues })
}

/// Whether a motion grows. The integral of an attitude on which nothing acts stays where it is.
pub(crate) fn grows(eigenvalue: &Complex<f64>) -> bool {
    eigenvalue.re > UNSTABLE_1_S
}

/// The effectors of each kind, by their place among the commands.
fn groups(settled: &ClosedLoop, list: &EffectorList) -> Vec<(EffectorKind, Vec<usize>)> {
    let mut groups: Vec<(EffectorKind, Vec<usize>)> = Vec::new();
    for (place, effector) in settled.effectors().iter().enumerate() {
        let Some(kind) = list.kind(*effector) else { continue };
        match groups.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, group)) => group.push(place),
            None => groups.push((kind, vec![place])),
        }
    }
    groups
}

/// Flies a little inside and a little outside of each margin.
fn fly(loops: &Loops<'_>, margins: &Margins) -> Flights {
    let h = loops.period_s;
    let with_gains = |inside: f64, outside: f64| {
        // Long enough for what grows outside to be seen, however little of it the disturbance has.
        let duration_s = E_FOLDINGS / loops.linear.growth(loops.group, outside, h).abs();
        loops.decays(inside, 0, duration_s) && !loops.has_died_out(outside, 0, duration_s)
    };
    let [least, most] = margins.gain;
    let above = (most < GAIN_FLOWN_MAX).then(|| with_gains(INSIDE * most, OUTSIDE * most));
    // The lower limit is left downwards, so inside of it is above.
    let below = (least > 1.0 / GAIN_FLOWN_MAX).then(|| with_gains(least / INSIDE, least / OUTSIDE));
    let gain = match (above, below) {
        (Some(above), Some(below)) => Some(above && below),
        (one, other) => one.or(other),
    };
    let delay = margins.delay_s.zip(margins.crossover_rad_s).map(|(delay_s, crossover_rad_s)| {
        // Some 10^3.
        let periods = |factor: f64| (factor * delay_s / h) as usize;
        let duration_s = CYCLES * TAU / crossover_rad_s;
        loops.decays(1.0, periods(INSIDE), duration_s)
            // A delay is a whole number of periods: this one is surely outside.
            && !loops.has_died_out(1.0, periods(OUTSIDE) + 1, duration_s)
    });
    Flights { gain, delay }
}

/// A loop that is flown with changed commands of a group.
struct Loops<'a> {
    settled: &'a ClosedLoop,
    linear: &'a Linear,
    group: &'a [usize],
    amplitude: f64,
    period_s: f64,
}

impl Loops<'_> {
    fn decays(&self, gain: f64, delay: usize, duration_s: f64) -> bool {
        self.swings(gain, delay, duration_s)
            .is_some_and(|[first, middle, last]| last < DIED_OUT * first || last < DECAYS * middle)
    }

    fn has_died_out(&self, gain: f64, delay: usize, duration_s: f64) -> bool {
        self.swings(gain, delay, duration_s).is_some_and(|[first, _, last]| last < DIED_OUT * first)
    }

    /// Swings of the commands after a disturbance of the body rates, with a factor on their distance from the steady
    /// ones and a delay of so many periods: in the first tenth of the flight, in the sixth and in the last. `None` if
    /// the aircraft is lost.
    fn swings(&self, gain: f64, delay: usize, duration_s: f64) -> Option<[f64; 3]> {
        let periods = duration_s.clamp(FLIGHT_S[0], FLIGHT_S[1]) / self.period_s;
        // Some 10^5.
        let (periods, window) = (periods as usize, (periods / 10.0) as usize);
        let mut disturbed = self.settled.copy();
        disturbed.disturb(self.amplitude);
        let mut disturbed = ChangedLoop::new(self.group, gain, delay, disturbed);
        // The twin takes out whatever moves without the disturbance.
        let mut twin = ChangedLoop::new(self.group, gain, delay, self.settled.copy());
        let [mut first, mut middle, mut last] =
            [Swing::default(), Swing::default(), Swing::default()];
        for period in 0..periods {
            let difference = disturbed.period()? - twin.period()?;
            if !difference.is_finite() {
                return None;
            }
            if period < window {
                first.take(difference);
            } else if (5 * window..6 * window).contains(&period) {
                middle.take(difference);
            } else if period >= periods - window {
                last.take(difference);
            }
        }
        Some([first.size(), middle.size(), last.size()])
    }
}

/// A loop whose commands are changed on their way.
struct ChangedLoop<'a> {
    group: &'a [usize],
    gain: f64,
    flies: ClosedLoop,
    steady: PerEffector<f64>,
    under_way: VecDeque<PerEffector<f64>>,
}

impl<'a> ChangedLoop<'a> {
    fn new(group: &'a [usize], gain: f64, delay: usize, flies: ClosedLoop) -> Self {
        let steady = flies.commands();
        let under_way = std::iter::repeat_n(steady, delay).collect();
        Self { group, gain, flies, steady, under_way }
    }

    /// One period; the command to the first of the group. `None` if the aircraft is lost.
    fn period(&mut self) -> Option<f64> {
        let commanded = self.flies.commands();
        self.under_way.push_back(commanded);
        // Without a delay it is the one that was just put in.
        let late = self.under_way.pop_front().unwrap_or(commanded);
        let mut commands = commanded;
        for i in self.group {
            let effector = self.flies.effectors()[*i];
            let steady = self.steady[effector];
            commands[effector] = steady + self.gain * (late[effector] - steady);
        }
        self.flies.step(&commands)?;
        let first = self.group.first();
        Some(first.map_or(0.0, |i| commanded[self.flies.effectors()[*i]]))
    }
}

/// Smallest and largest of some numbers.
#[derive(Default)]
struct Swing(Option<(f64, f64)>);

impl Swing {
    fn take(&mut self, value: f64) {
        let (least, most) = self.0.unwrap_or((value, value));
        self.0 = Some((least.min(value), most.max(value)));
    }

    fn size(&self) -> f64 {
        self.0.map_or(0.0, |(least, most)| most - least)
    }
}

impl LawLoops {
    fn add_to(&self, margins: &mut Table, eigenvalues: &mut Table) {
        for LoopRow { effectors, margins: loop_margins, flights } in &self.loops.rows {
            let Margins { crossover_rad_s, gain: [least, most], phase_rad, delay_s } =
                *loop_margins;
            let flights = flights.unwrap_or_default();
            margins.rows.push(cells![
                &self.main,
                self.compensator,
                *effectors,
                crossover_rad_s,
                least,
                most.is_finite().then_some(most),
                phase_rad.map(f64::to_degrees),
                delay_s.map(|delay_s| delay_s * 1.0e3),
                flights.gain.map(verdict),
                flights.delay.map(verdict),
            ]);
        }
        let rows = self.loops.eigenvalues.iter();
        eigenvalues.rows.extend(rows.map(|s| cells![&self.main, self.compensator, s.re, s.im]));
    }

    fn markdown(&self) -> String {
        let mut text = format!(
            "## {}, compensator {}\n\n| commands | crossover, rad/s | gain | phase, deg | delay, ms | flown: gain | flown: delay |\n\
             |---|---|---|---|---|---|---|\n",
            self.main, self.compensator
        );
        for LoopRow { effectors, margins, flights } in &self.loops.rows {
            let Margins { crossover_rad_s, gain: [least, most], phase_rad, delay_s } = *margins;
            let number = |value: Option<f64>, digits: usize| {
                value.map_or("none".to_owned(), |value| format!("{value:.digits$}"))
            };
            let shown = |flown: Option<bool>| match flown.map(verdict) {
                Some("differs") => "**differs**",
                other => other.unwrap_or_default(),
            };
            let least = if least > 0.0 { format!("{least:.2}") } else { "0".to_owned() };
            let most = if most.is_finite() { format!("{most:.2}") } else { "any".to_owned() };
            let flights = flights.unwrap_or_default();
            // Writing to a text cannot fail.
            let _ = writeln!(
                text,
                "| {effectors} | {} | {least} to {most} | {} | {} | {} | {} |",
                number(crossover_rad_s, 2),
                number(phase_rad.map(f64::to_degrees), 1),
                number(delay_s.map(|delay_s| delay_s * 1.0e3), 1),
                shown(flights.gain),
                shown(flights.delay),
            );
        }
        let eigenvalues = &self.loops.eigenvalues;
        let shown: Vec<String> = eigenvalues
            .iter()
            // Of a conjugate pair one is enough.
            .filter(|s| s.im >= 0.0 && s.re.is_finite())
            .map(|s| match s.im > 0.0 {
                true => format!("{:.4} ± {:.4}i", s.re, s.im),
                false => format!("{:.4}", s.re),
            })
            .collect();
        let unstable = eigenvalues.iter().filter(|s| s.re > 0.0).count();
        let _ = writeln!(
            text,
            "\nEigenvalues of the closed loop, 1/s ({}): {}.",
            if unstable == 0 { "all stable".to_owned() } else { format!("{unstable} unstable") },
            shown.join(", ")
        );
        text
    }
}

fn verdict(agrees: bool) -> &'static str {
    if agrees { "agrees" } else { "differs" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser as _;
    use flight_control::{Law, LawInput, MainCommand};
    use plant_sim::ReadAirframe as _;

    #[derive(Debug, clap::Parser)]
    struct Command {
        #[command(flatten)]
        args: MarginsArgs,
    }

    fn study(options: &str) -> String {
        let words = std::iter::once("margins").chain(options.split_whitespace());
        let args = Command::try_parse_from(words).unwrap().args;
        args.study(args.all_laws(&Airframe::paper().effectors)[0]).unwrap().markdown()
    }

    #[test]
    fn flights_agree_with_the_margins_of_the_nozzle_and_of_the_ailerons() {
        let text = study("--law pid --compensator neso");
        let agree = |kind: &str| {
            let row = text.lines().find(|line| line.starts_with(&format!("| {kind} |"))).unwrap();
            row.matches("agrees").count()
        };
        assert_eq!((agree("aileron"), agree("nozzle_pitch")), (2, 2), "{text}");
        assert!(text.contains("(all stable)") && !text.contains("differs"), "{text}");
    }

    #[test]
    fn a_law_of_the_program_has_its_name_and_the_ganged_nozzle_needs_one() {
        let own = OwnLaw::new("mine", || Silent);
        let names = |main| Laws { main, compensator: None }.names(Some(&own));
        assert_eq!(names(MainLaw::Own), ("mine", "off"));
        assert_eq!(names(MainLaw::Pid), ("pid", "off"));
        let words = ["margins", "--airframe", "aerosonde", "--ftc", "off"];
        let args = Command::try_parse_from(words).unwrap().args;
        let all = args.all_laws(&args.aircraft.airframe().unwrap().effectors);
        assert_eq!(all.len(), MainLaw::NAMES.len() - 2);
        let words = words.into_iter().chain(["--law", "pid-ganged-nozzle"]);
        let args = Command::try_parse_from(words).unwrap().args;
        let all = args.all_laws(&Airframe::paper().effectors);
        let refused = args.study(all[0]).err().unwrap().to_string();
        let expected =
            "--law pid-ganged-nozzle: aerosonde has no nozzle; without one this law is pid";
        assert_eq!(refused, expected);
    }

    #[derive(Clone)]
    struct Silent;

    impl Law for Silent {
        fn step(&mut self, _: &LawInput<'_>) -> MainCommand {
            MainCommand::default()
        }
    }

    /// A figure of the nozzle's loop in pitch.
    fn of_nozzle(column: usize, options: &str) -> f64 {
        let text = study(&format!("--law pid --compensator neso --no-flights {options}"));
        let row = text.lines().find(|line| line.starts_with("| nozzle_pitch |")).unwrap();
        row.split('|').nth(column).unwrap().trim().parse().unwrap()
    }

    #[test]
    fn a_slower_servo_costs_phase_and_one_of_second_order_too() {
        let phase_deg = |options: &str| of_nozzle(4, options);
        let healthy = phase_deg("");
        assert!(phase_deg("--set airframe.effector.6.lag_s=0.1") < healthy - 10.0);
        let order = "--set airframe.effector.6.natural_frequency_rad_s=15";
        assert!(phase_deg(order) < healthy - 10.0);
    }

    #[test]
    fn the_delay_of_an_actuator_is_taken_off_the_delay_margin() {
        let delay_ms = |options: &str| of_nozzle(5, options);
        let healthy = delay_ms("");
        for late_s in [0.02, 0.0335] {
            let left = delay_ms(&format!("--set airframe.effector.6.delay_s={late_s}"));
            let lost = healthy - left;
            // Half a digit of the table twice.
            assert!((lost - 1.0e3 * late_s).abs() < 0.2, "{healthy} ms, {left} ms of {late_s} s");
        }
    }

    #[test]
    fn an_amplitude_that_cannot_be_is_refused() {
        for bad in ["0", "nan", "1", "-0.1", "x"] {
            assert!(Command::try_parse_from(["margins", "--amplitude", bad]).is_err(), "{bad}");
        }
    }
}
