//! Which effector the isolation names.

use std::sync::Arc;

use autopilot::config;
use autopilot::event::EventKind;
use flight_analysis::closed_loop::{FlightSetup, Observation, fly_while};
use flight_analysis::runner;
use flight_control::{AllocationMode, IsolationMode};
use icd::{ControlPeriod, SimTime};
use plant_sim::{Airframe, Scenario};

fn setup(
    text: &str,
    mode: IsolationMode,
    allocation: AllocationMode,
    duration_s: f64,
) -> FlightSetup {
    let airframe = Airframe::paper();
    let text = format!("[plant]\nseed = 1\n{text}");
    let scenario = Scenario::from_toml("scenario", &text, &airframe.effectors).expect("above");
    let model = config::model("model", config::DEFAULT_MODEL).expect("a shipped model");
    let mut parameters = model.defaults;
    parameters.gains.selection.isolation = mode;
    parameters.gains.selection.allocation = allocation;
    FlightSetup {
        plant: scenario.plant.setup(airframe, 1, ControlPeriod::DEFAULT, 1_000),
        model: model.aircraft,
        parameters,
        references: config::references("scenario", &text).expect("above"),
        script: None,
        duration: SimTime::from_seconds(duration_s).expect("seconds of a flight"),
    }
}

fn jam(effector: &str, angle_deg: f64) -> String {
    format!(
        "[[plant.fault]]\neffector = \"{effector}\"\nonset_s = 3.0\nkind = \"stuck_at\"\nangle_deg = {angle_deg:?}\n"
    )
}

#[test]
fn explore() {
    let mut flights = Vec::new();
    let turn = "[[autopilot.reference]]\nat_s = 2.0\nroll_deg = 15.0\n[[autopilot.reference]]\nat_s = 10.0\nroll_deg = -10.0\n";
    for (name, angles) in [
        ("left_aileron", [-20.0, 10.0, 20.0]),
        ("right_aileron", [-20.0, 10.0, 20.0]),
        ("left_elevator", [-20.0, 10.0, 30.0]),
        ("right_elevator", [-20.0, 10.0, 30.0]),
        ("rudder", [-7.0, 3.0, 7.0]),
        ("nozzle_pitch", [-8.0, 4.0, 10.0]),
        ("nozzle_yaw", [-8.0, 4.0, 12.0]),
    ] {
        for angle in angles {
            flights.push((format!("{name} {angle}"), jam(name, angle)));
            flights.push((format!("{name} {angle} turn"), jam(name, angle) + turn));
        }
    }
    for (l, r) in [(10.0, 10.0), (20.0, 20.0), (10.0, 20.0), (-10.0, 10.0)] {
        flights.push((
            format!("both elevators {l} {r}"),
            jam("left_elevator", l) + &jam("right_elevator", r),
        ));
    }
    for (effector, rest) in [
        ("left_elevator", "kind = \"oscillating\"\namplitude_deg = 15.0\nfrequency_hz = 1.0"),
        ("rudder", "kind = \"biased\"\nbias_deg = 6.0"),
        ("left_aileron", "kind = \"partial_loss\"\nremaining_percent = 0.0"),
        ("right_aileron", "kind = \"float\""),
        ("left_elevator", "kind = \"hard_over\"\nside = \"negative\""),
        ("rudder", "kind = \"drifting\"\nrate_deg_s = 1.0"),
    ] {
        let text = format!("[[plant.fault]]\neffector = \"{effector}\"\nonset_s = 3.0\n{rest}\n");
        flights.push((format!("{effector} {rest}").replace('\n', " "), text + turn));
    }
    let flown = runner::map("explore", &flights, |(_, text)| {
        [
            (IsolationMode::Report, AllocationMode::Paper),
            (IsolationMode::Use, AllocationMode::Relief),
        ]
        .map(|(mode, allocation)| {
            let setup = setup(text, mode, allocation, 20.0);
            let limits = setup.plant.airframe.limits;
            let list = setup.plant.airframe.effectors;
            let mut out = String::new();
            let mut active = None;
            let mut lost = false;
            let mut sink = |o: &Observation| {
                let t = o.truth.time.as_seconds();
                if o.snapshot.log.compensator_active && active.is_none() {
                    active = Some(t);
                }
                for event in o.events {
                    if let EventKind::Isolated(verdict) = event.kind {
                        out += &format!(
                            "{t:.2} {}; ",
                            autopilot::flight_management::event_text::verdict_text(&verdict, &list)
                        );
                    }
                    if event.kind == EventKind::IsolationWithdrawn {
                        out += &format!("{t:.2} none; ");
                    }
                }
                if std::env::var("DBG").is_ok() && (t * 500.0).round() as i64 % 100 == 0 && t > 3.0
                {
                    let i = &o.snapshot.log.isolation;
                    out += &format!(
                        "\n      {t:.1} likely {:?} {:.2} test {:.3} rates {:.2}",
                        i.likely.map(|e| e.map(|e| list.name(e).to_owned())),
                        i.probability,
                        i.test_rad,
                        o.snapshot.log.state.rates.amax()
                    );
                }
                if limits.are_exceeded(&(o.truth).into()) {
                    out += &format!("LOST {t:.1}");
                    lost = true;
                }
                !lost
            };
            fly_while(&setup, &[], &mut sink).expect("flies");
            format!("active {active:?} {out}")
        })
    });
    for ((name, _), [a, b]) in flights.iter().zip(&flown) {
        println!("{name}\n    paper  {a}\n    relief {b}");
    }
    let _ = Arc::new(());
}
