//! What the paper does not do: three comparisons, so that a reader can judge what the compensator itself adds, and
//! flights with other parameters.

use std::array;

use flight_control::{CompensatorMode, MainLaw, ObserverMode};
use icd::SimTime;
use plant_sim::{PlantSetup, Scenario};
use rayon::prelude::*;

use super::cases::{Case, Conditions, Flown, Run, Runs, fly_once};
use super::claim::ClaimResult;
use super::claims::Axis;
use super::{both, claims, in_process};
use host_io::problem::{At as _, Problem, problem};
use lab_engine::configuration::AircraftArgs;
use lab_judges::closed_loop::FlightSetup;
use lab_judges::metrics::{mean, rms, travel};
use lab_judges::trace::{Trace, column};
use lab_studies::linearize::linearize;

/// Seeds over which the healthy flights in turbulence are averaged.
const SEEDS: u64 = 10;
/// Length of a healthy flight in turbulence, s.
const TURBULENT_S: u64 = 60;
/// Light and moderate turbulence, m/s rms.
const TURBULENCE_M_S: [f64; 2] = [1.5, 3.0];
/// Gyro noise of the flights in turbulence, deg/s rms: that of claim 4.
const GYRO_NOISE_DEG_S: f64 = 0.1;
/// The end of a run, over which means are taken, s.
const SETTLED_S: f64 = 10.0;

#[derive(Debug, Clone)]
pub struct Comparisons {
    /// The observer of equations 21 to 23, taken literally, case by case.
    pub literal: [Literal; 2],
    /// Claims of the faults with the compensator always on, case by case.
    pub always_on: [Vec<ClaimResult>; 2],
    /// Healthy flight in turbulence, light and moderate.
    pub turbulence: [TurbulenceEffect; 2],
    /// The same effectors without observer, case by case.
    pub ganged: [Ganged; 2],
}

/// One case with the observer that does not get the compensation, beside the normal one.
#[derive(Debug, Clone)]
pub struct Literal {
    /// Mean z2 of the last 10 s, rad/s², by axis.
    pub z2: [f64; 3],
    /// Mean F of the last 10 s, rad/s², by axis.
    pub fault: [f64; 3],
    /// The flight with the literal observer.
    pub flight: Summary,
    /// The flight with the informed observer.
    pub informed: Summary,
    /// The flight without fault.
    pub no_fault: Summary,
}

/// How a flight ended, in three numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// When the aircraft was lost, s.
    pub lost_s: Option<f64>,
    /// Mean roll of the last 10 s, rad.
    pub roll_rad: f64,
    /// Altitude at the end, m.
    pub end_altitude_m: f64,
}

/// Healthy flight in turbulence, means over the seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurbulenceEffect {
    /// Intensity, m/s rms.
    pub turbulence_m_s: f64,
    pub switched: Healthy,
    pub always_on: Healthy,
    pub flights: u64,
}

/// What a healthy flight costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Healthy {
    /// rms of the roll angle, rad.
    pub roll_rms_rad: f64,
    /// rms of the roll rate, rad/s.
    pub roll_rate_rms_rad_s: f64,
    /// Way travelled by one aileron a second, rad/s.
    pub aileron_rad_s: f64,
    /// Way travelled by the nozzle a second, both axes, rad/s.
    pub nozzle_rad_s: f64,
}

/// One case flown by the PID alone, the PID with ganged nozzle, and the two-step controller.
#[derive(Debug, Clone)]
pub struct Ganged {
    /// Claims a and c with the PID alone.
    pub pid_only: Vec<ClaimResult>,
    /// Claims a and c with the ganged nozzle, measured against its own flight without fault.
    pub ganged: Vec<ClaimResult>,
    /// Claims a and c with the two-step controller.
    pub two_step: Vec<ClaimResult>,
    /// The flights with the fault, in the same order.
    pub flights: [Summary; 3],
}

