//! Texts as QGroundControl shows them.

use core::time::Duration;

use flight_control::AltitudeLimit;
use icd::fault::{FaultKind, Timing, Travel};
use icd::tvc_jet;
use icd::{Effector, SimTime};

use super::*;
use crate::event::Axis;
use crate::vehicle::Mode;

/// A verdict about the rudder, and about a second effector at 0.1 rad.
fn isolated(behaviour: Behaviour, value: f64, second: Option<Effector>) -> EventKind {
    let (effectors, values) = ([Some(tvc_jet::RUDDER), second], [value, 0.1]);
    EventKind::Isolated(Verdict { effectors, behaviour, values, confidence: 0.9799 })
}

/// How a version of QGroundControl treats a text.
struct Qgc {
    version: &'static str,
    /// The largest severity number that opens the banner.
    banner: u8,
    /// The largest one that is shown in orange; the rest is plain.
    orange: u8,
    /// The largest one that is spoken.
    spoken: u8,
}

/// Taken from its source text. Tags v4.3.0, v4.4.0, v4.4.4: `src/uas/UASMessageHandler.cc` (`handleTextMessage`,
/// `severityIsError`, then `QGCApplication::showCriticalVehicleMessage`). Tag v5.0.0:
/// `src/MAVLink/StatusTextHandler.cc` (`handleHTMLEscapedTextMessage`, the same by `newErrorMessage`). Speech output:
/// `src/Vehicle/Vehicle.cc`, where a text arrives (NOTICE and worse). By number: 0 EMERGENCY, 2 CRITICAL, 3 ERROR,
/// 4 WARNING, 5 NOTICE, 6 INFO.
const QGC: [Qgc; 3] = [
    Qgc { version: "4.3", banner: 3, orange: 5, spoken: 5 },
    Qgc { version: "4.4", banner: 3, orange: 5, spoken: 5 },
    Qgc { version: "5.0", banner: 3, orange: 5, spoken: 5 },
];
/// No banner for a text with this beginning, of any severity (`showCriticalVehicleMessage`); `[cal]` is not shown at
/// all, and `#` is removed and the rest spoken.
const QGC_PREFIXES: [&str; 4] = ["prearm", "preflight", "[cal]", "#"];

/// Presentation of a text to the pilot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shown {
    /// A banner over the Fly view, in red in the list, spoken.
    Banner,
    /// Orange in the list behind a triangle, spoken.
    Orange,
    /// White in the list.
    Plain,
}

impl Qgc {
    fn shows(&self, severity: Severity) -> Shown {
        let severity = severity as u8;
        assert_eq!(severity <= self.spoken, severity <= self.orange, "spoken and coloured");
        if severity <= self.banner {
            Shown::Banner
        } else if severity <= self.orange {
            Shown::Orange
        } else {
            Shown::Plain
        }
    }
}

fn fault(state: FaultState) -> EventKind {
    let kind = FaultKind::StuckAt { angle_rad: 30.0_f64.to_radians(), travel: Travel::Jump };
    let timing = Timing::NOW;
    EventKind::Fault(FaultEntry {
        id: 1,
        target: tvc_jet::LEFT_ELEVATOR.into(),
        kind,
        timing,
        state,
    })
}