/// Flies and compares; `flown` are the paper's runs.
pub fn compare(flown: [&Flown; 2], conditions: &Conditions) -> Result<Comparisons, Problem> {
    let (literal, (always_on, (ganged, turbulence))) = rayon::join(
        || both_cases(flown, literal),
        || {
            rayon::join(
                || both_cases(flown, always_on),
                || {
                    rayon::join(
                        || both_cases(flown, ganged),
                        || turbulence_pair(flown[0], conditions),
                    )
                },
            )
        },
    );
    Ok(Comparisons {
        literal: literal?,
        always_on: always_on?,
        turbulence: turbulence?,
        ganged: ganged?,
    })
}

fn both_cases<T: Send>(
    flown: [&Flown; 2],
    one: impl Fn(&Flown) -> Result<T, Problem> + Sync,
) -> Result<[T; 2], Problem> {
    let (first, second) = rayon::join(|| one(flown[0]), || one(flown[1]));
    Ok([first?, second?])
}

fn literal(flown: &Flown) -> Result<Literal, Problem> {
    let case = flown.case.with_gains(|g| g.selection.observer = ObserverMode::Literal);
    let flight = case.fly(Run::Compensated, &in_process)?;
    let end = flight.last(SETTLED_S);
    let mean_of = |signal: fn(Axis, &lab_judges::row::Row) -> f64| {
        Axis::ALL.map(|axis| mean(column(end, |row| signal(axis, row))))
    };
    Ok(Literal {
        z2: mean_of(|axis, row| axis.estimate(row)),
        fault: mean_of(|axis, row| axis.fault(row)),
        flight: Summary::of(&flight),
        informed: Summary::of(&flown.compensated),
        no_fault: Summary::of(&flown.no_fault),
    })
}

fn always_on(flown: &Flown) -> Result<Vec<ClaimResult>, Problem> {
    let case = flown.case.with_gains(|g| g.selection.compensator = CompensatorMode::AlwaysOn);
    let (no_fault, compensated) = rayon::join(
        || case.fly(Run::NoFault, &in_process),
        || case.fly(Run::Compensated, &in_process),
    );
    let flown = Flown {
        no_fault: no_fault?,
        compensated: compensated?,
        case,
        // In these two the compensator is off, so they would be the same flights again.
        no_fault_off: flown.no_fault_off.clone(),
        pid_only: flown.pid_only.clone(),
    };
    let mut results = claims::of_case(&flown.runs());
    results.extend(both::claim_3(&flown));
    Ok(results)
}

fn ganged(flown: &Flown) -> Result<Ganged, Problem> {
    let case = flown.case.with_gains(|g| g.selection.main = MainLaw::PidGangedNozzle);
    // Both without the compensator: the nozzle belongs to the PID here.
    let (no_fault, faulty) = rayon::join(
        || case.fly(Run::NoFaultOff, &in_process),
        || case.fly(Run::PidOnly, &in_process),
    );
    let (no_fault, faulty) = (no_fault?, faulty?);
    let runs =
        Runs { case: &case, no_fault: &no_fault, pid_only: &flown.pid_only, compensated: &faulty };
    let pid = Runs { compensated: &flown.pid_only, ..flown.runs() };
    Ok(Ganged {
        pid_only: claims::of_performance(&pid),
        ganged: claims::of_performance(&runs),
        two_step: claims::of_performance(&flown.runs()),
        flights: [
            Summary::of(&flown.pid_only),
            Summary::of(&faulty),
            Summary::of(&flown.compensated),
        ],
    })
}

fn turbulence_pair(
    flown: &Flown,
    conditions: &Conditions,
) -> Result<[TurbulenceEffect; 2], Problem> {
    let [light, moderate] = TURBULENCE_M_S.map(|m_s| turbulence(&flown.case, conditions, m_s));
    Ok([light?, moderate?])
}

fn turbulence(
    case: &Case,
    conditions: &Conditions,
    turbulence_m_s: f64,
) -> Result<TurbulenceEffect, Problem> {
    let level = level_flight(case)?;
    let fly_all = |mode: CompensatorMode| -> Result<Healthy, Problem> {
        let flights = (0..SEEDS).into_par_iter().map(|number| {
            let conditions = Conditions {
                turbulence_m_s,
                gyro_noise_rad_s: GYRO_NOISE_DEG_S.to_radians(),
                seed: conditions.seed.wrapping_add(number),
                ..*conditions
            };
            let mut case = Case { setup: level.clone(), ..case.clone() }.under(&conditions);
            case.setup.parameters.gains.selection.compensator = mode;
            let flight = fly_once(&case.setup, &in_process);
            flight
                .map(|trace| Healthy::of(&trace))
                .at(format_args!("healthy flight in turbulence of {turbulence_m_s} m/s"))
        });
        flights.collect::<Result<Vec<Healthy>, Problem>>().map(|all| Healthy::mean(&all))
    };
    Ok(TurbulenceEffect {
        turbulence_m_s,
        switched: fly_all(CompensatorMode::Armed)?,
        always_on: fly_all(CompensatorMode::AlwaysOn)?,
        flights: SEEDS,
    })
}

/// Roll angle zero, as in the paper, instead of the course that a flight without references holds.
const LEVEL: &str = "[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 0.0\n";

/// Level flight without references and faults.
fn level_flight(case: &Case) -> Result<FlightSetup, Problem> {
    let like = &case.setup.plant;
    let effectors = &like.airframe.effectors;
    let nominal = Scenario::from_toml("nominal.toml", scenarios::NOMINAL, effectors)?.plant;
    let plant = nominal.setup(like.airframe.clone(), 0, like.period, like.step_us);
    Ok(FlightSetup {
        plant: PlantSetup { start: like.start, ..plant },
        references: autopilot::config::references("level flight", LEVEL)?,
        script: None,
        duration: SimTime::from_micros(TURBULENT_S * 1_000_000),
        ..case.setup.clone()
    })
}

impl Summary {
    pub fn of(trace: &Trace) -> Self {
        Self {
            lost_s: trace.lost_at(),
            roll_rad: mean(column(trace.last(SETTLED_S), |row| row.phi_rad)),
            end_altitude_m: trace.samples().last().map_or(f64::NAN, |s| s.row.altitude_m),
        }
    }
}

impl Healthy {
    fn of(trace: &Trace) -> Self {
        let samples = trace.samples();
        let way = |signal: fn(&lab_judges::row::Row) -> f64| {
            travel(column(samples, signal)) / trace.end_s()
        };
        Self {
            roll_rms_rad: rms(column(samples, |row| row.phi_rad)),
            roll_rate_rms_rad_s: rms(column(samples, |row| row.p_rad_s)),
            aileron_rad_s: way(|row| row.right_aileron_rad),
            nozzle_rad_s: way(|row| row.nozzle_pitch_rad) + way(|row| row.nozzle_yaw_rad),
        }
    }

    fn mean(all: &[Self]) -> Self {
        let fields: [fn(&Self) -> f64; 4] = [
            |h| h.roll_rms_rad,
            |h| h.roll_rate_rms_rad_s,
            |h| h.aileron_rad_s,
            |h| h.nozzle_rad_s,
        ];
        let [roll_rms_rad, roll_rate_rms_rad_s, aileron_rad_s, nozzle_rad_s] =
            array::from_fn(|i| mean(all.iter().map(fields[i])));
        Self { roll_rms_rad, roll_rate_rms_rad_s, aileron_rad_s, nozzle_rad_s }
    }
}

/// A parameter that a reader will doubt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// Letters (docs/paper.md).
    pub name: &'static str,
    pub meaning: &'static str,
    /// The value to try instead, of surfaces that of the left one.
    pub instead: f64,
    /// Where that value comes from.
    pub why: &'static str,
}