/// Every kind of event that has a text here, its presentation, and the text.
fn texts() -> Vec<(EventKind, Shown, &'static str)> {
    use EventKind as E;
    use Shown::{Banner, Orange, Plain};
    use VehicleEvent as V;
    let at = SimTime::from_micros(12_002_000);
    let next = SimTime::from_micros(32_002_000);
    let (axis, at_limit) = (Axis::Pitch, Limits::default());
    let after = Duration::from_secs(293);
    let exhausted = |by| E::AuthorityExhausted { axis, by };
    vec![
        (E::CompensatorActive { axis, at_limit }, Banner, "Compensator active: pitch"),
        (exhausted(Limit::NozzlePitch), Orange, "No authority left: pitch, nozzle pitch at limit"),
        (exhausted(Limit::Thrust), Orange, "No authority left: pitch, too little thrust"),
        (E::GroundContact, Banner, "Ground contact: the flight is over"),
        (E::Vehicle(V::Terminated), Banner, "Flight terminated: engine off, surfaces hard over"),
        (
            fault(FaultState::Active { since: at }),
            Orange,
            "Injected: left elevator stuck at 30.0 deg, from 12.002 s",
        ),
        (E::Saturated(Limit::Rudder), Orange, "Saturated: rudder"),
        (E::Saturated(Limit::Thrust), Plain, "Saturated: thrust"),
        (
            E::AltitudeNotHeld(AltitudeLimit::Engine),
            Orange,
            "Altitude not held: engine at its limit",
        ),
        (
            E::AltitudeNotHeld(AltitudeLimit::Elevator),
            Orange,
            "Altitude not held: elevator at its limit",
        ),
        (E::AltitudeNotHeld(AltitudeLimit::Wing), Orange, "Altitude not held: wing at its limit"),
        (E::AltitudeHeld, Plain, "Altitude held again"),
        (E::ThrustFloorTaken, Orange, "Thrust floor: the compensation needs the thrust"),
        (E::ThrustFloorReleased, Plain, "Thrust floor no longer needed"),
        (E::CompensatorYields, Orange, "Compensator yields: its action oscillates"),
        (E::CompensatorResumes, Plain, "Compensator acts in full again"),
        (
            isolated(Behaviour::Stuck, 0.52, None),
            Orange,
            "Isolated: rudder stuck at 29.8 deg, 97 %",
        ),
        (
            isolated(Behaviour::Stuck, -0.000_1, Some(tvc_jet::LEFT_ELEVATOR)),
            Orange,
            "Isolated: rudder stuck at 0.0 deg and left elevator stuck at 5.7 deg, 97 %",
        ),
        (
            isolated(Behaviour::Reduced, 0.4, None),
            Orange,
            "Isolated: rudder has 40 % of its effect, 97 %",
        ),
        (
            isolated(Behaviour::Biased, -0.05, None),
            Orange,
            "Isolated: rudder off by -2.9 deg, 97 %",
        ),
        (
            isolated(Behaviour::Irregular, 0.0, None),
            Orange,
            "Isolated: rudder moves by itself, 97 %",
        ),
        (E::IsolationWithdrawn, Plain, "Isolation: no effector is named now"),
        (E::SensorLost(SensorKind::Gnss), Orange, "GNSS lost"),
        (E::SensorLost(SensorKind::Pitot), Orange, "Airspeed lost"),
        (E::SensorBack(SensorKind::EngineMonitor), Plain, "Engine monitor is back"),
        (E::PlantLost, Orange, "Plant link lost: simulation time stands still"),
        (E::Vehicle(V::LinkLost(LinkLossAction::Hold)), Orange, "Ground station lost: Hold"),
        (E::EventsLost(7), Orange, "7 events were lost: fault list refreshed"),
        (fault(FaultState::Ended { at }), Plain, "Cleared: left elevator stuck at 30.0 deg"),
        (
            fault(FaultState::Resting { since: at, next }),
            Plain,
            "Cleared: left elevator stuck at 30.0 deg, again at 32.002 s",
        ),
        (E::CompensatorReleased { after }, Plain, "Compensator released after 293.0 s"),
        (E::AuthorityRestored(axis), Plain, "Authority restored: pitch"),
        (E::SaturationEnded(Limit::Rudder), Plain, "No longer saturated: rudder"),
        (E::PlantBack, Plain, "Plant link is back"),
        (E::Vehicle(V::LinkBack(Mode::Hold)), Plain, "Ground station is back: Hold"),
        (E::Vehicle(V::Mode(Mode::Hold)), Plain, "Mode Hold"),
        (E::Vehicle(V::PlanComplete), Plain, "Mission complete"),
        (E::FlightBegan { joined_in_flight: false }, Plain, "Flight began"),
        (E::FlightBegan { joined_in_flight: true }, Plain, "Joined a flight under way"),
        (E::Paced(Pace::Pause), Plain, "Simulation paused"),
        (E::Paced(Pace::Run), Plain, "Simulation runs"),
        (E::Paced(Pace::Step(5)), Plain, "Simulation steps: 5"),
        (E::Paced(Pace::Speed(2.0)), Plain, "Simulation speed: x2"),
    ]
}