/// Values of the F-16 (NASA S-119 model at 2.5 deg of incidence), from which the aircraft departs, and the two
/// other ratios of yaw to roll that were tried.
pub const DOUBTS: [Doubt; 12] = [
    f16("Cmde", "pitch moment of an elevator", -0.28),
    f16("CLde", "lift of an elevator", 0.218),
    f16("Clda", "roll moment of an aileron", 0.073_75),
    f16("Cma", "pitch stiffness", 0.05),
    f16("Cnb", "yaw stiffness", 0.212),
    f16("Clb", "dihedral effect", -0.115),
    f16("Clp", "roll damping", -0.43),
    f16("CD0", "drag, which sets the thrust and with it the nozzle's authority", 0.020),
    f16("Cndr", "yaw moment of the rudder", -0.0859),
    ratio("rCnde", "yaw over roll moment of an elevator", 0.15),
    ratio("rCnde", "yaw over roll moment of an elevator", 0.22),
    ratio("rCnda", "yaw over roll moment of the ailerons", 0.15),
];

const fn f16(name: &'static str, meaning: &'static str, instead: f64) -> Doubt {
    Doubt { name, meaning, instead, why: "F-16" }
}

const fn ratio(name: &'static str, meaning: &'static str, instead: f64) -> Doubt {
    Doubt { name, meaning, instead, why: "not equal to the other one" }
}

/// What becomes of the claims with another value.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    pub doubt: Doubt,
    pub value: f64,
    /// Limits of claims 1 and 2 that are met, and how many there are; `None` if the aircraft cannot be trimmed
    /// or modelled.
    pub held: Option<(usize, usize)>,
    /// Claims of which a limit is not met.
    pub broken: Vec<&'static str>,
}

/// How the outcomes depend on the parameters that a reader will doubt: the paper prints none. Each is replaced, the
/// controller's model derived anew, and both cases flown again.
pub fn sensitivity(
    conditions: &Conditions,
    aircraft: &AircraftArgs,
) -> Result<Vec<Sensitivity>, Problem> {
    // The limits of claims 1 and 2 are meant for still air.
    let still = Conditions { gyro_noise_rad_s: 0.0, turbulence_m_s: 0.0, ..*conditions };
    let cases = [Case::with(1, &still, aircraft)?, Case::with(2, &still, aircraft)?];
    DOUBTS.par_iter().map(|doubt| with_other_value(&cases, doubt)).collect()
}

fn with_other_value(cases: &[Case; 2], doubt: &Doubt) -> Result<Sensitivity, Problem> {
    let mut airframe = cases[0].setup.plant.airframe.clone();
    let unknown = || problem!("the airframe has no derivative {}", doubt.name);
    let value = airframe.set_derivative(doubt.name, doubt.instead).ok_or_else(unknown)?;

    let mut results = Vec::new();
    for case in cases {
        let mut case = case.with_airframe(airframe.clone());
        // A model that the autopilot would refuse is as good as none.
        let model = linearize(&case.setup.plant, &[]).ok().filter(|b| b.validate().is_ok());
        let Some(model) = model else {
            return Ok(Sensitivity { doubt: *doubt, value, held: None, broken: Vec::new() });
        };
        case.setup.model = model;
        let fly = |run| case.fly(run, &in_process);
        let (no_fault, pid_only, compensated) =
            (fly(Run::NoFault)?, fly(Run::PidOnly)?, fly(Run::Compensated)?);
        let runs = Runs {
            case: &case,
            no_fault: &no_fault,
            pid_only: &pid_only,
            compensated: &compensated,
        };
        results.extend(claims::of_case(&runs));
    }
    let mut broken: Vec<_> = results.iter().filter(|r| !r.pass).map(|r| r.id).collect();
    // In the order of the claims, so that equal ones are neighbours.
    broken.dedup();
    let held = results.iter().filter(|r| r.pass).count();
    Ok(Sensitivity { doubt: *doubt, value, held: Some((held, results.len())), broken })
}