#[test]
fn every_version_of_qgroundcontrol_shows_what_matters_as_a_banner_and_good_news_plainly() {
    for (kind, shown, expected) in texts() {
        let (severity, text) =
            of_event(&kind, &Parameters::default(), &tvc_jet::effectors()).unwrap();
        assert_eq!(text, expected);
        for qgc in &QGC {
            assert_eq!(qgc.shows(severity), shown, "{text}, {}", qgc.version);
        }
        let lower = text.to_lowercase();
        assert!(QGC_PREFIXES.iter().all(|prefix| !lower.starts_with(prefix)), "{text}");
    }
}

#[test]
fn a_text_that_can_be_a_banner_is_one_message() {
    for (_, shown, text) in texts() {
        assert!(shown != Shown::Banner || text.len() <= 50, "{} characters: {text}", text.len());
    }
}

#[test]
fn a_fault_that_is_seen_without_the_compensator_is_a_banner_too() {
    let mut parameters = Parameters::default();
    parameters.gains.selection.compensator = CompensatorMode::Off;
    let kind = EventKind::CompensatorActive { axis: Axis::Yaw, at_limit: Limits::default() };
    let (severity, _) = of_event(&kind, &parameters, &tvc_jet::effectors()).unwrap();
    assert_eq!(QGC[0].shows(severity), Shown::Banner);
}

fn text(kind: EventKind) -> String {
    of_event(&kind, &Parameters::default(), &tvc_jet::effectors()).unwrap().1
}

#[test]
fn the_compensators_texts_name_the_axis_and_what_is_at_its_limit() {
    let active = |limits: &[Limit]| {
        let at_limit = Limits::from_fn(|limit| limits.contains(&limit));
        text(EventKind::CompensatorActive { axis: Axis::Yaw, at_limit })
    };
    assert_eq!(active(&[Limit::NozzleYaw]), "Compensator active: yaw, nozzle yaw at limit");
    assert_eq!(
        active(&[Limit::Aileron, Limit::Rudder, Limit::NozzleYaw]),
        "Compensator active: yaw, aileron, rudder and nozzle yaw at limit"
    );
    let exhausted = |by| text(EventKind::AuthorityExhausted { axis: Axis::Pitch, by });
    assert_eq!(exhausted(Limit::NozzlePitch), "No authority left: pitch, nozzle pitch at limit");
    assert_eq!(exhausted(Limit::Thrust), "No authority left: pitch, too little thrust");
    let after = Duration::from_millis(12_340);
    let released = text(EventKind::CompensatorReleased { after });
    assert_eq!(released, "Compensator released after 12.3 s");
}

#[test]
fn with_the_compensator_off_the_text_does_not_claim_that_it_acts() {
    let mut parameters = Parameters::default();
    let at_limit = Limits::default();
    let kind = EventKind::CompensatorActive { axis: Axis::Yaw, at_limit };
    assert_eq!(
        of_event(&kind, &parameters, &tvc_jet::effectors()).unwrap().1,
        "Compensator active: yaw"
    );
    parameters.gains.selection.compensator = CompensatorMode::Off;
    assert_eq!(
        of_event(&kind, &parameters, &tvc_jet::effectors()).unwrap().1,
        "Fault detected: yaw (compensator off)"
    );
}
